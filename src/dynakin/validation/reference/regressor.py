"""The total wrench of a planar chain as a linear function of its inertial parameters."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from dynakin.arrays import Array
from dynakin.model.inertia import RigidBody
from dynakin.simulation import mechanics
from dynakin.validation.reference.chain import Kinematics, PlanarChain

PLANAR_NAMES = ("mass", "mx", "my", "izz")


def parameter_names(chain: PlanarChain) -> tuple[str, ...]:
    """Names of phi, four a segment (kg, kg m, kg m, kg m^2), as in the filter's state: inertia/thigh/mass."""
    return tuple(f"inertia/{link.name}/{name}" for link in chain.links for name in PLANAR_NAMES)


def table_parameters(chain: PlanarChain) -> Array:
    """phi (4 S,) of the table."""
    return np.concatenate([link.body.vector[[0, 1, 2, 6]] for link in chain.links])


def parameter_scales(chain: PlanarChain) -> Array:
    """A size (4 S,) of each parameter that makes the columns of the regressor comparable: m, m r, m r, m r^2 with r
    the segment's radius of gyration about its hinge (of a massless segment: 1)."""
    sizes = []
    for link in chain.links:
        mass, inertia = link.body.mass, float(link.body.inertia[2, 2])
        radius = np.sqrt(inertia / mass) if mass > 0.0 and inertia > 0.0 else 1.0
        mass = mass if mass > 0.0 else 1.0
        sizes += [mass, mass * radius, mass * radius, mass * radius**2]
    return np.array(sizes)


def wrench_regressor(chain: PlanarChain, kinematics: Kinematics) -> Array:
    """Y (T, 3, 4 S) with [fx, fy, mz] = Y phi: ground on person, about the ground origin; NaN where a coordinate is.

    Of a segment with origin o, acceleration a of the origin, orientation R, angular speed w and acceleration e:
    f = m (a - g) + (e J - w^2) R c m, and mz = o x f + R c m x (a - g) + izz e, where J is a quarter turn; linear in
    m, m c and izz about the origin. Source: Bonnet & Venture 2015 [13], Ayusawa et al. 2013 [14], for the plane.
    """
    moving = chain.moving(kinematics)
    Y = np.zeros((len(kinematics.coordinates), 3, 4 * len(chain.links)))
    for k, link in enumerate(chain.links):
        body = moving.segments[link.name]
        o, a = body.origin[:, :2], (body.acceleration - mechanics.GRAVITY)[:, :2]
        w, e = body.omega[:, 2:], body.alpha[:, 2:]
        columns = Y[:, :, 4 * k : 4 * k + 4]
        columns[:, :2, 0] = a
        columns[:, 2, 0] = _cross(o, a)
        for i in (0, 1):  # the segment's x and y axes, in the ground frame
            u = body.rotation[:, :2, i]
            f = e * np.column_stack([-u[:, 1], u[:, 0]]) - w**2 * u
            columns[:, :2, 1 + i] = f
            columns[:, 2, 1 + i] = _cross(o, f) + _cross(u, a)
        columns[:, 2, 3] = e[:, 0]
    return Y


def _cross(a: Array, b: Array) -> Array:
    """z component of the cross product of vectors (T, 2) in the plane."""
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


# "AT" of the paper: total external wrench and joint moments from given kinematics and an anthropometric table.
#
# The Newton-Euler of `dynakin.simulation.mechanics` is used, the one NumPy implementation outside the tests; it shares
# no code with the compiled core.
IN_PLANE = (0, 1, 5)
"""fx, fy, mz among the six components: all that a planar model explains."""


@dataclass(frozen=True, eq=False)
class ChainDynamics:
    """Forces that a motion of the chain takes.

    wrench: (T, 6) ground on person about the ground origin, N and N m, NaN out of the plane; moments: (T, C) N m,
    positive where they add power along the coordinate.
    """

    wrench: Array
    moments: Array


def table_dynamics(
    chain: PlanarChain, kinematics: Kinematics, inertia: Mapping[str, RigidBody] | None = None
) -> ChainDynamics:
    """Inverse dynamics (1) of the chain with the table's inertia, or with another ``inertia``; frames with an unknown
    coordinate are NaN."""
    motion = chain.motion(kinematics)
    forces = mechanics.dynamics(chain.tree(inertia, sliding=kinematics.hinges is not None), motion)
    wrench = np.full((len(motion.q), 6), np.nan)
    wrench[:, IN_PLANE] = forces.wrench[:, IN_PLANE]
    return ChainDynamics(wrench, chain.generalised(forces.moments))
