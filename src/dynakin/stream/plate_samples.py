"""Plates at the times of the markers, sample by sample, as `recordings.resampling` brings whole recordings there, and
what of them is no measurement."""

from __future__ import annotations

import numpy as np

from dynakin.arrays import Array, Flags
from dynakin.recordings.limits import LARGEST_MOMENT_NM
from dynakin.recordings.plates.stuck import SOON, frozen
from dynakin.recordings.resampling import PASS, CausalLowPass, latest_before, low_pass_for, reach_s
from dynakin.stream.sources.clock import Pace

_FILLED_S = 0.02  # gaps up to this are bridged by a straight line; after longer ones the low-pass begins anew
_KEPT_S = 2.0
_BEFORE_S = 1.0  # by which it is judged whether a plate is frozen


class PlateSamples:
    """Takes plates at their own rate, in order, and gives the wrench at the time of a marker frame.

    Args:
        rate_hz: of the plates. marker_rate_hz: of the markers. count: plates.
    """

    def __init__(self, rate_hz: float, marker_rate_hz: float, count: int) -> None:
        self.rate_hz, self.marker_rate_hz, self.count = rate_hz, marker_rate_hz, count
        self._filter: CausalLowPass | None = None
        self._time = np.zeros(0)
        self._values = np.zeros((0, 6 * count))
        self._last: tuple[float, Array] | None = None
        self._pace = Pace(1.0 / rate_hz)
        self._from = -np.inf  # nothing is known before: a gap ends here
        self._lost_until = np.full(count, -np.inf)  # from when on a plate is measured again
        self._lost = np.zeros((0, count), dtype=bool)
        self._settles_s = reach_s(rate_hz, rate_hz, PASS * marker_rate_hz) if rate_hz > 1.01 * marker_rate_hz else 0.0
        self._watch = _Still(rate_hz, count)

    @property
    def frozen(self) -> list[tuple[int, float]]:
        """Which plates repeated one row while somebody stood on them, from when on, s."""
        return self._watch.found

    @property
    def frozen_until(self) -> list[float]:
        """Times of the last of each of these rows, s."""
        return self._watch.until

    @property
    def newest_s(self) -> float:
        """Time of the newest sample, -inf before there is one."""
        return float(self._time[-1]) if len(self._time) else -np.inf

    def push(self, time: Array, wrenches: Array) -> None:
        """The next samples: (K,) s and (K, P, 6)."""
        values = np.asarray(wrenches, float).reshape(len(time), 6 * self.count)
        each: Flags = np.asarray((np.abs(wrenches) <= LARGEST_MOMENT_NM).all(axis=2))  # NaN is not
        good: Flags = np.asarray(each.any(axis=1) & np.isfinite(time))
        time, values, each = np.asarray(time, float)[good], values[good], each[good]
        if not len(time):
            return
        if not each.all():
            values = self._with_the_last(values, each)
        if self._last is not None:
            gap = time[0] - self._last[0]
            if gap > _FILLED_S + 1.5 / self.rate_hz:
                self._filter, self._from = None, float(time[0])
                self._pace.go_on_from(None)
            if missing := self._pace.missing(float(time[0]), float(time[-1]), len(time)):
                part = (np.arange(missing) + 1.0)[:, None] / (missing + 1.0)
                values = np.vstack([self._last[1] + part * (values[0] - self._last[1]), values])
                time = np.concatenate([self._last[0] + part[:, 0] * gap, time])
                each = np.vstack([np.ones((missing, self.count), dtype=bool), each])
        else:
            self._from = float(time[0])
            self._pace.missing(float(time[0]), float(time[-1]), len(time))
        lost = self._lost_in(time, values, each)
        self._last = (float(time[-1]), values[-1].copy())
        if self._filter is None:
            self._filter = low_pass_for(self.rate_hz, self.marker_rate_hz)
        filtered = values if self._filter is None else self._filter.push(values)
        keep = np.searchsorted(self._time, time[-1] - _KEPT_S)
        self._time = np.concatenate([self._time[keep:], time])
        self._values = np.vstack([self._values[keep:], filtered])
        self._lost = np.vstack([self._lost[keep:], lost])

    def _with_the_last(self, values: Array, each: Flags) -> Array:
        """What a plate that alone is not measured had last, so that the low-pass goes on."""
        found, last = values.copy(), np.zeros(6 * self.count) if self._last is None else self._last[1]
        for k, known in enumerate(np.repeat(each, 6, axis=1)):
            last = found[k] = np.where(known, found[k], last)
        return found

    def _lost_in(self, time: Array, values: Array, each: Flags) -> Flags:
        """(K, P) samples of plates that are frozen or not measured, and those that the low-pass makes of them."""
        still = self._watch.look(time, values.reshape(-1, self.count, 6))
        lost = ~each | still
        if not lost.any() and not (time[0] <= self._lost_until).any():
            return lost
        for k in range(len(time)):
            self._lost_until[lost[k]] = time[k] + self._settles_s
            lost[k] |= time[k] <= self._lost_until
        return lost

    def covers(self, time_s: float) -> bool:
        """Whether no sample that is still to come could be the one at ``time_s``."""
        return self.newest_s > time_s - 0.98 / self.rate_hz

    def at(self, time_s: float) -> Array | None:
        """Wrenches (P, 6) at a time, None where the plates were silent then."""
        k = int(latest_before(self._time, np.array([time_s]), 1.0 / self.rate_hz)[0])
        if k < 0 or time_s < self._from - 0.5 / self.rate_hz or time_s - self._time[k] > _FILLED_S + 1.5 / self.rate_hz:
            return None
        wrenches = self._values[k].reshape(self.count, 6)
        return np.where(self._lost[k][:, None], np.nan, wrenches) if self._lost[k].any() else np.asarray(wrenches)


