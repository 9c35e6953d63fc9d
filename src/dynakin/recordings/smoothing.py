"""Zero-lag low-pass and differentiation, as gait laboratories do it offline; gaps are filled where they are short."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from dynakin.arrays import Array, Flags, runs
from dynakin.recordings.resampling import low_pass
from dynakin.recordings.times import even_step
from dynakin.settings.defaults import CUTOFF_HZ

MAX_GAP_S = 0.1
"""Longer gaps stay gaps: at 6 Hz a spline over more than half a period invents the movement."""

_DEGREE = 5  # of the interpolating spline: its second derivative is still smooth


@dataclass(frozen=True, eq=False)
class Smoothed:
    """Signals with their derivatives, each (T, n); NaN where a gap was left. ``notes``: one sentence a thing said."""

    values: Array
    rates: Array
    seconds: Array
    notes: tuple[str, ...]


def smooth(
    time: Array,
    signals: Array,
    cutoff_hz: float | None = CUTOFF_HZ,
    *,
    max_gap_s: float = MAX_GAP_S,
    names: Sequence[str] = (),
) -> Smoothed:
    """Fill short gaps, low-pass (zero lag) and differentiate.

    The filter is a Butterworth of 2nd order run both ways, -3 dB at ``cutoff_hz`` after both passes (Winter 2009); each
    stretch without gaps is filtered on its own. Derivatives are those of the quintic spline through the filtered
    samples, so they are consistent with them and without the attenuation of differences. At both ends of a
    stretch the filter knows one side only: about one period of the cut-off is less certain there, accelerations most.

    Args:
        time: (T,) s, evenly spaced up to rounding.
        signals: (T, n), NaN where missing.
        cutoff_hz: None: no filter, derivatives only.
        names: (n,) of the signals, for the notes.

    Raises:
        RecordingError: uneven time steps, or a cut-off that is not below half the rate.
    """
    step = even_step(time)
    labels = list(names) or [f"signal {k + 1}" for k in range(signals.shape[1])]
    values, rates, seconds = (np.full(signals.shape, np.nan) for _ in range(3))
    notes: list[str] = []
    shortest = max(_DEGREE + 1, round(1.0 / (cutoff_hz * step)) if cutoff_hz else 0)
    for k, label in enumerate(labels):
        column, filled = fill_gaps(signals[:, k], round(max_gap_s / step))
        if filled.any():
            notes.append(f"{label}: {int(filled.sum())} frames in gaps of at most {max_gap_s:g} s interpolated.")
        if np.isnan(column).any():
            notes.append(f"{label}: {int(np.isnan(column).sum())} frames missing, in longer gaps or at the ends.")
        for first, end in runs(np.isfinite(column)):
            if end - first < shortest:
                notes.append(f"{label}: {end - first} frames from {time[first]:.2f} s on are too few, left out.")
                continue
            part = column[first:end]
            if cutoff_hz is not None:
                part = low_pass(part[:, None], 1.0 / step, cutoff_hz)[:, 0]
            spline = scipy.interpolate.make_interp_spline(step * np.arange(len(part)), part, k=_DEGREE)
            at = step * np.arange(len(part))
            values[first:end, k] = part
            rates[first:end, k], seconds[first:end, k] = spline.derivative(1)(at), spline.derivative(2)(at)
    return Smoothed(values, rates, seconds, tuple(notes))


def fill_gaps(signal: Array, max_frames: int) -> tuple[Array, Flags]:
    """The signal (T,) with inner gaps of at most ``max_frames`` filled by a cubic spline, and where (T,) it was."""
    missing = ~np.isfinite(signal)
    filled = np.zeros(len(signal), dtype=bool)
    for first, end in runs(missing):
        if first > 0 and end < len(signal) and end - first <= max_frames:
            filled[first:end] = True
    known = np.flatnonzero(~missing)
    found = np.array(signal, dtype=float)
    found[missing] = np.nan
    if filled.any() and len(known) >= 4:
        found[filled] = scipy.interpolate.CubicSpline(known, signal[known])(np.flatnonzero(filled))
    elif filled.any():
        filled[:] = False
    return found, filled
