"""Do the plates' vertical forces fit the motion, and each other?

Where they contradict each other one plate has another gain, or one of its sensors has: whatever the person weighs, the
same part of each plate's force must be what the motion of the centre of mass needs. Where all of them contradict the
motion it is the markers' rate: accelerations grow with its square, forces do not.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from dynakin.arrays import Array, Flags, rms
from dynakin.filter.ground.mass_centre import second_derivative
from dynakin.filter.ground.needed import SMOOTH_S, Needed, smoothed
from dynakin.filter.ground.plate_errors import NO_ERRORS, PlateErrors
from dynakin.messages import Message, warning
from dynakin.recordings.recording import Plate
from dynakin.results.naming import listed

APART, SIGMAS = 0.03, 3.0
"""Part by which a plate's vertical force may differ from what the motion needs of it, beside the others', and how many
of its standard deviations it takes to say so (1 to 2 % where each stance has a plate of its own). Chosen on one walk
with a plate 5 and 10 % too high and with a sensor a fifth too low (3.8, 7.0 and 3.2 deviations), `truth3d`'s seeds 1 to
4 and 25 simulated walks of others (up to 1.8). Some 150 other recordings without such faults, which did not choose,
stay below 2.4 (`subject01_walk1`: 1.2 %)."""
VARIES = 0.1
"""RMS, part of the weight, of what a plate bears beside a fixed part of the sum, from which on its gain shows: what is
needed is known to 0.01 to 0.04 of the weight (`needed.NEAR`), and a trunk that no marker shows, or a load in a hand,
may follow the shift of the weight. Chosen on squats of two seeds and lifts (0.003 to 0.035). Others, which did not
choose: squats of four seeds and standing 0.005 to 0.04, walks and a run 0.27 to 0.57."""
EXPLAINED = 0.4
"""Part of what is left otherwise that the gain must explain: else something else is the matter, too. Chosen on walks of
`truth3d`, of whole bodies and of the legs alone: plates scaled by 0.9 or 1.1 have more in 220 of 252 (226 were found
before). Of 140 of other people, which did not choose, 120 (124, and 8 times the wrong plate)."""
LEAST_S = 0.2
"""Seconds of the whole weight that a plate must have borne."""
ALIKE, BORNE, ALIKE_S = 1.5, 0.05, 0.1
"""What is left where it bears more than this part of the weight may be so many times what is left elsewhere, once its
gain is accounted for: a gain follows the plate's load, a hand on a rail does not. 1.4 and less in 300 stances of 8
walks whose plate was scaled by 0.9 to 1.2; a hand that bears a tenth for 0.4 s 1.2 to 4.4, one that bears just as long
as a stance lasts cannot be told apart. Asked where there is so much of both."""
SENSOR_M = 0.25
"""How far from where a foot presses the sensor lies whose gain it may be: plates are 0.4 to 0.6 m long."""


class _Apart(NamedTuple):
    """One plate beside others: log of what it says over what they say, of what the motion needs of each; its standard
    deviation; the part that this explains of what else is left; alike: what is left is as large where it bears as
    elsewhere."""

    plate: int
    log: float
    sd: float
    explained: float
    alike: bool


def found_gains(needed: Needed, plates: Sequence[Plate], wrenches: Array, known: Flags) -> PlateErrors:
    """What the motion of the centre of mass says of each plate beside the others.

    Args:
        wrenches: (P, T, 6) of the plates, ground frame. known: (T,) frames in which their sum is all that bears the
            person.
    """
    judged = needed.known & known & np.isfinite(wrenches).all(axis=(0, 2))
    if len(plates) < 2 or not judged.any():
        return NO_ERRORS
    push = smoothed(wrenches[:, :, 1].T, judged, needed.rate)[judged] / needed.weight
    need = smoothed(needed.force[:, [1]], judged, needed.rate)[judged, 0] / needed.weight
    bears = push.sum(axis=0) / needed.rate
    gain_error, gain, notes = np.zeros(len(plates)), np.ones(len(plates)), list[Message]()
    own, rest = list[int](), list(range(len(plates)))
    while len(asked := [p for p in rest if bears[p] > LEAST_S]) > 1:
        apart = [each for p in asked if (each := _beside(push, need, p, own, rest, needed.rate)) is not None]
        found = max(apart, key=lambda each: abs(each.log) / each.sd, default=None)
        if found is None or abs(found.log) < max(np.log1p(APART), SIGMAS * found.sd):
            break
        if found.explained < EXPLAINED or not found.alike:  # something else bears, too, and may be what the others lack
            break
        plate, by, only_two = found.plate, float(np.exp(found.log)), len(asked) == 2
        gain_error[asked if only_two else plate] = abs(1.0 - 1.0 / by)
        gain[plate] = 1.0 if only_two else by
        others = listed([plates[p].name for p in asked if p != plate])
        notes.append(warning("gain", _in_words(plates[plate].name, others, by, found.sd, only_two)))
        own.append(plate)
        rest.remove(plate)
    return PlateErrors(gain_error=gain_error, gain=gain, said=tuple(notes))


def _in_words(plate: str, others: str, by: float, sd: float, only_two: bool) -> str:
    there = f"{plate} or {others}" if only_two else plate
    return (
        f"the plates' vertical forces contradict each other: beside what the motion needs, {plate} shows {by:.2f} "
        f"times what {others} does (standard deviation {sd:.2f}, expected within {100.0 * APART:.0f} %): the gain of "
        f"{there}, or of one of its sensors, is wrong, or something else bears or pulls the person there. Deviations "
        "of moments hold that "
        f"difference where a foot is on {there}."
    )


def _beside(push: Array, need: Array, plate: int, own: list[int], rest: list[int], rate: float) -> _Apart | None:
    """One of the rest beside the others of it, least squares of loads (N, P) to what is needed (N,), parts of the
    weight; plates of their own are no witnesses. None where it hardly bears apart from them.

    Errors last as long as the mean of `smoothed` does: 2 sqrt(pi) of its standard deviation.
    """
    others = [p for p in rest if p != plate]
    common = np.column_stack([push[:, rest].sum(axis=1), push[:, own]])
    alone = push[:, plate] - common @ np.linalg.lstsq(common, push[:, plate], rcond=None)[0]
    if rms(alone) < VARIES:
        return None
    columns = np.column_stack([push[:, plate], push[:, others].sum(axis=1), push[:, own]])
    normal = columns.T @ columns
    part = np.linalg.solve(normal, columns.T @ need)
    if part[:2].min() <= 0.0:
        return None
    square, bears = np.square(need - columns @ part), push[:, plate] > BORNE
    by_gain = np.square((part[0] - part[1]) * alone).mean()
    explained = float(by_gain / (by_gain + square.mean()))
    left = float(square.mean()) * max(2.0 * np.sqrt(np.pi) * SMOOTH_S * rate, 1.0)
    both = min(bears.sum(), (~bears).sum()) > ALIKE_S * rate
    alike = not both or bool(square[bears].mean() < ALIKE**2 * square[~bears].mean())
    by = np.zeros(len(part))
    by[:2] = -1.0 / part[0], 1.0 / part[1]
    variance = left * float(by @ np.linalg.solve(normal, by))
    return _Apart(plate, float(np.log(part[1] / part[0])), float(np.sqrt(variance)), explained, alike)


SLOPE, SHORT_SLOPE, SHORT_S = (0.8, 1.25), (0.6, 1.7), 0.7
"""Vertical acceleration by the plates over that by the markers and their times, which grows with the square of the
rate: a rate that is off by 12 %, of less than `SHORT_S` by 30 %. Real recordings 0.96 to 1.04, a run 0.89, simulated
ones 0.96 to 1.06; 393 parts of 0.7 s 0.8 to 1.25, 590 of 0.4 s up to 1.56."""
WITH_PELVIS = 0.8
"""Correlation of the vertical accelerations of the pelvis and the centre of mass from which the whole body moves. Where
limbs alone do, what they weigh by the table counts in full, and `SHORT_SLOPE` holds however long it lasts: simulated
kicks and knee raises 0.19 to 0.51, with a slope of 1.2 to 1.5 at the right rate; 25 other movements 0.93 and more."""
VIGOROUS, FOLLOWS, UPRIGHT = 0.04, 0.95, (0.8, 1.25)
"""What it takes to tell it: the plates' load varies by more than this part of the weight (standard deviation), is a
straight line of what the movement needs (correlation), and where nothing accelerates is about the weight (of who rises
from a chair it is less, and anything comes out)."""
_HALF_STRIDE_S = 0.4
SLOWEST_HZ = 30.0
"""At 25 Hz a walk's accelerations by the markers are a quarter too small."""


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
    low, high = SLOPE if seconds >= SHORT_S and _with_pelvis(needed, moved, force) else SHORT_SLOPE
    if most >= low and least <= high:
        return None
    middle = float(np.sqrt(least * most))
    return needed.rate * float(np.sqrt(middle)), middle


def _with_pelvis(needed: Needed, moved: Array, force: Array) -> bool:
    """Whether the pelvis accelerates as the centre of mass does (N,); true of one that no frame shows whole."""
    height, time = needed.root[:, 1], needed.time
    seen = np.isfinite(height)
    if not seen.any():
        return True
    path = np.interp(time, time[seen], height[seen])[:, None]
    own = needed.smoothed(second_derivative(path, needed.rate), force)[:, 0]
    return bool(np.std(own) > 0.0 and np.corrcoef(own, moved)[0, 1] > WITH_PELVIS)


def wrong_rate_in_words(rate: float, fitting: float, slope: float) -> str:
    """That it does not, with the rate that would."""
    return (
        f"movement and forces do not fit each other at {rate:.4g} Hz: by the plates the centre of mass accelerates "
        f"{slope:.2f} times as much as by the "
        f"markers, expected {SLOPE[0]:g} to {SLOPE[1]:g}. About {fitting:.3g} Hz would fit. Correct the rate, or the "
        "times, in the files of markers and forces; until then speeds, moments and what is said of other loads are "
        "wrong."
    )
