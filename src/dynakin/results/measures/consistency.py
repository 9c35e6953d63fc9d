"""Does the filter believe what it should? Innovations against the covariance that the filter gives them.

Innovations of single frames are mostly the cameras' noise, which hardly moves an angle; what does, skin and geometry,
lasts longer. Averaged over `AVERAGED_S`, the noise falls and the rest stays. Which statistic speaks for which word, and
from where on, was found on trials with known truth: ``verdicts.toml``, chosen and judged by
``benchmarks/verdicts.py``. Noise that was calibrated (`dynakin.filter.adapt`) has limits of its own: it makes the
innovations of single frames right however the recording is.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib import resources
from typing import Any, Literal, NamedTuple, get_args

import numpy as np
from scipy.special import gammaincinv

from dynakin.arrays import rms
from dynakin.recordings.times import step_of
from dynakin.results.naming import listed

Judgement = Literal["overconfident", "consistent", "conservative"]
NoiseFrom = Literal["declared", "calibrated", "given"]
"""Scales as declared, found by this recording, or given (by a preset of another recording, or a hand); those that were
given have the limits of those that were found."""

SD_OVER_ERROR = (0.5, 2.5)
"""Standard deviations over errors that are called consistent: what a laboratory can plan with. Below, overconfident."""
INSIDE = 0.85
"""Truth in the 95 % interval at least this often; less is overconfident regardless of the ratio."""
CONSISTENT = (SD_OVER_ERROR[1] ** -2, SD_OVER_ERROR[0] ** -2)
"""The same of mean normalised squares."""
AVERAGED_S = 0.3
"""Innovations are averaged over this time: longer than the filter takes to follow, shorter than half a step."""
GROUPS = {"motion": "angles and speeds", "moments": "moments"}
"""What is judged, and its words."""


Innovations = tuple[np.ndarray, np.ndarray | None]
"""Measured less predicted (T, N), NaN where missing, and standard deviations, None where they were not kept."""


class Limit(NamedTuple):
    """A statistic of `Consistency.statistics`, and the value from which on a word is said."""

    statistic: str
    value: float


class Limits(NamedTuple):
    """Of one group: conservative below the first, overconfident above the second."""

    conservative: Limit
    overconfident: Limit


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
        noise: whether its scales are as declared, or were found by innovations.
        statistics: what is judged by (see `statistics_of`); empty where the run kept no covariance of innovations.
        judgements: of each group of `GROUPS`; empty likewise.
        verdict: the same in words.
    """

    mean_nis_per_dof: float | None
    interval_95: tuple[float, float] | None
    measured_dof: int
    whiteness_markers: float | None
    whiteness_wrench: float | None
    noise: NoiseFrom = "declared"
    statistics: Mapping[str, float] = field(default_factory=dict)
    judgements: Mapping[str, Judgement] = field(default_factory=dict)
    verdict: str = ""

    @property
    def judgement(self) -> Judgement | None:
        """Of all groups: overconfident where one is, else conservative where one is; None where none was judged."""
        words: tuple[Judgement, ...] = ("overconfident", "conservative", "consistent")
        return next((word for word in words if word in self.judgements.values()), None)


def consistency(
    time: np.ndarray,
    nis: np.ndarray,
    n_rows: np.ndarray,
    markers: Innovations,
    wrench: Innovations,
    noise: NoiseFrom = "declared",
) -> Consistency:
    """Judge a run.

    Args:
        time: (T,) s, evenly spaced.
        nis: (T,) normalised innovation squared of each frame, v' S^-1 v.
        n_rows: (T,) measured rows of each frame.
        markers: (T, N) m, measured less predicted, one column a marker and axis, NaN where missing; and their standard
            deviations, None where they were not kept.
        wrench: (T, K) N or N m, likewise.
        noise: whose limits hold (`noise_from`).
    """
    used = np.isfinite(nis) & (n_rows > 0)
    dof = int(np.sum(n_rows[used]))
    found = Consistency(
        float(np.sum(nis[used]) / dof) if dof else None,
        mean_interval_95(dof) if dof else None,
        dof,
        lag_one(markers[0]),
        lag_one(wrench[0]),
        noise,
        statistics_of(time, markers, wrench),
    )
    judgements = {
        group: judged for group in GROUPS if (judged := judge_group(found.statistics, limits()[noise][group]))
    }
    verdict = "Nothing was measured in this window, so nothing can be said." if not dof else _verdict(judgements, noise)
    return Consistency(**(vars(found) | {"judgements": judgements, "verdict": verdict}))


def noise_from(config: Mapping[str, Any]) -> NoiseFrom:
    """Of a run's settings: where the scales that it used are from."""
    used, asked = (config.get(name) or {} for name in ("noise_used", "noise"))
    scales, given = ((own.get("variance_scale", 1.0), own.get("jerk_scale") or {}) for own in (used, asked))
    if scales == (1.0, {}):
        return "declared"
    return "given" if scales == given else "calibrated"


