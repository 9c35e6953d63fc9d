"""Squats and gait cycles in a recording: which frames each one takes."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import chain, pairwise
from typing import Literal

import numpy as np
import numpy.typing as npt

from dynakin.arrays import Array, peaks, runs
from dynakin.errors import RecordingError
from dynakin.recordings.frame import GroundFrame
from dynakin.recordings.landmarks import DEFAULT_PAIRS, find_marker
from dynakin.recordings.recording import Recording
from dynakin.recordings.smoothing import smooth
from dynakin.results.estimate import Estimate
from dynakin.results.measures.metrics import evaluation_window

Movement = Literal["squat", "gait"]

SQUAT_CUTOFF_HZ, GAIT_CUTOFF_HZ = 2.0, 6.0
"""Low-pass before turning points are sought: a squat takes a second or more, a step half of one."""
LEAST_DEPTH_M = 0.05
"""Less is sway or a shift of weight, not a squat."""
PROMINENCE = 0.25
"""Of the deepest descent: what a dip must have to count; the smaller ones are corrections at the bottom."""
COMPLETE = 0.8
"""Of the way from the lowest point up to standing, which a squat must come from and get to."""
EDGE = 0.05
"""A squat begins and ends where this part of its own descent, or ascent, is done."""
LEAST_STEP_M = 0.2
"""How far a foot goes forward past the pelvis and back in a step; a shuffle is less."""
EDGE_S = 0.02
"""A foot that is foremost within this time of the recording's ends may still be on its way."""


@dataclass(frozen=True)
class Repetition:
    """One squat, from standing to standing, or one gait cycle, from a foot's initial contact to its next.

    side: "both" (squat), "left" or "right" (the foot). first, last: frames; start_s, end_s: their times.
    lowest, lowest_s, depth_m: the deepest frame of a squat and how far down it is; None for a gait cycle.
    """

    movement: Movement
    side: str
    first: int
    last: int
    start_s: float
    end_s: float
    lowest: int | None = None
    lowest_s: float | None = None
    depth_m: float | None = None


@dataclass(frozen=True)
class Found:
    """Repetitions in the order of time, what they were taken for, and a sentence on them or on why there are none."""

    movement: Movement
    items: tuple[Repetition, ...]
    note: str


@dataclass(frozen=True, eq=False)
class BodyPaths:
    """What repetitions are found from, X forward and Y up, NaN where not known.

    time: (T,) s. pelvis: (T, 3) m. heels: by side, (T, 3) m each.
    """

    time: Array
    pelvis: Array
    heels: dict[str, Array]


def body_paths(recording: Recording, ground: GroundFrame, pelvis: Iterable[str] = ()) -> BodyPaths:
    """Middle of the pelvis' markers and the heels' paths.

    Args:
        pelvis: the recording's names of markers on the pelvis; none: iliac spines by their usual names. Heels are
            found by theirs (`recordings.DEFAULT_PAIRS`).
    """
    ground = ground.facing()
    named = list(pelvis) or _present(recording, chain(*DEFAULT_PAIRS.pelvis))
    missing = np.full((recording.n_frames, 3), np.nan)
    middle = np.mean([recording.marker(name) for name in named], axis=0) if named else missing
    heels: dict[str, Array] = {}
    for heel in _present(recording, (heel for heel, _ in DEFAULT_PAIRS.heel_toe)):
        side = "left" if heel.rsplit(":", 1)[-1][:1].casefold() == "l" else "right"
        heels.setdefault(side, ground.points_to_ground(recording.marker(heel)))
    return BodyPaths(recording.time, ground.points_to_ground(middle), heels)


def repetitions_of(estimate: Estimate) -> Found:
    """Whole repetitions of an estimate that lie after the adaptation; as `find_repetitions`."""
    carriers = estimate.marker_segments
    pelvis = [name for name in estimate.marker_names if carriers.get(name) == "pelvis"]
    paths = body_paths(estimate.recording, estimate.ground, pelvis)
    return find_repetitions(paths, window=evaluation_window(estimate.time))


