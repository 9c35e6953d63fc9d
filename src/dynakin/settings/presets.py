"""Named noise settings, and those of one's own as a file: what `tune` writes, and what `--preset FILE.toml` reads."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import tomli_w

from dynakin.errors import ConfigError, OutputError
from dynakin.files import write_text
from dynakin.settings.noise import Noise
from dynakin.settings.strict import nearest, read_toml

_KEYS = ("base", "noise")


def default() -> Noise:
    """Settings for anyone: the defaults of `Noise`."""
    return Noise()


def paper() -> Noise:
    """Bonnet et al., Table I, as it stands: its R as variances, its Q added at each step."""
    return Noise(
        coordinate_variance=1e3,
        speed_variance=1e2,
        acceleration_variance=1e3,
        marker_place_variance_m2=1e-4,
        jerk_density_rad2_s5=0.0,
        translation_jerk_density_m2_s5=0.0,
        floating_jerk_density_rad2_s5=None,
        floating_translation_jerk_density_m2_s5=None,
        length_drift_density_m2_s=0.0,
        length_skin_fraction=0.0,
        systematic_scale=0.0,
        soft_tissue_sd_fraction=0.0,
        soft_tissue_least_sd_m=0.0,
        soft_tissue_time_s=1.0,
        floating_soft_tissue_time_s=None,
        following_skin_fraction=0.0,
        marker_sd_m=None,
        force_variance_n2=0.1,
        moment_variance_n2_m2=0.1,
        reference_point_m=(0.0, 0.0, 0.0),
        plate_force_sd_n=0.0,
        plate_moment_sd_nm=0.0,
        plate_time_s=1.0,
        residual_force_sd_n=0.0,
        residual_moment_sd_nm=0.0,
        plate_load_tolerance=None,
        plate_delay_sd_s=0.0,
        total_mass_variance_kg2=1e-4,
        total_mass_use="frame",
        marker_gate=0.0,
        wrench_gate=0.0,
        recover=False,
        unseen_sd=None,
        iterate_beyond_sd=None,
        adapt=False,
        constraint="gain",
    )


PRESETS = {"default": default, "paper": paper}


def preset(name: str, changes: Mapping[str, Any] | None = None) -> Noise:
    """The preset of that name, or the settings of a file whose name ends in .toml, with changes.

    Raises:
        ConfigError: there is none (the message lists those that there are), or a change is wrong. As `read_preset`.
    """
    found = read_preset(Path(name)) if is_file(name) else _built_in(name, " or a .toml file")
    return found.changed(**changes or {})


def _built_in(name: str, otherwise: str = "") -> Noise:
    if name not in PRESETS:
        raise ConfigError(f"preset {name!r} is unknown; expected {', '.join(PRESETS)}{otherwise}")
    return PRESETS[name]()


def is_file(name: str) -> bool:
    """Whether a preset is a file of the user's."""
    return name.casefold().endswith(".toml")


def title(name: str) -> str:
    """What a preset is called in tables: a file by its name without folder and ending."""
    return Path(name).stem if is_file(name) else name


def read_preset(path: Path) -> Noise:
    """The settings of a file: ``base``, the built-in preset from which it starts ("default" where not given), and the
    table ``noise`` with what is different. It fixes the noise: nothing is calibrated, unless it says ``adapt = true``.
    The ``config.toml`` of a run is such a file, too: its preset, with the scales that were found in its recording.

    Raises:
        ConfigError: the file cannot be read, or a key or value is wrong; the message names it.
    """
    content = read_toml(path, ConfigError)
    if "noise_used" in content:
        own = content.get("noise", {}) | {"adapt": False} | content["noise_used"]
        return preset(content.get("preset", "default"), own)
    for key in content:
        if key not in _KEYS:
            raise ConfigError(f"{path}: unknown key {key!r}{nearest(key, _KEYS)}; expected keys: {', '.join(_KEYS)}")
    base, noise = content.get("base", "default"), content.get("noise", {})
    if not isinstance(base, str) or not isinstance(noise, dict):
        raise ConfigError(f'{path}: expected base = "NAME" and a table [noise]')
    try:
        start = _built_in(base)  # not another file, which could name this one
    except ConfigError as error:
        raise error.reworded(f"{path}: base: {error.message}") from None
    try:
        return start.changed(**({"adapt": False} | noise))
    except ConfigError as error:
        raise error.reworded(f"{path}: {error.message}") from None


def write_preset(path: Path, noise: Noise, base: str, remarks: Sequence[str] = ()) -> None:
    """Write settings so that they stay what they are when presets change: every key that has a value but ``adapt``,
    because a file fixes them.

    Args:
        base: the built-in preset that they come from. remarks: lines that open the file.

    Raises:
        OutputError: the file cannot be written.
    """
    values: dict[str, Any] = {
        k: v for k, v in noise.model_dump(mode="json", exclude={"adapt"}).items() if v is not None
    }
    text = "".join(f"# {line}\n" for line in remarks) + tomli_w.dumps({"base": base, "noise": values})
    write_text(path, text, OutputError)
