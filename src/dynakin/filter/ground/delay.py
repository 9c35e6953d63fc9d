"""Plates that lag behind the markers: by how much, in words, and brought into step."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from dynakin.filter.samples import in_step
from dynakin.recordings.recording import Plate, Recording
from dynakin.results.naming import listed

Array = npt.NDArray[np.float64]

HELD_S = 0.02 + 1e-9
"""The first and the last sample stand for so much before and after."""
LEAST_S, LEAST_SD, LEGS_SD = 0.001, 0.7, 2.0
"""A lesser delay, or one of fewer of its standard deviations, is none; of a body that is not marked whole more of
them."""


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
