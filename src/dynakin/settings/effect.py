"""Noise settings that do nothing: those of a model that is fixed nowhere with one in the ground, and the other way."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from dynakin.errors import ConfigError
from dynakin.settings import presets
from dynakin.settings.noise import SCALES, Noise
from dynakin.settings.settings import Settings

_IN_THE_GROUND = {"force_variance_n2": "plate_force_sd_n", "moment_variance_n2_m2": "plate_moment_sd_nm"}
"""Of a model that stands on its root alone; what a model that is fixed nowhere has of the kind (its plates' own noise
is declared by foot)."""
_FIXED_NOWHERE = {
    "residual_force_sd_n": "force_variance_n2",
    "residual_moment_sd_nm": "moment_variance_n2_m2",
    "systematic_scale": None,
    "following_skin_fraction": None,
    "jerk_scale": None,
}
"""The other way round; None: there is nothing of the kind."""


def without_effect(names: Sequence[str], noise: Noise, floating: Collection[bool]) -> dict[str, str]:
    """Those of the settings that no trial depends on, and why.

    Args:
        noise: all other settings. floating: whether the model is fixed nowhere, of each trial.
    """
    found = {}
    for name in names:
        own = f"floating_{name}"  # stands in for this one on a model that is fixed nowhere
        replaced = own in SCALES and (own in names or getattr(noise, own) is not None)
        if (name.startswith("floating_") or name in _FIXED_NOWHERE) and not any(floating):
            other = _FIXED_NOWHERE.get(name, name.removeprefix("floating_"))
            found[name] = "a model that is fixed in the ground" + (f", expected {other!r}" if other else "")
        elif (replaced or name in _IN_THE_GROUND) and all(floating):
            found[name] = f"a model that is fixed nowhere, expected {_IN_THE_GROUND.get(name, own)!r}"
    return found


def check_effect(names: Sequence[str], noise: Noise, floating: Collection[bool]) -> None:
    """Refuse settings that have no effect.

    Raises:
        ConfigError: there is one; the message names it and the one that has.
    """
    for name, why in without_effect(names, noise, floating).items():
        raise ConfigError(f"setting {name!r} has no effect on {why}")


def check_noise(settings: Settings, floating: bool) -> None:
    """Refuse keys of [noise] that have no effect on the model. A value that the preset has anyway was not set by hand,
    nor was any of an output's config.toml, which lists them all.

    Raises:
        ConfigError: as `check_effect`.
    """
    if settings.versions:
        return
    noise, usual = settings.noise_settings(), presets.preset(settings.preset)
    by_hand = [n for n in settings.noise if getattr(noise, n) not in (None, getattr(usual, n))]
    check_effect(by_hand, noise, [floating])
