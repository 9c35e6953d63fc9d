"""A bounded buffer that brings packets back into the order of their time stamps."""

from __future__ import annotations

import heapq
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

from dynakin.stream.sources.clock import Pace

T = TypeVar("T")

_SAME = 0.01  # part of a period within which two stamps are the same


@dataclass
class Counts:
    """What was wrong with a stream's stamps so far, in packets (lost: in samples)."""

    late: int = 0
    duplicate: int = 0
    lost: int = 0
    invalid: int = 0


class InOrder(Generic[T]):
    """Gives each packet as soon as it is the next one; after a gap it waits for what is missing, at most ``delay_s``.

    So nothing is delayed while nothing is lost.

    Args:
        period_s: nominal time between two samples.
        delay_s: longest wait for a packet that is missing, by the stamps and by the clock of arrival.
        most: packets kept at most; the oldest is given before there are more.
        ordered: packets come in their order, so that none is waited for.
    """

    def __init__(self, period_s: float, delay_s: float, most: int = 256, ordered: bool = False) -> None:
        self.period_s, self.delay_s, self.most, self.ordered = period_s, delay_s, most, ordered
        self._pace = Pace(period_s)
        self.counts = Counts()
        self.last_s: float | None = None  # stamp of the last sample given
        self._heap: list[tuple[float, int, float, float, T, int]] = []
        self._pushed = 0
        self._newest = -np.inf
        self._seam_s = np.inf

    def push(self, start_s: float, end_s: float, arrived_s: float, item: T, count: int = 1) -> None:
        """A packet with ``count`` samples; left out where it is too late or there already."""
        if not (np.isfinite(start_s) and np.isfinite(end_s)) or end_s < start_s:
            self.counts.invalid += 1
            return
        if self._refused(start_s, end_s):
            return
        self._pushed += 1
        heapq.heappush(self._heap, (start_s, self._pushed, end_s, arrived_s, item, count))
        self._newest = max(self._newest, end_s)

    def pop(self, now_s: float) -> T | None:
        """The next packet, None where there is none or it still waits for one before it."""
        while self._heap:
            start, _, end, arrived, item, count = self._heap[0]
            if self._refused(start, end):
                heapq.heappop(self._heap)
                continue
            due = (
                self.ordered
                or self.last_s is None
                or start <= self.last_s + 1.5 * self.period_s
                or self._newest - start >= self.delay_s
                or now_s - arrived >= self.delay_s
                or len(self._heap) > self.most
            )
            if not due:
                return None
            heapq.heappop(self._heap)
            if end > self._seam_s:
                self._seam_s = np.inf
                self._pace.go_on_from(None)
            self.counts.lost += self._pace.missing(start, end, count)
            self.last_s = end
            return item
        return None

    def skip_to(self, time_s: float) -> None:
        """Take what lies before ``time_s`` as given."""
        self.last_s = time_s if self.last_s is None else max(self.last_s, time_s)
        self._pace.go_on_from(self.last_s)

    def seam(self, before_s: float) -> None:
        """Nothing was sent between what has come and ``before_s``."""
        self._seam_s = before_s - 0.5 * self.period_s

    def clear(self) -> None:
        """Forget the order, keep the counts."""
        self._heap.clear()
        self.last_s, self._newest = None, -np.inf
        self._pace.go_on_from(None)

    def _refused(self, start_s: float, end_s: float) -> bool:
        if self.last_s is None or start_s > self.last_s + _SAME * self.period_s:
            return False
        if abs(end_s - self.last_s) <= _SAME * self.period_s:
            self.counts.duplicate += 1
        else:
            self.counts.late += 1
        return True
