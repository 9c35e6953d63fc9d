"""Centres of pressure: of an estimate's feet, and of any wrench that is given about the ground's origin."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from dynakin.recordings.plates.pressure import LOADED_N, Surface
from dynakin.recordings.plates.pressure import centre_of_pressure as recorded_pressure
from dynakin.results.estimate import Estimate

Array = npt.NDArray[np.float64]


def centre_of_pressure(wrench: Array, height_m: float, threshold_n: float = LOADED_N) -> tuple[Array, Array]:
    """Where on the level plane y = ``height_m`` a wrench has no moment but about the vertical.

    Args:
        wrench: (T, 6) N and N m about the ground's origin, ground frame; what is not modelled is NaN.

    Returns:
        Point (T, 3) m and free moment (T,) N m about the vertical; NaN where the vertical force is below
        ``threshold_n`` or a component that it takes is not known (in a plane: z and the free moment).
    """
    wrench = np.asarray(wrench, dtype=float)
    known = np.isfinite(wrench)
    filled = np.where(known, wrench, 0.0)
    floor = Surface(np.array([0.0, height_m, 0.0]), np.array([0.0, 1.0, 0.0]))
    point, free = recorded_pressure(filled[..., :3], filled[..., 3:], floor, threshold_n)
    in_plane, across = known[..., [0, 1, 5]].all(axis=-1), known[..., 1:4].all(axis=-1)
    pushed = known[..., 1] & (filled[..., 1] >= threshold_n)
    given = np.stack([in_plane, known[..., 1], across], axis=-1) & pushed[..., None]
    return np.where(given, point, np.nan), np.where(known.all(axis=-1) & pushed, free[..., 1], np.nan)


def foot_pressure(estimate: Estimate, foot: str | None = None) -> tuple[Array, Array]:
    """Centre of pressure (T, 3) m, ground frame, and free moment (T,) N m, of a foot or of the estimated total wrench;
    NaN below `LOADED_N` and where the model does not have the components.

    Raises:
        KeyError: no such foot.
    """
    wrench = estimate.data["wrench_estimated"] if foot is None else estimate.data["foot_wrench"].sel(foot=foot)
    return centre_of_pressure(wrench.transpose("time", "component").values, floor_height(estimate))


def floor_height(estimate: Estimate) -> float:
    """Height (m, ground frame) of the plates' surface: the median of their centres of pressure, else of their corners,
    else 0."""
    plates, ground = estimate.recording.plates, estimate.ground
    points = [plate.cop for plate in plates]
    heights = ground.points_to_ground(np.concatenate(points))[:, 1] if points else np.array([])
    if not np.isfinite(heights).any():
        corners = [plate.corners for plate in plates if plate.corners is not None]
        heights = ground.points_to_ground(np.concatenate(corners))[:, 1] if corners else np.zeros(1)
    return float(np.nanmedian(heights))
