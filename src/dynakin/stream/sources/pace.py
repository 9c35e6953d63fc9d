"""Counts the samples that are missing in a stream whose stamps jitter."""

from __future__ import annotations

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
