"""What all share of arrays: their types, runs of true values, peaks, angles within a turn, vectors' products, wrenches
about another point, means of what is known, samples by their neighbours; no gaps, and no infinities, which no file may
have."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]
Codes = npt.NDArray[np.uint8]


def runs(flags: Flags) -> list[tuple[int, int]]:
    """Frames [first, end) of each stretch of true in ``flags`` (T,)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(int)))
    return [(int(first), int(end)) for first, end in edges.reshape(-1, 2)]


def widened(flags: Flags, frames: int) -> Flags:
    """``flags`` (T,) with so many frames more on either side of each stretch of true."""
    wide = flags.copy()
    for first, end in runs(flags):
        wide[max(0, first - frames) : end + frames] = True
    return wide


def peaks(path: Array, prominence: float) -> list[int]:
    """Where ``path`` (T,) is higher than on both sides, the middle of a flat top, and at least by ``prominence`` higher
    than the higher of the two lowest points on the way to something higher, or to an end, on either side.

    As `scipy.signal.find_peaks`, which takes half a second to load.
    """
    ends = np.flatnonzero(np.diff(path))  # the last frame of each flat stretch but the last
    found = []
    for before, end in pairwise(ends):
        if path[before] < path[end] > path[end + 1]:
            top = int(before + 1 + end) // 2
            higher = np.concatenate([[-1], np.flatnonzero(path > path[top]), [len(path)]])
            k = int(np.searchsorted(higher, top))
            lowest = path[higher[k - 1] + 1 : top + 1].min(), path[top : higher[k]].min()
            if path[top] - max(lowest) >= prominence:
                found.append(top)
    return found


def wrapped(angles: npt.ArrayLike) -> Array:
    """Angles (rad) within half a turn of zero."""
    return np.asarray((np.asarray(angles) + np.pi) % (2.0 * np.pi) - np.pi)


_NEXT = np.array([1, 2, 0])


def cross(a: Array, b: Array) -> Array:
    """Vector products along the last axis, bit for bit those of `np.cross`, which takes ten times as long for the few
    hundred vectors of a movement."""
    turned = a * b.take(_NEXT, -1) - a.take(_NEXT, -1) * b
    return np.asarray(turned.take(_NEXT, -1))


def by_neighbours(values: Array) -> Array:
    """(T - 4, ...) what each sample but two on either side of (T, ...) would be by the cubic through the two before it
    and the two behind it; NaN where one of these is missing."""
    return np.asarray((4.0 * (values[1:-3] + values[3:-1]) - values[:-4] - values[4:]) / 6.0)


def filled(values: Array) -> Array:
    """The same numbers with 0 where one is missing (NaN): `np.nan_to_num` takes ten times as long for a frame."""
    return np.where(np.isnan(values), 0.0, values)


def wrench_about(wrench: Array, point: Array) -> Array:
    """Wrenches (..., 6) about the origin, their moments about ``point`` (..., 3) instead: m_r = m_O - r x f."""
    force = wrench[..., :3]
    return np.concatenate([force, wrench[..., 3:] - cross(point, force)], axis=-1)


def rms(values: npt.ArrayLike, axis: int | None = None) -> Array:
    """Root mean square of the numbers that are known, along an axis or of all; NaN where none is."""
    return _root_mean(np.asarray(values) ** 2, axis)


def rms_length(vectors: Array, axis: int | None = None) -> Array:
    """Root mean square length of vectors (..., n), along an axis or of all; one with an unknown component does not
    count. NaN without any."""
    return _root_mean((vectors**2).sum(axis=-1), axis)


def _root_mean(squares: Array, axis: int | None) -> Array:
    known = ~np.isnan(squares)  # an infinity is no gap
    with np.errstate(invalid="ignore"):
        return np.asarray(np.sqrt(np.where(known, squares, 0.0).sum(axis=axis) / known.sum(axis=axis)))


def mean_seen(points: Array, axis: int) -> Array:
    """Mean along an axis of the points (..., n) that are seen whole; NaN where none is."""
    seen = np.isfinite(points).all(axis=-1, keepdims=True)
    with np.errstate(invalid="ignore"):
        return np.asarray(np.where(seen, points, 0.0).sum(axis=axis) / seen.sum(axis=axis))


def finite(values: npt.ArrayLike) -> Array:
    """The same numbers with infinities as NaN."""
    found = np.asarray(values, dtype=float)
    return np.where(np.isinf(found), np.nan, found) if np.isinf(found).any() else found
