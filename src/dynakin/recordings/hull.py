"""How far points on the level lie from the area between others: a foot's markers, a plate's edges."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from dynakin.recordings.recording import Array


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
