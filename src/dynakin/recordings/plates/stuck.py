"""Plates whose data stand still while the load on them does not: rows that repeat (a logger that hung), and channels
that are dead (a cable, an export without moments).

Frames are frozen by the data at their own rate, before any filter; channels are dead by the plates at the markers'
rate. A channel that no plate has is no defect: of vertical forces only, or of a movement in a plane.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from dynakin.arrays import runs
from dynakin.messages import Message, warning
from dynakin.recordings.plates.pressure import main_axis
from dynakin.recordings.pushes import JUDGED_N, UNLOADED_N
from dynakin.recordings.recording import Array, Plate, Recording
from dynakin.recordings.times import spans

Flags = npt.NDArray[np.bool_]

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
PRESS_S, CHANGES = 0.2, 0.2
"""A press so long, through which the vertical force changes by so large a part of its largest value, moves the other
forces and the centre of pressure: what stands still then is no person."""
STILL_N, STILL_M = 1e-5, 1e-4
"""Part of the largest vertical force, and m, within which a channel is constant: noise alone is 0.1 N and 0.2 mm."""
LACKS, COMES = 0.003, 0.7
"""Part of the largest vertical force that is less, RMS, than a person pushes sideways who comes onto a plate or leaves
it (the load changes by so large a part): 2 to 14 % in 30 plates of walks and jumps, real and simulated, noise of a
newton 0.15 %. Who squats slowly pushes no more than noise does."""

LEANS = 0.03
"""Part of the vertical force by which plates that follow it may differ in what they push sideways: each may lie tilted
by a degree, and a treadmill that is inclined leans all of them one way. Feet push towards each other, or apart: by 0.41
in hops of two legs, which chose, by 0.51 in a jump."""

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


@dataclass(frozen=True)
class _Press:
    """A press of a plate, frames [first, end), and which of its level axes stand still: of the force, of the centre of
    pressure."""

    plate: int
    first: int
    end: int
    force: tuple[bool, bool]
    cop: tuple[bool, bool]


def without_dead_channels(recording: Recording) -> Recording:
    """The recording without (NaN) the presses of plates of which a channel is dead, and with a warning for each such
    plate."""
    if not recording.plates or recording.n_frames < 2:
        return recording
    up = main_axis(recording.plates)
    level = [axis for axis in range(3) if axis != up]
    presses = [press for p, plate in enumerate(recording.plates) for press in _presses(plate, p, up, level, recording)]
    if not presses:
        return recording
    force, cop = (np.array([getattr(press, what) for press in presses]) for what in ("force", "cop"))
    none_has = np.all(force, axis=0) & np.all(cop, axis=0)  # in a plane
    dead_force = force & ~none_has & (not vertical_only(recording))
    dead_cop = cop & (cop.all(axis=1, keepdims=True) | ~np.all(cop, axis=0))  # both, or one that some press has
    plates, notes = list(recording.plates), list[Message]()
    for p, plate in enumerate(recording.plates):
        own = [k for k, press in enumerate(presses) if press.plate == p and (dead_force[k].any() or dead_cop[k].any())]
        if not own:
            continue
        dead = [(presses[k].first, presses[k].end) for k in own]
        notes.append(_dead_in_words(recording, plate.name, dead, level, dead_force[own], dead_cop[own]))
        plates[p] = _without(plate, dead, up)
    return recording.with_plates(tuple(plates), tuple(notes)) if notes else recording


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


def _presses(plate: Plate, p: int, up: int, level: Sequence[int], recording: Recording) -> list[_Press]:
    """The presses of a plate that can be judged."""
    push, found = np.abs(np.nan_to_num(plate.force[:, up])), []
    for first, end in runs(push > JUDGED_N):
        own, most = slice(first, end), float(push[first:end].max())
        if end - first < max(PRESS_S * recording.rate, 3.0) or np.ptp(push[own]) < CHANGES * most:
            continue
        places = plate.cop[own][:, level]
        if not np.isfinite(places).all():
            continue
        force, cop = np.ptp(plate.force[own][:, level], axis=0) < STILL_N * most, np.ptp(places, axis=0) < STILL_M
        found.append(_Press(p, first, end, (bool(force[0]), bool(force[1])), (bool(cop[0]), bool(cop[1]))))
    return found


def _dead_in_words(
    recording: Recording, name: str, dead: list[tuple[int, int]], level: Sequence[int], force: Flags, cop: Flags
) -> Message:
    what = [f"its F{'xyz'[axis]}" for k, axis in enumerate(level) if force[:, k].any()]
    if cop.any():
        axes = " and ".join("XYZ"[axis] for k, axis in enumerate(level) if cop[:, k].any())
        what.append(f"its centre of pressure along {axes}")
    return warning(
        "plates",
        f"{name}: {' and '.join(what)} never change{'s' if len(what) == 1 else ''} while the load on it does, from "
        f"{spans(recording.time, dead, MOST)}: a channel is dead or was not exported. Not measured there; look "
        f"at its channels in {recording.plates_file}.",
    )


def _without(plate: Plate, dead: list[tuple[int, int]], up: int) -> Plate:
    """The plate without these presses, from where it is loaded at all to where it is left."""
    lost = np.zeros(len(plate.force), dtype=bool)
    for first, end in runs(np.abs(np.nan_to_num(plate.force[:, up])) > UNLOADED_N):
        lost[first:end] = any(first <= a < end for a, _ in dead)
    for first, end in dead:
        lost[first:end] = True
    return without_frames(plate, lost)


def without_frames(plate: Plate, lost: Flags) -> Plate:
    """A plate that is not measured (NaN) in these frames (T,)."""
    if not lost.any():
        return plate
    values = (plate.force, plate.moment, plate.cop, plate.free_moment)
    force, moment, cop, free = (np.where(lost[:, None], np.nan, value) for value in values)
    return replace(plate, force=force, moment=moment, cop=cop, free_moment=free)