def statistics_of(
    time: np.ndarray,
    markers: Innovations,
    wrench: Innovations,
) -> dict[str, float]:
    """Mean squares of normalised innovations, by name; 1 where covariances are right and innovations white.

    ``markers``, ``wrench``: of single frames. ``markers_averaged``, ``wrench_averaged``: of their means over
    `AVERAGED_S`, times the frames in a mean. ``markers_larger``, ``wrench_larger``: the larger of the two. Arguments as
    in `consistency`.
    """
    found = {}
    frames = max(2, round(AVERAGED_S / step_of(time))) if len(time) > 2 else len(time) + 1
    for name, (innovations, sd) in {"markers": markers, "wrench": wrench}.items():
        if sd is None:
            continue
        with np.errstate(invalid="ignore", divide="ignore"):
            z = np.where(sd > 0.0, innovations / sd, np.nan)
        if np.isfinite(z).any():
            found[name] = float(np.nanmean(z**2))
        averaged = averaged_square(z, frames)
        if averaged is not None:
            found[f"{name}_averaged"] = averaged
            found[f"{name}_larger"] = max(averaged, found[name])
    return found


def averaged_square(z: np.ndarray, frames: int) -> float | None:
    """Mean square of the means of ``frames`` successive values of each column of z (T, N), over what white ones of
    unit variance would have; NaN left out, and means of fewer than half of the frames. None where there is none."""
    whole = len(z) // frames * frames
    blocks = z[:whole].reshape(-1, frames, z.shape[1])
    count = np.isfinite(blocks).sum(axis=1)
    kept = count > frames // 2
    if not kept.any():
        return None
    return float(np.mean(np.nansum(blocks, axis=1)[kept] ** 2 / count[kept]))


@cache
def limits() -> dict[NoiseFrom, dict[str, Limits]]:
    """By where the noise is from, of each group of `GROUPS`, from ``verdicts.toml``."""
    text = (resources.files("dynakin.results.measures") / "verdicts.toml").read_text(encoding="utf-8")
    content = tomllib.loads(text)["limits"]
    return {
        noise: {
            group: Limits(*(Limit(row[word]["statistic"], row[word]["value"]) for word in Limits._fields))
            for group, row in content["declared" if noise == "declared" else "calibrated"].items()
        }
        for noise in get_args(NoiseFrom)
    }


def judge_group(statistics: Mapping[str, float], own: Limits) -> Judgement | None:
    """The word on one group; None where the run lacks what it is judged by."""
    high, low = statistics.get(own.overconfident.statistic), statistics.get(own.conservative.statistic)
    if high is None or low is None:
        return None
    if high > own.overconfident.value:
        return "overconfident"
    return "conservative" if low < own.conservative.value else "consistent"


def mean_interval_95(dof: float) -> tuple[float, float]:
    """Where the mean of ``dof`` independent squared standard normal numbers lies in 95 % of cases."""
    low, high = 2.0 * gammaincinv(0.5 * dof, [0.025, 0.975]) / dof  # quantiles of chi squared; scipy.stats loads slowly
    return float(low), float(high)


def judge(ratio: float, band: tuple[float, float] = CONSISTENT) -> Judgement:
    """A mean normalised square in words: above ``band`` deviations are too small, below too large."""
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


def _verdict(judgements: Mapping[str, Judgement], noise: NoiseFrom) -> str:
    said = {word: [GROUPS[g] for g, j in judgements.items() if j == word] for word in judgements.values()}
    parts = []
    if over := said.get("overconfident"):
        parts.append(
            f"The standard deviations of {listed(over)} are too small (overconfident): this recording departs from the "
            "model by more than they allow for."
        )
    if wide := said.get("conservative"):
        parts.append(
            f"The standard deviations of {listed(wide)} are larger than needed (conservative); the values themselves "
            "are not the worse for it."
        )
    if not parts and said:
        parts.append(
            "The noise was calibrated on this recording, whose innovations do not contradict the standard deviations."
            if noise == "calibrated"  # innovations are then of the expected size, whatever the errors are
            else "The standard deviations fit this recording."
        )
    return " ".join(parts) or "Innovations were kept without their covariances, so the deviations are not judged."


# A mismatch below half of the coordinate's own speed is left unsaid: differencing measured angles makes noise too.
TOLERATED = 0.5
# Nor one that no one would notice, as of a coordinate that is locked or hardly moves.
UNNOTICED = 0.01  # rad/s or m/s
_NAMED = 5


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
    return rms(speeds - derivative, axis=0), rms(derivative, axis=0)


def mismatch_in_words(
    names: list[str], rotation: np.ndarray, mismatch: np.ndarray, moving: np.ndarray, stated: np.ndarray
) -> str:
    """One sentence about the coordinates whose speeds do not fit, the worst first, or an empty text where all do. A
    speed that is off by less than it says itself (``stated``, (C,), RMS of its deviations) fits."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(mismatch > 0.0, mismatch / moving, 0.0)
    wrong = np.flatnonzero((ratio > TOLERATED) & (mismatch > np.fmax(stated, UNNOTICED)))
    if not len(wrong):
        return ""
    wrong = wrong[np.argsort(-mismatch[wrong])]
    worst = int(wrong[0])
    which = [names[k] for k in wrong]
    shown = listed(which) if len(which) <= _NAMED else f"{', '.join(which[:_NAMED])} and {len(which) - _NAMED} more"
    unit = "rad/s" if rotation[worst] else "m/s"
    return (
        f"The estimated speeds are not the derivatives of the estimated coordinates for {len(wrong)} of {len(names)}: "
        f"{shown} (worst: {names[worst]}, {mismatch[worst]:.2g} {unit} off where it moves at {moving[worst]:.2g} "
        f"{unit}), so the speeds and accelerations of {'this' if len(wrong) == 1 else 'these'} are not to be relied on."
    )
