"""The simulator's trees in Pinocchio and by their momentum, and a spatial body through the simulator's own classes."""

from __future__ import annotations

from collections.abc import Mapping
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from dynakin.simulation.bodies.body import Contact, SimulatedBody
from dynakin.simulation.bodies.markers import Site
from dynakin.simulation.bodies.subject import (
    LUMBAR_DIRECTION,
    T12_ON_TORSO,
    SimulatedSubject,
    affine,
    draw_subject,
    mass_com_inertia,
    symmetric,
)
from dynakin.simulation.mechanics import Axis, Motion, Segment, SegmentMotion, kinematics
from dynakin.simulation.output import SimulatedTrial

Array = NDArray[np.float64]
UP = np.array([0.0, 1.0, 0.0])
X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


def motion_of(trial: SimulatedTrial, every: int = 1) -> Motion:
    """The true motion in every so many frames."""
    data = trial.truth.data.isel(time=slice(0, None, every))
    names = tuple(str(n) for n in data["coordinate"].values)
    return Motion(names, data["coordinates"].values, data["speeds"].values, data["accelerations"].values)


def wrench_of_momentum(tree: tuple[Segment, ...], poses: Mapping[str, SegmentMotion], step_s: float) -> Array:
    """What the outside gives, (T, 6) N and N m about the ground origin: the rate of linear and angular momentum less
    the weight, from poses alone: neither velocities nor accelerations of the simulator go into it."""
    momentum, weight = 0.0, 0.0
    for s in tree:
        c, R = poses[s.name].point(s.com), poses[s.name].rotation
        p = s.mass * np.gradient(c, step_s, axis=0)
        rate = np.gradient(R, step_s, axis=0) @ np.swapaxes(R, 1, 2)
        omega = np.stack([rate[:, 2, 1], rate[:, 0, 2], rate[:, 1, 0]], axis=1)
        spin = (R @ s.inertia @ np.swapaxes(R, 1, 2) @ omega[:, :, None])[:, :, 0]
        force = np.tile([0.0, -9.80665 * s.mass, 0.0], (len(c), 1))
        momentum = momentum + np.hstack([p, np.cross(c, p) + spin])
        weight = weight + np.hstack([force, np.cross(c, force)])
    return np.asarray(np.gradient(momentum, step_s, axis=0) - weight)


def inverse_dynamics(
    pin: ModuleType, tree: tuple[Segment, ...], motion: Motion, outside: Mapping[str, Array] | None = None
) -> Array:
    """Pinocchio's moments (T, n) in the order of the motion; ``outside``: wrenches (T, 6) about the ground origin."""
    model = pin.Model()
    joint_of: dict[str, int] = {}
    model.gravity.linear = np.array([0.0, -9.80665, 0.0])
    for segment in tree:
        joint = 0 if segment.parent is None else joint_of[segment.parent]
        place = pin.SE3(np.eye(3), segment.placement)
        for axis in segment.axes:
            kind = pin.JointModelPrismaticUnaligned if axis.translation else pin.JointModelRevoluteUnaligned
            joint = model.addJoint(joint, kind(np.array(axis.direction)), place, axis.coordinate)
            place = pin.SE3.Identity()
        model.appendBodyToJoint(joint, pin.Inertia(segment.mass, segment.com, segment.inertia), pin.SE3.Identity())
        joint_of[segment.name] = joint
    order = [motion.names.index(name) for name in list(model.names)[1:]]
    data, moving = model.createData(), kinematics(tree, motion)
    result = np.empty_like(motion.q)
    for t in range(len(motion.q)):
        forces = pin.StdVec_Force()
        forces.extend([pin.Force.Zero() for _ in range(model.njoints)])
        for name, wrench in (outside or {}).items():
            body, (f, m) = moving.segments[name], np.split(wrench[t], 2)
            R, o = body.rotation[t], body.origin[t]
            forces[joint_of[name]] = pin.Force(R.T @ f, R.T @ (m - np.cross(o, f)))
        result[t, order] = pin.rnea(model, data, motion.q[t, order], motion.qd[t, order], motion.qdd[t, order], forces)
    return result


def waving(names: tuple[str, ...], middle: Mapping[str, float], size: float = 0.12):
    """A motion as a function of time: each coordinate a sinusoid of its own about its middle."""

    def at(time: Array) -> Motion:
        k = np.arange(len(names))
        a = size * (0.5 + 0.5 * np.cos(3.0 * k)) * np.array([0.3 if "_t" in n else 1.0 for n in names])
        w, p = 1.5 + 0.7 * np.sin(5.0 * k), 2.0 * k
        angle = time[:, None] * w + p
        rest = np.array([middle.get(n, 0.0) for n in names])
        return Motion(names, rest + a * np.sin(angle), a * w * np.cos(angle), -a * w**2 * np.sin(angle))

    return at


