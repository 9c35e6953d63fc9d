"""What is judged that no method was given: names of the yardsticks, their figures, and what raw data predict without
any model (the last value held, the last slope carried on)."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from dynakin.arrays import Array
from dynakin.bindings import _core
from dynakin.filter.live.ahead import LookAhead
from dynakin.filter.measurements import Measurements
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.recordings.times import step_of
from dynakin.results.measures.fit import marker_rms_mm, signal_fit
from dynakin.results.measures.metrics import evaluation_window
from dynakin.units import COMPONENTS
from dynakin.validation.table2 import MARKERS, spread

Figures = dict[tuple[str, str, str], float | None]  # (yardstick, quantity, method) -> RMS in the quantity's unit

WITHHELD, LEFT_OUT = "plates withheld", "marker left out"
PERSISTENCE, LINEAR = "persistence", "linear extrapolation"


def ahead(horizon_s: float) -> str:
    """Name of the yardstick that looks so far ahead."""
    return f"{1000.0 * horizon_s:g} ms ahead"


def with_mean(yardstick: str, figures: Figures) -> Figures:
    """The same, opened by the mean over markers of each method."""
    methods = dict.fromkeys(method for _, _, method in figures)
    means: Figures = {
        (yardstick, MARKERS, method): spread(
            [value for (_, q, m), value in figures.items() if m == method and q not in COMPONENTS]
        ).mean
        for method in methods
    }
    return means | figures


@dataclass(frozen=True, eq=False)
class Judged:
    """What a trial measured, as methods are judged by it over its window.

    measured: ground frame; wrenches are NaN where the plates do not measure all of it. seen: wrenches (T, 6) -> the
    same along the axes and about the points (T, 3) by which they are judged.
    """

    calibrated: CalibratedModel
    measured: Measurements
    seen: Callable[[Array], Array] = np.asarray

    @property
    def window(self) -> npt.NDArray[np.bool_]:
        """Frames (T,) that errors are taken over."""
        return evaluation_window(self.measured.time)

    def markers(self, yardstick: str, method: str, places: Array, columns: Iterable[int]) -> Figures:
        """RMS distance (mm) of some markers of ``places`` (T, M, 3) m."""
        axes, window = np.array(self.calibrated.spec.markers[0].measured), self.window
        return {
            (yardstick, self.calibrated.recorded_markers[k], method): marker_rms_mm(
                self.measured.markers[window, k], places[window, k], axes
            )
            for k in columns
        }

    def wrench(self, yardstick: str, method: str, wrench: Array) -> Figures:
        """RMS (N, N m) of each modelled component of a wrench (T, 6) that the plates measure."""
        measured, given = (self.seen(each)[self.window] for each in (self.measured.wrench, wrench))
        return {
            (yardstick, COMPONENTS[k], method): signal_fit(measured[:, k], given[:, k]).rms
            for k in np.flatnonzero(self.calibrated.spec.wrench_measured)
            if np.isfinite(measured[:, k]).any()
        }

    def raw_ahead(self, frames: int) -> dict[str, tuple[Array, Array]]:
        """Markers and wrench as raw data predict them so many frames on, by method."""
        time, markers, wrench, _ = self.measured
        return {
            PERSISTENCE: (persisted(markers, frames), persisted(wrench, frames)),
            LINEAR: (extrapolated(time, markers, frames), extrapolated(time, wrench, frames)),
        }


SLOPE_S = 0.01
"""Span of the slope. Chosen in favour of the extrapolation: the best of 10, 20, 50 and 100 ms for the markers and
the plates of a real squat, 100 ms ahead."""


def expected_ahead(model: _core.Model, time: Array, states: Array, horizon_s: float) -> tuple[Array, Array]:
    """Markers (T, M, 3) and wrench (T, 6) of each frame as `LookAhead` expects them ``horizon_s`` before, from states
    (T, n); NaN where there is none."""
    frames = span_frames(time, horizon_s)
    look = LookAhead(model, frames * step_of(time))  # at low rates these are not quite the horizon
    places, wrench = np.full((len(time), len(model.marker_names), 3), np.nan), np.full((len(time), 6), np.nan)
    for k, state in enumerate(states[: len(time) - frames]):
        if not np.isfinite(state).all():
            look.interrupted()
            continue
        look.look(float(time[k]), np.ascontiguousarray(state))
        if (expected := look.expected()) is not None:
            places[k + frames], wrench[k + frames] = expected.values["markers"], expected.values["wrench"]
    return places, wrench


def persisted(signal: Array, frames: int) -> Array:
    """Each frame (T, ...) as it was ``frames`` before; NaN at the beginning."""
    found = np.full(signal.shape, np.nan)
    found[frames:] = signal[: len(signal) - frames]
    return found


def extrapolated(time: Array, signal: Array, frames: int) -> Array:
    """Each frame (T, ...) as the line through the signal ``frames`` before and `SLOPE_S` earlier says it."""
    span = span_frames(time, SLOPE_S)
    rate = (signal - persisted(signal, span)) / _column(time - persisted(time, span), signal)
    ahead = _column(time - persisted(time, frames), signal)
    return persisted(signal, frames) + persisted(rate, frames) * ahead


def held(signal: Array, last: int) -> Array:
    """The value of frame ``last``, or of the last one known before it, at every frame (T, ...)."""
    return np.broadcast_to(_known(signal, last)[1], signal.shape).copy()


def line(time: Array, signal: Array, last: int, slope_s: float = SLOPE_S) -> Array:
    """The line through the signal at frame ``last`` and ``slope_s`` earlier, at every frame (T, ...)."""
    frame, value = _known(signal, last)
    before = max(frame - span_frames(time, slope_s), 0)
    step = time[frame] - time[before]
    rate = (value - signal[before]) / step if step > 0.0 else np.full_like(value, np.nan)
    return np.asarray(value + _column(time - time[frame], signal) * rate)


def span_frames(time: Array, seconds: float) -> int:
    """Frames in a span, at least one."""
    return max(1, round(seconds / step_of(time)))


def _known(signal: Array, last: int) -> tuple[int, Array]:
    whole = np.isfinite(signal[: last + 1].reshape(last + 1, -1)).all(axis=1)
    frame = int(np.flatnonzero(whole)[-1]) if whole.any() else last
    return frame, np.asarray(signal[frame])


def _column(values: Array, like: Array) -> Array:
    """(T,) as (T, 1, ...), to go with ``like`` (T, ...)."""
    return values.reshape(-1, *[1] * (like.ndim - 1))
