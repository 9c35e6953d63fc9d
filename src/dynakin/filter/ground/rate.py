"""Does the rate of the markers fit the plates? Accelerations grow with its square, forces do not."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from dynakin.filter.ground.mass_centre import second_derivative
from dynakin.filter.ground.needed import Needed

Array = npt.NDArray[np.float64]

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
