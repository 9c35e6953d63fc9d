"""Plates against what the centre of mass needs, by the markers alone: their clock and their axes.

A filter cannot ask itself either: what plates that are out of step, or whose axes are turned, say of a walk is taken up
by accelerations and inertia. Newton's second law in every frame is enough to know (`filter.closure`, `mass_centre`).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import product

import numpy as np
import numpy.typing as npt

from dynakin.filter.closure import smoothed
from dynakin.filter.mass_centre import mass_centre
from dynakin.filter.samples import in_step
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.recordings.recording import Plate, Recording, rate_of
from dynakin.results.naming import listed
from dynakin.units import GRAVITY_M_S2

Array = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]

LONGEST_S, STEP_S = 0.1, 0.005
"""Delays that are looked for, and how finely."""
LEAST_S = 0.008
"""A lesser delay is left to the filter's state: recordings in step have their minimum at up to 6 ms."""
LESS = 0.75
"""So much less must the sum be off what the motion needs once it is in step; 0.12 to 0.2 where plates were moved, 0.84
and more of real recordings in step."""
NEAR = 0.05
"""Part of the weight within which the force must then be what the motion needs; real recordings 0.007 to 0.04."""
KEPT = 0.7
"""Part of the frames that must be left to judge it by."""
TURNED = 0.4
"""With other axes the horizontal force must be off by so much less: 0.9 to 1 times of 16 real recordings whose plates
are right, 0.07 to 0.24 where they are not. Judged where the vertical force is within `NEAR` of what the motion needs:
else something that no plate measures pulls (a flywheel's cable)."""
LARGE, SMALL_N = 0.02, 4.0
"""And as it is by more than this part of the weight; where a second or more is judged by so many N."""
_SHORTEST_S, _LONG_S = 0.3, 1.0
AWAY_DEG, ALONG_DEG = 70.0, 45.0
"""While several plates are loaded the ground pushes each foot towards the centre of mass: of 17 real recordings each
plate's horizontal force lies 0 to 31 deg off that line, seen from above (one, which reads 16 N forward while somebody
stands, 101). Of plates with other axes all are more than the first off it, and together less than the second once their
axes are others."""
_BEARS_N = 100.0

_TURNS: tuple[tuple[str, Array], ...] = (
    ("{first} points the other way", np.diag([-1.0, 1.0])),
    ("{second} points the other way", np.diag([1.0, -1.0])),
    ("both horizontal axes point the other way (half a turn)", -np.eye(2)),
    ("the horizontal axes are turned by a quarter turn", np.array([[0.0, -1.0], [1.0, 0.0]])),
    ("the horizontal axes are turned by a quarter turn", np.array([[0.0, 1.0], [-1.0, 0.0]])),
)


class Needed:
    """What the motion of the centre of mass needs.

    Attributes:
        time: (T,) s. rate: Hz. weight: N, with what is carried.
        force: (T, 3) N, ground axes. path: (T, 3) m of the centre, ground frame. known: (T,) frames in which they are.
    """

    def __init__(self, initial: CalibratedModel, time: Array, markers: Array) -> None:
        found = mass_centre(initial, time, markers)
        self.time, self.rate, self.weight = time, rate_of(time), initial.weighed_kg * GRAVITY_M_S2
        self.known: Flags = np.zeros(len(time), dtype=bool) if found is None else found.known
        self.force = np.zeros((len(time), 3)) if found is None else found.needed_force(initial.weighed_kg)
        self.path = np.zeros((len(time), 3)) if found is None else found.path

    def judged(self, force: Array) -> Flags:
        """(T,) frames in which both this and forces (T, 3) are known."""
        return np.asarray(self.known & np.isfinite(force).all(axis=1))

    def judged_s(self, force: Array) -> float:
        """How long that is."""
        return float(np.count_nonzero(self.judged(force)) / self.rate)

    def misfit(self, force: Array) -> float:
        """RMS, N, of what forces (T, 3) lack beyond a constant (a mass or a zero that is off), smoothed, where both
        are known; inf where these frames are too few."""
        if not self.judged_s(force) >= _SHORTEST_S:  # a rate that is NaN, too
            return float("inf")
        judged = self.judged(force)
        lacks = smoothed(np.where(judged[:, None], self.force - force, 0.0), judged, self.rate)[judged]
        return float(np.sqrt(np.sum(lacks.var(axis=0))))


