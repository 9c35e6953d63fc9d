"""Dead channels of plates (a broken cable, an amplifier without power, an export without moments): one that stays what
it is, but for noise, while the load on its plate changes.

A live channel moves smoothly with whoever stands there, and far above its noise; a dead one does not, whatever noise it
carries. Judged are the channels as they were recorded where a file has them (C3D), in the plate's own axes and at its
sensors; else whether horizontal forces and centres of pressure along the laboratory's axes are constant.
What no plate has at all is no defect where a movement in a plane, or plates of vertical forces only, explain it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from dynakin.arrays import Array, Flags, runs
from dynakin.messages import Message, warning
from dynakin.recordings.plates.pressure import main_axis
from dynakin.recordings.plates.stuck import STILL_N, vertical_only, without_frames
from dynakin.recordings.pushes import JUDGED_N, UNLOADED_N
from dynakin.recordings.recording import Plate, Recording
from dynakin.recordings.times import spans

Levels = npt.NDArray[np.int_]
STILL, NOISE, FOLLOWS, CLEAR = range(4)  # how a channel is, beside the load

PRESS_S, CHANGES = 0.2, 0.2
"""A press so long, through which the vertical force changes by so large a part of its largest value, moves the other
channels: what stands still then is no person."""
COMES, LEAST = 0.7, 0.001
"""Who comes onto a plate or leaves it (the load changes by the first part of its largest value) moves every channel by
more than the second part, RMS: in 19 such presses of real walks and stairs the least is 0.0063 (a moment about the
vertical), of simulated walks on Kistler plates, which judged, 0.0070. The noise of a newton has 0.0002."""
BLOCK_S, BLOCKS, LIKE_NOISE = 0.05, 4, 5.0
"""Means over so long, where there are so many, that vary less than so many times as noise has them vary, by how samples
scatter within them, are noise: it has 1. Live channels have 45 and more at 1000 Hz (36 presses of real recordings,
people who stand still among them), 22 and more at 100 Hz (simulated walks).
Walks of one simulated subject and real data chose; walks and squats of five others judged, each channel dead in turn,
also rounded to 1 N: 720 of 720 found, no right one accused."""
CLEARLY = 4.0
"""So many times that somewhere, and the plates hold it: who is simulated and squats in a plane pushes sideways by noise
alone, or hardly more, which is no defect."""
STILL_M = 1e-4
"""What a centre of pressure stays within that is none: noise alone moves it by 0.2 mm."""
LEVER_M = 0.3
"""Moments count as the force that has them at this distance, about the half of a plate."""

MOST = 3  # spans that a message lists


@dataclass(frozen=True, eq=False)
class Channels:
    """One plate's channels over a press or more.

    Attributes:
        plate: its name.
        push: (N,) N along its normal, of either sign; NaN where it is not measured.
        values: (N, C) N: how much of the plate's wrench each one makes, moments by `LEVER_M`; m of a place.
        names: of each, in words.
        holds: what each one holds, or a part of it: a force "Fx", what tells where along an axis it acts "Px", "Py" (a
            moment), or anything else.
        noiseless: which ones are judged by standing still alone: what is calculated has no noise of its own (somebody
            may press at one place), and what a table has was low-passed.
    """

    plate: str
    push: Array
    values: Array
    names: tuple[str, ...]
    holds: tuple[str, ...]
    noiseless: tuple[bool, ...]

    def presses(self, rate_hz: float) -> list[tuple[int, int, Levels]]:
        """First frame, end and how the channels (C,) are, for each press that can be judged."""
        push, found = np.abs(np.nan_to_num(self.push)), []
        for first, end in runs(push > JUDGED_N):
            own, most = slice(first, end), float(push[first:end].max())
            change = float(np.ptp(push[own])) / most
            if end - first < max(PRESS_S * rate_hz, 3.0) or change < CHANGES:
                continue
            if np.isfinite(self.values[own]).all():
                parts = self.values[own] * np.where(self.noiseless, STILL_N / STILL_M, 1.0 / most)
                level = np.where(self.noiseless, CLEAR, _level(parts, change, rate_hz))
                found.append((first, end, np.where(np.ptp(parts, axis=0) < STILL_N, STILL, level)))
        return found

    def loaded(self, dead: Sequence[tuple[int, int]], *, always: bool) -> Flags:
        """(N,) the plate is not empty in these presses, from where it is loaded at all to where it is left; or ever."""
        lost = np.zeros(len(self.push), dtype=bool)
        for first, end in runs(np.abs(np.nan_to_num(self.push)) > UNLOADED_N):
            lost[first:end] = always or any(first <= a < end for a, _ in dead)
        return lost


def _level(parts: Array, change: float, rate_hz: float) -> Levels:
    """(C,) whether channels, as parts (N, C) of the largest load, are as noise is while that changes by a part of
    itself, or follow it; `FOLLOWS` where this is too short to tell."""
    size = max(round(BLOCK_S * rate_hz), 3)
    count = len(parts) // size
    if count < BLOCKS:
        return np.full(parts.shape[1], FOLLOWS)
    blocks = parts[: count * size].reshape(count, size, -1)
    means = blocks.mean(axis=1)
    noise, found = blocks.var(axis=1, ddof=1).mean(axis=0) / size, means.var(axis=0, ddof=1)
    level = np.where(found < LIKE_NOISE * noise, NOISE, np.where(found < CLEARLY * LIKE_NOISE * noise, FOLLOWS, CLEAR))
    return np.where(means.std(axis=0) < LEAST, STILL, level) if change > COMES else level


def dead_channels(
    plates: Sequence[Channels], time: Array, rate_hz: float, look: str, *, vertical: bool = False
) -> tuple[list[Flags], list[Message]]:
    """For each plate the frames (N,) in which it is not measured as a channel is dead, and a warning for each that has
    some. ``look``: where to look for the reason. ``vertical``: they are known to measure vertical forces only."""
    presses = [plate.presses(rate_hz) for plate in plates]
    judged = [(plate, level) for plate, own in zip(plates, presses, strict=True) for _, _, level in own]
    missing = _missing(judged, vertical=vertical)
    lost, notes = [], list[Message]()
    for plate, own in zip(plates, presses, strict=True):
        counted = np.array([what not in missing for what in plate.holds], dtype=bool)
        flags = np.array([(level <= NOISE) & counted for _, _, level in own]).reshape(len(own), len(counted))
        dead = [(first, end) for (first, end, _), here in zip(own, flags, strict=True) if here.any()]
        always = bool(len(own)) and bool(flags.all(axis=0).any())
        lost.append(plate.loaded(dead, always=always) if dead else np.zeros(len(plate.push), dtype=bool))
        if dead:
            there = [own for own in runs(lost[-1]) if np.nanmax(np.abs(plate.push[slice(*own)])) > JUDGED_N]
            notes.append(_in_words(plate, np.asarray(flags.any(axis=0)), there, time, look))
    return lost, notes


def _missing(judged: Sequence[tuple[Channels, Levels]], *, vertical: bool) -> set[str]:
    """What no plate holds in any press, and need not: of a movement in a plane, or of vertical forces only."""

    def nowhere(what: str, least: int) -> bool:
        own = [level[[held == what for held in plate.holds]] for plate, level in judged]
        return all(len(level) and (level < least).all() for level in own)

    absent = {what for plate, _ in judged for what in plate.holds if nowhere(what, CLEAR)}
    sensed = {what for plate, _ in judged for what, out in zip(plate.holds, plate.noiseless, strict=True) if not out}

    def explained(what: str) -> bool:
        others = {other[0] for other in absent if other != what and other[0] == what[0]}
        if what[0] not in "FPT":  # a signal of no axis
            return False
        if what[0] == "F":
            return vertical or bool(others) or f"P{what[1]}" in absent or not nowhere(what, NOISE)
        return what[0] != "P" or (not others and (what not in sensed or f"F{what[1]}" in absent))

    return {what for what in absent if explained(what)}


def _in_words(plate: Channels, dead: Flags, stretches: list[tuple[int, int]], time: Array, look: str) -> Message:
    names = [name for name, here in zip(plate.names, dead, strict=True) if here]
    return warning(
        "plates",
        f"{plate.plate}: {' and '.join(names)} never change{'s' if len(names) == 1 else ''} but for noise while the "
        f"load on it does, from {spans(time, stretches, MOST)}: a channel is dead or was not exported. Not measured "
        f"there; {look}.",
    )


def without_dead_channels(recording: Recording) -> Recording:
    """The recording without (NaN) the presses of plates of which a channel is dead, and with a warning for each such
    plate."""
    if not recording.plates or recording.n_frames < 2:
        return recording
    up = main_axis(recording.plates)
    level = [axis for axis in range(3) if axis != up]
    channels = [_of_wrench(plate, up, level) for plate in recording.plates]
    look = f"look at its channels in {recording.plates_file}"
    vertical = vertical_only(recording)
    lost, notes = dead_channels(channels, recording.time, recording.rate, look, vertical=vertical)
    if not notes:
        return recording
    plates = tuple(without_frames(plate, flags) for plate, flags in zip(recording.plates, lost, strict=True))
    return recording.with_plates(plates, tuple(notes))


def _of_wrench(plate: Plate, up: int, level: Sequence[int]) -> Channels:
    """Of a plate at the markers' rate, along the laboratory's axes."""
    push = plate.force[:, up]
    most = float(np.max(np.abs(push), initial=JUDGED_N, where=np.isfinite(push)))
    values = np.hstack([plate.force[:, level] / most * STILL_M / STILL_N, plate.cop[:, level]])  # still alike
    names = [*(f"its F{'xyz'[k]}" for k in level), *(f"its centre of pressure along {'XYZ'[k]}" for k in level)]
    holds = [f"{what}{'xyz'[k]}" for what in "FP" for k in level]
    return Channels(plate.name, push, values, tuple(names), tuple(holds), (True,) * 4)  # a seat may push up alone
