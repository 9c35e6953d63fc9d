"""Plates whose moment about the vertical is not what the motion needs: not zeroed, of another gain or sign.

Only the sum is known by the motion: opposite errors of two plates that bear at the same time leave nothing of it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from dynakin.arrays import Array, Flags, rms, wrench_about
from dynakin.filter.ground.fine_delay import TURNING, UPWARDS
from dynakin.filter.ground.needed import Needed, smoothed
from dynakin.filter.ground.plate_errors import NO_ERRORS, PlateErrors
from dynakin.filter.ground.stretches import CUTOFF_HZ
from dynakin.messages import warning
from dynakin.recordings.plates.pressure import free_moments
from dynakin.recordings.resampling import low_pass
from dynakin.results.naming import listed

TURN_M, TURN_S = 0.008, 0.6
"""How far it may be off, RMS and over the weight, over so long at least, smoothed. Chosen on `truth3d`'s squats and
walks of seeds 1 to 4 (0.0007 to 0.0008, 0.0018 to 0.0022) and on `opencap_subject4` and `Movement_trial` (0.0034 to
0.0065): plates of which one reads 10 N m too much have 0.016 in squats, free moments times 3 or -1 in walks 0.009 to
0.012, times 10 in squats 0.010 to 0.013. Seeds 5 to 8, which did not choose, 0.0004 to 0.0007 and 0.0019 to 0.0026,
with these faults 0.016, 0.009 to 0.014 and 0.008 to 0.011; other real recordings 0.0005 to 0.0061."""
LEGS_S = 2.0
"""The same on average of a body that is not marked whole, whose arms and trunk turn as well, over so long at least: no
angular momentum lasts. 0.0005 and 0.0011 of two real ones."""
STANCE_M, STANCE_S, MOST = 0.012, 0.25, 0.5
"""The same on average over the frames in which one plate bears more than this part of the load, as of a walk over a
plate a stance: 0.0016 to 0.0021 in `truth3d`'s walks that chose, 0.0061 and 0.0073 in real ones; of others 0.0017 to
0.0028, 0.0011 to 0.0080; where that plate reads 10 N m too much or too little 0.0145 to 0.018."""
BRIEF = 6.0
"""Times the median beyond which a frame is not judged: a kick of a plate for some frames is the filter's to refuse."""
FOLLOWS = 0.95
"""What is off is laid to a gain, or a sign, where it follows the plates' free moments (correlation)."""


class _Off(NamedTuple):
    """By how much the plates' moment about the vertical through the centre of mass is more than what the motion needs
    (N,) N m, the sum of their free moments (N,) N m, both smoothed, and which plate bears most of the load (P, N); in
    frames that are judged, of which there are so many a second."""

    moment: Array
    free: Array
    most: Flags
    rate: float


def found_turn(needed: Needed, wrench: Array, plates: Array, names: list[str]) -> PlateErrors:
    """What the motion of the whole body says of the moment about the vertical.

    Args:
        wrench: (T, 6) N and N m of all plates, about the ground's origin, where that is all that bears the person; NaN
            elsewhere. plates: (P, T, 6), of each, by their names.
    """
    off, weight = _off(needed, wrench, plates), needed.weight
    if off is None:
        return NO_ERRORS
    whole, mean = needed.whole, float(off.moment.mean())
    size, least_s = (float(rms(off.moment)), TURN_S) if whole else (abs(mean), LEGS_S)
    if not (size > TURN_M * weight and len(off.moment) >= least_s * off.rate):
        size = 0.0
    own = _of_stances(off, STANCE_M * weight) if whole else np.zeros(len(plates))
    if own.any() and off.most[own == 0.0].any() and float(rms(off.moment - own @ off.most)) < TURN_M * weight:
        size = 0.0  # nothing is wrong with the others
    part = _part_of_free(off) if size and whole else None
    if part is not None:
        how = (
            f"by {size:.1f} N m (root mean square, expected within {TURN_M * weight:.1f} N m), as if the true free "
            f"moments were {1.0 - part:.2f} times those measured"
        )
    elif size:
        how = (
            f"by {size:.1f} N m ({'root mean square' if whole else 'on average'}, expected within "
            f"{TURN_M * weight:.1f} N m), on average by {mean:+.1f} N m"
        )
    elif own.any():
        which = [f"{by:+.1f} N m while {name} bears most" for name, by in zip(names, own, strict=True) if by]
        how = f"on average by {listed(which)} of the load, expected within {STANCE_M * weight:.1f} N m"
    else:
        return NO_ERRORS
    text = (
        f"the plates' moment about the vertical is off what the motion needs {how}: its zero, sign, unit or "
        "calibration is wrong, or something that no plate measures turns the person. Deviations of moments hold as "
        "much at each foot that it may concern."
    )
    # a factor takes more than what the sum has: the feet's opposite shear cancels in it
    return PlateErrors(
        turn_error_nm=np.maximum(np.abs(own), size),
        turn_gain_error=abs(part or 0.0),
        said=(warning("free moment", text),),
    )


def _off(needed: Needed, wrench: Array, plates: Array) -> _Off | None:
    moving, centre = needed.moving, needed.centre
    borne = moving.borne(wrench)
    if borne is None or centre is None:
        return None
    path = moving.laid(np.where(needed.known[:, None], centre.path, np.nan))
    own = np.stack([moving.laid(np.nan_to_num(plate)) for plate in plates])
    free, found, rate = free_moments(own).sum(axis=0), list[Array](), borne.stretches[0].rate
    for stretch in borne.stretches:
        part = stretch.part
        judged = np.asarray(stretch.inner & np.isfinite(path[part]).all(axis=1))
        excess = low_pass(borne.wrench[part], rate, CUTOFF_HZ) - stretch.wrench
        turning = wrench_about(excess, path[part])[:, TURNING]
        both = np.column_stack([turning, low_pass(free[part, None], rate, CUTOFF_HZ)])
        found.append(np.column_stack([smoothed(both, judged, rate), own[:, part, UPWARDS].T])[judged])
    every = np.concatenate(found)
    size = np.abs(every[:, 0])
    every = every[size <= BRIEF * np.median(size)] if len(every) else every
    push = every[:, 2:].T
    return _Off(every[:, 0], every[:, 1], push > MOST * push.sum(axis=0), rate) if len(every) else None


def _of_stances(off: _Off, most: float) -> Array:
    """(P,) N m that are off on average while each plate bears most of the load; 0 of what is less than ``most``."""
    frames = off.most.sum(axis=1)
    mean = (off.most @ off.moment) / np.maximum(frames, 1)
    return np.where((frames >= STANCE_S * off.rate) & (np.abs(mean) > most), mean, 0.0)


def _part_of_free(off: _Off) -> float | None:
    """The part of the plates' free moments that is too much, where that is what is off; None where it is not."""
    if not off.free.std() > 0.0 or not off.moment.std() > 0.0:
        return None
    if np.square(off.moment - off.moment.mean()).mean() < 0.5 * np.square(off.moment).mean():  # a zero
        return None
    if abs(float(np.corrcoef(off.free, off.moment)[0, 1])) < FOLLOWS:
        return None
    return float(np.polyfit(off.free, off.moment, 1)[0])
