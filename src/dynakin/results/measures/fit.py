"""How well two trajectories agree: RMS differences of markers, of wrench components and of any signal; errors against
truth."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from dynakin.arrays import rms, rms_length


def marker_rms_mm(measured: np.ndarray, estimated: np.ndarray, axes: np.ndarray) -> float | None:
    """Root mean square distance of one marker, mm, over the frames where it is measured and estimated.

    Args:
        measured, estimated: (T, 3) m.
        axes: (3,) bool, the modelled axes; a planar model's distance is taken in its plane.
    """
    difference = (measured - estimated)[:, axes]
    seen = np.isfinite(difference).all(axis=1)
    if not seen.any():
        return None
    return 1000.0 * float(rms_length(difference[seen]))


class SignalFit(NamedTuple):
    """Agreement of two signals; None where a figure is not defined (a constant signal, no frame).

    The paper does not say by what it normalises: per cent of the measured signal's RMS fits its FY, not its FX and MZ.
    The RMS of a force that carries weight is mostly the weight; its range is what the movement makes of it.
    """

    rms: float | None
    nrms_rms_percent: float | None
    """Of the measured signal's RMS."""
    nrms_range_percent: float | None
    """Of the measured signal's range."""
    correlation: float | None


class TruthError(NamedTuple):
    """Error of an estimate where the truth is known, in the signal's unit; None without a frame."""

    rms: float | None
    """As it is."""
    mean: float | None
    """Estimate less truth: an angle's zero, mostly."""
    rms_about_mean: float | None
    """What is left once the mean offset is taken off: the error of the movement."""


def signal_fit(measured: np.ndarray, estimated: np.ndarray) -> SignalFit:
    """RMS difference, the same in per cent of the measured signal's RMS and of its range, correlation.

    Args:
        measured, estimated: (T,) in the same unit; frames in which either is NaN do not count.
    """
    seen = np.isfinite(measured) & np.isfinite(estimated)
    if not seen.any():
        return SignalFit(None, None, None, None)
    a, b = measured[seen], estimated[seen]
    off, size, span = float(rms(a - b)), float(rms(a)), float(np.ptp(a))
    constant = span == 0.0 or np.ptp(b) == 0.0
    return SignalFit(
        off,
        100.0 * off / size if size > 0.0 else None,
        100.0 * off / span if span > 0.0 else None,
        None if constant else float(np.corrcoef(a, b)[0, 1]),
    )


def truth_error(truth: np.ndarray, estimated: np.ndarray) -> TruthError:
    """Error of a coordinate, a speed, an acceleration or a moment.

    Args:
        truth, estimated: (T,) in the same unit; frames in which either is NaN do not count.
    """
    error = np.asarray(estimated - truth, dtype=float)
    error = error[np.isfinite(error)]
    if not len(error):
        return TruthError(None, None, None)
    return TruthError(float(rms(error)), float(np.mean(error)), float(np.std(error)))
