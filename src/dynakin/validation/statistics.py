"""Mean and standard deviation over trials of figures that may be undefined in some."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np


class Spread(NamedTuple):
    """Mean over ``n`` trials and the sample standard deviation (None below two); mean None if no trial has it."""

    mean: float | None
    sd: float | None
    n: int


def spread(values: Sequence[float | None]) -> Spread:
    """Over the values that are defined."""
    known = [value for value in values if value is not None]
    if not known:
        return Spread(None, None, 0)
    sd = float(np.std(known, ddof=1)) if len(known) > 1 else None
    return Spread(float(np.mean(known)), sd, len(known))
