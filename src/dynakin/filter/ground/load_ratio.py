"""The mass by the plates over the declared one, by what the motion of the centre of mass needs."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from dynakin.arrays import Array, Flags, runs

_WITHIN, _OFTEN, _ROUNDS = 0.15, 0.2, 3
AMPLITUDE, LEFT_OPEN = 0.15, 0.02
"""Part by which accelerations of the markers may be larger or smaller than the body's (skin, a trunk that bends): in a
run or a landing single frames are no witnesses of the mass, means over a second or some strides are. Chosen on a real
run (0.14 too large); walks, a landing and squats, which did not choose, 0.02 to 0.16. And the part of the mass that
this may leave open of frames (walks 0.01 and less, runs 0.06): of means a cane that bears now and then is a part."""
VIGOROUS = 1.5
"""Times the weight that the motion needs at most: walks 1.1 to 1.3, runs 2 and more. Of what needs less, all frames,
plates as measured, are right to 0.02, also where one plate shows the middle of a walk's stances alone, which need 0.7
(five of `truth3d` and another person 0.995 to 1.016; as of runs 1.006 to 1.035)."""


def load_ratio(
    need: Array, have: Array, judged: Flags, weight: float, window: int, apart: float, amplitude: float
) -> float | None:
    """Mass by the plates over the declared one; None where that is within 15 % too seldom to be said.

    It is the median of frames, or, where that rests too much on the size of accelerations, of means over a window (or
    over the longest stretch that is judged) if they rest less on it. A rail that bears a tenth for more than half of
    the time would pass for a mass that is a tenth less: where the means fall into two groups, the frames that are
    nearer to the declared mass count.

    Args:
        need, have: (T,) N upwards: what the motion needs of the declared mass, and what the plates carry.
        judged: (T,) frames in which that can be compared. window: frames, about a second. apart: from how far apart on
            means are two groups. amplitude: part by which accelerations may be off.
    """
    frames = _Loads(need, have, amplitude).carrying(judged, weight)
    if len(frames.need) <= _OFTEN * np.count_nonzero(judged):
        return None
    about = 1.0
    for _ in range(_ROUNDS):  # frames chosen by the declared mass lean towards it: they are chosen by the one found
        about = frames.ratio
        frames = _Loads(need, have, amplitude).carrying(judged, weight, about)
    window = min(window, max(end - first for first, end in runs(judged)))
    needed, had, whole = (window_means(np.where(judged, v, 0.0), window) for v in (need, have, judged.astype(float)))
    found = [frames]
    means = _Loads(needed, had, amplitude).carrying(whole > 1.0 - 1e-9, weight, about)
    if len(means.need):
        low, high = np.percentile(means.have / means.need, (2.0, 98.0))
        if high - low < apart:
            found += [means] * (frames.left_open(weight) > LEFT_OPEN)
        else:
            lower = frames.have < 0.5 * (low + high) * frames.need
            groups = [_Loads(frames.need[own], frames.have[own], amplitude) for own in (lower, ~lower) if own.any()]
            found = [min(groups, key=lambda group: abs(group.ratio - 1.0))]
    return min(found, key=lambda loads: loads.left_open(weight)).of_mass(weight)


class _Loads(NamedTuple):
    """What is needed of the plates and what they have, N, in frames or as means over a time; the part by which the
    accelerations in it may be off."""

    need: Array
    have: Array
    amplitude: float

    @property
    def ratio(self) -> float:
        return float(np.median(self.have / self.need))

    def carrying(self, judged: Flags, weight: float, about: float = 1.0) -> _Loads:
        """Those that are judged and in which the plates carry about the person, so many times as heavy as declared."""
        loaded = judged & (self.need > 0.5 * weight)
        near = loaded & (np.abs(self.have - about * self.need) < _WITHIN * about * self.need)
        return _Loads(self.need[near], self.have[near], self.amplitude)

    def left_open(self, weight: float) -> float:
        """Part of the ratio that the size of the accelerations may explain."""
        needed = float(np.mean(self.need))
        return self.amplitude * abs(needed - weight) / needed

    def of_mass(self, weight: float) -> float:
        """The ratio without that: the nearest to one that may be the mass'."""
        apart = self.ratio - 1.0
        return 1.0 + float(np.sign(apart)) * max(abs(apart) - self.left_open(weight), 0.0)


def window_means(values: Array, window: int) -> Array:
    """Means over the window around each frame, 0 beyond the ends: (T, ...) as given."""
    window = max(window, 1)
    before, unchanged = window // 2, [(0, 0)] * (values.ndim - 1)
    sums = np.cumsum(np.pad(values, [(before + 1, window - 1 - before), *unchanged]), axis=0)
    return np.asarray((sums[window:] - sums[:-window]) / window)
