"""Masses off where the model has them: the centres of mass of each segment, and of limbs that no marker shows, which
are locked to what carries them, and may hang, swing or be raised; of arms that a model's file does not have, whose mass
is the trunk's, and what they do goes through the joint below; and inertia that a recording leaves open."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from dynakin.arrays import Array
from dynakin.bindings import _core
from dynakin.filter.uncertainty.frames import Frame
from dynakin.filter.uncertainty.geometry import Geometry, Parts
from dynakin.filter.uncertainty.upright import thighs_of, trunks_of
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.model.spec import free_names

APART = 0.5
"""Times as far as forwards and up a limb may lie off to its side, each by itself (`Sizes.limbs`)."""
_AXES = 3


ARM = 0.05
"""Part of the mass of the person in each arm (de Leva 1996)."""
REACH, SHOULDERS, APART_OF_SHOULDERS = 0.9, 1.3, 0.6
"""How far an arm's centre of mass hangs from its shoulder, how high shoulders lie, and how far to the side, over the
height of the trunk's centre of mass above the joint below it."""
SWING = 1.0
"""Size of the arms' angular acceleration over that of the thighs, times 1 / `Sizes.limbs`. Chosen for simulated walk 1
of a model without arms; walks 2 and 3 and a squat judge (docs/validation/deviations.md)."""
STRIDE_RAD_S = 6.0
"""Rhythm of a stride: what moves to it accelerates by so much of its speed a second, a quarter of a stride later."""


@dataclass(frozen=True, eq=False)
class Arms:
    """Arms that a model's file does not have: its trunk does not branch, and has their mass.

    Attributes:
        trunk: segment that they would hang on, ``k`` its place. mass_kg, reach_m: of each, as in `REACH`.
        shoulders_m: (2, 3) m, in the axes of the trunk. forwards: (3,) there. legs: places of free rotations of hips.
    """

    trunk: str
    k: int
    mass_kg: float
    reach_m: float
    shoulders_m: Array
    forwards: Array
    legs: npt.NDArray[np.intp]

    @classmethod
    def of(cls, calibrated: CalibratedModel) -> Arms | None:
        """None where the trunk branches, of a model that was measured by its markers, and of one without a trunk."""
        spec, trunks = calibrated.spec, trunks_of(calibrated)
        above = [
            s for s in spec.segments if s.name in {*trunks, *calibrated.tree.below(*trunks)} and s.inertia[0] > 0.0
        ]
        carrying = {segment.parent for segment in above}
        tips = [segment for segment in above if segment.name not in carrying]
        if calibrated.plan is not None or len(tips) != 1 or not all(spec.markers[0].measured):
            return None
        names = [segment.name for segment in spec.segments]
        trunk = max(above, key=lambda segment: segment.inertia[0])
        centre = np.array(trunk.inertia[1 : 1 + _AXES]) / trunk.inertia[0]
        height = float(np.linalg.norm(centre))
        if not height:
            return None
        up, side = centre / height, np.array([0.0, 0.0, 1.0])
        free, thighs = free_names(spec), thighs_of(calibrated)
        hips = {a.coordinate for s in spec.segments if s.name in thighs for a in s.axes if a.kind == "rotation"}
        return cls(
            trunk.name,
            names.index(trunk.name),
            ARM * sum(float(segment.inertia[0]) for segment in spec.segments),
            REACH * height,
            height * (SHOULDERS * up + APART_OF_SHOULDERS * np.outer([1.0, -1.0], side)),
            np.cross(up, side),
            np.array([place for place, name in enumerate(free) if name in hips], dtype=np.intp),
        )

    @property
    def raised(self) -> dict[str, float]:
        """As a limb of `mass_centres.unsure_moments`: what one of them has, because both together are seldom raised all
        the way."""
        return {self.trunk: self.mass_kg * self.reach_m}

    def variances(self, geometry: Geometry, motion: tuple[Array, Array, Array]) -> Array:
        """(C,) of moments by arms that swing as fast as thighs do, together and against each other.

        Args:
            motion: free coordinates, their speeds and accelerations (K,).
        """
        q, qd, qdd = motion
        x = np.concatenate([q, geometry.x0[len(q) :]])
        turning = np.square(qdd[self.legs]).sum() + STRIDE_RAD_S**2 * np.square(qd[self.legs]).sum()
        size = SWING * self.mass_kg * self.reach_m * float(np.sqrt(0.5 * turning))  # of each of two
        rotations, places = _core.segment_poses(geometry.model, x)
        force = size * rotations[self.k] @ self.forwards
        points = places[self.k] + self.shoulders_m @ rotations[self.k].T
        each = np.array([np.concatenate([force, np.cross(point, force)]) for point in points])
        found = np.zeros(geometry.count)
        for wrench in (each.sum(axis=0), each[0] - each[1]):
            load = np.zeros((len(rotations), 6))
            load[self.k] = wrench
            found += np.square(geometry.moments_by(x, load))
        return found


