"""What all share of arrays: runs of true values, angles within a turn, and no infinities, which no file may have."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt


def runs(flags: npt.NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Frames [first, end) of each stretch of true in ``flags`` (T,)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(int)))
    return [(int(first), int(end)) for first, end in edges.reshape(-1, 2)]


def wrapped(angles: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """Angles (rad) within half a turn of zero."""
    return np.asarray((np.asarray(angles) + np.pi) % (2.0 * np.pi) - np.pi)


def finite(values: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """The same numbers with infinities as NaN."""
    found = np.asarray(values, dtype=float)
    return np.where(np.isinf(found), np.nan, found) if np.isinf(found).any() else found


def with_nulls(value: Any) -> Any:
    """The same dictionaries and lists with what is not a finite number as None."""
    if isinstance(value, dict):
        return {key: with_nulls(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [with_nulls(item) for item in value]
    if isinstance(value, float | np.floating) and not math.isfinite(value):
        return None
    return value
