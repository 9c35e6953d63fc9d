"""Which noise settings can be varied, and the presets that come of it."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

from dynakin.errors import ConfigError
from dynakin.settings.noise import SCALES, Noise
from dynakin.settings.strict import nearest


def check_setting(name: str) -> str:
    """The name, if it is one that can be varied.

    Raises:
        ConfigError: it is not; the nearest that is, is suggested.
    """
    if name in Noise.renamed:
        raise ConfigError(f"setting {name!r} is now called {Noise.renamed[name]!r}")
    if name not in SCALES:
        raise ConfigError(
            f"setting {name!r} cannot be varied{nearest(name, SCALES)}; expected one of {', '.join(SCALES)}"
        )
    return name


def of_floating(name: str) -> str | None:
    """The setting that stands in for this one on a model that is fixed nowhere; None: there is none."""
    return f"floating_{name}" if f"floating_{name}" in SCALES else None


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
    if (
        "soft_tissue_sd_fraction" in found
        and "soft_tissue_least_sd_m" not in found
        and base.soft_tissue_sd_fraction > 0.0
    ):
        least = base.soft_tissue_least_sd_m * found["soft_tissue_sd_fraction"] / base.soft_tissue_sd_fraction
        found["soft_tissue_least_sd_m"] = least * (1.0 - 1e-9)  # a size that lies on the limit stays on its side
    return found
