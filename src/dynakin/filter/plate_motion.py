"""Plates against what the centre of mass needs, by the markers alone: their clock, the rate and their axes.

A filter cannot ask itself either: what plates that are out of step, or whose axes are turned, say of a walk is taken up
by accelerations and inertia. Newton's second law in every frame is enough to know (`filter.closure`, `mass_centre`).
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import replace
from itertools import product
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from dynakin.filter.closure import smoothed
from dynakin.filter.mass_centre import mass_centre
from dynakin.filter.plate_clock import Delay
from dynakin.filter.plate_lean import root_path, turned_by_lean
from dynakin.filter.samples import in_step
from dynakin.filter.sources import hidden_segments, root_of
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.recordings.plates.axes import TURNS, PlateAxes, turned_feet
from dynakin.recordings.recording import Plate, Recording
from dynakin.recordings.times import rate_of
from dynakin.results.naming import listed
from dynakin.units import GRAVITY_M_S2

Array = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]

LONGEST_S, STEP_S = 0.1, 0.005
"""Delays that are looked for, and how finely."""
HELD_S = 0.02 + 1e-9
"""The first and the last sample stand for so much before and after."""
COARSE_S = 0.005
"""Standard deviation of what is found so, half of the step about a right one and what skin does."""
LEAST_S = 0.016
"""A lesser delay is left to `plate_clock`: skin and the model do as much to the centre of mass' acceleration.
Recordings in step have their minimum at 0 to 6 ms (real, but for one at 15), walks of `truth3d` with joints found from
markers 5 to 10 ms later than their plates are."""
LONGEST_LEGS_S, LEAST_LEGS_S, COARSE_LEGS_S = 0.15, 0.025, 0.015
"""The same of a body whose trunk no marker shows, by the vertical force alone: it needs no lean, and the trunk goes up
and down with the pelvis. In step the minimum lies at 0 to 10 ms in 8 simulated walks and squats and 4 real recordings
without their trunks' markers, at -10 in one whose whole body says 9, at 10 to 20 in 3 that have no others, at -31 to 5
in `truth3d`'s. What is less, and what is then left, `plate_clock` finds."""
WIDE_S, EVIDENT, APART, WIDE_JUDGED_S = 0.5, 0.4, 1.5, 1.0
"""Where the force fits best at the end of that range, or nowhere in it, longer delays are looked for. One is believed
where its misfit is so much less than in step (0.09 to 0.12 of walks that were moved by 0.1 to 0.3 s), no delay more
than `LONGEST_S` from it is as near as so many times its misfit (a step later a walk's force is nearly the same), and so
much is judged."""
LESS = 0.75
"""So much less must the sum be off what the motion needs once it is in step; 0.12 to 0.76 where plates were moved by
15 ms and more, 0.64 and more of recordings in step."""
NEAR = 0.05
"""Part of the weight within which the force must then be what the motion needs; real recordings 0.007 to 0.04."""
KEPT = 0.7
"""Part of the frames that must be left to judge it by."""
TURNED = 0.4
"""With other axes the horizontal force must be off by so much less: 0.9 times and more of 19 real recordings whose
plates are right (0.6 of one that misfits by 2 N), 0.07 to 0.24 where they are not. Judged where the vertical force is
within `NEAR` of what the motion needs: else something that no plate measures pulls (a flywheel's cable)."""
EXPLAINS = 0.7
"""And so turned, by so much less than with no horizontal force at all: 0.2 to 0.62 where one plate of a simulated squat
or walk is turned back. Weights in the hands push both feet alike, which one turned plate cancels (1.0 to 1.1)."""
LARGE, SMALL_N = 0.02, 4.0
"""And as it is by more than this part of the weight; where a second or more is judged by so many N."""
_SHORTEST_S, _LONG_S = 0.3, 1.0
SLOPE, SHORT_SLOPE, SHORT_S = (0.8, 1.25), (0.6, 1.7), 0.7
"""Vertical acceleration by the plates over that by the markers and their times, which grows with the square of the
rate: a rate that is off by 12 %, of less than `SHORT_S` by 30 %. Real recordings 0.96 to 1.04, a run 0.89, simulated
ones 0.96 to 1.06; 393 parts of 0.7 s 0.8 to 1.25, 590 of 0.4 s up to 1.56."""
VIGOROUS, FOLLOWS, UPRIGHT = 0.04, 0.95, (0.8, 1.25)
"""What it takes to tell it: the plates' load varies by more than this part of the weight (standard deviation), is a
straight line of what the movement needs (correlation), and where nothing accelerates is about the weight (of who rises
from a chair it is less, and anything comes out)."""
_HALF_STRIDE_S = 0.4
SLOWEST_HZ = 30.0
"""At 25 Hz a walk's accelerations by the markers are a quarter too small."""


