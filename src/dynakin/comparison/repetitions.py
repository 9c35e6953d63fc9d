"""Squats found by the height of the pelvis, and 0 to 100 % curves with mean and standard deviation over them."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt
from scipy.signal import find_peaks

from dynakin.comparison.methods import Method, Trial
from dynakin.reference import smooth
from dynakin.results import COMPONENTS

Array = npt.NDArray[np.float64]

CUTOFF_HZ = 2.0
"""Low-pass of the height before turning points are sought: a squat takes a second or more."""
LEAST_DEPTH_M = 0.05
"""Less is sway or a shift of weight, not a squat."""
PROMINENCE = 0.25
"""Of the deepest descent: what a dip must have to count; the smaller ones are corrections at the bottom."""
COMPLETE = 0.8
"""Of the way from the lowest point up to standing, which a squat must come from and get to."""
EDGE = 0.05
"""A squat begins and ends where this part of its own descent, or ascent, is done."""
PERCENT = np.linspace(0.0, 100.0, 101)


@dataclass(frozen=True)
class Repetition:
    """One squat: first and last frame, and the lowest between; times in s, depth in m."""

    first: int
    lowest: int
    last: int
    start_s: float
    lowest_s: float
    end_s: float
    depth_m: float


@dataclass(frozen=True)
class Curve:
    """One point of a mean curve over the repetitions of a trial; a row of ``repetitions.csv``.

    quantity: a coordinate ("knee"), its moment ("knee/moment") or a wrench component ("fy"). unit: deg or mm, N m or N.
    mean_per_kg, sd_per_kg: moments and wrench over the body mass, None for coordinates. sd: sample standard deviation,
    None for one repetition.
    n: repetitions that are known at this point.
    """

    trial: str
    method: str
    quantity: str
    unit: str
    percent: float
    n: int
    mean: float | None
    sd: float | None
    mean_per_kg: float | None
    sd_per_kg: float | None


def squat_repetitions(time: Array, height: Array) -> list[Repetition]:
    """Complete squats, from standing through the lowest point to standing again.

    A descent that the recording begins in, or an ascent that it ends in, is not complete. Standing is the 95th
    percentile of the height.

    Args:
        time: (T,) s. height: (T,) m of the pelvis or hip over the ground; short gaps are filled.

    Raises:
        RecordingError: uneven time steps.
    """
    if not np.isfinite(height).any():
        return []
    path = smooth(time, height[:, None], CUTOFF_HZ, max_gap_s=0.5, names=["height"]).values[:, 0]
    known = np.isfinite(path)
    if not known.any() or np.ptp(path[known]) < LEAST_DEPTH_M:
        return []
    path = np.where(known, path, path[known].max())  # a long gap is no squat
    travel, standing = float(np.ptp(path[known])), float(np.percentile(path[known], 95))
    lows, _ = find_peaks(-path, prominence=max(PROMINENCE * travel, LEAST_DEPTH_M))
    tops = [0, *(int(a + np.argmax(path[a:b])) for a, b in pairwise(lows)), len(path) - 1]
    found = []
    for k, low in enumerate(lows):
        before, after = path[tops[k] : low + 1], path[low : tops[k + 1] + 1]
        if min(before.max(), after.max()) - path[low] < COMPLETE * (standing - path[low]):
            continue
        first = tops[k] + int(np.flatnonzero(before >= before.max() - EDGE * np.ptp(before))[-1])
        last = int(low) + int(np.flatnonzero(after >= after.max() - EDGE * np.ptp(after))[0])
        if not known[first : last + 1].all():
            continue
        depth = float(min(before.max(), after.max()) - path[low])
        at = (float(time[first]), float(time[low]), float(time[last]))
        found.append(Repetition(first, int(low), last, *at, depth))
    return found


def after_adaptation(trial: Trial) -> list[Repetition]:
    """The trial's squats that lie within its window; none where the height is not known."""
    return [r for r in squat_repetitions(trial.time, trial.height) if trial.window[r.first : r.last + 1].all()]


def curves(trial: Trial, repetitions: list[Repetition]) -> list[Curve]:
    """Mean curves of every method: coordinates, moments and wrench; nothing without a repetition."""
    rows: list[Curve] = []
    if not repetitions:
        return rows
    for method in trial.methods:
        for quantity, unit, values in _quantities(trial, method):
            each = np.stack([normalised(trial.time, values, r.first, r.last) for r in repetitions])
            rows += _rows(trial, method.name, quantity, unit, each)
    return rows


def normalised(time: Array, values: Array, first: int, last: int) -> Array:
    """A signal (T,) at 0 to 100 % of the frames first to last (101,), linearly between frames; NaN across gaps."""
    part = slice(first, last + 1)
    at = time[first] + PERCENT / 100.0 * (time[last] - time[first])
    return np.asarray(np.interp(at, time[part], values[part]))


def _quantities(trial: Trial, method: Method) -> list[tuple[str, str, Array]]:
    found = []
    for k, name in enumerate(trial.coordinate_names):
        turn = bool(trial.rotation[k])
        scale = np.degrees(1.0) if turn else 1000.0
        found.append((name, "deg" if turn else "mm", scale * method.coordinates[:, k]))
        found.append((f"{name}/moment", "N m" if turn else "N", method.moments[:, k]))
    for k, name in enumerate(COMPONENTS):
        if np.isfinite(trial.measured_wrench[:, k]).any():
            found.append((name, "N" if name.startswith("f") else "N m", method.wrench[:, k]))
    return found


def _rows(trial: Trial, method: str, quantity: str, unit: str, each: Array) -> list[Curve]:
    rows = []
    for k, percent in enumerate(PERCENT):
        values = each[np.isfinite(each[:, k]), k]
        mean = float(values.mean()) if len(values) else None
        sd = float(values.std(ddof=1)) if len(values) > 1 else None
        per_kg = unit in ("N", "N m")
        rows.append(
            Curve(
                trial.name,
                method,
                quantity,
                unit,
                float(percent),
                len(values),
                mean,
                sd,
                mean / trial.mass_kg if per_kg and mean is not None else None,
                sd / trial.mass_kg if per_kg and sd is not None else None,
            )
        )
    return rows
