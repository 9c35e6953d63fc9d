"""Does the filter believe what it should? Innovations against the covariance that the filter gives them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import stats

# A ratio within these is called consistent: model error always moves it a little from one, while noise settings
# wrong by a factor of two in standard deviation move it by four.
CONSISTENT = (0.5, 2.0)
# Innovations of a filter whose model is complete are white; above this the model leaves motion unexplained.
WHITE = 0.3


@dataclass(frozen=True)
class Consistency:
    """Consistency of one run over a window.

    Attributes:
        mean_nis_per_dof: normalised innovation squared, summed and divided by the number of measured rows: 1 for
            a filter whose covariances are right, larger if it trusts itself too much. None without a measured row.
        interval_95: where that number would lie in 95 % of runs if every covariance were exactly right.
        measured_dof: number of measured rows.
        whiteness_markers, whiteness_wrench: lag-1 autocorrelation of the innovations (see `lag_one`); None if there
            are too few frames.
        verdict: the same in words.
    """

    mean_nis_per_dof: float | None
    interval_95: tuple[float, float] | None
    measured_dof: int
    whiteness_markers: float | None
    whiteness_wrench: float | None
    verdict: str


def consistency(
    nis: np.ndarray, n_rows: np.ndarray, marker_innovations: np.ndarray, wrench_innovations: np.ndarray
) -> Consistency:
    """Judge a run.

    Args:
        nis: (T,) normalised innovation squared of each frame, v' S^-1 v.
        n_rows: (T,) measured rows of each frame.
        marker_innovations: (T, N) m, measured less predicted, one column a marker and axis; NaN where missing.
        wrench_innovations: (T, K) N or N m, likewise.
    """
    used = np.isfinite(nis) & (n_rows > 0)
    dof = int(np.sum(n_rows[used]))
    ratio = float(np.sum(nis[used]) / dof) if dof else None
    interval = None
    if dof:
        interval = (float(stats.chi2.ppf(0.025, dof) / dof), float(stats.chi2.ppf(0.975, dof) / dof))
    white_markers, white_wrench = lag_one(marker_innovations), lag_one(wrench_innovations)
    return Consistency(ratio, interval, dof, white_markers, white_wrench, _verdict(ratio, white_markers, white_wrench))


def lag_one(innovations: np.ndarray) -> float | None:
    """Lag-1 autocorrelation of innovations (T, N): 0 for white ones, near 1 for a slow error left over.

    Each channel is sum(e_k e_k+1) / sum(e_k^2) over neighbouring frames that both have it, its mean left in (a
    constant error is not white either); the channels' values are averaged, so that units do not matter.
    """
    first, second = innovations[:-1], innovations[1:]
    both = np.isfinite(first) & np.isfinite(second)
    first, second = np.where(both, first, 0.0), np.where(both, second, 0.0)
    power = 0.5 * np.sum(first**2 + second**2, axis=0)
    kept = (power > 0.0) & (both.sum(axis=0) >= 10)
    if not kept.any():
        return None
    return float(np.mean(np.sum(first * second, axis=0)[kept] / power[kept]))


def _verdict(ratio: float | None, markers: float | None, wrench: float | None) -> str:
    if ratio is None:
        return "Nothing was measured in this window, so nothing can be said."
    if ratio > CONSISTENT[1]:
        text = (
            f"The filter is overconfident: its innovations are {_times(ratio)} times as large as its covariances "
            "say. P, Q or R may be too small, or the model does not fit."
        )
    elif ratio < CONSISTENT[0]:
        text = (
            f"The filter is too cautious: its innovations are {_times(1.0 / max(ratio, 1e-300))} times smaller "
            "than its covariances say. Q or R are larger than this recording needs, and the standard deviations it "
            "reports are too large."
        )
    else:
        text = "The filter is consistent: its innovations are as large as its covariances say."
    slow = [name for name, value in (("marker", markers), ("wrench", wrench)) if value is not None and value > WHITE]
    if slow:
        text += (
            f" The {' and '.join(slow)} innovations are not white: a frame's error foretells the next one's, so there "
            "is something in the recording that the model does not explain."
        )
    return text


def _times(ratio: float) -> str:
    """Ratio of standard deviations, from one of variances."""
    root = float(np.sqrt(ratio))
    return f"{root:.2g}" if root < 10.0 else f"{root:.0f}"
