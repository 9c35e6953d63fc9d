"""What the filter is told about noise: process and measurement variances, and how constraints are kept."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, ConfigDict, Field

from dynakin import _core

Variance = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]
PositiveVariance = Annotated[float, Field(gt=0.0)]


class Noise(BaseModel):
    """Variances in SI units squared. The defaults are the paper's Table I, Q added at each step."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    coordinate: Variance = 1e3
    """Q of each coordinate, rad^2 or m^2 a step."""
    speed: Variance = 1e2
    """Q of each speed, (rad/s)^2 a step."""
    acceleration: Variance = 1e3
    """Q of each acceleration, (rad/s^2)^2 a step."""
    length: Variance = 0.0
    """Q of each segment length: constants."""
    marker_place: Variance = 1e-4
    """Q of each local marker coordinate, m^2 a step."""
    inertia: Variance = 0.0
    """Q of each inertial parameter: constants."""

    marker_scale: PositiveVariance = 1.0
    """Factor on the R of all markers that the marker set gives."""
    marker: dict[str, PositiveVariance] = {}
    """R of single markers, m^2, by their name in the recording, instead of the marker set's."""
    force: PositiveVariance = 0.1
    """R of each force component of the total wrench, N^2."""
    moment: PositiveVariance = 0.1
    """R of each moment component, (N m)^2."""
    reference_point_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Where the wrench's noise is declared, in the ground frame."""
    total_mass: PositiveVariance = 1e-4
    """R of the total mass as a soft constraint at each frame, kg^2."""

    constraint: Literal["gain", "none"] = "gain"
    """How bounds are kept: by restricting the gain (7), or not at all."""

    def process_variance(self, layout: _core.StateLayout) -> npt.NDArray[np.float64]:
        """Diagonal of Q (n,) in the order of the state."""
        by_block = {
            "coordinates": self.coordinate,
            "speeds": self.speed,
            "accelerations": self.acceleration,
            "lengths": self.length,
            "markers": self.marker_place,
            "inertia": self.inertia,
        }
        return np.concatenate([np.full(size, by_block[name]) for name, (_, size) in layout.blocks.items()])

    def wrench_covariance(self) -> npt.NDArray[np.float64]:
        """R (6, 6) of the total wrench about the reference point."""
        return np.diag([self.force] * 3 + [self.moment] * 3)
