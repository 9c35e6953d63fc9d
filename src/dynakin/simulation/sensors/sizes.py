"""How large the errors of the simulated sensors are; each can be switched by itself."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path

from dynakin.errors import ConfigError
from dynakin.files import LARGEST_TEXT, is_file, read_bytes
from dynakin.settings.strict import nearest

_HIGHEST = {"soft_tissue_random": 1.0, "plate_gain_sd": 0.5}
_SIGNED = {"plate_lag_s": 0.5}
_AT_LEAST = {"occlusion_mean_s": 1e-3, "swap_mean_s": 1e-3, "flying_mean_s": 1e-3}


@dataclass(frozen=True)
class SensorNoise:
    """Sizes of what the sensors and the skin add; any of them may be 0, and each draws from a stream of its own, so
    that switching one leaves the others as they are.

    Markers:
        marker_sd_m: white noise of each marker along each axis, m.
        soft_tissue: factor on the amplitudes of soft_tissue.toml.
        soft_tissue_random: share of them that wanders instead of following a joint angle, 0 to 1.
        misplacement_sd_m: how far off landmarks are put on, standard deviation an axis, m.
        hip_regression_sd_m: how far off the regressed hip centres lie in the pelvis, an axis, m.
        occlusion_per_min, occlusion_mean_s: gaps a marker and minute, and their mean length, s.
        swap_per_min, swap_mean_s: swaps of two near markers a minute of the trial, and their mean length, s.
        flying_per_min, flying_mean_s, flying_distance_m: markers flying off a minute of the trial, the mean time
            they do so, s, and how far at most, m.

    Plates:
        plate_force_sd_n: white noise of each component of each plate's force, N.
        plate_moment_sd_nm: white noise of each plate's moment about the plate's centre, N m.
        plate_gain_sd: relative error of each of a plate's six channels, standard deviation.
        plate_drift_n_per_min, plate_drift_nm_per_min: slope of a channel, standard deviation.
        plate_step_n, plate_step_nm: steps to which forces and moments are rounded, 0: not.
        plate_lag_s: by how much the plates are late against the markers, -0.5 to 0.5 s.

    Raises:
        ConfigError: a value out of its range; the message names it.
    """

    marker_sd_m: float = 0.0005
    soft_tissue: float = 1.0
    soft_tissue_random: float = 0.3
    misplacement_sd_m: float = 0.0
    hip_regression_sd_m: float = 0.0
    occlusion_per_min: float = 0.0
    occlusion_mean_s: float = 0.2
    swap_per_min: float = 0.0
    swap_mean_s: float = 0.1
    flying_per_min: float = 0.0
    flying_mean_s: float = 0.03
    flying_distance_m: float = 0.5
    plate_force_sd_n: float = 1.0
    plate_moment_sd_nm: float = 0.3
    plate_gain_sd: float = 0.0
    plate_drift_n_per_min: float = 0.0
    plate_drift_nm_per_min: float = 0.0
    plate_step_n: float = 0.0
    plate_step_nm: float = 0.0
    plate_lag_s: float = 0.0

    def __post_init__(self) -> None:
        for key, value in vars(self).items():
            if isinstance(value, bool) or not isinstance(value, int | float):
                raise ConfigError(f"sensor noise: {key} is {value!r}, expected a number")
            lowest = -_SIGNED[key] if key in _SIGNED else _AT_LEAST.get(key, 0.0)
            highest = _SIGNED.get(key, _HIGHEST.get(key, float("inf")))
            if not lowest <= value <= highest or value == float("inf"):
                wanted = f"{lowest:g} or more" if highest == float("inf") else f"{lowest:g} to {highest:g}"
                raise ConfigError(f"sensor noise: {key} is {value:g}, expected {wanted}")

    @classmethod
    def none(cls) -> SensorNoise:
        """Perfect sensors on a rigid body."""
        return cls(marker_sd_m=0.0, soft_tissue=0.0, plate_force_sd_n=0.0, plate_moment_sd_nm=0.0)

    @classmethod
    def laboratory(cls) -> SensorNoise:
        """Everything that goes a little wrong on an ordinary day.

        Misplacement: landmarks are found again to within 6 to 21 mm by one examiner (Della Croce et al. 2005, Gait
        Posture 21:226-237); the lower end is taken, as 6 mm an axis. The other sizes are chosen.
        """
        return cls(
            misplacement_sd_m=0.006,
            hip_regression_sd_m=0.006,
            occlusion_per_min=0.5,
            swap_per_min=0.5,
            flying_per_min=1.0,
            plate_gain_sd=0.005,
            plate_drift_n_per_min=1.0,
            plate_drift_nm_per_min=0.3,
            plate_step_n=0.2,
            plate_step_nm=0.05,
            plate_lag_s=0.002,
        )

    def changed(self, values: Mapping[str, object]) -> SensorNoise:
        """The same with some values replaced.

        Raises:
            ConfigError: a key that is none of the attributes (the nearest is named), or a value out of range.
        """
        known = [entry.name for entry in fields(self)]
        for key in values:
            if key not in known:
                raise ConfigError(
                    f"sensor noise: unknown key {key!r}{nearest(key, known)}, expected one of {', '.join(known)}"
                )
        return replace(self, **values)  # type: ignore[arg-type]

    def as_dict(self) -> dict[str, float]:
        """The values by name."""
        return {key: float(value) for key, value in asdict(self).items()}


PRESETS = {"none": SensorNoise.none, "default": SensorNoise, "laboratory": SensorNoise.laboratory}


def load_sensors(name_or_path: str) -> SensorNoise:
    """A preset by name (none, default, laboratory), or a .toml file whose keys are `SensorNoise`'s; what the file
    does not name is as in "default".

    Raises:
        ConfigError: no such preset or file, or a wrong key or value; the message names it.
    """
    if name_or_path in PRESETS:
        return PRESETS[name_or_path]()
    path = Path(name_or_path)
    if path.suffix != ".toml" or not is_file(path):
        raise ConfigError(
            f"simulation: sensors is {name_or_path!r}, expected {', '.join(PRESETS)} or a .toml file that exists"
        )
    try:
        values = tomllib.loads(read_bytes(path, ConfigError, LARGEST_TEXT).decode("utf-8-sig"))
    except (ValueError, RecursionError) as error:
        raise ConfigError(f"{path}: cannot be read as TOML ({error})") from None
    try:
        return SensorNoise().changed(values)
    except ConfigError as error:
        raise error.reworded(f"{path}: {error.message}") from None
