"""Channels of force plates at the end of their range, at the analog rate: a filter makes the flat top uneven."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from dynakin.arrays import runs
from dynakin.recordings.plates.pressure import JUDGED_N
from dynakin.recordings.recording import Array

Flags = npt.NDArray[np.bool_]

FLAT = 5
"""So many samples exactly at a channel's extreme, and so many times as many as it holds any other value for while it
changes (a signal that was held when it was brought to a higher rate). Its counterpart at the rate of the markers, for
plates of any file, is `ground_plate.FLAT_FRAMES` (`GroundPlate`)."""
STEPS = 20
"""A peak that is only written in steps is as flat: but half its width beyond its edges it has fallen by 3 to 4 steps, a
signal that was cut off by three times the depth of the cut."""
SLOPE = 0.5
"""The last step up to the extreme is less than this part of the way there: else it is a switch, or made up."""
_ONE, _COMPUTED = 1e-9, 1e-5
"""Part of the range within which values of a channel are one, and of a force that is computed of several, in single
precision."""


def at_end_of_range(channels: Array, push: Array) -> Flags:
    """(N,) samples in which a channel (C, N) of a plate rests at its largest or smallest value, or the plate's force
    along its normal (N,) N does, while somebody stands on it."""
    found = np.zeros(len(push), dtype=bool)
    loaded = np.abs(push) > JUDGED_N
    if not loaded.any():
        return found
    for values, same in (*((channel, _ONE) for channel in channels), (push, _COMPUTED)):
        found |= _at_end(values, loaded, same) | _at_end(-values, loaded, same)
    return np.asarray(found & loaded)


def _at_end(values: Array, loaded: Flags, same: float) -> Flags:
    """(N,) where values (N,), the same within a part of their range, rest at their largest one."""
    found = np.zeros(len(values), dtype=bool)
    top, size = float(np.max(values)), float(np.ptp(values))
    if not (np.isfinite(size) and size > 0.0):
        return found
    at_top: Flags = np.asarray(values >= top - same * size)
    flat = [(first, end) for first, end in runs(at_top) if end - first >= FLAT and first > 0 and end < len(values)]
    if not flat:
        return found
    change = np.abs(np.diff(values))
    moves = change > same * size
    if not moves.any():  # so slow, and without noise, that nothing tells a rest
        return found
    step = float(change[moves].min())
    for first, end in flat:
        half = (end - first) // 2
        before, after = values[max(first - 1 - half, 0) : first].min(), values[end : end + half + 1].min()
        near = slice(max(first - 4 * half, 0), end + 4 * half)
        still = ~moves[near] & loaded[1:][near] & ~at_top[1:][near]
        held = max((b - a + 1 for a, b in runs(still)), default=1)
        slope = max(top - values[first - 1], top - values[end]) < SLOPE * size
        found[first:end] = slope and top - max(before, after) > STEPS * step and end - first >= FLAT * held
    return found
