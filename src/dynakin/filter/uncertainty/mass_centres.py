"""Centres of mass off where the model has them: of each segment, and of limbs that no marker shows, which are locked to
what carries them, and may hang, swing or be raised."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dynakin.arrays import Array
from dynakin.bindings import _core
from dynakin.filter.uncertainty.arms import Arms
from dynakin.filter.uncertainty.frames import Frame
from dynakin.filter.uncertainty.geometry import Geometry, Parts
from dynakin.model.calibration.calibrated import CalibratedModel

APART = 0.5
"""Times as far as forwards and up a limb may lie off to its side, each by itself (`Sizes.limbs`)."""
_AXES = 3


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
