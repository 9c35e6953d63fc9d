"""How high the plates' surfaces are, and the floor."""

from __future__ import annotations

import numpy as np

from dynakin.recordings.frame import GroundFrame
from dynakin.recordings.recording import Plate, Recording

UNDER_MARKERS_M = 0.02
"""How far below its lowest marker a shoe's sole is at least: half a marker and its base."""
SHOE_M = 0.12
"""How far above the floor the lowest marker of a foot that stands may be: on a boot, or on an ankle."""
SAME_LEVEL_M = 0.05
"""Supports whose heights differ by less are on one level: a foot's markers show its support to some cm. Steps of stairs
are 0.15 m and more."""


def surface_height(plate: Plate, ground: GroundFrame) -> float | None:
    """Height (m, ground frame) of a plate's surface: its corners' mean, else the median of its centres of pressure;
    None where neither is known."""
    points = plate.cop if plate.corners is None else plate.corners
    heights = ground.points_to_ground(points)[:, 1]
    return float(np.nanmedian(heights)) if np.isfinite(heights).any() else None


def floor_height(recording: Recording, ground: GroundFrame) -> float:
    """Height (m, ground frame) of the floor, the one that a run has: that of its lowest plate. Without plates it is the
    laboratory's zero, which is where laboratories put it, or, where markers go lower or never come near that, a little
    below the lowest of them."""
    plates = [height for plate in recording.plates if (height := surface_height(plate, ground)) is not None]
    if plates:
        return min(plates)
    zero = float(ground.points_to_ground(np.zeros(3))[1])
    heights = ground.points_to_ground(recording.markers)[..., 1]
    if not np.isfinite(heights).any():
        return zero
    lowest = float(np.percentile(np.where(np.isfinite(heights), heights, np.inf).min(axis=1), 5.0))
    return zero if -UNDER_MARKERS_M <= lowest - zero <= SHOE_M or not np.isfinite(lowest) else lowest - UNDER_MARKERS_M
