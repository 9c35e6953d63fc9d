"""Plates whose axes are turned: their horizontal force against what the motion of the centre of mass needs, or, of
bodies whose trunk no marker shows as well, against how the body leans.

What is above a foot falls the way it leans, and the ground pushes it there: with r from the centre of pressure to the
centre of mass and the angular momentum left out, F_x / F_y = r_x / r_y. Where a body passes over a foot, its pelvis
shows enough of r to say which way each axis of that plate points.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np

from dynakin.arrays import Array, Flags, rms, runs
from dynakin.filter.ground.needed import NEAR, Needed
from dynakin.recordings.plates.axes import TURNS, PlateAxes, turned_feet
from dynakin.recordings.recording import Plate
from dynakin.results.naming import listed

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
LOADED, STANCE_S = 0.2, 0.1
"""Part of the weight that a plate bears while a stance is judged, and how long it lasts at least."""
PASSES, ENDS = 0.05, 0.2
"""A stance is judged over which the body passes: it leans back by so much on average over this part of its frames at
the beginning, and forward at the end, or the other way round. In squats, chairs and landings a pelvis goes back and
forth behind the foot, against what the trunk does."""
ALONG, SLOPE = 0.7, 0.15
"""Along the way, less each plate's mean: correlation of force over load with the lean once the axes are turned, and how
many times the lean it is at most as they are; 0.78 to 0.96 and 0.55 to 1.35 times on 20 plates of 11
real recordings (walks, stairs, a run)."""
ASIDE, ACROSS, ACROSS_SLOPE = 0.04, -0.5, -0.2
"""Across it, the mean with it (the ground pushes a foot inwards): correlation and slope of an axis that is reversed,
where feet lie so far aside (RMS of the lean; a run's 0.01 to 0.03 show nothing). On those plates 0.01 to 0.97 and 0.01
to 0.8."""


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


def _passing(on: Flags, arm: Array, rate_hz: float) -> Flags:
    """Those of the frames (T,) in stances over which the body passes."""
    found = np.zeros(len(on), dtype=bool)
    for first, end in runs(on):
        if not end - first >= STANCE_S * rate_hz:  # a rate that is NaN, too
            continue
        lean = arm[first:end, [0, 2]] / arm[first:end, [1]]
        few = max(round(ENDS * len(lean)), 1)
        before, after = lean[:few].mean(axis=0), lean[-few:].mean(axis=0)
        way = (after - before) / max(float(np.linalg.norm(after - before)), 1e-9)
        found[first:end] = before @ way < -PASSES and after @ way > PASSES
    return found


class _Lean:
    """What a plate's frames show: lean and force over load, (K, 2) each, along the way over it and across.

    Attributes:
        lean: along the way and across. axes: the plate's.
    """

    def __init__(self, lean: Array, push: Array, axes: PlateAxes) -> None:
        x, z = np.linalg.eigh(np.cov(lean.T))[1][:, 1]
        way = np.array([[x, z], [-z, x]])
        self.lean, self.axes, self._push, self._way = lean @ way.T, axes, push, way

    def push(self, turn: Array) -> Array:
        """Force over load (K, 2) with the plate's axes turned."""
        return np.asarray(self.axes.turned(self._push, turn) @ self._way.T)


def turned_by_lean(needed: Needed, plates: Sequence[Plate]) -> str | None:
    """A sentence on plates, all together or one, that push a travelling body against its lean; None where none do, or
    nothing can be said."""
    ground, weight = needed.initial.ground, needed.weight
    leans = dict[str, _Lean]()
    for plate in plates:
        force, cop = ground.vectors_to_ground(plate.force), ground.points_to_ground(plate.cop)
        arm = needed.root - cop
        on = (np.nan_to_num(force[:, 1]) > LOADED * weight) & np.isfinite(arm).all(axis=1) & (arm[:, 1] > 0.0)
        on = _passing(on, arm, needed.rate)
        if not on.any():
            continue
        lean, push = (values[on][:, [0, 2]] / values[on][:, [1]] for values in (arm, force))
        leans[plate.name] = _Lean(lean, push, PlateAxes(plate, ground))
    every = list(leans)
    for names in (every, *([name] for name in every if len(every) > 1)):
        chosen = [leans[name] for name in names]
        if names and (how := _better(chosen)) is not None:
            return (
                f"the horizontal force of {listed(names)} does not fit the motion: it pushes the body against the way "
                f"it leans over the foot, and with it if {chosen[0].axes.in_words(how)}"
            )
    return None


def _better(leans: Sequence[_Lean]) -> str | None:
    """The words of the turn with which the force follows the lean, None where it does as it is, or with none."""
    _, slope, across, across_slope = _follows(leans, np.eye(2))
    aside = rms(np.concatenate([each.lean[:, 1] for each in leans]))
    if slope > SLOPE and not (aside > ASIDE and across < ACROSS and across_slope < ACROSS_SLOPE):
        return None
    turned = [(words, _follows(leans, turn)) for words, turn in TURNS]
    words, (along, _, across, _) = max(turned, key=lambda each: each[1][0] + each[1][2])
    return words if along > ALONG and across > 0.0 else None


def _follows(leans: Sequence[_Lean], turn: Array) -> tuple[float, float, float, float]:
    """Correlation and slope of force over load with the lean along the way, and both across it."""
    pairs = [(each.lean, each.push(turn)) for each in leans]
    way, own = (np.concatenate([_less_mean(v[:, 0]) for v in of]) for of in zip(*pairs, strict=True))
    side, other = (np.concatenate([v[:, 1] for v in of]) for of in zip(*pairs, strict=True))
    return *_fit(way, own), *_fit(side, other)


def _less_mean(values: Array) -> Array:
    return np.asarray(values - values.mean())


def _fit(x: Array, y: Array) -> tuple[float, float]:
    size = max(float(x @ x), 1e-12)
    return float(x @ y) / float(np.sqrt(size * max(float(y @ y), 1e-12))), float(x @ y) / size