def plates_delay(needed: Needed, force: Array) -> float | None:
    """By how much plates lag, s, whose sum (T, 3) N is known where it is no NaN; None where they are in step, or
    nothing can be said."""
    delays = np.arange(-LONGEST_S, LONGEST_S + 0.5 * STEP_S, STEP_S)
    moved = [_later(needed.time, force, delay) for delay in delays]
    misfits = np.array([needed.misfit(each) for each in moved])
    k, now = int(np.argmin(misfits)), misfits[len(delays) // 2]
    if not 0 < k < len(delays) - 1 or not np.isfinite(misfits[k - 1 : k + 2]).all():
        return None
    before, least, after = misfits[k - 1 : k + 2]
    delay = float(delays[k] + 0.5 * STEP_S * (before - after) / max(before - 2.0 * least + after, 1e-12))
    if abs(delay) < LEAST_S or least > LESS * now or least > NEAR * needed.weight:
        return None
    return delay if needed.judged_s(moved[k]) > KEPT * needed.judged_s(force) else None


def out_of_step_in_words(delay_s: float) -> str:
    """Which way, and by how much."""
    where = "behind" if delay_s > 0.0 else "ahead of"
    return f"By the motion of the centre of mass the plates are {1000.0 * abs(delay_s):.0f} ms {where} the markers"


def brought_into_step(recording: Recording, delay_s: float) -> Recording:
    """The recording with what its plates say so much later at each time; not known (NaN) where they end before."""

    def of(plate: Plate) -> Plate:
        values = (plate.force, plate.moment, plate.cop, plate.free_moment)
        force, moment, cop, free = (_later(recording.time, each, delay_s) for each in values)
        return replace(plate, force=force, moment=moment, cop=cop, free_moment=free)

    return recording.with_plates(tuple(of(plate) for plate in recording.plates))


def _later(time: Array, values: Array, delay_s: float) -> Array:
    """`in_step` of values (T, 3), but NaN beyond the recording."""
    then = time + delay_s
    inside = (then >= time[0] - 1e-9) & (then <= time[-1] + 1e-9)
    return np.where(inside[:, None], in_step(time, values, delay_s), np.nan)


def turned_axes(
    needed: Needed, plates: Sequence[Plate], initial: CalibratedModel, known: Flags, remedy: str = ""
) -> str | None:
    """A sentence on plates whose horizontal force fits the motion once their axes are others; None where none are, or
    something was declared that pushes or pulls as well.

    Their sum is judged; and, as feet that push against each other leave no sum, each one's direction.

    Args:
        known: (T,) frames in which the sum over the plates is all that bears the person. remedy: where to correct them;
            "": in the file that they were read from.
    """
    if initial.contacts or not plates:
        return None
    turned = _Turned(needed, plates, initial, known)
    found = turned.by_their_sum() or turned.by_their_directions()
    if found is None:
        return None
    if not remedy and plates[0].corners is None:  # columns of a table
        remedy = "Correct the signs or columns in this file"
    elif not remedy:
        remedy = "Correct it in this file (order of the corners, signs of the channels, calibration)"
    return f"{found}. {remedy}; if something else pulls the person, declare it (--contact)"


class _Turned:
    """Plates, and what their axes would have to be."""

    def __init__(self, needed: Needed, plates: Sequence[Plate], initial: CalibratedModel, known: Flags) -> None:
        self._needed, self._plates, self._known = needed, plates, known
        self._forces = np.stack([initial.ground.vectors_to_ground(plate.force) for plate in plates])  # (P, T, 3)
        self._cops = np.stack([initial.ground.points_to_ground(plate.cop) for plate in plates])
        self._axes = [_axes(plate, initial) for plate in plates]

    def by_their_sum(self) -> str | None:
        """Where the sum of some turned, or all, fits what the centre of mass needs."""
        needed, forces = self._needed, self._forces
        total = np.where(self._known[:, None], forces.sum(axis=0), np.nan)
        upright = needed.force.copy()
        upright[:, 1] = total[:, 1]
        if needed.misfit(upright) > NEAR * needed.weight:
            return None
        total[:, 1] = needed.force[:, 1]  # axes are judged by the horizontal force alone
        now = needed.misfit(total)
        if now < (SMALL_N if needed.judged_s(total) > _LONG_S else LARGE * needed.weight):
            return None
        every = range(len(forces))
        subsets: list[Sequence[int]] = [every, *([k] for k in every if len(forces) > 1)]
        best, how = now, ""
        which: Sequence[int] = every
        for subset, (words, turn) in product(subsets, _TURNS):
            changed = total.copy()
            for k in subset:
                changed[:, [0, 2]] += self._after(k, turn) - forces[k][:, [0, 2]]
            if (misfit := needed.misfit(changed)) < best:
                best, which, how = misfit, subset, words
        if best > TURNED * now:
            return None
        return (
            f"the horizontal force of {self._names(which)} does not fit the motion: it is {now:.0f} N off what the "
            f"centre of mass needs, and {best:.0f} N if {self._in_words(how, which[0])}"
        )

    def by_their_directions(self) -> str | None:
        """Where the ground would push every foot away from the centre of mass, or across."""
        needed, up = self._needed, self._forces[:, :, 1]
        arm = needed.path - self._cops
        loaded = (up > _BEARS_N) & np.isfinite(self._cops).all(axis=2) & needed.known & self._known
        loaded &= np.count_nonzero(loaded, axis=0) > 1
        which = np.flatnonzero(np.count_nonzero(loaded, axis=1) > _SHORTEST_S * needed.rate).tolist()
        if len(which) < 2:
            return None

        def off(turn: Array) -> tuple[Array, Array, float]:
            """Angles (deg) between force and arm of each plate, over its frames, and of all; RMS of the force, N."""
            each, size = [], []
            for k in which:
                t = loaded[k]
                arms = (arm[k, t] / arm[k, t, 1:2])[:, [0, 2]] * up[k, t, None]
                force = self._after(k, turn)[t]
                each.append(np.sum((force[:, 0] + 1j * force[:, 1]) * (arms[:, 0] - 1j * arms[:, 1])))
                size.append(np.mean(force**2) * 2.0)
            return np.abs(np.angle(each, deg=True)), np.abs(np.angle(sum(each), deg=True)), float(np.sqrt(min(size)))

        each, _, size = off(np.eye(2))
        if each.min() < AWAY_DEG or size < LARGE * needed.weight:
            return None
        how, turn = min(_TURNS, key=lambda named: float(off(named[1])[1]))
        if (best := float(off(turn)[1])) > ALONG_DEG:
            return None
        return (
            f"while several plates are loaded the horizontal force of {self._names(which)} lies {each.min():.0f} to "
            f"{each.max():.0f} deg off the direction from the foot to the centre of mass, seen from above, and "
            f"{best:.0f} deg if {self._in_words(how, which[0])}"
        )

    def _after(self, k: int, turn: Array) -> Array:
        """(T, 2) N, X and Z of the ground: a plate's horizontal force once its own axes are turned."""
        axes, _ = self._axes[k]
        return np.asarray(self._forces[k][:, [0, 2]] @ axes.T @ turn.T @ axes)

    def _names(self, which: Iterable[int]) -> str:
        return listed([self._plates[k].name for k in which])

    def _in_words(self, how: str, k: int) -> str:
        first, second = self._axes[k][1]
        return how.format(first=first, second=second)


def _axes(plate: Plate, initial: CalibratedModel) -> tuple[Array, tuple[str, str]]:
    """(2, 2) the plate's horizontal axes, rows, in the ground's X and Z, and their names; the laboratory's own where it
    has no corners."""
    if plate.corners is not None:
        along = initial.ground.vectors_to_ground(plate.corners[0] - plate.corners[1])[[0, 2]]
        if np.linalg.norm(along) > 1e-6:
            along = along / np.linalg.norm(along)
            names = "its first axis (from corner 2 to 1)", "its second axis (from corner 4 to 1)"
            return np.array([along, [-along[1], along[0]]]), names
    x, z = (k for k in range(3) if "XYZ"[k] != initial.ground.vertical[1])
    rows = initial.ground.vectors_to_ground(np.eye(3)[[x, z]])[:, [0, 2]]
    return rows, ("XYZ"[x], "XYZ"[z])
