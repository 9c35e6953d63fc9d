"""Which noise settings can be varied, and the presets that come of it."""

from __future__ import annotations

from collections.abc import Mapping

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