class MassCentres:
    """Kinds "mass_centre" and "limbs"."""

    def __init__(self, geometry: Geometry, calibrated: CalibratedModel) -> None:
        self._geometry = geometry
        self._arms = Arms.of(calibrated)
        limbs = unseen_limbs(calibrated) + ([self._arms.raised] if self._arms else [])
        self._limbs = unsure_moments(limbs, geometry.errors.massive)

    def variances(self, frame: Frame) -> Parts:
        """Of moments, in one frame."""
        errors = self._geometry.errors
        by_moment = frame.moment_jacobian[:, errors.first_moments]
        sources = (("mass_centre", by_moment * errors.masses), ("limbs", by_moment @ self._limbs))
        found = {kind: np.square(displaced).sum(axis=1) for kind, displaced in sources}
        if self._arms is not None:
            found["limbs"] = found["limbs"] + self._arms.variances(self._geometry, frame.motion)
        return {kind: self._geometry.of_moments(moments) for kind, moments in found.items()}


class Inertia:
    """Kind "inertia", which a recording leaves open: by the declared noise."""

    def __init__(self, geometry: Geometry, calibrated: CalibratedModel) -> None:
        self._geometry = geometry
        self._at = [k for k, name in enumerate(calibrated.names) if name.startswith("inertia/")]

    def variances(self, frame: Frame) -> Parts:
        """Of moments, in one frame."""
        if not self._at:
            return {"inertia": self._geometry.of_moments(np.zeros(self._geometry.count))}
        sd, known = frame.known
        covariance = sd[self._at, None] * known[np.ix_(self._at, self._at)] * sd[self._at]
        T = _core.moment_jacobian(self._geometry.model, frame.x, frame.external)[: self._geometry.count, self._at]
        return {"inertia": self._geometry.of_moments(np.asarray(((T @ covariance) * T).sum(axis=1)))}


def unseen_limbs(calibrated: CalibratedModel) -> list[dict[str, float]]:
    """Of each: its segments, and the first moment (kg m) of each about the limb's joint.

    A limb has two segments or more, and hangs on a segment that is marked and is not the root: head and hands count as
    still, of what hangs on the root the joint's moment is absent.
    """
    spec = calibrated.spec
    tree = calibrated.tree
    marked = {marker.segment for marker in spec.markers}
    members: dict[str, list[str]] = {}
    for segment in spec.segments:  # children stand after their parents
        if segment.name in marked:
            continue
        top = next((first for first, own in members.items() if segment.parent in own), segment.name)
        members.setdefault(top, []).append(segment.name)
    limbs = [own for top, own in members.items() if len(own) > 1 and len(tree.up(top)) > 2]
    if not limbs:
        return []
    model = _core.Model(spec)
    turns, places = _core.segment_poses(model, np.array(calibrated.x0))
    at = {name: k for k, name in enumerate(model.segment_names)}
    inertia = {segment.name: np.array(segment.inertia[: 1 + _AXES]) for segment in spec.segments}

    def moment(name: str, joint: Array) -> float:
        mass, first = inertia[name][0], inertia[name][1:]
        return float(np.linalg.norm(mass * (places[at[name]] - joint) + turns[at[name]] @ first))

    return [{name: moment(name, places[at[own[0]]]) for name in own if inertia[name][0] > 0.0} for own in limbs]


def unsure_moments(limbs: Sequence[dict[str, float]], segments: Sequence[str]) -> Array:
    """(3 B, S) what the first moments, kg m, of segments along their axes are off by where limbs are off by all of the
    distance from their joints: all limbs forwards, all of them up, each to its side (`APART`)."""
    sources = np.zeros((len(segments), _AXES, 2 + len(limbs)))
    for k, limb in enumerate(limbs):
        for name, moment in limb.items():
            own = sources[segments.index(name)]
            own[0, 0] += moment
            own[1, 1] += moment
            own[2, 2 + k] = APART * moment
    return sources.reshape(_AXES * len(segments), -1)
