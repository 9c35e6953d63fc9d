"""How far a centre of pressure lies from the feet."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from dynakin.recordings.frame import GroundFrame
from dynakin.recordings.landmarks import find_marker
from dynakin.recordings.recording import Array, Recording

DEFAULT_FOOT_MARKERS: dict[str, list[str]] = {
    "left": ["LHEE", "LTOE", "LMT5", "LANK", "L_calc", "L_toe", "L_5meta", "L_ankle"],
    "right": ["RHEE", "RTOE", "RMT5", "RANK", "r_calc", "r_toe", "r_5meta", "r_ankle"],
}
"""Plug-in-Gait and OpenCap's laboratory markers on each foot."""


def foot_outline(recording: Recording, ground: GroundFrame, names: list[str]) -> Array:
    """Horizontal places (T, K, 2) m [X, Z of the ground frame] of those of the markers that the recording
    has."""
    own = list(dict.fromkeys(marker for name in names if (marker := find_marker(recording, name))))
    if not own:
        return np.empty((recording.n_frames, 0, 2))
    points = np.stack([recording.marker(name) for name in own], axis=1)
    return ground.points_to_ground(points)[:, :, [0, 2]]


def distance_to_hull(points: Array, outline: Array) -> Array:
    """Distance (T,) m of points (T, 2) from the convex hull of the corners (T, K, 2), 0 inside, NaN corners
    left out.

    A point outside is as far from the hull as from the nearest of all lines between two corners; it is inside
    if it lies in some triangle of corners. NaN where the point or all corners are missing.
    """
    n_corners = outline.shape[1]
    distance = np.full(len(points), np.inf)
    for i in range(n_corners):  # alone: where the only other corners are missing
        distance = np.fmin(distance, np.linalg.norm(points - outline[:, i], axis=1))
    for i, j in combinations(range(n_corners), 2):
        distance = np.fmin(distance, _to_segment(points, outline[:, i], outline[:, j]))
    for i, j, k in combinations(range(n_corners), 3):
        sides = np.stack([_side(points, outline[:, a], outline[:, b]) for a, b in ((i, j), (j, k), (k, i))], axis=1)
        distance[(sides > 0).all(axis=1) | (sides < 0).all(axis=1)] = 0.0
    return np.where(np.isfinite(distance) & np.isfinite(points).all(axis=1), distance, np.nan)


def _to_segment(points: Array, a: Array, b: Array) -> Array:
    along = b - a
    with np.errstate(invalid="ignore", divide="ignore"):
        share = np.clip(((points - a) * along).sum(axis=1) / (along**2).sum(axis=1), 0.0, 1.0)
        return np.asarray(np.linalg.norm(points - a - share[:, None] * along, axis=1))


def _side(points: Array, a: Array, b: Array) -> Array:
    along, to_point = b - a, points - a
    return np.asarray(along[:, 0] * to_point[:, 1] - along[:, 1] * to_point[:, 0])
