"""Exact mechanics of a tree of rigid segments, for all frames of a motion at once.

Written with ordinary vectors (angular velocity, acceleration of a point, Newton's and Euler's laws about the
centre of mass), not with the spatial algebra of the compiled core, and sharing no code with it: what the
filter is judged against must not repeat the filter's mistakes. Planar and spatial trees are the same code.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from dynakin.arrays import Array, cross

GRAVITY = np.array([0.0, -9.80665, 0.0])  # m/s^2, ground frame: X forward, Y up, Z right


@dataclass(frozen=True)
class Axis:
    """One degree of freedom of a joint: a rotation (rad) about, or a translation (m) along, a fixed
    direction."""

    coordinate: str
    direction: tuple[float, float, float]
    translation: bool = False


@dataclass(frozen=True)
class Segment:
    """A rigid body that hangs on its parent by a chain of axes.

    placement: (3,) m, the joint in the parent's frame; com: (3,) m and inertia: (3, 3) kg m^2 about the
    centre of mass, both in the segment's own frame, whose origin is the joint.
    """

    name: str
    parent: str | None
    placement: Array
    axes: tuple[Axis, ...]
    mass: float
    com: Array
    inertia: Array


@dataclass(frozen=True)
class Motion:
    """Coordinates over time: names, and q, qd, qdd of shape (T, n) in rad or m, and per s, per s^2."""

    names: tuple[str, ...]
    q: Array
    qd: Array
    qdd: Array


@dataclass
class SegmentMotion:
    """Pose and motion of a segment in the ground frame: rotation R_GB (T, 3, 3); origin, its velocity and
    acceleration, the angular velocity and angular acceleration, each (T, 3)."""

    rotation: Array
    origin: Array
    velocity: Array
    acceleration: Array
    omega: Array
    alpha: Array

    def point(self, p_B: Array) -> Array:
        """Position in the ground frame (T, 3) of a point given in the segment's frame (3,)."""
        return self.origin + self.rotation @ p_B

    def point_velocity(self, p_B: Array) -> Array:
        """Velocity (T, 3) of a point fixed in the segment."""
        return self.velocity + cross(self.omega, self.rotation @ p_B)

    def point_acceleration(self, p_B: Array) -> Array:
        """Acceleration (T, 3) of a point fixed in the segment."""
        r = self.rotation @ p_B
        return self.acceleration + cross(self.alpha, r) + cross(self.omega, cross(self.omega, r))


@dataclass
class TreeMotion:
    """Motion of every segment, and of every axis (segment name, place in its chain): direction and a point of
    it, (T, 3)."""

    segments: dict[str, SegmentMotion] = field(default_factory=dict)
    axes: dict[tuple[str, int], tuple[Array, Array]] = field(default_factory=dict)


def kinematics(tree: Sequence[Segment], motion: Motion) -> TreeMotion:
    """Poses, velocities and accelerations of all segments; parents must stand before their children."""
    result = at_rest(tree, motion.names, motion.q)
    for segment in tree:
        own = result.segments[segment.name]
        velocity, acceleration, omega, alpha = own.velocity, own.acceleration, own.omega, own.alpha
        if segment.parent is not None:
            parent = result.segments[segment.parent]
            velocity, omega = parent.point_velocity(segment.placement), parent.omega
            acceleration, alpha = parent.point_acceleration(segment.placement), parent.alpha
        for k, axis in enumerate(segment.axes):
            j = motion.names.index(axis.coordinate)
            u, _ = result.axes[segment.name, k]
            qd, qdd = motion.qd[:, j, None], motion.qdd[:, j, None]
            if axis.translation:
                d = u * motion.q[:, j, None]
                velocity = velocity + cross(omega, d) + u * qd
                acceleration = (
                    acceleration
                    + cross(alpha, d)
                    + cross(omega, cross(omega, d))
                    + 2.0 * cross(omega, u * qd)
                    + u * qdd
                )
            else:
                omega, alpha = omega + u * qd, alpha + u * qdd + cross(omega, u * qd)
        own.velocity, own.acceleration, own.omega, own.alpha = velocity, acceleration, omega, alpha
    return result


