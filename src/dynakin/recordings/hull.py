"""How far points on the level lie from the area between others: a foot's markers, a plate's edges."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from dynakin.recordings.recording import Array

_FRAMES = 4096  # at once: all pairs of corners of an hour take much memory


def distance_to_hull(points: Array, outline: Array) -> Array:
    """Distance (T,) m of points (T, 2) from the convex hull of the corners (T, K, 2), 0 inside, NaN corners
    left out.

    A point outside is as far from the hull as from the nearest of all lines between two corners; it is inside
    if it lies in some triangle of corners. NaN where the point or all corners are missing.
    """
    blocks = [slice(first, first + _FRAMES) for first in range(0, max(len(points), 1), _FRAMES)]
    return np.concatenate([_distance(points[block], outline[block]) for block in blocks])


def _distance(points: Array, outline: Array) -> Array:
    numbers = range(outline.shape[1])
    pairs, triangles = list(combinations(numbers, 2)), list(combinations(numbers, 3))
    to_point = points[:, None] - outline  # (T, K, 2)
    distance = np.fmin.reduce(_length(to_point), axis=1, initial=np.inf)  # alone: the only other corners are missing
    if pairs:
        first, second = np.array(pairs).T
        along, to_point = outline[:, second] - outline[:, first], to_point[:, first]
        with np.errstate(invalid="ignore", divide="ignore"):
            share = np.clip((to_point * along).sum(axis=2) / (along**2).sum(axis=2), 0.0, 1.0)
            distance = np.fmin(distance, np.fmin.reduce(_length(to_point - share[..., None] * along), axis=1))
    if triangles:
        side = along[..., 0] * to_point[..., 1] - along[..., 1] * to_point[..., 0]  # of each pair
        pair = {own: k for k, own in enumerate(pairs)}
        ij, jk, ik = np.array([(pair[i, j], pair[j, k], pair[i, k]) for i, j, k in triangles]).T
        around = side[:, ij], side[:, jk], -side[:, ik]
        within = np.logical_and.reduce([one > 0 for one in around]) | np.logical_and.reduce([one < 0 for one in around])
        distance[within.any(axis=1)] = 0.0
    return np.where(np.isfinite(distance) & np.isfinite(points).all(axis=1), distance, np.nan)


def _length(vectors: Array) -> Array:
    return np.asarray(np.sqrt(vectors[..., 0] ** 2 + vectors[..., 1] ** 2))
