"""The same tree in Pinocchio: one joint an axis, whose position, speed and acceleration are s, sd, sdd.

A free-flyer that stays at rest in the ground carries the whole tree, so that its generalised force is the
total external wrench about the ground's origin.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from support.oracle.functions import axis_function
from support.oracle.state import Values

try:
    import pinocchio as pin
except ImportError as error:  # pragma: no cover
    pytest.skip(f"Pinocchio (package `pin`) cannot be imported: {error}", allow_module_level=True)


def _inertia(ten: NDArray) -> Any:
    mass, first = ten[0], ten[1:4]
    xx, yy, zz, xy, xz, yz = ten[4:]
    about_origin = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    c = first / mass
    return pin.Inertia(mass, c, about_origin - mass * (c @ c * np.eye(3) - np.outer(c, c)))


def _joint(kind: str, direction: NDArray) -> Any:
    if kind == "rotation":
        for k, joint in enumerate((pin.JointModelRX, pin.JointModelRY, pin.JointModelRZ)):
            if np.array_equal(direction, np.eye(3)[k]):
                return joint()
        return pin.JointModelRevoluteUnaligned(direction)
    return pin.JointModelPrismaticUnaligned(direction)


def solve(spec: Any, values: Values, external: NDArray | None = None) -> dict[str, NDArray]:
    """Poses, marker positions, total wrench, joint moments and loads, energy and centre of mass, all from Pinocchio.

    external: (S, 6) wrenches on the segments about the ground's origin, which ``rnea`` takes off moments and loads.
    """
    model = pin.Model()
    model.gravity = pin.Motion(np.asarray(spec.gravity, float), np.zeros(3))
    base = model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "base")
    coordinate = {c.name: i for i, c in enumerate(spec.coordinates)}
    joint_of, place_of = {"ground": base}, {"ground": pin.SE3.Identity()}
    position, speed, acceleration = [*np.zeros(6), 1.0], [*np.zeros(6)], [*np.zeros(6)]
    slopes: list[tuple[int, float]] = []
    for k, segment in enumerate(spec.segments):
        offset = np.array(segment.translation, float)
        for term in segment.lengths:
            offset = offset + np.asarray(term.direction) * values.parameters[term.parameter]
        joint = joint_of[segment.parent]
        place = place_of[segment.parent] * pin.SE3(np.array(segment.rotation, float), offset)
        for i, axis in enumerate(segment.axes):
            c = coordinate[axis.coordinate]
            scale = values.parameters[axis.scale] if axis.scale else 1.0
            s, first, second = axis_function(axis, values.q[c], scale)
            name = f"{segment.name}/{i}"
            joint = model.addJoint(joint, _joint(axis.kind, np.array(axis.direction, float)), place, name)
            place = pin.SE3.Identity()
            position.append(s)
            speed.append(first * values.qd[c])
            acceleration.append(first * values.qdd[c] + second * values.qd[c] ** 2)
            slopes.append((c, first))
        joint_of[segment.name], place_of[segment.name] = joint, place
        model.appendBodyToJoint(joint, _inertia(values.inertia[k]), place)
    data = model.createData()
    pin.forwardKinematics(model, data, np.array(position))
    applied = [pin.Force.Zero() for _ in range(model.njoints)]
    for segment, wrench in zip(spec.segments, [] if external is None else external, strict=external is not None):
        joint = joint_of[segment.name]
        applied[joint] += data.oMi[joint].actInv(pin.Force(np.array(wrench, float)))
    tau = pin.rnea(model, data, np.array(position), np.array(speed), np.array(acceleration), applied)
    origin_loads = [data.oMi[j].act(data.f[j]) for j in range(model.njoints)]
    poses = [data.oMi[joint_of[s.name]] * place_of[s.name] for s in spec.segments]
    names = [s.name for s in spec.segments]
    moments = np.zeros(len(spec.coordinates))
    for (c, slope), force in zip(slopes, tau[6:], strict=True):
        moments[c] += slope * force
    return {
        "rotations": np.array([p.rotation for p in poses]),
        "origins": np.array([p.translation for p in poses]),
        "markers": np.array(
            [
                poses[names.index(m.segment)].act(values.markers[i] + values.soft_tissue[i])
                for i, m in enumerate(spec.markers)
            ]
        ),
        "wrench": tau[:6].copy(),
        "moments": moments,
        # A force of the joint's first axis is that of all its axes: they have no mass between them.
        "loads": np.array([origin_loads[joint_of[s.name]].vector for s in spec.segments]),
        "energy": np.array(
            pin.computeKineticEnergy(model, data, np.array(position), np.array(speed))
            + pin.computePotentialEnergy(model, data, np.array(position))
        ),
        "mass_centre": pin.centerOfMass(model, data, np.array(position), np.array(speed), False).copy(),
        "mass_centre_velocity": data.vcom[0].copy(),
    }