def spatial_body(seed: int = 0) -> SimulatedBody:
    """A whole body from the table's parts: free pelvis, two legs, trunk, two arms; 29 coordinates, feet apart."""
    subject = draw_subject(np.random.default_rng(seed), 64.0, 1.70, "female")
    L = subject.lengths
    pelvis_place = (L["shank"] + L["thigh"] + 0.07) * UP
    free = [Axis(f"pelvis_t{n}", d, translation=True) for n, d in zip("xyz", (X, Y, Z), strict=True)]
    free += [Axis(f"pelvis_{n}", d) for n, d in (("tilt", Z), ("list", X), ("rotation", Y))]
    neck = L["torso"] * UP
    trunk = symmetric(
        subject.placed("abdomen", T12_ON_TORSO * neck) + subject.placed("thorax", neck) + subject.placed("head", neck)
    )
    tree = [
        _segment(
            "pelvis", None, pelvis_place, free, symmetric(subject.placed("pelvis", L["pelvis"] * LUMBAR_DIRECTION))
        ),
        _segment(
            "trunk", "pelvis", L["pelvis"] * LUMBAR_DIRECTION, _turns("lumbar", "extension bending rotation"), trunk
        ),
    ]
    sites = [_site("pelvis", "pelvis", "hip_flexion_r", [0.10, 0.08, z]) for z in (-0.12, 0.12)] + [
        _site("trunk", "trunk", "lumbar_extension", [0.08, 0.30, 0.02])
    ]
    feet: list[Contact] = []
    for side, sign in (("r", 1.0), ("l", -1.0)):
        tree += _limbs(subject, side, sign)
        drivers = {"thigh": "knee", "shank": "knee", "foot": "ankle", "upper_arm": "elbow", "forearm": "elbow"}
        for name, joint in drivers.items():
            for k, place in enumerate(([0.04, -0.10, 0.05], [-0.03, -0.20, 0.04], [0.05, -0.05, -0.02])):
                region = {"upper_arm": "arm", "foot": "forefoot"}.get(name, name)
                sites.append(_site(f"{name}_{side}", region, f"{joint}_{side}", place, k))
        word = "right" if side == "r" else "left"
        feet.append(
            Contact(f"{word} foot", f"plate {len(feet) + 1}", f"foot_{side}", np.array([0.05, 0.0, 0.15 * sign]))
        )
    return SimulatedBody(
        name="spatial",
        subject=subject,
        tree=tuple(tree),
        sites=tuple(sites),
        feet=tuple(feet),
        lengths={name: L[name] for name in ("shank", "thigh", "upper_arm")},
        joint_centres={"knee_r": ("shank_r", np.zeros(3)), "knee_l": ("shank_l", np.zeros(3))},
        full_change={axis.coordinate: 1.6 for segment in tree for axis in segment.axes},
    )


def _segment(name: str, parent: str | None, place: Array, axes: list[Axis], J: Array) -> Segment:
    return Segment(name, parent, place, tuple(axes), *mass_com_inertia(J))


def _turns(stem: str, words: str, side: str = "") -> list[Axis]:
    directions = zip(words.split(), (Z, X, Y), strict=False)
    return [Axis(f"{stem}_{word}{side}", direction) for word, direction in directions]


def _limbs(subject: SimulatedSubject, side: str, sign: float) -> list[Segment]:
    L, mirror = subject.lengths, np.diag([1.0, 1.0, sign])
    part = {name: affine(J, stretch=mirror) for name, J in subject.parts.items()}
    hip = 0.5 * sign * L["hip_width"] * np.array(Z)
    shoulder = L["trunk"] * UP + 0.5 * sign * L["shoulder_width"] * np.array(Z)
    three = "flexion adduction rotation"
    forearm = part["forearm"] + affine(part["hand"], shift=-L["forearm"] * UP)
    return [
        _segment(f"thigh_{side}", "pelvis", hip, _turns("hip", three, f"_{side}"), part["thigh"]),
        _segment(
            f"shank_{side}", f"thigh_{side}", -L["thigh"] * UP, [Axis(f"knee_{side}", (0.0, 0.0, -1.0))], part["shank"]
        ),
        _segment(
            f"foot_{side}",
            f"shank_{side}",
            -L["shank"] * UP,
            [Axis(f"ankle_{side}", Z), Axis(f"subtalar_{side}", X)],
            part["foot"],
        ),
        _segment(f"upper_arm_{side}", "trunk", shoulder, _turns("arm", three, f"_{side}"), part["upper_arm"]),
        _segment(f"forearm_{side}", f"upper_arm_{side}", -L["upper_arm"] * UP, [Axis(f"elbow_{side}", Z)], forearm),
    ]


def _site(segment: str, region: str, driver: str, place: list[float], number: int = 0) -> Site:
    name = f"{segment}_{number}{'+' if place[2] > 0 else '-'}"
    return Site(name, segment, region, np.array(place), landmark=number == 1, driver=driver)
