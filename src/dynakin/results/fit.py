"""How well two trajectories agree: RMS differences of markers and of wrench components."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class WrenchFit(NamedTuple):
    """Agreement of one wrench component; None where a figure is not defined (a constant signal, no frame)."""

    rms: float | None
    nrms_percent: float | None
    correlation: float | None


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
    return float(1000.0 * np.sqrt(np.mean(np.sum(difference[seen] ** 2, axis=1))))


def wrench_fit(measured: np.ndarray, estimated: np.ndarray) -> WrenchFit:
    """RMS difference, the same in percent of the RMS of the measured signal (as the paper's Table II), correlation.

    Args:
        measured, estimated: (T,) in N or N m.
    """
    seen = np.isfinite(measured) & np.isfinite(estimated)
    if not seen.any():
        return WrenchFit(None, None, None)
    a, b = measured[seen], estimated[seen]
    rms = float(np.sqrt(np.mean((a - b) ** 2)))
    size = float(np.sqrt(np.mean(a**2)))
    constant = np.ptp(a) == 0.0 or np.ptp(b) == 0.0
    return WrenchFit(
        rms,
        100.0 * rms / size if size > 0.0 else None,
        None if constant else float(np.corrcoef(a, b)[0, 1]),
    )