def find_repetitions(paths: BodyPaths, window: npt.NDArray[np.bool_] | None = None) -> Found:
    """Whole gait cycles where the feet pass one another, else whole squats.

    Args:
        window: (T,) frames that a repetition must lie in; None: all.
    """
    kind: Movement = "gait" if feet_pass(paths) else "squat"
    what = "squat" if kind == "squat" else "gait cycle"
    try:
        every = squats(paths.time, paths.pelvis[:, 1]) if kind == "squat" else gait_cycles(paths)
    except RecordingError as error:  # uneven time steps: nothing else of a result depends on repetitions
        return Found(kind, (), f"No {what} was sought: {error.message}")
    kept = tuple(r for r in every if window is None or window[r.first : r.last + 1].all())
    if not kept:
        lacks = not np.isfinite(paths.pelvis).any()
        return Found(kind, (), f"No {what} was found{': the recording has no pelvis markers' if lacks else ''}.")
    after = "" if window is None or window.all() else " after the adaptation"
    times = ", ".join(f"{r.start_s:.1f} to {r.end_s:.1f} s" for r in kept)
    return Found(kind, kept, f"{len(kept)} {what}{'' if len(kept) == 1 else 's'}{after}: {times}.")


def squats(time: Array, height: Array) -> list[Repetition]:
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
    path = smooth(time, height[:, None], SQUAT_CUTOFF_HZ, max_gap_s=0.5).values[:, 0]
    known = np.isfinite(path)
    if not known.any() or np.ptp(path[known]) < LEAST_DEPTH_M:
        return []
    path = np.where(known, path, path[known].max())  # a long gap is no squat
    travel, standing = float(np.ptp(path[known])), float(np.percentile(path[known], 95))
    lows = peaks(-path, max(PROMINENCE * travel, LEAST_DEPTH_M))
    tops = [0, *(int(a + np.argmax(path[a:b])) for a, b in pairwise(lows)), len(path) - 1]
    found = []
    for k, low in enumerate(lows):
        before, after = path[tops[k] : low + 1], path[low : tops[k + 1] + 1]
        if min(before.max(), after.max()) - path[low] < COMPLETE * (standing - path[low]):
            continue
        first = tops[k] + int(np.flatnonzero(before >= before.max() - EDGE * np.ptp(before))[-1])
        last = low + int(np.flatnonzero(after >= after.max() - EDGE * np.ptp(after))[0])
        if not known[first : last + 1].all():
            continue
        depth = float(min(before.max(), after.max()) - path[low])
        at = (float(time[first]), float(time[last]), low, float(time[low]), depth)
        found.append(Repetition("squat", "both", first, last, *at))
    return found


def gait_cycles(paths: BodyPaths) -> list[Repetition]:
    """Gait cycles of each foot, from initial contact to the next one, of all feet in the order of time.

    Raises:
        RecordingError: uneven time steps.
    """
    found = [
        Repetition("gait", side, first, last, float(paths.time[first]), float(paths.time[last]))
        for side, heel in paths.heels.items()
        for contacts in initial_contacts(paths.time, heel[:, 0] - paths.pelvis[:, 0])
        for first, last in pairwise(contacts)
    ]
    return sorted(found, key=lambda repetition: repetition.first)


def initial_contacts(time: Array, ahead: Array) -> list[list[int]]:
    """Frames at which a foot is foremost: initial contacts, those of each stretch without a long gap together.

    The coordinate-based algorithm of Zeni, Richards and Higginson, Two simple methods for determining gait events
    during treadmill and overground walking using kinematic data, Gait & Posture 27 (2008) 710-714. It needs no plates,
    which see few steps, and works on a treadmill too. Straight walking only: a turn swaps front and back.

    Args:
        time: (T,) s. ahead: (T,) m, the heel in front of the pelvis, along the direction in which the person faces.

    Raises:
        RecordingError: uneven time steps.
    """
    path = smooth(time, ahead[:, None], GAIT_CUTOFF_HZ).values[:, 0]
    found = []
    for first, end in runs(np.isfinite(path)):
        low = [float(path[first:end].min())]  # beyond the ends counts as low: a swing that is cut has its contact too
        frames = [first + peak - 1 for peak in peaks(np.concatenate([low, path[first:end], low]), LEAST_STEP_M)]
        found.append([k for k in frames if min(time[k] - time[first], time[end - 1] - time[k]) > EDGE_S])
    return found


def feet_pass(paths: BodyPaths) -> bool:
    """Whether each foot is at some time a step in front of the other, as in walking on a floor or a treadmill."""
    if len(paths.heels) < 2:
        return False
    apart = paths.heels["right"][:, 0] - paths.heels["left"][:, 0]
    apart = apart[np.isfinite(apart)]
    return bool(len(apart) and apart.max() > LEAST_STEP_M and apart.min() < -LEAST_STEP_M)


def _present(recording: Recording, names: Iterable[str]) -> list[str]:
    own = [marker for name in names if (marker := find_marker(recording, name))]
    return [name for name in dict.fromkeys(own) if name in recording.seen_names]
