"""One cycle of a movement that repeats, for the figures that show one."""

from __future__ import annotations

import numpy as np
from scipy import signal

from dynakin.results import Estimate

_REST = 0.05  # a cycle begins where the leading angle leaves, and ends where it comes back to, this share of its range


def leading_coordinate(estimate: Estimate) -> int:
    """Number of the knee's coordinate where there is one, else of the rotation that moves most."""
    names = estimate.coordinate_names
    if "knee" in names:
        return names.index("knee")
    ranges = np.ptp(estimate.data["coordinates"].transpose("time", "coordinate").values, axis=0)
    return int(np.argmax(np.where(estimate.is_rotation(), np.nan_to_num(ranges), -1.0)))


def middle_cycle(estimate: Estimate) -> slice:
    """Frames of the middle repetition, from rest to rest; the whole recording where nothing repeats."""
    angle = estimate.data["coordinates"].transpose("time", "coordinate").values[:, leading_coordinate(estimate)]
    span = float(np.ptp(angle))
    peaks, _ = signal.find_peaks(angle, prominence=0.5 * span, distance=max(1, round(0.5 * estimate.recording.rate)))
    if span == 0.0 or not len(peaks):
        return slice(0, len(angle))
    k = len(peaks) // 2
    before = int(peaks[k - 1]) if k else 0
    after = int(peaks[k + 1]) if k + 1 < len(peaks) else len(angle)
    start = before + _last_low(angle[before : peaks[k] + 1])
    end = peaks[k] + len(angle[peaks[k] : after]) - 1 - _last_low(angle[peaks[k] : after][::-1])
    return slice(start, int(end) + 1)


def _last_low(rise: np.ndarray) -> int:
    """The last place before the rise to the end of the array."""
    low, high = float(rise.min()), float(rise[-1])
    return int(np.flatnonzero(rise <= low + _REST * (high - low))[-1])
