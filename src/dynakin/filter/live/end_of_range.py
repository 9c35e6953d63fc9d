"""Whether a plate is at the end of its range, at this moment."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from dynakin.recordings.plates.ground_plate import FLAT_FRAMES
from dynakin.recordings.pushes import JUDGED_N

Array = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]


class EndOfRange:
    """Whether plates are at the end of their range; afterwards it is `recordings.plates.ground_plate.saturated`."""

    def __init__(self, plates: int) -> None:
        self._top = np.full(plates, JUDGED_N)
        self._last, self._before = np.full(plates, np.nan), np.full(plates, np.nan)
        self._flat = np.zeros(plates, dtype=int)

    def at_end(self, push: Array) -> Flags:
        """(P,) of the next frame's vertical forces (P,) N."""
        self._top = np.fmax(self._top, push)
        flat = (push > self._top * (1.0 - 1e-6)) & (np.abs(push - self._last) <= 1e-6 * self._top)
        self._before = np.where(flat, self._before, self._last)
        self._flat = np.where(flat, self._flat + 1, 0)
        self._last = push.copy()
        return np.asarray((self._flat >= FLAT_FRAMES - 1) & (self._before < 0.99 * self._top))
