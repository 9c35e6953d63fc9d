"""Rigid-body inertia about the origin of a frame, and the maps that carry a table's entry into a model's
segment.

The ten numbers are mass, first moment (m c) and tensor entries about the ORIGIN of the frame.
The three maps of the table into the planar chain are ``rotated``, ``moved`` and lumping (``mirrored``
and ``+``).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from dynakin.arrays import Array

INERTIA_NAMES = ("mass", "mx", "my", "mz", "ixx", "iyy", "izz", "ixy", "ixz", "iyz")
PLANAR_INERTIA = frozenset({"mass", "mx", "my", "izz"})
"""The four numbers that a motion in the sagittal plane depends on."""


def inertia_from(values: Mapping[str, float], owner: str, otherwise: Sequence[float] | Array) -> Array:
    """The ten numbers (10,) of a segment, SI, by their names in the state; those that ``values`` lacks as otherwise."""
    named = zip(INERTIA_NAMES, otherwise, strict=True)
    return np.array([values.get(f"inertia/{owner}/{name}", float(number)) for name, number in named])


def _shift(vector: Array) -> Array:
    """The tensor (3, 3) |v|^2 1 - v v' of a unit point mass at v."""
    return np.asarray(np.dot(vector, vector) * np.eye(3) - np.outer(vector, vector))


@dataclass(frozen=True, eq=False)
class RigidBody:
    """Mass (kg), first moment (3,) kg m and inertia tensor (3, 3) kg m^2, both about the origin of the
    frame."""

    mass: float
    first_moment: Array
    inertia: Array

    @classmethod
    def from_centre(cls, mass: float, centre: npt.ArrayLike, inertia_at_centre: npt.ArrayLike) -> RigidBody:
        """From the centre of mass (3,) m and the tensor (3, 3) kg m^2 about it."""
        c = np.asarray(centre, dtype=float)
        return cls(float(mass), mass * c, np.asarray(inertia_at_centre, dtype=float) + mass * _shift(c))

    @classmethod
    def nothing(cls) -> RigidBody:
        """A body without mass."""
        return cls(0.0, np.zeros(3), np.zeros((3, 3)))

    @classmethod
    def from_vector(cls, vector: npt.ArrayLike) -> RigidBody:
        """From the ten numbers in the order of ``INERTIA_NAMES``."""
        m, mx, my, mz, ixx, iyy, izz, ixy, ixz, iyz = np.asarray(vector, dtype=float)
        tensor = np.array([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]])
        return cls(float(m), np.array([mx, my, mz]), tensor)

    @property
    def vector(self) -> Array:
        """The ten numbers (10,) in the order of ``INERTIA_NAMES``."""
        i = self.inertia
        return np.array([self.mass, *self.first_moment, i[0, 0], i[1, 1], i[2, 2], i[0, 1], i[0, 2], i[1, 2]])

    @property
    def centre(self) -> Array:
        """Centre of mass (3,) m."""
        return self.first_moment / self.mass

    @property
    def spread(self) -> Array:
        """Covariance (3, 3) m^2 of where its mass lies, about the centre of mass."""
        return np.asarray(self.pseudo_inertia[:3, :3] / self.mass - np.outer(self.centre, self.centre))

    def rotated(self, R_SB: Array) -> RigidBody:
        """Map 1: the same body with its numbers along the axes of frame S; ``R_SB`` turns B's vectors into
        S's."""
        return RigidBody(self.mass, R_SB @ self.first_moment, R_SB @ self.inertia @ R_SB.T)

    def moved(self, p_SB: npt.ArrayLike) -> RigidBody:
        """Map 2: about the origin of S, in which the present origin lies at ``p_SB`` (3,) m (parallel
        axes)."""
        p = np.asarray(p_SB, dtype=float)
        cross = np.dot(p, self.first_moment) * 2.0 * np.eye(3)
        cross -= np.outer(p, self.first_moment) + np.outer(self.first_moment, p)
        return RigidBody(self.mass, self.first_moment + self.mass * p, self.inertia + cross + self.mass * _shift(p))

    def mirrored(self) -> RigidBody:
        """Map 3a: the body on the other side: z of the centre and the xz and yz entries change sign."""
        mirror = np.diag([1.0, 1.0, -1.0])
        return RigidBody(self.mass, mirror @ self.first_moment, mirror @ self.inertia @ mirror)

    def __add__(self, other: RigidBody) -> RigidBody:
        """Map 3b: two rigid bodies of one frame joined rigidly."""
        return RigidBody(self.mass + other.mass, self.first_moment + other.first_moment, self.inertia + other.inertia)

    @property
    def pseudo_inertia(self) -> Array:
        """(4, 4) [[sigma, m c], [m c', m]] with sigma = tr(I)/2 1 - I; positive definite for every real
        body."""
        pseudo = np.empty((4, 4))
        pseudo[:3, :3] = 0.5 * np.trace(self.inertia) * np.eye(3) - self.inertia
        pseudo[:3, 3] = pseudo[3, :3] = self.first_moment
        pseudo[3, 3] = self.mass
        return pseudo

    def possible_in_plane(self) -> bool:
        """m > 0 and m izz > mx^2 + my^2: all that a motion in the x-y plane asks."""
        mx, my, _ = self.first_moment
        return self.mass > 0.0 and self.mass * self.inertia[2, 2] > mx**2 + my**2

    def possible(self) -> bool:
        """Whether the pseudo-inertia is positive definite (a body of positive density exists)."""
        return bool(np.linalg.eigvalsh(self.pseudo_inertia)[0] > 0.0)
