"""What the motion of the centre of mass needs of the ground, by the markers alone.

A filter cannot ask itself whether plates are out of step or their axes turned: accelerations and inertia take it up.
Newton's second law in every frame is enough to know (`closure`, `mass_centre`).
"""

from __future__ import annotations

from copy import copy
from functools import cached_property

import numpy as np

from dynakin.arrays import Array, Flags
from dynakin.filter.ground.mass_centre import MassCentre, mass_centre
from dynakin.filter.ground.stretches import Moving
from dynakin.filter.sight import owners_of, root_of
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.recordings.times import rate_of
from dynakin.results.measures.sources import out_of_sight
from dynakin.units import GRAVITY_M_S2

NEAR = 0.05
"""Part of the weight within which the force must then be what the motion needs; real recordings 0.007 to 0.04."""
SMOOTH_S = 0.05
"""Standard deviation of the Gaussian by which a difference is smoothed: -3 dB at 2.6 Hz."""
BESIDE_M = 0.03
"""How far the mean of the pelvis' markers may lie beside its middle: three quarters of `axes.ASIDE` under a centre of
mass 1 m up. Those of one side (0.09 to 0.13 m) make a body lean over that foot as it does over neither."""
_SHORTEST_S = 0.3


class Needed:
    """The motion of a recording, or of the last seconds, and what it needs: the evidence that plates are held against.

    Attributes:
        initial: the person. time: (T,) s. markers: (T, M, 3) m, ground frame, NaN missing.
        rate: Hz. weight: N, with what is carried. whole: all of the body is marked.
    """

    def __init__(self, initial: CalibratedModel, time: Array, markers: Array) -> None:
        self.initial, self.time, self.markers = initial, time, markers
        self.rate, self.weight = rate_of(time), initial.weighed_kg * GRAVITY_M_S2
        self.whole = not initial.unseen_kg

    @cached_property
    def centre(self) -> MassCentre | None:
        """The centre of mass; None where no stretch of the markers shows it."""
        return mass_centre(self.initial, self.time, self.markers)

    @cached_property
    def moving(self) -> Moving:
        """The same by inverse kinematics, in stretches."""
        return Moving(self.initial, self.time, self.markers)

    @cached_property
    def force(self) -> Array:
        """(T, 3) N, ground axes; 0 where there is no centre of mass."""
        found = self.centre
        return np.zeros((len(self.time), 3)) if found is None else found.needed_force(self.initial.weighed_kg)

    @cached_property
    def known(self) -> Flags:
        """(T,) frames in which that is, and the pelvis is seen, which carries the rest."""
        if self.centre is None:
            return np.zeros(len(self.time), dtype=bool)
        spec, seen = self.initial.spec, np.asarray(np.isfinite(self.markers).any(axis=2))
        root = root_of(spec)
        return self.centre.known & ~out_of_sight(seen, owners_of(spec), self.time, root).get(root, np.False_)

    @cached_property
    def root(self) -> Array:
        """(T, 3) m, ground frame: mean of the markers on the pelvis; NaN where one of them is missing that most frames
        show, and throughout where they show one side of it alone."""
        markers = self.initial.spec.markers
        on_root = [k for k, marker in enumerate(markers) if marker.segment in self.initial.tree.roots]
        own, places = self.markers[:, on_root], np.array([markers[k].position for k in on_root]).reshape(-1, 3)
        often = np.isfinite(own).all(axis=2).mean(axis=0) > 0.5
        if not often.any() or abs(places[often, 2].mean()) > BESIDE_M:
            return np.full((len(self.time), 3), np.nan)
        return np.asarray(own[:, often].mean(axis=1))

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


def smoothed(values: Array, judged: Flags, rate: float) -> Array:
    """Gaussian mean (`SMOOTH_S`) of values (T, C) over the judged frames alone; NaN elsewhere."""
    reach = round(4.0 * SMOOTH_S * rate)
    kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) / (SMOOTH_S * rate)) ** 2)
    weighed = np.column_stack([np.where(judged[:, None], values, 0.0), judged])
    sums = np.column_stack([np.convolve(column, kernel)[reach : reach + len(judged)] for column in weighed.T])
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(judged[:, None], sums[:, :-1] / sums[:, -1:], np.nan)
