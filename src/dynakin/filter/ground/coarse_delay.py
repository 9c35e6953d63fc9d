"""By how much plates are out of step, to some milliseconds: what the motion of the centre of mass needs, by the markers
alone, against their sum.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from dynakin.filter.ground.delay import Delay, later
from dynakin.filter.ground.needed import NEAR, Needed

Array = npt.NDArray[np.float64]

LONGEST_S, STEP_S = 0.1, 0.005
"""Delays that are looked for, and how finely."""
COARSE_S = 0.005
"""Standard deviation of what is found so, half of the step about a right one and what skin does."""
LEAST_S = 0.016
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
    moved = [later(needed.time, force, delay) for delay in delays]
    if not needed.whole:
        for each in moved:
            each[:, [0, 2]] = np.where(np.isfinite(each[:, [1]]), needed.force[:, [0, 2]], np.nan)
    misfits = np.array([needed.misfit(each) for each in moved])
    return _Misfits(delays, misfits, np.array([needed.judged_s(each) for each in moved]))
