"""Plates whose axes are turned: their horizontal force against what the motion of the centre of mass needs."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np
import numpy.typing as npt

from dynakin.filter.ground.lean import turned_by_lean
from dynakin.filter.ground.needed import NEAR, Needed
from dynakin.recordings.plates.axes import TURNS, PlateAxes, turned_feet
from dynakin.recordings.recording import Plate
from dynakin.results.naming import listed

Flags = npt.NDArray[np.bool_]

TURNED = 0.4
"""With other axes the horizontal force must be off by so much less: 0.9 times and more of 19 real recordings whose
plates are right (0.6 of one that misfits by 2 N), 0.07 to 0.24 where they are not. Judged where the vertical force is
within `NEAR` of what the motion needs: else something that no plate measures pulls (a flywheel's cable)."""
EXPLAINS = 0.7
"""And so turned, by so much less than with no horizontal force at all: 0.2 to 0.62 where one plate of a simulated squat
or walk is turned back. Weights in the hands push both feet alike, which one turned plate cancels (1.0 to 1.1)."""
LARGE, SMALL_N = 0.02, 4.0
"""And as it is by more than this part of the weight; where a second or more is judged by so many N."""
_LONG_S = 1.0


def turned_axes(needed: Needed, plates: Sequence[Plate], known: Flags, remedy: str = "") -> str | None:
    """A sentence on plates whose horizontal force fits the motion once their axes are others; None where none are, or
    something was declared that pushes or pulls as well.

    Args:
        known: (T,) frames in which the sum over the plates is all that bears the person. remedy: where to correct them;
            "": in the file that they were read from.
    """
    if needed.initial.contacts or not plates:
        return None
    found = (
        turned_feet(plates, needed.initial.ground, needed.rate)
        or _turned_sum(needed, plates, known)
        or turned_by_lean(needed, plates)
    )
    if found is None:
        return None
    if not remedy and plates[0].corners is None:  # columns of a table
        remedy = "Correct the signs or columns in this file"
    elif not remedy:
        remedy = "Correct it in this file (order of the corners, order and signs of the channels, calibration)"
    return f"{found}. {remedy}; if something else pulls the person, declare it (--contact)"


def _turned_sum(needed: Needed, plates: Sequence[Plate], known: Flags) -> str | None:
    """Where the sum of some turned, or all, fits what the centre of mass needs."""
    ground = needed.initial.ground
    forces = np.stack([ground.vectors_to_ground(plate.force) for plate in plates])
    total = np.where(known[:, None], forces.sum(axis=0), np.nan)
    upright = needed.force.copy()
    upright[:, 1] = total[:, 1]
    if needed.misfit(upright) > NEAR * needed.weight:
        return None
    total[:, 1] = needed.force[:, 1]  # axes are judged by the horizontal force alone
    now = needed.misfit(total)
    if now < (SMALL_N if needed.judged_s(total) > _LONG_S else LARGE * needed.weight):
        return None
    axes = [PlateAxes(plate, ground) for plate in plates]
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
