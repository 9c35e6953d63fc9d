"""What the motion of the centre of mass needs of the ground, by the markers alone.

A filter cannot ask itself whether plates are out of step or their axes turned: accelerations and inertia take it up.
Newton's second law in every frame is enough to know (`closure`, `mass_centre`).
"""

from __future__ import annotations

from copy import copy

import numpy as np
import numpy.typing as npt

from dynakin.filter.ground.closure import smoothed
from dynakin.filter.ground.lean import root_path
from dynakin.filter.ground.mass_centre import mass_centre
from dynakin.filter.sight import owners_of, root_of
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.recordings.times import rate_of
from dynakin.results.measures.sources import out_of_sight
from dynakin.units import GRAVITY_M_S2

Array = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]

NEAR = 0.05
"""Part of the weight within which the force must then be what the motion needs; real recordings 0.007 to 0.04."""
_SHORTEST_S = 0.3


class Needed:
    """What the motion of the centre of mass needs.

    Attributes:
        time: (T,) s. rate: Hz. weight: N, with what is carried.
        force: (T, 3) N, ground axes. known: (T,) frames in which it is, and the pelvis is seen, which carries the rest.
            whole: all of the body is marked.
        root: (T, 3) m, `root_path`.
    """

    def __init__(self, initial: CalibratedModel, time: Array, markers: Array) -> None:
        found = mass_centre(initial, time, markers)
        self.time, self.rate, self.weight = time, rate_of(time), initial.weighed_kg * GRAVITY_M_S2
        self.whole, self.root = not initial.unseen_kg, root_path(initial, markers)
        root, seen = root_of(initial.spec), np.asarray(np.isfinite(markers).any(axis=2))
        unseen = out_of_sight(seen, owners_of(initial.spec), time, root).get(root, np.False_)
        self.known: Flags = np.zeros(len(time), dtype=bool) if found is None else found.known & ~unseen
        self.force = np.zeros((len(time), 3)) if found is None else found.needed_force(initial.weighed_kg)

    def vertically(self) -> Needed:
        """The same, for delays that are judged by the vertical force alone, as of a body whose trunk no marker
        shows."""
        other = copy(self)
        other.whole = False
        return other

    def with_horizontal(self, wrench: Array) -> Array:
        """Wrenches (T, 6) whose horizontal force, which is not measured, is what the motion needs."""
        found = wrench.copy()
        found[:, [0, 2]] = np.where(self.known[:, None], self.force[:, [0, 2]], 0.0)
        return found

    def judged(self, force: Array) -> Flags:
        """(T,) frames in which both this and forces (T, 3) are known."""
        return np.asarray(self.known & np.isfinite(force).all(axis=1))

    def judged_s(self, force: Array) -> float:
        """How long that is."""
        return float(np.count_nonzero(self.judged(force)) / self.rate)

    def smoothed(self, values: Array, force: Array) -> Array:
        """Values (T, C), smoothed over the frames in which both this and forces (T, 3) are known, at these."""
        judged = self.judged(force)
        return smoothed(values, judged, self.rate)[judged]

    def closed(self, force: Array) -> Array:
        """Forces (T, 3) where the vertical one is what the motion needs within `NEAR`, NaN elsewhere: there something
        else bears the person, and pushes sideways too."""
        near = np.abs(force[:, [1]] - self.force[:, [1]]) < NEAR * self.weight
        return np.where(near, force, np.nan)

    def misfit(self, force: Array) -> float:
        """RMS, N, of what forces (T, 3) lack beyond a constant (a mass or a zero that is off), smoothed, where both
        are known; inf where these frames are too few."""
        if not self.judged_s(force) >= _SHORTEST_S:  # a rate that is NaN, too
            return float("inf")
        return float(np.sqrt(np.sum(self.smoothed(self.force - force, force).var(axis=0))))
