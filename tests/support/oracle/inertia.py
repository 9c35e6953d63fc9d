"""Whether ten numbers are the inertia of some body: its mass and its principal moments about the centre of mass.

A rigid body exists with them exactly if the mass is positive and none of the principal moments about the centre of
mass exceeds the sum of the other two (Traversaro et al. 2016). In the plane one moment is left, and it is positive.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from support.oracle.mechanics import inertia_tensor
from support.oracle.state import Layout, unpack


def central_moments(phi: NDArray) -> NDArray:
    """Principal moments (3,) about the centre of mass, in increasing order."""
    mass, first = phi[0], phi[1:4]
    steiner = (first @ first * np.eye(3) - np.outer(first, first)) / mass
    return np.linalg.eigvalsh(inertia_tensor(phi) - steiner)


def possible(phi: NDArray, planar: bool) -> bool:
    if not phi[0] > 0:
        return False
    if planar:
        return bool(phi[6] - (phi[1] ** 2 + phi[2] ** 2) / phi[0] > 0)
    a, b, c = central_moments(phi)
    return bool(a > 0 and a + b - c > 0)


def is_planar(spec: Any) -> bool:
    """Nothing out of the plane is measured."""
    return not any(spec.wrench_measured[2:5])


def all_possible(layout: Layout, x: NDArray) -> bool:
    """Of each segment of which something is estimated."""
    bodies = unpack(layout, x).inertia
    estimated = [any(s.inertia_estimated) for s in layout.spec.segments]
    planar = is_planar(layout.spec)
    return all(possible(phi, planar) for phi, judged in zip(bodies, estimated, strict=True) if judged)
