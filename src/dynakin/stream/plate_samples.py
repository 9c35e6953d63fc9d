"""Plates at the times of the markers, sample by sample, as `recordings.resampling` brings whole recordings there."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from dynakin.recordings.limits import LARGEST_MOMENT_NM
from dynakin.recordings.resampling import CausalLowPass, latest_before, low_pass_for
from dynakin.stream.sources.clock import Pace

Array = npt.NDArray[np.float64]

_FILLED_S = 0.02  # gaps up to this are bridged by a straight line; after longer ones the low-pass begins anew
_KEPT_S = 2.0


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

    @property
    def newest_s(self) -> float:
        """Time of the newest sample, -inf before there is one."""
        return float(self._time[-1]) if len(self._time) else -np.inf

    def push(self, time: Array, wrenches: Array) -> None:
        """The next samples: (K,) s and (K, P, 6)."""
        values = np.asarray(wrenches, float).reshape(len(time), 6 * self.count)
        good = (np.abs(values) <= LARGEST_MOMENT_NM).all(axis=1) & np.isfinite(time)  # NaN is not
        time, values = np.asarray(time, float)[good], values[good]
        if not len(time):
            return
        if self._last is not None:
            gap = time[0] - self._last[0]
            if gap > _FILLED_S + 1.5 / self.rate_hz:
                self._filter, self._from = None, float(time[0])
                self._pace.go_on_from(None)
            if missing := self._pace.missing(float(time[0]), float(time[-1]), len(time)):
                part = (np.arange(missing) + 1.0)[:, None] / (missing + 1.0)
                values = np.vstack([self._last[1] + part * (values[0] - self._last[1]), values])
                time = np.concatenate([self._last[0] + part[:, 0] * gap, time])
        else:
            self._from = float(time[0])
            self._pace.missing(float(time[0]), float(time[-1]), len(time))
        self._last = (float(time[-1]), values[-1].copy())
        if self._filter is None:
            self._filter = low_pass_for(self.rate_hz, self.marker_rate_hz)
        filtered = values if self._filter is None else self._filter.push(values)
        keep = np.searchsorted(self._time, time[-1] - _KEPT_S)
        self._time = np.concatenate([self._time[keep:], time])
        self._values = np.vstack([self._values[keep:], filtered])

    def covers(self, time_s: float) -> bool:
        """Whether no sample that is still to come could be the one at ``time_s``."""
        return self.newest_s > time_s - 0.98 / self.rate_hz

    def at(self, time_s: float) -> Array | None:
        """Wrenches (P, 6) at a time, None where the plates were silent then."""
        k = int(latest_before(self._time, np.array([time_s]), 1.0 / self.rate_hz)[0])
        if k < 0 or time_s < self._from - 0.5 / self.rate_hz or time_s - self._time[k] > _FILLED_S + 1.5 / self.rate_hz:
            return None
        return np.asarray(self._values[k].reshape(self.count, 6))
