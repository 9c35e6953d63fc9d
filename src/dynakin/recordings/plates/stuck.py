"""Plates whose rows repeat while the load on them does not (a logger that hung), seen in the data at their own rate,
before any filter; two plates that hold one load, because no two measure the same number to the last digit, row by row;
and plates that measure vertical forces only. Dead channels: `dead`.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np

from dynakin.arrays import Array, Flags, runs
from dynakin.messages import Message, warning
from dynakin.recordings.plates.pressure import main_axis
from dynakin.recordings.pushes import JUDGED_N
from dynakin.recordings.recording import Plate, Recording
from dynakin.recordings.times import spans

FROZEN, FROZEN_S = 5, 0.04
"""So many equal rows and so long, and so many times as many as the plate usually holds one for (a table brought to a
higher rate repeats each row)."""
SOON = 3, 0.01
"""The same where each row is asked as it comes: of 446 runs of two equal rows and more under a load, in 42 plates of
real recordings, none is taken for frozen by what was before it."""
JUMP, STEPS = 3.0, 5.0
"""Rows that were frozen come free with a jump: of some channel, more than so many times what it changes by in a row
next to it, and so many times its smallest change (a file may round, and a person stand still)."""
BEFORE_S = 0.2
"""Where nothing follows, a channel has usually changed by so many smallest changes in the rows of this time before."""
PRESS_S = 0.2  # of a load that can be judged
STILL_N = 1e-5
"""Part of the largest vertical force within which a channel is constant: noise alone is 0.1 N."""
LACKS, COMES = 0.003, 0.7
"""Part of the largest vertical force that is less, RMS, than a person pushes sideways who comes onto a plate or leaves
it (the load changes by so large a part): 2 to 14 % in 30 plates of walks and jumps, real and simulated, noise of a
newton 0.15 %. Who squats slowly pushes no more than noise does."""

LEANS = 0.03
"""Part of the vertical force by which plates that follow it may differ in what they push sideways: each may lie tilted
by a degree, and a treadmill that is inclined leans all of them one way. Feet push towards each other, or apart: by 0.41
in hops of two legs, which chose, by 0.51 in a jump."""

SAME, SAME_M = 1e-6, 1e-3
"""Part of the largest force within which two are the same, and m, within which their places are: noise alone is
0.1 N, and plates lie side by side."""

MOST = 3  # spans that a message lists


def frozen(rows: Array, push: Array, rate_hz: float, least: tuple[int, float] = (FROZEN, FROZEN_S)) -> Flags:
    """(N,) rows (N, K) of one plate's channels that repeat the one before while somebody stands on it, by its vertical
    force (N,) N of either sign; at least so many, and so long (s)."""
    found = np.zeros(len(rows), dtype=bool)
    loaded = np.abs(np.nan_to_num(push)) > JUDGED_N
    if len(rows) < 2 or not loaded.any():
        return found
    change = np.abs(np.diff(rows, axis=0))
    same = (change == 0.0).all(axis=1) & loaded[1:]
    held = runs(same)  # rows first to end, the end among them
    if not any(end - first + 1 >= least[0] for first, end in held):
        return found
    lengths = np.ones(len(rows))
    for first, end in held:
        lengths[first : end + 1] = end - first + 1
    usual = float(np.percentile(lengths[loaded], 25.0))
    smallest = np.min(np.where(change > 0.0, change, np.inf), axis=0)
    for first, end in held:
        length = end - first + 1
        if length < max(least[0], least[1] * rate_hz, least[0] * usual):
            continue
        ends_so = end >= len(change) or not np.isfinite(change[end]).any()  # nothing follows to jump to
        reach = round(BEFORE_S * rate_hz) if ends_so else length
        near = change[max(first - 1 - reach, 0) : max(first - 1, 0)]
        near = near if ends_so else np.concatenate([near, change[end + 1 : end + length]])
        usually = np.nanmedian(near, axis=0) if len(near) else np.zeros(rows.shape[1])
        moves = usually > STEPS * smallest
        if (moves if ends_so else change[end] > np.maximum(JUMP * usually, STEPS * smallest)).any():
            found[first + 1 : end + 1] = True  # the first of them was measured
    return found


def frozen_in_words(
    name: str,
    time: Array,
    lost: Flags,
    do: str = "Export the forces again, or look whether their recording was interrupted",
) -> list[Message]:
    """A warning of a plate some of whose rows (N,) are frozen, and what to do about it."""
    if not lost.any():
        return []
    return [
        warning(
            "plates",
            f"{name} repeats one and the same row while somebody stands on it, from {spans(time, runs(lost), MOST)}, "
            f"though its load moved before or jumps after: not measured there. {do}.",
        )
    ]


def frozen_live_in_words(name: str, since_s: float) -> Message:
    """The same of a plate that is frozen now."""
    return warning(
        "plates",
        f"{name} repeats one and the same row while somebody stands on it, from {since_s:.2f} s on, though its load "
        "moved before: it is not measured as long as it does. Look whether its amplifier or its connection hangs.",
    )


def vertical_only(recording: Recording) -> bool:
    """Whether no plate of a recording measures horizontal forces: they stay what they are but for noise, or the same
    part of the vertical force, on all plates (which lie tilted), while that changes. A load that never changes is made
    up, and lacks nothing."""
    up, parts = main_axis(recording.plates), list[Array]()
    for plate in recording.plates:
        loaded = plate.force[np.abs(np.nan_to_num(plate.force[:, up])) > JUDGED_N]
        if not len(loaded) >= max(PRESS_S * recording.rate, 3.0):  # a rate that is NaN, too
            continue
        most = np.abs(loaded[:, up]).max()
        moves = loaded - loaded.mean(axis=0)
        if np.ptp(moves[:, up]) < STILL_N * most:
            continue
        part = moves[:, up] @ moves / (moves[:, up] @ moves[:, up])
        least = LACKS if np.ptp(moves[:, up]) > COMES * most else STILL_N
        if np.sqrt(np.square(moves - np.outer(moves[:, up], part)).mean(axis=0)).max() > least * most:
            return False
        parts.append(part)
    return bool(parts) and bool(np.ptp(parts, axis=0).max() < LEANS)


def without_frames(plate: Plate, lost: Flags) -> Plate:
    """A plate that is not measured (NaN) in these frames (T,)."""
    if not lost.any():
        return plate
    values = (plate.force, plate.moment, plate.cop, plate.free_moment)
    force, moment, cop, free = (np.where(lost[:, None], np.nan, value) for value in values)
    return replace(plate, force=force, moment=moment, cop=cop, free_moment=free)


def without_doubles(recording: Recording) -> Recording:
    """The recording with a plate that is listed twice once, and without (NaN) what two plates at different places hold
    alike; with a warning of each pair."""
    plates, notes = {plate.name: plate for plate in recording.plates}, list[Message]()
    if len(plates) < len(recording.plates):  # names are all that tells them apart here
        return recording
    for first, second in combinations(recording.plates, 2):
        if first.name not in plates or second.name not in plates or not _same_load(first, second):
            continue
        both = f"{first.name} and {second.name} hold the same forces in every row"
        if _same_place(first, second):
            del plates[second.name]
            text = f"{both}, at the same place: one plate that is listed twice. {second.name} is left out"
        elif _in_a_plane(first):
            continue
        else:
            for plate in (first, second):
                plates[plate.name] = without_frames(plate, np.ones(recording.n_frames, dtype=bool))
            text = f"{both}, at different places: one of them at most bore them. Neither is measured"
        notes.append(warning("plates", f"{text}. Export each plate once, with its own channels."))
    return recording.with_plates(tuple(plates.values()), tuple(notes)) if notes else recording


def _same_load(first: Plate, second: Plate) -> bool:
    """By the size of the force, whichever way the plates are turned."""
    own, other = (np.linalg.norm(plate.force, axis=1) for plate in (first, second))
    largest = float(np.max(own, initial=0.0, where=np.isfinite(own)))
    return largest > JUDGED_N and np.allclose(own, other, rtol=0.0, atol=SAME * largest, equal_nan=True)


def _same_place(first: Plate, second: Plate) -> bool:
    if first.corners is not None and second.corners is not None:
        return bool(np.abs(first.corners.mean(axis=0) - second.corners.mean(axis=0)).max() < SAME_M)
    away = np.abs(first.cop - second.cop)
    return bool(np.isfinite(away).any() and np.nanmax(away) < SAME_M)


def _in_a_plane(plate: Plate) -> bool:
    """Whether a plate's centre of pressure moves along one axis alone: of a movement that was made in a plane, each
    foot bears just half."""
    pressed = plate.cop[np.isfinite(plate.cop).all(axis=1)]
    return bool(len(pressed) and np.count_nonzero(np.ptp(pressed, axis=0) < SAME_M) >= 2)
