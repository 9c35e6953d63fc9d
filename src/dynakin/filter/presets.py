"""Named noise settings."""

from __future__ import annotations

from pathlib import Path

from dynakin.errors import ConfigError
from dynakin.filter.noise import Noise
from dynakin.filter.preset_file import read_preset


def default() -> Noise:
    """Settings for anyone: white jerk, soft tissue as a process of its own, bounds by projection, gates, recovery.

    How each number was found is told in docs/validation.md.
    """
    return Noise(
        coordinate=0.0,
        speed=0.0,
        acceleration=0.0,
        marker_place=0.0,
        jerk=60.0,
        jerk_translation=10.0,
        floating_jerk=3e4,
        floating_jerk_translation=1e3,
        length_drift=3e-6,
        length_skin=0.6,
        soft_tissue=0.5,
        soft_tissue_least_m=0.002,
        soft_tissue_time_s=6.0,
        floating_soft_tissue_time_s=0.5,
        marker_sd_m=0.0007,
        force=36.0,
        moment=4.0,
        reference_point_m="auto",
        plate_force=5.0,
        plate_moment=2.0,
        plate_time_s=30.0,
        plate_load_tolerance=0.15,
        plate_delay_s=0.02,
        total_mass=0.25,
        total_mass_use="prior",
        marker_gate=1e-9,
        wrench_gate=1e-9,
        recover=True,
        unseen_sd=0.5,
        iterate_beyond=0.2,
        constraint="projection",
    )


def paper() -> Noise:
    """Bonnet et al., Table I, as it stands: its R as variances, its Q added at each step."""
    return Noise()


PRESETS = {"default": default, "paper": paper}


def preset(name: str) -> Noise:
    """The preset of that name, or the settings of a file whose name ends in .toml.

    Raises:
        ConfigError: there is none; the message lists those that there are. As `read_preset`.
    """
    if is_file(name):
        return read_preset(Path(name), built_in)  # not another file, which could name this one
    return built_in(name, " or a .toml file")


def built_in(name: str, otherwise: str = "") -> Noise:
    """The preset of that name that comes with dynakin.

    Raises:
        ConfigError: there is none; ``otherwise`` ends the list of those that there are.
    """
    if name not in PRESETS:
        raise ConfigError(f"preset {name!r} is unknown; expected {', '.join(PRESETS)}{otherwise}")
    return PRESETS[name]()


def is_file(name: str) -> bool:
    """Whether a preset is a file of the user's."""
    return name.casefold().endswith(".toml")


def title(name: str) -> str:
    """What a preset is called in tables: a file by its name without folder and ending."""
    return Path(name).stem if is_file(name) else name
