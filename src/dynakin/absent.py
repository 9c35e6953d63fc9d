"""What is not a finite number is absent from every file: NaN in tables and arrays, null in JSON, a blank cell in CSV.

Infinity is never a result, only the trace of an overflow or of a division by zero, and readers of files do not expect
it; OpenSim takes ``nan`` for a gap.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt


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
