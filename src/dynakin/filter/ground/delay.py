"""Plates that lag behind the markers: by how much, to some milliseconds (`fine_delay` knows it better), in words, and
brought into step.

What the motion of the centre of mass needs, by the markers alone, against their sum.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from dynakin.arrays import Array
from dynakin.filter.ground.needed import NEAR, Needed
from dynakin.filter.samples import in_step
from dynakin.recordings.recording import Plate, Recording
from dynakin.results.naming import listed

HELD_S = 0.02 + 1e-9
"""The first and the last sample stand for so much before and after."""
LEAST_S, LEAST_SD, LEGS_SD = 0.001, 0.7, 2.0
"""A lesser delay, or one of fewer of its standard deviations, is none; of a body that is not marked whole more of
them."""

LONGEST_S, STEP_S = 0.1, 0.005
"""Delays that are looked for, and how finely."""
COARSE_S = 0.005
"""Standard deviation of what is found so, half of the step about a right one and what skin does."""
LEAST_COARSE_S = 0.016
"""A lesser delay is left to `fine_delay`: skin and the model do as much to the centre of mass' acceleration.
Recordings in step have their minimum at 0 to 6 ms (real, but for one at 15), walks of `truth3d` with joints found from
markers 5 to 10 ms later than their plates are."""
LONGEST_LEGS_S, LEAST_LEGS_S, COARSE_LEGS_S = 0.15, 0.025, 0.015
"""The same of a body whose trunk no marker shows, by the vertical force alone: it needs no lean, and the trunk goes up
and down with the pelvis. In step the minimum lies at 0 to 10 ms in 8 simulated walks and squats and 4 real recordings
without their trunks' markers, at -10 in one whose whole body says 9, at 10 to 20 in 3 that have no others, at -31 to 5
in `truth3d`'s. What is less, and what is then left, `fine_delay` finds."""
WIDE_S, EVIDENT, APART, WIDE_JUDGED_S = 0.5, 0.4, 1.5, 1.0
"""Where the force fits best at the end of that range, or nowhere in it, longer delays are looked for. One is believed
where its misfit is so much less than in step (0.09 to 0.12 of walks that were moved by 0.1 to 0.3 s), no delay more
than `LONGEST_S` from it is as near as so many times its misfit (a step later a walk's force is nearly the same), and so
much is judged."""
LESS = 0.75
"""So much less must the sum be off what the motion needs once it is in step; 0.12 to 0.76 where plates were moved by
15 ms and more, 0.64 and more of recordings in step."""
KEPT = 0.7
"""Part of the frames that must be left to judge it by."""


class Delay(NamedTuple):
    """By how much plates lag behind the markers, s, and its standard deviation: in the middle of a recording where they
    lag ``drift`` seconds more each second, as plates do whose clock is faster by that part; and each plate (P,) lags so
    much more that is ``apart``, where they have not one clock."""

    delay_s: float
    sd_s: float
    drift: float = 0.0
    drift_sd: float = 0.0
    apart: tuple[float, ...] = ()

    def lags(self, time: Array) -> Array:
        """(T,) s, at the times (T,) s of the recording."""
        return np.asarray(self.delay_s + self.drift * (time - 0.5 * (time[0] + time[-1])))

    def after(self, other: Delay) -> Delay:
        """Of plates that were brought into step by another."""
        apart = np.add(self.apart or 0.0, other.apart or 0.0) if self.apart or other.apart else np.zeros(0)
        sd = max(self.sd_s, other.sd_s) if other.apart else self.sd_s  # some plates' own delays may not be known
        return self._replace(delay_s=self.delay_s + other.delay_s, sd_s=sd, apart=tuple(apart.tolist()))

    def worth_it(self, whole: bool) -> bool:
        """Whether it is worth bringing the plates into step, of a body that is marked whole or not."""
        return bool(self.drift or self.apart) or self.beyond(LEAST_S, LEAST_SD if whole else LEGS_SD)

    def beyond(self, least_s: float, sigmas: float) -> bool:
        """Whether it is longer than so much, and than so many of its standard deviations."""
        return abs(self.delay_s) > max(least_s, sigmas * self.sd_s)


IN_STEP = Delay(0.0, 0.0)


def brought_into_step(recording: Recording, delay: Delay) -> Recording:
    """The recording with what its plates say so much later, as it is where that is not worth it; not known (NaN) where
    they end before."""
    if not delay.worth_it(whole=True):
        return recording
    lags = delay.lags(recording.time) if delay.drift else delay.delay_s

    def of(plate: Plate, more: float) -> Plate:
        values = (plate.force, plate.moment, plate.cop, plate.free_moment)
        force, moment, cop, free = (later(recording.time, each, lags + more) for each in values)
        return replace(plate, force=force, moment=moment, cop=cop, free_moment=free)

    return recording.with_plates(tuple(map(of, recording.plates, delay.apart or [0.0] * len(recording.plates))))


def noise_in_step(recording: Recording, delay: Delay) -> Array:
    """(P,) by which the variance of white noise is less in plates that were brought into step: what is said between two
    samples is a mean of both."""
    if not delay.worth_it(whole=True):
        return np.ones(len(recording.plates))
    lags = delay.lags(recording.time) if delay.drift else np.array([delay.delay_s])
    between = np.mod((lags + np.reshape(delay.apart or [0.0] * len(recording.plates), (-1, 1))) * recording.rate, 1.0)
    return np.asarray(np.mean(1.0 - 2.0 * between * (1.0 - between), axis=1))


def later(time: Array, values: Array, delay_s: float | Array) -> Array:
    """`in_step` of values (T, 3), but NaN farther than `HELD_S` beyond the recording."""
    then = time + delay_s
    inside = (then >= time[0] - HELD_S) & (then <= time[-1] + HELD_S)
    return np.where(inside[:, None], in_step(time, values, delay_s), np.nan)


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
    shortest, sd_s = (LEAST_COARSE_S, COARSE_S) if needed.whole else (LEAST_LEGS_S, COARSE_LEGS_S)
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
    moved = [later(needed.time, force, delay) for delay in delays]
    if not needed.whole:
        for each in moved:
            each[:, [0, 2]] = np.where(np.isfinite(each[:, [1]]), needed.force[:, [0, 2]], np.nan)
    misfits = np.array([needed.misfit(each) for each in moved])
    return _Misfits(delays, misfits, np.array([needed.judged_s(each) for each in moved]))
