"""How large the errors of the simulated sensors are."""

from __future__ import annotations

from dataclasses import dataclass

from dynakin.errors import ConfigError


@dataclass(frozen=True)
class SensorNoise:
    """Sizes of what the sensors and the skin add; any of them may be 0.

    Attributes:
        marker_sd_m: white noise of each marker along each axis, m.
        soft_tissue: factor on the amplitudes of soft_tissue.toml.
        soft_tissue_random: share of them that wanders instead of following a joint angle, 0 to 1.
        plate_force_sd_n: white noise of each component of each plate's force, N.
        plate_moment_sd_nm: white noise of each plate's moment about the plate's centre, N m.

    Raises:
        ConfigError: a value out of its range; the message names it.
    """

    marker_sd_m: float = 0.0005
    soft_tissue: float = 1.0
    soft_tissue_random: float = 0.3
    plate_force_sd_n: float = 1.0
    plate_moment_sd_nm: float = 0.3

    def __post_init__(self) -> None:
        for key, value in vars(self).items():
            highest = 1.0 if key == "soft_tissue_random" else float("inf")
            if not 0.0 <= value <= highest:
                raise ConfigError(f"sensor noise: {key} is {value}, expected 0 to {highest:g}")

    @classmethod
    def none(cls) -> SensorNoise:
        """Perfect sensors on a rigid body."""
        return cls(marker_sd_m=0.0, soft_tissue=0.0, plate_force_sd_n=0.0, plate_moment_sd_nm=0.0)