def at_rest(tree: Sequence[Segment], names: tuple[str, ...], q: Array) -> TreeMotion:
    """Poses of all segments in postures ``q`` (T, n) in which nothing moves."""
    frames = q.shape[0]
    zero = np.zeros((frames, 3))
    result = TreeMotion()
    for segment in tree:
        if segment.parent is None:
            rotation, origin = np.tile(np.eye(3), (frames, 1, 1)), np.tile(segment.placement, (frames, 1))
        else:
            parent = result.segments[segment.parent]
            rotation, origin = parent.rotation, parent.point(segment.placement)
        for k, axis in enumerate(segment.axes):
            direction, angle = np.asarray(axis.direction, dtype=float), q[:, names.index(axis.coordinate)]
            u = rotation @ direction
            result.axes[segment.name, k] = (u, origin)
            if axis.translation:
                origin = origin + u * angle[:, None]
            else:
                rotation = rotation @ rotation_about(direction, angle)
        result.segments[segment.name] = SegmentMotion(rotation, origin, zero, zero, zero, zero)
    return result


def rotation_about(direction: Array, angle: Array) -> Array:
    """Rotation matrices (T, 3, 3) about a fixed unit direction by angles (T,) in rad (Rodrigues' formula)."""
    x, y, z = direction
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    s, c = np.sin(angle)[:, None, None], np.cos(angle)[:, None, None]
    return np.asarray(np.eye(3) + s * K + (1.0 - c) * (K @ K))


@dataclass(frozen=True)
class Dynamics:
    """Forces that a motion takes.

    wrench: (T, 6) [fx, fy, fz, mx, my, mz], ground on person, about the ground origin, N and N m;
    moments: (T, n), the generalised force of each coordinate, N m or N, positive when it adds power along the
    coordinate; kinetic, potential: (T,) J.
    """

    wrench: Array
    moments: Array
    kinetic: Array
    potential: Array


def dynamics(
    tree: Sequence[Segment],
    motion: Motion,
    moving: TreeMotion | None = None,
    external: Mapping[str, Array] | None = None,
) -> Dynamics:
    """Newton's and Euler's laws, segment by segment, then the moment of all that hangs on a joint about its
    axis.

    external: wrenches (T, 6) from outside on segments, by name, about the ground origin. A joint need not
    supply what they do, so moments are less by them; the wrench stays the sum of all that acts on the person.
    Where none is given everything comes through the root.
    """
    moving = moving or kinematics(tree, motion)
    frames = motion.q.shape[0]
    # Force and moment about the ground origin, of a segment and what hangs on it.
    load: dict[str, tuple[Array, Array]] = {}
    kinetic, potential = np.zeros(frames), np.zeros(frames)
    for segment in tree:
        body = moving.segments[segment.name]
        c = body.point(segment.com)
        v = body.point_velocity(segment.com)
        inertia_G = body.rotation @ segment.inertia @ np.swapaxes(body.rotation, 1, 2)
        spin = (inertia_G @ body.omega[:, :, None])[:, :, 0]
        force = segment.mass * (body.point_acceleration(segment.com) - GRAVITY)
        moment = cross(c, force) + (inertia_G @ body.alpha[:, :, None])[:, :, 0] + cross(body.omega, spin)
        load[segment.name] = (force, moment)
        if external and segment.name in external:
            given = external[segment.name]
            load[segment.name] = (force - given[:, :3], moment - given[:, 3:])
        kinetic += 0.5 * (segment.mass * np.sum(v * v, axis=1) + np.sum(body.omega * spin, axis=1))
        potential -= segment.mass * (c @ GRAVITY)
    total_force, total_moment = np.zeros((frames, 3)), np.zeros((frames, 3))
    moments = np.zeros_like(motion.q)
    for segment in reversed(tree):
        force, moment = load[segment.name]
        for k, axis in enumerate(segment.axes):
            u, point = moving.axes[segment.name, k]
            effort = force if axis.translation else moment - cross(point, force)
            # += because one coordinate may drive several axes
            moments[:, motion.names.index(axis.coordinate)] += np.sum(u * effort, axis=1)
        if segment.parent is None:
            total_force, total_moment = total_force + force, total_moment + moment
        else:
            above = load[segment.parent]
            load[segment.parent] = (above[0] + force, above[1] + moment)
    wrench = np.hstack([total_force, total_moment])
    for given in (external or {}).values():
        wrench = wrench + given
    return Dynamics(wrench, moments, kinetic, potential)
