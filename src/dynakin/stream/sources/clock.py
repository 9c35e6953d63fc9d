"""Clocks of the streams: one that starts again, the offset between two, and missing samples on one that jitters."""

from __future__ import annotations

import numpy as np

STALE_S = 1.0
"""Stamps that lie further back than this are old packets, or a clock that was set back."""
RESTART_S = 0.5
"""How long nothing but such stamps must arrive before the clock counts as set back."""


class Clock:
    """Carries the stamps of one clock to a time that never goes back: a clock that starts again is set forward.

    A burst of old packets is over within less than ``RESTART_S``, a clock that was set back is not.
    """

    def __init__(self) -> None:
        self.offset_s = 0.0
        self.restarts = 0
        self.least_age_s = np.inf  # smallest difference of arrival and stamp: how late the fastest packet was
        self._newest = -np.inf
        self._newest_arrived = -np.inf
        self._stale_since: float | None = None

    def time(self, stamp_s: float, arrived_s: float) -> float | None:
        """The stamp on the continued time; None where it is not a number."""
        if not np.isfinite(stamp_s):
            return None
        time = stamp_s + self.offset_s
        if time >= self._newest - STALE_S:
            self._stale_since = None
            if time > self._newest:
                self._newest, self._newest_arrived = time, arrived_s
        elif self._stale_since is None:
            self._stale_since = arrived_s
        elif arrived_s - self._stale_since >= RESTART_S:
            continued = self._newest + max(arrived_s - self._newest_arrived, 1e-3)
            self.offset_s += continued - time
            self.restarts += 1
            self._stale_since = None
            self._newest, self._newest_arrived = continued, arrived_s
            time = continued
        self.least_age_s = min(self.least_age_s, arrived_s - time)
        return time


def offset_between(own: Clock, other: Clock) -> float:
    """What to add to times of ``other`` to have those of ``own``, s.

    The fastest packet of each stream is taken to have been as fast as the other's: the answer is wrong by the
    difference of the two shortest transmissions.
    """
    return float(other.least_age_s - own.least_age_s)


_FOLLOW = 0.1  # part of a stamp's deviation that the even pace follows: a clock that is off by 0.1 %, but not jitter


class Pace:
    """An even pace that follows the stamps slowly, so that a stamp may be off by nearly half a period.

    Args:
        period_s: nominal time between two samples.
    """

    def __init__(self, period_s: float) -> None:
        self.period_s = period_s
        self._at: float | None = None

    def missing(self, start_s: float, end_s: float, count: int = 1) -> int:
        """How many samples lie between the last ones and ``count`` from ``start_s`` to ``end_s``, which are taken."""
        period = self.period_s
        if self._at is None:
            self._at = end_s
            return 0
        found = max(round((start_s - self._at) / period) - 1, 0)
        even = self._at + (found + count) * period
        self._at = even + _FOLLOW * (end_s - even)
        return found

    def go_on_from(self, time_s: float | None) -> None:
        """The last sample was at ``time_s``; None: begin anew."""
        self._at = time_s
