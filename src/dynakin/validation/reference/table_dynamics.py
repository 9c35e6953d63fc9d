""" "AT" of the paper: total external wrench and joint moments from given kinematics and an anthropometric table.

The Newton-Euler of `dynakin.simulation.mechanics` is used, the one NumPy implementation outside the tests; it shares
no code with the compiled core.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from dynakin.model.inertia import RigidBody
from dynakin.simulation import mechanics
from dynakin.validation.reference.chain import Kinematics, PlanarChain

Array = npt.NDArray[np.float64]

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
    chain: PlanarChain, kinematics: Kinematics, bodies: Mapping[str, RigidBody] | None = None
) -> ChainDynamics:
    """Inverse dynamics (1) of the chain with the table's inertia, or with other ``bodies``; frames with an unknown
    coordinate are NaN."""
    motion = chain.motion(kinematics)
    forces = mechanics.dynamics(chain.tree(bodies, sliding=kinematics.hinges is not None), motion)
    wrench = np.full((len(motion.q), 6), np.nan)
    wrench[:, IN_PLANE] = forces.wrench[:, IN_PLANE]
    return ChainDynamics(wrench, chain.generalised(forces.moments))
