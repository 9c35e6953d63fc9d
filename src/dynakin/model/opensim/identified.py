"""An OpenSim model with the values that a run found: scales, marker places, masses and inertias."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from dynakin.model.inertia import INERTIA_NAMES, RigidBody
from dynakin.model.opensim.chains import grows
from dynakin.model.opensim.description import Body, Joint, JointAxis, Marker, Offset, OpenSimModel, Vector
from dynakin.model.opensim.functions import joined, polynomial


def identified(model: OpenSimModel, scales: Mapping[str, str], values: Mapping[str, float]) -> OpenSimModel:
    """The same model with values by the core's names (``length/scale_femur``, ``marker/r_knee/x``,
    ``inertia/femur_r/mass``); what is not among them stays.

    Args:
        scales: scale parameter of each body that has one, as when the values were found.
    """

    def scale(body: str) -> float:
        return float(values.get(f"length/{scales[body]}", 1.0)) if body in scales else 1.0

    return replace(
        model,
        bodies=tuple(_body(body, values) for body in model.bodies),
        joints=tuple(_joint(joint, scale(joint.parent), scale(joint.child)) for joint in model.joints),
        markers=tuple(_marker(marker, values) for marker in model.markers),
    )


def _body(body: Body, values: Mapping[str, float]) -> Body:
    names = [f"inertia/{body.name}/{name}" for name in INERTIA_NAMES]
    if not any(name in values for name in names):
        return body
    old = body.rigid.vector
    new = np.array([values.get(name, value) for name, value in zip(names, old, strict=True)])
    return Body.of(body.name, RigidBody.from_vector(new))


def _joint(joint: Joint, parent: float, child: float) -> Joint:
    if parent == 1.0 and child == 1.0:
        return joint
    return replace(
        joint,
        parent_offset=_offset(joint.parent_offset, parent),
        child_offset=_offset(joint.child_offset, child),
        axes=tuple(_axis(axis, parent) for axis in joint.axes),
    )


def _offset(offset: Offset, factor: float) -> Offset:
    x, y, z = offset.translation
    return replace(offset, translation=(factor * x, factor * y, factor * z))


def _axis(axis: JointAxis, factor: float) -> JointAxis:
    if not grows(axis):
        return axis
    return replace(axis, functions=joined([*axis.functions, polynomial(0.0, factor)]))


def _marker(marker: Marker, values: Mapping[str, float]) -> Marker:
    place: Vector = (
        float(values.get(f"marker/{marker.name}/x", marker.location[0])),
        float(values.get(f"marker/{marker.name}/y", marker.location[1])),
        float(values.get(f"marker/{marker.name}/z", marker.location[2])),
    )
    return replace(marker, location=place)
