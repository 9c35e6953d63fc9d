"""Does the filter believe what it should? Innovations against the covariance that the filter gives them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy import stats

Judgement = Literal["overconfident", "consistent", "conservative"]

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
        judgement: of that number; None without a measured row.
        judged_by: by what: the practical band, or the chi-square interval where the data are the filter's own.
        verdict: the same in words.
    """

    mean_nis_per_dof: float | None
    interval_95: tuple[float, float] | None
    measured_dof: int
    whiteness_markers: float | None
    whiteness_wrench: float | None
    judgement: Judgement | None
    judged_by: str
    verdict: str


def consistency(
    nis: np.ndarray,
    n_rows: np.ndarray,
    marker_innovations: np.ndarray,
    wrench_innovations: np.ndarray,
    *,
    own_model: bool = False,
) -> Consistency:
    """Judge a run.

    Args:
        nis: (T,) normalised innovation squared of each frame, v' S^-1 v.
        n_rows: (T,) measured rows of each frame.
        marker_innovations: (T, N) m, measured less predicted, one column a marker and axis; NaN where missing.
        wrench_innovations: (T, K) N or N m, likewise.
        own_model: the data were drawn from the filter's own model and noise, so the chi-square interval is strict;
            no recording of a person is, and there the practical band (0.5 to 2) and whiteness judge.
    """
    used = np.isfinite(nis) & (n_rows > 0)
    dof = int(np.sum(n_rows[used]))
    ratio = float(np.sum(nis[used]) / dof) if dof else None
    interval = mean_interval_95(dof) if dof else None
    white_markers, white_wrench = lag_one(marker_innovations), lag_one(wrench_innovations)
    band = interval if own_model and interval else CONSISTENT
    judgement = None if ratio is None else judge(ratio, band)
    judged_by = "95 % chi-square interval" if own_model else f"practical band, {band[0]:g} to {band[1]:g}"
    verdict = _verdict(ratio, judgement, white_markers, white_wrench)
    return Consistency(ratio, interval, dof, white_markers, white_wrench, judgement, judged_by, verdict)


def mean_interval_95(dof: float) -> tuple[float, float]:
    """Where the mean of ``dof`` independent squared standard normal numbers lies in 95 % of cases."""
    return float(stats.chi2.ppf(0.025, dof) / dof), float(stats.chi2.ppf(0.975, dof) / dof)


def judge(ratio: float, band: tuple[float, float] = CONSISTENT) -> Judgement:
    """A mean normalised square in words: above ``band`` the filter trusts itself too much, below too little."""
    if ratio > band[1]:
        return "overconfident"
    return "conservative" if ratio < band[0] else "consistent"


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


def _verdict(ratio: float | None, judgement: Judgement | None, markers: float | None, wrench: float | None) -> str:
    if ratio is None:
        return "Nothing was measured in this window, so nothing can be said."
    if judgement == "overconfident":
        text = (
            f"The filter is overconfident: its innovations are {_times(ratio)} times as large as its covariances "
            "say. P, Q or R may be too small, or the model does not fit."
        )
    elif judgement == "conservative":
        text = (
            "The filter is conservative, its standard deviations are larger than needed: its innovations are "
            f"{_times(1.0 / max(ratio, 1e-300))} times smaller than its covariances say. Q or R are larger than this "
            "recording needs."
        )
    else:
        text = "The filter is consistent: its innovations are as large as its covariances say."
    slow = [name for name, value in (("marker", markers), ("wrench", wrench)) if value is not None and value > WHITE]
    if slow:
        text += (
            f" The {' and '.join(slow)} innovations are not white: a frame's error predicts the next one's, so there "
            "is something in the recording that the model does not explain."
        )
    return text


def _times(ratio: float) -> str:
    """Ratio of standard deviations, from one of variances."""
    root = float(np.sqrt(ratio))
    return f"{root:.2g}" if root < 10.0 else f"{root:.0f}"


# A mismatch below half of the coordinate's own speed is left unsaid: differencing measured angles makes noise too.
TOLERATED = 0.5
# Nor one that no one would notice, as of a coordinate that is locked or hardly moves.
UNNOTICED = 0.01  # rad/s or m/s


def speed_mismatch(time: np.ndarray, coordinates: np.ndarray, speeds: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """RMS of speed less differenced coordinate, and RMS of the differenced coordinate itself.

    Args:
        time: (T,) s.
        coordinates, speeds: (T, C), rad and rad/s or m and m/s.

    Returns:
        Two arrays (C,), rad/s or m/s. Differences are central, so both lag by nothing.
    """
    if len(time) < 3:
        return np.full(coordinates.shape[1], np.nan), np.full(coordinates.shape[1], np.nan)
    derivative = np.gradient(coordinates, time, axis=0)
    return _rms(speeds - derivative), _rms(derivative)


def _rms(values: np.ndarray) -> np.ndarray:
    """Of each column, frames without a number left out."""
    known = np.isfinite(values)
    with np.errstate(invalid="ignore"):
        return np.asarray(np.sqrt(np.sum(np.where(known, values, 0.0) ** 2, axis=0) / known.sum(axis=0)))


def mismatch_in_words(names: list[str], rotation: np.ndarray, mismatch: np.ndarray, moving: np.ndarray) -> str:
    """One sentence about the worst coordinate, or an empty text where all speeds fit."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(mismatch > 0.0, mismatch / moving, 0.0)
    wrong = np.flatnonzero((ratio > TOLERATED) & (mismatch > UNNOTICED))
    if not len(wrong):
        return ""
    worst = int(wrong[np.argmax(mismatch[wrong])])
    unit = "rad/s" if rotation[worst] else "m/s"
    return (
        f"The estimated speeds are not the derivatives of the estimated coordinates ({len(wrong)} of {len(names)}; "
        f"worst: {names[worst]}, {mismatch[worst]:.2g} {unit} off where it moves at {moving[worst]:.2g} {unit}), "
        "so the speeds and accelerations of this run are not to be relied on."
    )
