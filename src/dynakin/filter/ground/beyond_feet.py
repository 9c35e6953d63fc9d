"""Whether a person without plates is borne beyond the feet: on a hand, a knee or a seat that nobody declared."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from dynakin.arrays import runs
from dynakin.filter.ground.needed import Needed
from dynakin.messages import Message, warning
from dynakin.recordings.hull import distance_to_hull
from dynakin.recordings.times import spans
from dynakin.units import GRAVITY_M_S2

Array = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]

BEYOND_M, BEYOND_S = 0.25, 0.5
"""How far beyond the markers of both feet, and for how long at least, the motion needs the ground's push to act for
something else to bear the person: a shoe is 0.05 larger, who lies or is on hands and toes has it 0.5 to 0.9 away."""


def beyond_the_feet(needed: Needed) -> Flags:
    """(T,) frames in which the ground would have to push there, by the motion of the centre of mass; none of a body
    with a foot that nobody sees."""
    initial, markers = needed.initial, needed.markers
    beyond = np.zeros(len(markers), dtype=bool)
    feet = [[m for m, n in enumerate(initial.recorded_markers) if n in own] for own in initial.foot_markers.values()]
    found = needed.centre if len(feet) > 1 and all(feet) else None
    if found is None:
        return beyond
    soles = markers[:, [m for own in feet for m in own]]
    upward = found.acceleration[:, 1] + GRAVITY_M_S2
    floor = float(np.nanmin(soles[..., 1]))
    lever = (found.path[:, 1] - floor) / upward.clip(1.0)
    at = found.path[:, [0, 2]] - lever[:, None] * found.acceleration[:, [0, 2]]
    with np.errstate(invalid="ignore"):
        far = distance_to_hull(at, soles[:, :, [0, 2]]) > BEYOND_M
    far &= found.known & (upward > 0.5 * GRAVITY_M_S2) & np.isfinite(soles).all(axis=(1, 2))
    for first, end in runs(far):
        beyond[first:end] = end - first >= BEYOND_S * needed.rate
    for first, end in runs(~found.known):  # not judged: as its neighbours are
        sides = [bool(beyond[k]) for k in (first - 1, end) if 0 <= k < len(beyond)]
        beyond[first:end] = bool(sides) and all(sides)
    return beyond


def beyond_in_words(beyond: Flags, time: Array) -> Message:
    """A sentence on when that is, and what to do."""
    return warning(
        "plates",
        f"something that nobody measures bears the person beyond both feet, by the motion, from "
        f"{spans(time, runs(beyond))} (a hand, a knee, a seat): what it can reach has no moments there. Declare it "
        "(--contact hand_right, seat or knee=shank_l), or give the forces of all that bears.",
    )
