"""Centres of pressure of wrenches that are given about the ground's origin."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from dynakin.recordings import GroundFrame, Recording

Array = npt.NDArray[np.float64]

LOADED_N = 20.0
"""Vertical force from which a centre of pressure is given: below, 1 N m of error moves it by more than 5 cm."""


def centre_of_pressure(wrench: Array, height_m: float, threshold_n: float = LOADED_N) -> tuple[Array, Array]:
    """Where on the level plane y = ``height_m`` a wrench has no moment but about the vertical.

    Args:
        wrench: (..., 6) N and N m about the ground's origin, ground frame; what is not modelled is NaN.

    Returns:
        Point (..., 3) m and free moment (...) N m about the vertical; NaN where the vertical force is below
        ``threshold_n`` or a component that it takes is not known (in a plane: z and the free moment).
    """
    fx, fy, fz, mx, my, mz = np.moveaxis(np.asarray(wrench, dtype=float), -1, 0)
    with np.errstate(invalid="ignore", divide="ignore"):
        loaded = fy >= threshold_n
        x = np.where(loaded, (mz + height_m * fx) / fy, np.nan)
        z = np.where(loaded, (height_m * fz - mx) / fy, np.nan)
    y = np.where(loaded, height_m, np.nan)
    return np.stack([x, y, z], axis=-1), my - (z * fx - x * fz)


def floor_height(recording: Recording, ground: GroundFrame) -> float:
    """Height (m, ground frame) of the plates' surface: the median of their centres of pressure, else of their corners,
    else 0."""
    points = [plate.cop for plate in recording.plates]
    heights = ground.points_to_ground(np.concatenate(points))[:, 1] if points else np.array([])
    if not np.isfinite(heights).any():
        corners = [plate.corners for plate in recording.plates if plate.corners is not None]
        heights = ground.points_to_ground(np.concatenate(corners))[:, 1] if corners else np.zeros(1)
    return float(np.nanmedian(heights))
