"""How far points on the level lie from the area between others: a foot's markers, a plate's edges."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from dynakin.arrays import Array

_FRAMES = 4096  # at once: all pairs of corners of an hour take much memory


def distance_to_hull(points: Array, outline: Array) -> Array:
    """Distance (T,) m of points (T, 2) from the convex hull of the corners (T, K, 2), or (K, 2) all the time, 0 inside,
    NaN corners left out.

    A point outside is as far from the hull as from the nearest of all lines between two corners; it is inside if no
    half of its horizon is without corners. NaN where the point or all corners are missing.
    """
    outline = np.broadcast_to(outline, (len(points), *outline.shape[-2:]))
    blocks = [slice(first, first + _FRAMES) for first in range(0, max(len(points), 1), _FRAMES)]
    return np.concatenate([_distance(points[block], outline[block]) for block in blocks])


def _distance(points: Array, outline: Array) -> Array:
    pairs = list(combinations(range(outline.shape[1]), 2))
    from_corner = points[:, None] - outline  # (T, K, 2)
    distance = np.fmin.reduce(_length(from_corner), axis=1, initial=np.inf)  # alone: the only other corners are missing
    if pairs:
        first, second = np.array(pairs).T
        along, to_point = outline[:, second] - outline[:, first], from_corner[:, first]
        with np.errstate(invalid="ignore", divide="ignore"):
            share = np.clip((to_point * along).sum(axis=2) / (along**2).sum(axis=2), 0.0, 1.0)
            distance = np.fmin(distance, np.fmin.reduce(_length(to_point - share[..., None] * along), axis=1))
        around = np.arctan2(from_corner[..., 1], from_corner[..., 0])
        last = np.fmax.reduce(around, axis=1, keepdims=True)
        around = np.sort(np.where(np.isnan(around), last, around), axis=1)
        widest = np.diff(around, axis=1, append=around[:, :1] + 2.0 * np.pi).max(axis=1)
        distance[widest < np.pi] = 0.0
    return np.where(np.isfinite(distance) & np.isfinite(points).all(axis=1), distance, np.nan)


def _length(vectors: Array) -> Array:
    return np.asarray(np.sqrt(vectors[..., 0] ** 2 + vectors[..., 1] ** 2))