class Needed:
    """What the motion of the centre of mass needs.

    Attributes:
        time: (T,) s. rate: Hz. weight: N, with what is carried.
        force: (T, 3) N, ground axes. known: (T,) frames in which it is, and the pelvis is seen, which carries the rest.
            whole: all of the body is marked.
        root: (T, 3) m, `root_path`.
    """

    def __init__(self, initial: CalibratedModel, time: Array, markers: Array) -> None:
        found = mass_centre(initial, time, markers)
        self.time, self.rate, self.weight = time, rate_of(time), initial.weighed_kg * GRAVITY_M_S2
        self.whole, self.root = not initial.unseen_kg, root_path(initial, markers)
        unseen = hidden_segments(initial.spec, markers, time).get(root_of(initial.spec), np.False_)
        self.known: Flags = np.zeros(len(time), dtype=bool) if found is None else found.known & ~unseen
        self.force = np.zeros((len(time), 3)) if found is None else found.needed_force(initial.weighed_kg)

    def vertically(self) -> Needed:
        """The same, for delays that are judged by the vertical force alone, as of a body whose trunk no marker
        shows."""
        other = copy(self)
        other.whole = False
        return other

    def with_horizontal(self, wrench: Array) -> Array:
        """Wrenches (T, 6) whose horizontal force, which is not measured, is what the motion needs."""
        found = wrench.copy()
        found[:, [0, 2]] = np.where(self.known[:, None], self.force[:, [0, 2]], 0.0)
        return found

    def judged(self, force: Array) -> Flags:
        """(T,) frames in which both this and forces (T, 3) are known."""
        return np.asarray(self.known & np.isfinite(force).all(axis=1))

    def judged_s(self, force: Array) -> float:
        """How long that is."""
        return float(np.count_nonzero(self.judged(force)) / self.rate)

    def smoothed(self, values: Array, force: Array) -> Array:
        """Values (T, C), smoothed over the frames in which both this and forces (T, 3) are known, at these."""
        judged = self.judged(force)
        return smoothed(values, judged, self.rate)[judged]

    def closed(self, force: Array) -> Array:
        """Forces (T, 3) where the vertical one is what the motion needs within `NEAR`, NaN elsewhere: there something
        else bears the person, and pushes sideways too."""
        near = np.abs(force[:, [1]] - self.force[:, [1]]) < NEAR * self.weight
        return np.where(near, force, np.nan)

    def misfit(self, force: Array) -> float:
        """RMS, N, of what forces (T, 3) lack beyond a constant (a mass or a zero that is off), smoothed, where both
        are known; inf where these frames are too few."""
        if not self.judged_s(force) >= _SHORTEST_S:  # a rate that is NaN, too
            return float("inf")
        return float(np.sqrt(np.sum(self.smoothed(self.force - force, force).var(axis=0))))


def plates_delay(needed: Needed, force: Array) -> Delay | None:
    """By how much plates lag whose sum (T, 3) N is known where it is no NaN; None where they are in step, or nothing
    can be said."""
    longest = LONGEST_S if needed.whole else LONGEST_LEGS_S
    found = _misfits(needed, force, longest)
    least, ends = found.misfit.min(), found.misfit[[0, -1]].min()
    if least < ends and least <= NEAR * needed.weight:
        return _fitting(needed, found, LESS)
    if not needed.judged_s(force) >= WIDE_JUDGED_S:
        return None
    found = _misfits(needed, force, WIDE_S)
    k = int(np.argmin(found.misfit))
    others = found.misfit[np.abs(found.delay - found.delay[k]) > longest]
    return _fitting(needed, found, EVIDENT) if others.min() > APART * found.misfit[k] else None


