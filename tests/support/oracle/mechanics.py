"""Kinematics and dynamics of a tree of segments: classical Newton-Euler, every vector in the ground frame.

All functions take leading batch dimensions (written ``...``) and complex numbers: nothing conjugates or takes
an absolute value, so that a complex step through them gives derivatives to machine precision.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from support.oracle.functions import axis_function


def cross(a: NDArray, b: NDArray) -> NDArray:
    """Vector product over the last axis (never conjugates)."""
    following = np.array([1, 2, 0])
    # x y' - y x' is the z of the product, and so on: once more around for each in its place
    return (a * b.take(following, -1) - a.take(following, -1) * b).take(following, -1)


def dot(a: NDArray, b: NDArray) -> NDArray:
    """Scalar product over the last axis (never conjugates)."""
    return (a * b).sum(axis=-1)


def times(matrix: NDArray, vector: NDArray) -> NDArray:
    """Matrix (..., 3, 3) times vector (..., 3)."""
    return (matrix @ vector[..., None])[..., 0]


def axis_angle(direction: NDArray, angle: NDArray) -> NDArray:
    """Rodrigues' formula: rotation by ``angle`` (...) about the unit vector ``direction`` (3,)."""
    x, y, z = direction
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    s, c = np.sin(angle)[..., None, None], np.cos(angle)[..., None, None]
    return np.eye(3) + s * k + (1 - c) * (k @ k)


@dataclass
class Motion:
    """Pose, velocity and acceleration of a frame, in the ground frame; v and a are those of its origin."""

    R: NDArray  # (..., 3, 3)
    o: NDArray  # (..., 3) m
    w: NDArray  # (..., 3) rad/s
    v: NDArray  # (..., 3) m/s
    alpha: NDArray  # (..., 3) rad/s^2
    a: NDArray  # (..., 3) m/s^2

    def carried(self, r: NDArray) -> Motion:
        """The parallel frame fixed to the same body, its origin moved by r (ground frame)."""
        w, alpha = self.w, self.alpha
        velocity = self.v + cross(w, r)
        acceleration = self.a + cross(alpha, r) + cross(w, cross(w, r))
        return Motion(self.R, self.o + r, w, velocity, alpha, acceleration)


@dataclass
class Axis1D:
    """One axis in motion: unit direction u and a point of it (ground frame), its coordinate and ds/dq."""

    coordinate: int
    kind: str
    u: NDArray
    point: NDArray
    slope: NDArray


@dataclass
class Kinematics:
    segments: list[Motion]
    axes: list[list[Axis1D]]  # by segment
    parents: list[int]  # -1: the ground


def kinematics(spec: Any, q: NDArray, qd: NDArray, qdd: NDArray, parameters: dict[str, Any]) -> Kinematics:
    """Motion of every segment, from the root outwards. q, qd, qdd: (..., coordinates), all of them."""
    coordinate = {c.name: i for i, c in enumerate(spec.coordinates)}
    index = {s.name: i for i, s in enumerate(spec.segments)}
    batch = np.broadcast_shapes(q.shape[:-1], qd.shape[:-1], qdd.shape[:-1])
    zero = np.zeros((*batch, 3))
    ground = Motion(np.broadcast_to(np.eye(3), (*batch, 3, 3)), zero, zero, zero, zero, zero)
    motions: list[Motion] = []
    axes: list[list[Axis1D]] = []
    parents: list[int] = []
    for segment in spec.segments:
        parents.append(-1 if segment.parent == "ground" else index[segment.parent])
        parent = ground if parents[-1] < 0 else motions[parents[-1]]
        offset = np.asarray(segment.translation, float) + zero
        for term in segment.lengths:
            offset = offset + parameters[term.parameter][..., None] * np.asarray(term.direction, float)
        frame = parent.carried(times(parent.R, offset))
        frame.R = frame.R @ np.asarray(segment.rotation, float)
        axes.append([])
        for axis in segment.axes:
            j = coordinate[axis.coordinate]
            scale = parameters[axis.scale] if axis.scale else 1.0
            s, slope, curvature = axis_function(axis, q[..., j], scale)
            sd = (slope * qd[..., j])[..., None]
            sdd = (slope * qdd[..., j] + curvature * qd[..., j] ** 2)[..., None]
            direction = np.asarray(axis.direction, float)
            u = times(frame.R, direction + zero)
            axes[-1].append(Axis1D(j, axis.kind, u, frame.o, slope))
            if axis.kind == "rotation":
                frame.alpha = frame.alpha + sdd * u + cross(frame.w, sd * u)
                frame.w = frame.w + sd * u
                frame.R = frame.R @ axis_angle(direction, s)
            else:
                coriolis = 2 * cross(frame.w, sd * u)
                frame = frame.carried(s[..., None] * u)
                frame.v = frame.v + sd * u
                frame.a = frame.a + sdd * u + coriolis
        motions.append(frame)
    return Kinematics(motions, axes, parents)


