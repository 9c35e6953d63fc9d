"""Which noise settings can be varied, and the presets that come of it."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

from dynakin.errors import ConfigError
from dynakin.settings.noise import Noise
from dynakin.settings.strict import nearest

# Settings on a scale of their own kind, so that a logarithm makes sense: variances, deviations, times. -> unit
UNITS = {
    "coordinate": "rad² or m² a step",
    "speed": "(rad/s)² or (m/s)² a step",
    "acceleration": "(rad/s²)² or (m/s²)² a step",
    "length": "m² a step",
    "marker_place": "m² a step",
    "inertia": "SI² a step",
    "jerk": "rad²/s⁵",
    "jerk_translation": "m²/s⁵",
    "floating_jerk": "rad²/s⁵",
    "floating_jerk_translation": "m²/s⁵",
    "length_drift": "m²/s",
    "soft_tissue": "of the declared size",
    "soft_tissue_least_m": "m",
    "soft_tissue_time_s": "s",
    "floating_soft_tissue_time_s": "s",
    "marker_sd_m": "m",
    "marker_scale": "1",
    "force": "N²",
    "moment": "(N m)²",
    "plate_force": "N",
    "plate_moment": "N m",
    "plate_time_s": "s",
    "total_mass": "kg²",
}

# What each does, in words for the table of `tune fit`.
MEANINGS = {
    "coordinate": "how far coordinates may jump between frames",
    "speed": "how far speeds may jump between frames",
    "acceleration": "how far accelerations may jump between frames",
    "length": "how fast lengths may change",
    "marker_place": "how fast marker places may change",
    "inertia": "how fast inertial parameters may change",
    "jerk": "how abruptly joints accelerate",
    "jerk_translation": "how abruptly the body accelerates",
    "floating_jerk": "how abruptly joints accelerate",
    "floating_jerk_translation": "how abruptly the body accelerates",
    "length_drift": "how fast lengths may change",
    "soft_tissue": "how far skin and flesh move",
    "soft_tissue_least_m": "below which size soft tissue counts as noise",
    "soft_tissue_time_s": "how long skin stays displaced",
    "floating_soft_tissue_time_s": "how long skin stays displaced",
    "marker_sd_m": "noise of the cameras",
    "marker_scale": "noise of the markers",
    "force": "noise of the forces",
    "moment": "noise of the moments",
    "plate_force": "slow error of the forces",
    "plate_moment": "slow error of the moments",
    "plate_time_s": "how long that error lasts",
    "total_mass": "doubt about the total mass",
}


def check_setting(name: str) -> str:
    """The name, if it is one that can be varied.

    Raises:
        ConfigError: it is not; the nearest that is, is suggested.
    """
    if name not in UNITS:
        raise ConfigError(
            f"setting {name!r} cannot be varied{nearest(name, UNITS)}; expected one of {', '.join(UNITS)}"
        )
    return name


def of_floating(name: str) -> str | None:
    """The setting that stands in for this one on a model that is fixed nowhere; None: there is none."""
    return f"floating_{name}" if f"floating_{name}" in UNITS else None


def without_effect(names: Sequence[str], noise: Noise, floating: Collection[bool]) -> dict[str, str]:
    """Those of the settings that no trial depends on, and why.

    Args:
        noise: all other settings. floating: whether the model is fixed nowhere, of each trial.
    """
    found = {}
    for name in names:
        other = of_floating(name)
        if name.startswith("floating_") and not any(floating):
            found[name] = f"a model that is fixed in the ground, expected {name.removeprefix('floating_')!r}"
        elif other and all(floating) and (other in names or getattr(noise, other) is not None):
            found[name] = f"a model that is fixed nowhere, expected {other!r}"
    return found


def check_effect(names: Sequence[str], noise: Noise, floating: Collection[bool]) -> None:
    """Refuse settings that have no effect.

    Raises:
        ConfigError: there is one; the message names it and the one that has.
    """
    for name, why in without_effect(names, noise, floating).items():
        raise ConfigError(f"setting {name!r} has no effect on {why}")


def value_of(noise: Noise, name: str) -> float:
    """The present value of a setting that can be varied.

    Raises:
        ConfigError: it is 0 or not given, so that there is nothing to start from on a logarithmic scale.
    """
    value = getattr(noise, check_setting(name))
    if value is None and name.startswith("floating_"):  # then as the usual one
        value = getattr(noise, name.removeprefix("floating_"))
    if value is None or not value > 0.0:
        found = "not given" if value is None else "0"
        raise ConfigError(f"setting {name!r} is {found} in these settings, expected a positive value to start from")
    return float(value)


def together(base: Noise, settings: Mapping[str, float]) -> dict[str, float]:
    """Settings with those that go with them.

    With ``soft_tissue`` goes the size below which it counts as noise, so that no marker gains or loses a state on the
    way: the likelihood would jump there.
    """
    found = dict(settings)
    if "soft_tissue" in found and "soft_tissue_least_m" not in found and base.soft_tissue > 0.0:
        least = base.soft_tissue_least_m * found["soft_tissue"] / base.soft_tissue
        found["soft_tissue_least_m"] = least * (1.0 - 1e-9)  # a size that lies on the limit stays on its side
    return found