class _Still:
    """Watches for plates whose rows repeat while somebody stands on them (`recordings.plates.stuck`)."""

    def __init__(self, rate_hz: float, count: int) -> None:
        self.rate_hz = rate_hz
        self.found: list[tuple[int, float]] = []
        self.until: list[float] = []
        self._at = np.zeros(count, dtype=int)  # places there of those that hang
        self._rows = np.zeros((0, count, 6))  # of the last second
        self._kept = round(_BEFORE_S * rate_hz)
        self._same = np.zeros(count, dtype=int)  # rows so far that equal the one before
        self._hung = np.zeros(count, dtype=bool)

    def look(self, time: Array, rows: Array) -> Flags:
        """(K, P) rows of the next ones (K, P, 6) that are no measurement."""
        before = self._rows[-1:] if len(self._rows) else np.full_like(rows[:1], np.nan)
        same = (rows == np.concatenate([before, rows[:-1]])).all(axis=2)
        self._rows = np.concatenate([self._rows, rows])[-self._kept :]
        lost = np.zeros(same.shape, dtype=bool)
        if not (same[-1].any() or self._hung.any()):
            self._same[:] = 0
            return lost
        for p in range(same.shape[1]):
            moved = np.flatnonzero(~same[:, p])
            if self._hung[p]:
                held = int(moved[0]) if len(moved) else len(same)
                self.until[self._at[p]] = float(time[held - 1]) if held else self.until[self._at[p]]
            if len(moved):
                self._same[p], self._hung[p] = 0, False
            run = len(same) - (int(moved[-1]) + 1 if len(moved) else 0)
            self._same[p] += run
            if not run:
                continue
            if not self._hung[p] and self._stands_still(self._rows[:, p]):
                self._hung[p] = True
                self._at[p] = len(self.found)
                self.found.append((p, float(time[-1]) - (int(self._same[p]) - 1) / self.rate_hz))
                self.until.append(float(time[-1]))
            lost[-run:, p] = self._hung[p]
        return lost

    def _stands_still(self, rows: Array) -> bool:
        along = int(np.argmax(np.abs(rows[:, :3]).sum(axis=0)))
        return bool(frozen(rows, rows[:, along], self.rate_hz, SOON)[-1])
