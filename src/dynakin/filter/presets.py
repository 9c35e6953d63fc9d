"""Named noise settings."""

from __future__ import annotations

from dynakin.errors import ConfigError
from dynakin.filter.noise import Noise


def paper() -> Noise:
    """Bonnet et al., Table I, as it stands: its R as variances, its Q added at each step."""
    return Noise()


PRESETS = {"paper": paper}


def preset(name: str) -> Noise:
    """The preset of that name.

    Raises:
        ConfigError: there is none; the message lists those that there are.
    """
    if name not in PRESETS:
        raise ConfigError(f"preset {name!r} is unknown; expected {', '.join(PRESETS)}")
    return PRESETS[name]()
