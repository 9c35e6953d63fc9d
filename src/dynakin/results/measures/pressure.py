"""Centres of pressure of wrenches that are given about the ground's origin."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from dynakin.recordings.frame import GroundFrame
from dynakin.recordings.plates.pressure import Surface
from dynakin.recordings.plates.pressure import centre_of_pressure as recorded_pressure
from dynakin.recordings.recording import Recording

Array = npt.NDArray[np.float64]

LOADED_N = 20.0
"""Vertical force from which a centre of pressure is given: below, 1 N m of error moves it by more than 5 cm."""


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
    told = np.stack([in_plane, known[..., 1], across], axis=-1) & pushed[..., None]
    return np.where(told, point, np.nan), np.where(known.all(axis=-1) & pushed, free[..., 1], np.nan)


def floor_height(recording: Recording, ground: GroundFrame) -> float:
    """Height (m, ground frame) of the plates' surface: the median of their centres of pressure, else of their corners,
    else 0."""
    points = [plate.cop for plate in recording.plates]
    heights = ground.points_to_ground(np.concatenate(points))[:, 1] if points else np.array([])
    if not np.isfinite(heights).any():
        corners = [plate.corners for plate in recording.plates if plate.corners is not None]
        heights = ground.points_to_ground(np.concatenate(corners))[:, 1] if corners else np.zeros(1)
    return float(np.nanmedian(heights))