def marker_positions(spec: Any, kin: Kinematics, positions: NDArray) -> NDArray:
    """(..., M, 3) m, ground frame, from the positions (..., M, 3) in the segments' frames."""
    index = {s.name: i for i, s in enumerate(spec.segments)}
    found = []
    for k, marker in enumerate(spec.markers):
        body = kin.segments[index[marker.segment]]
        found.append(body.o + times(body.R, positions[..., k, :]))
    if not found:
        return np.zeros((*positions.shape[:-2], 0, 3))
    return np.stack(found, axis=-2)


def inertia_tensor(inertia: NDArray) -> NDArray:
    """(..., 3, 3) tensor about the segment's origin from the ten numbers (..., 10)."""
    xx, yy, zz, xy, xz, yz = (inertia[..., k] for k in range(4, 10))
    rows = [np.stack(r, -1) for r in ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))]
    return np.stack(rows, -2)


def segment_wrenches(spec: Any, kin: Kinematics, inertia: NDArray) -> list[tuple[NDArray, NDArray]]:
    """Force, and moment about the ground's origin, that each segment needs for its motion in gravity.

    Newton: F = m (a_o - g) + alpha x mc + w x (w x mc).
    Euler about the segment's origin o: M_o = I_o alpha + w x I_o w + mc x (a_o - g).
    About the ground's origin: M_o + o x F.
    """
    gravity = np.asarray(spec.gravity, float)
    result = []
    for k, body in enumerate(kin.segments):
        mass = inertia[..., k, 0, None]
        first = times(body.R, inertia[..., k, 1:4])
        tensor = body.R @ inertia_tensor(inertia[..., k, :]) @ np.swapaxes(body.R, -1, -2)
        pull = body.a - gravity
        w, alpha = body.w, body.alpha
        force = mass * pull + cross(alpha, first) + cross(w, cross(w, first))
        moment = times(tensor, alpha) + cross(w, times(tensor, w)) + cross(first, pull)
        result.append((force, moment + cross(body.o, force)))
    return result


def total_wrench(spec: Any, kin: Kinematics, inertia: NDArray) -> NDArray:
    """Ground on person, [force, moment about the ground's origin], (..., 6) N, N m."""
    zero = np.zeros((*inertia.shape[:-2], 3))
    wrenches = segment_wrenches(spec, kin, inertia)
    force = sum((f for f, _ in wrenches), zero)
    moment = sum((m for _, m in wrenches), zero)
    return np.concatenate([force, moment], axis=-1)


def joint_moments(spec: Any, kin: Kinematics, inertia: NDArray) -> NDArray:
    """Generalised force of every coordinate, (..., coordinates): S_j' times the sum over the subtree (1)."""
    wrenches = segment_wrenches(spec, kin, inertia)
    subtree: list[tuple[NDArray, NDArray]] = []
    for k in range(len(spec.segments)):
        members = [i for i in range(len(spec.segments)) if _hangs_from(kin.parents, i, k)]
        subtree.append((sum(wrenches[i][0] for i in members), sum(wrenches[i][1] for i in members)))
    batch = inertia.shape[:-2]
    dtype = np.result_type(inertia, *[b.a for b in kin.segments])
    result = np.zeros((*batch, len(spec.coordinates)), dtype=dtype)
    for (force, moment), chain in zip(subtree, kin.axes, strict=True):
        for axis in chain:
            turning = axis.kind == "rotation"
            effort = moment - cross(axis.point, force) if turning else force
            result[..., axis.coordinate] += axis.slope * dot(axis.u, effort)
    return result


def _hangs_from(parents: list[int], segment: int, ancestor: int) -> bool:
    while segment >= 0:
        if segment == ancestor:
            return True
        segment = parents[segment]
    return False