def _fitting(needed: Needed, found: _Misfits, less: float) -> Delay | None:
    """The delay with which the force fits what the motion needs, by ``less`` times as much as in step; None where there
    is none within the range."""
    k, now = int(np.argmin(found.misfit)), found.misfit[len(found.delay) // 2]
    if not 0 < k < len(found.delay) - 1 or not np.isfinite(found.misfit[k - 1 : k + 2]).all():
        return None
    before, least, after = found.misfit[k - 1 : k + 2]
    delay = float(found.delay[k] + 0.5 * STEP_S * (before - after) / max(before - 2.0 * least + after, 1e-12))
    shortest, sd_s = (LEAST_S, COARSE_S) if needed.whole else (LEAST_LEGS_S, COARSE_LEGS_S)
    if abs(delay) < shortest or least > less * now or least > NEAR * needed.weight:
        return None
    return Delay(delay, sd_s) if found.judged_s[k] > KEPT * found.judged_s[len(found.delay) // 2] else None


class _Misfits(NamedTuple):
    """Delays, s, the misfit of forces that are taken so much later, N, and how long it was judged, s."""

    delay: Array
    misfit: Array
    judged_s: Array


def _misfits(needed: Needed, force: Array, longest_s: float) -> _Misfits:
    """Of forces (T, 3), and delays up to the longest either way."""
    steps = round(longest_s / STEP_S)
    delays: Array = STEP_S * np.arange(-steps, steps + 1, dtype=np.float64)
    moved = [_later(needed.time, force, delay) for delay in delays]
    if not needed.whole:
        for each in moved:
            each[:, [0, 2]] = np.where(np.isfinite(each[:, [1]]), needed.force[:, [0, 2]], np.nan)
    misfits = np.array([needed.misfit(each) for each in moved])
    return _Misfits(delays, misfits, np.array([needed.judged_s(each) for each in moved]))


def out_of_step_in_words(delay: Delay) -> str:
    """Which way, and by how much."""
    return f"By the motion {clock_in_words(delay.delay_s, delay.sd_s)}"


def drift_in_words(delay: Delay, time: Array) -> str:
    """The same of a clock that is faster or slower, at the first and the last of the times (T,) s."""
    ends = [f"{abs(ms):.0f} ms {'behind' if ms >= 0.0 else 'ahead'}" for ms in 1000.0 * delay.lags(time)[[0, -1]]]
    by = f"{100.0 * abs(delay.drift):.2f} % {'faster' if delay.drift > 0.0 else 'slower'} than the markers'"
    return (
        f"By the motion the plates' clock is {by} (standard deviation {100.0 * delay.drift_sd:.2f} %): {ends[0]} at "
        f"the first frame, {ends[1]} at the last"
    )


def apart_in_words(delay: Delay, plates: Sequence[str]) -> str:
    """Which plates (P,) have a clock of their own, and how far the others lag."""
    ms = [1000.0 * more for more in delay.apart]
    own = [f"{name} is {abs(by):.0f} ms {_where(by)} the others" for name, by in zip(plates, ms, strict=True) if by]
    others = clock_in_words(delay.delay_s, delay.sd_s, "those")
    return f"By the motion the plates have not one clock: {listed(own)}; {others}"


def clock_in_words(delay_s: float, sd_s: float, which: str = "the plates") -> str:
    """How far these plates lag behind the markers, or run ahead of them."""
    how_well = f"(standard deviation {1000.0 * sd_s:.1f} ms)"
    return f"{which} are {1000.0 * abs(delay_s):.1f} ms {_where(delay_s)} the markers {how_well}"


def _where(delay: float) -> str:
    return "behind" if delay >= 0.0 else "ahead of"


def fitting_rate(needed: Needed, force: Array) -> tuple[float, float] | None:
    """The rate, Hz, at which the accelerations by the markers would be those by the plates' sum (T, 3) N, and these
    over the former as they are; None where the rate fits, or nothing can be said."""
    seconds = needed.judged_s(force)
    if not needed.whole or not (seconds >= _HALF_STRIDE_S and needed.rate >= SLOWEST_HZ):  # a rate that is NaN, too
        return None
    upward = np.stack([needed.force[:, 1] - needed.weight, force[:, 1]], axis=1)
    moved, carried = needed.smoothed(upward, force).T
    if carried.std() < VIGOROUS * needed.weight or not moved.std() > 0.0:
        return None
    follows = float(np.corrcoef(moved, carried)[0, 1])
    slope, load = np.polyfit(moved, carried, 1) / needed.weight
    if follows < FOLLOWS or not UPRIGHT[0] < load < UPRIGHT[1]:
        return None
    least = float(slope * needed.weight / load)  # a mass that is wrong is no rate
    most = least / follows**2
    low, high = SLOPE if seconds >= SHORT_S else SHORT_SLOPE
    if most >= low and least <= high:
        return None
    middle = float(np.sqrt(least * most))
    return needed.rate * float(np.sqrt(middle)), middle


def wrong_rate_in_words(rate: float, fitting: float, slope: float) -> str:
    """That it does not, with the rate that would."""
    return (
        f"movement and forces do not fit each other at {rate:.4g} Hz: by the plates the centre of mass accelerates "
        f"{slope:.2f} times as much as by the "
        f"markers, expected {SLOPE[0]:g} to {SLOPE[1]:g}. About {fitting:.3g} Hz would fit. Correct the rate, or the "
        "times, in the files of markers and forces; until then speeds, moments and what is said of other loads are "
        "wrong."
    )


def brought_into_step(recording: Recording, delay_s: float | Array, apart: Sequence[float] = ()) -> Recording:
    """The recording with what its plates say so much later, one or (T,), at each time, each (P,) so much more that is
    ``apart``; not known (NaN) where they end before."""

    def of(plate: Plate, more: float) -> Plate:
        values = (plate.force, plate.moment, plate.cop, plate.free_moment)
        force, moment, cop, free = (_later(recording.time, each, delay_s + more) for each in values)
        return replace(plate, force=force, moment=moment, cop=cop, free_moment=free)

    return recording.with_plates(tuple(map(of, recording.plates, apart or [0.0] * len(recording.plates))))


def _later(time: Array, values: Array, delay_s: float | Array) -> Array:
    """`in_step` of values (T, 3), but NaN farther than `HELD_S` beyond the recording."""
    then = time + delay_s
    inside = (then >= time[0] - HELD_S) & (then <= time[-1] + HELD_S)
    return np.where(inside[:, None], in_step(time, values, delay_s), np.nan)


def turned_axes(
    needed: Needed, plates: Sequence[Plate], initial: CalibratedModel, known: Flags, remedy: str = ""
) -> str | None:
    """A sentence on plates whose horizontal force fits the motion once their axes are others; None where none are, or
    something was declared that pushes or pulls as well.

    Args:
        known: (T,) frames in which the sum over the plates is all that bears the person. remedy: where to correct them;
            "": in the file that they were read from.
    """
    if initial.contacts or not plates:
        return None
    found = (
        turned_feet(plates, initial.ground, needed.rate)
        or _turned_sum(needed, plates, initial, known)
        or turned_by_lean(plates, initial, needed.root, needed.rate)
    )
    if found is None:
        return None
    if not remedy and plates[0].corners is None:  # columns of a table
        remedy = "Correct the signs or columns in this file"
    elif not remedy:
        remedy = "Correct it in this file (order of the corners, order and signs of the channels, calibration)"
    return f"{found}. {remedy}; if something else pulls the person, declare it (--contact)"


def _turned_sum(needed: Needed, plates: Sequence[Plate], initial: CalibratedModel, known: Flags) -> str | None:
    """Where the sum of some turned, or all, fits what the centre of mass needs."""
    forces = np.stack([initial.ground.vectors_to_ground(plate.force) for plate in plates])
    total = np.where(known[:, None], forces.sum(axis=0), np.nan)
    upright = needed.force.copy()
    upright[:, 1] = total[:, 1]
    if needed.misfit(upright) > NEAR * needed.weight:
        return None
    total[:, 1] = needed.force[:, 1]  # axes are judged by the horizontal force alone
    now = needed.misfit(total)
    if now < (SMALL_N if needed.judged_s(total) > _LONG_S else LARGE * needed.weight):
        return None
    axes = [PlateAxes(plate, initial.ground) for plate in plates]
    every = range(len(forces))
    subsets: list[Sequence[int]] = [every, *([k] for k in every if len(forces) > 1)]
    best, how = now, ""
    which: Sequence[int] = every
    for subset, (words, turn) in product(subsets, TURNS):
        changed = total.copy()
        for k in subset:
            changed[:, [0, 2]] += axes[k].turned(forces[k][:, [0, 2]], turn) - forces[k][:, [0, 2]]
        if (misfit := needed.misfit(changed)) < best:
            best, which, how = misfit, subset, words
    total[:, [0, 2]] *= 0.0
    if best > TURNED * now or best > EXPLAINS * needed.misfit(total):
        return None
    return (
        f"the horizontal force of {listed([plates[k].name for k in which])} does not fit the motion: it is {now:.0f} N "
        f"off what the centre of mass needs, and {best:.0f} N if {axes[which[0]].in_words(how)}"
    )
