"""What is judged that no method was given: names of the yardsticks, their figures, and what raw data predict without
any model (the last value held, the last slope carried on)."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from dynakin.recordings.times import step_of
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


Array = npt.NDArray[np.float64]

SLOPE_S = 0.01
"""Span of the slope. Chosen in favour of the extrapolation: the best of 10, 20, 50 and 100 ms for the markers and
the plates of a real squat, 100 ms ahead."""


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
