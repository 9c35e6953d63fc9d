"""Plates whose horizontal forces are wrong all the time: not zeroed, of another gain, or not measured at all."""

from __future__ import annotations

import numpy as np

from dynakin.arrays import Array
from dynakin.filter.ground.needed import Needed
from dynakin.filter.ground.plate_errors import PlateErrors
from dynakin.messages import warning

ZERO, ZERO_S = 0.015, 2.0
"""Part of the weight that the mean horizontal force may be off what the motion needs, over so long at least: on average
nobody accelerates, and a shorter time leaves speeds of the centre of mass that markers know to some cm/s. Chosen on
walks and squats of `truth3d` (seeds 1 to 4) and on `opencap_subject4`: 0 to 0.005; of 12 others, real and simulated,
0 to 0.005 as well, 0.014 and 0.03 of somebody who stands in `MH0222`, 0.03 and 0.05 of functional trials on one leg."""
STEADY = 0.5
"""Part of it that each third of the recording has at least: a hand on a rail comes and goes."""
GAIN, GAIN_S = (0.65, 1.35), 1.0
"""Horizontal force over what the motion needs, over so long at least: walks of `truth3d` 0.74 to 0.86 (their pelvis'
skin is in the motion), which chose, real ones 0.86 to 1.11, other simulated ones 0.97 to 1.08."""
VIGOROUS, FOLLOWS = 0.03, 0.95
"""What it takes to tell it: what the motion needs varies by this part of the weight (standard deviation; squats have
0.016), and the force follows it (correlation)."""


def found_shear(needed: Needed, force: Array) -> PlateErrors:
    """What the motion of the centre of mass says of the plates' sum (T, 3) N, NaN where it is not known."""
    closed = needed.closed(force)
    zero, gain = _zero(needed, force, closed), _gain(needed, closed)
    notes = []
    if zero is not None:
        text = (
            f"{not_zeroed(zero[0], zero[1], needed.weight)}, expected within {ZERO:.1%}: they were not zeroed, or a "
            "hand holds on to something. Deviations of moments hold as much at each foot."
        )
        notes.append(warning("zero", text))
    if gain is not None:
        text = (
            f"the plates' horizontal force is {gain:.2f} times what the motion needs, expected {GAIN[0]:g} to "
            f"{GAIN[1]:g}. Deviations of moments hold the difference."
        )
        notes.append(warning("gain", text))
    return PlateErrors(
        shear_zero_n=(0.0, 0.0) if zero is None else (float(zero[0]), float(zero[1])),
        shear_gain_error=0.0 if gain is None else abs(1.0 - 1.0 / gain),
        said=tuple(notes),
    )


def not_zeroed(x: float, z: float, weight: float) -> str:
    """By how much more the plates push sideways than the motion needs, all the time, N, ground frame."""
    return (
        f"on average the plates push sideways by {np.hypot(x, z):.0f} N more than the motion needs (X {x:+z.0f}, Z "
        f"{z:+z.0f}, ground frame), {np.hypot(x, z) / weight:.1%} of the weight"
    )


def _zero(needed: Needed, force: Array, closed: Array) -> Array | None:
    """(2,) N, X and Z of what is too much all the time: the smaller of what forces say and of what those say where
    nothing else bears the person (``closed``), which leaves out the same phases of each step, whose errors then do not
    average out (legs alone marked: 4 to 23 N of plates in order, 2 to 4 in all frames)."""
    if not needed.judged_s(closed) >= ZERO_S:  # a rate that is NaN, too
        return None
    found = [(each - needed.force)[needed.judged(each)][:, [0, 2]] for each in (force, closed)]
    excess = min(found, key=lambda each: float(np.hypot(*each.mean(axis=0))))
    mean = excess.mean(axis=0)
    size = float(np.hypot(*mean))
    if size < ZERO * needed.weight:
        return None
    thirds = [float(part.mean(axis=0) @ mean) / size for part in np.array_split(excess, 3)]
    return mean if min(thirds) > STEADY * size else None


def _gain(needed: Needed, force: Array) -> float | None:
    """Of the axis of the ground whose force is farther off what the motion needs."""
    if not (needed.whole and needed.judged_s(force) >= GAIN_S):
        return None
    found, both = [], needed.smoothed(np.hstack([needed.force, force]), force)
    for axis in (0, 2):
        moved, carried = both[:, axis], both[:, 3 + axis]
        if moved.std() < VIGOROUS * needed.weight or not carried.any():
            continue
        follows = float(np.corrcoef(moved, carried)[0, 1])
        least = float(np.polyfit(moved, carried, 1)[0])
        if follows > FOLLOWS and (least > GAIN[1] or least / follows**2 < GAIN[0]):
            found.append(least / follows)
    return max(found, key=lambda gain: abs(np.log(gain)), default=None)
