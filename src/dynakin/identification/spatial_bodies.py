"""Inertial parameters of segments in space in coordinates in which every value is a possible body.

A segment's mass density has a mean, the centre of mass c, and a covariance per kilogram S; the pseudo-inertia is
m [[S + c c', c], [c', 1]], so any m > 0, any c and any positive definite S is a body of positive density, and nothing
else is. Deviations from the table (Rucker and Wensing 2022, Smooth parameterization of rigid-body inertia, whose
log-Cholesky numbers these are, with the centre in metres and the mass held in a sum):

    m_i = M m0_i exp(a_i) / sum_j m0_j exp(a_j),   c = c0 + (cx, cy, cz),   S = A B B' A',   A A' = S0,
    B = [[exp d1, s12, s13], [0, exp d2, s23], [0, 0, exp d3]].

About the table the entropic (affine-invariant) metric of S (Lee and Park 2018) is 2 |d|^2 + |s|^2, so a prior that is
round in it has standard deviations in the ratio 1 : sqrt(2).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from dynakin.errors import ModelError
from dynakin.identification.body_priors import BodyPriors, masses_of, paired_with
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.model.inertia import INERTIA_NAMES, RigidBody

Array = npt.NDArray[np.float64]

PARTS = ("a", "cx", "cy", "cz", "d1", "d2", "d3", "s12", "s13", "s23")
_MIRROR = np.array([1.0, 1.0, 1.0, -1.0, 1.0, 1.0, 1.0, 1.0, -1.0, -1.0])  # z of the centre, and products with z
_UPPER = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))  # of B, in the order of PARTS
_ROD = np.sqrt(12.0)  # length of a rod over its radius of gyration


@dataclass(frozen=True, eq=False)
class SpatialBodies:
    """phi (10 S,) as a function of u (10 G,): G segments or pairs of a right and a left one, which share u.

    Attributes:
        segments: S names. total: kg. mass, centre: (S,) kg, (S, 3) m of the table. root: (S, 3, 3) m, upper
            triangular A. sd: (10 G,) prior standard deviations of u. tie: (10 S, 10 G) from u to each segment's own.
        apart: (10 S,) standard deviations by which a segment of a pair may differ from what both share.
        unknowns: (10 G,) names of u.
    """

    segments: tuple[str, ...]
    total: float
    mass: Array
    centre: Array
    root: Array
    sd: Array
    tie: Array
    apart: Array
    unknowns: tuple[str, ...]

    @classmethod
    def of(cls, initial: CalibratedModel, priors: BodyPriors | None = None) -> SpatialBodies:
        """The bodies that a measured model estimates with all ten numbers; those that are held keep their mass.

        Raises:
            ModelError: a body of the table is not possible.
        """
        chosen = [segment for segment in initial.spec.segments if any(segment.inertia_estimated)]
        held = sum(float(s.inertia[0]) for s in initial.spec.segments if not any(s.inertia_estimated))
        tables = [RigidBody.from_vector(segment.inertia) for segment in chosen]
        for segment, body in zip(chosen, tables, strict=True):
            if not body.possible():
                raise ModelError(
                    f"model {initial.spec.name}: the inertia of segment {segment.name} is that of no body (its "
                    "pseudo-inertia is not positive definite), expected one that a prior can stand about"
                )
        names = tuple(segment.name for segment in chosen)
        mass = np.array([body.mass for body in tables])
        centre = np.array([body.centre for body in tables])
        spread = np.array([body.pseudo_inertia[:3, :3] / body.mass for body in tables])
        spread -= centre[:, :, None] * centre[:, None, :]
        return cls.about(names, initial.weighed_kg - held, mass, centre, _upper(spread), priors or BodyPriors())

    @classmethod
    def about(
        cls, names: tuple[str, ...], total: float, mass: Array, centre: Array, root: Array, priors: BodyPriors
    ) -> SpatialBodies:
        """About a table: arguments as the attributes."""
        length = _ROD * np.sqrt(np.linalg.norm(root @ root.swapaxes(1, 2), ord=2, axis=(1, 2)))
        own = np.empty((len(names), len(PARTS)))
        own[:, 0] = priors.log_mass
        own[:, 1:4] = (priors.centre_fraction * length)[:, None]
        own[:, 4:7] = priors.log_gyration
        own[:, 7:] = np.sqrt(2.0) * priors.log_gyration
        first = [names.index(paired_with(name, names) or name) for name in names]
        group = [k for k in range(len(names)) if first[k] == k]
        tie = np.zeros((len(names), len(PARTS), len(group), len(PARTS)))
        at = np.arange(len(PARTS))
        paired = np.array([first.count(first[k]) == 2 for k in range(len(names))])
        for k in range(len(names)):
            tie[k, at, group.index(first[k]), at] = 1.0 if first[k] == k else _MIRROR
        words = [names[k].removesuffix("_r") if paired[k] else names[k] for k in group]
        return cls(
            names,
            total,
            mass,
            centre,
            root,
            own[group].ravel(),
            tie.reshape(own.size, -1),
            (priors.sides_apart * own * paired[:, None]).ravel(),
            tuple(f"body/{word}/{part}" for word in words for part in PARTS),
        )

    @property
    def names(self) -> tuple[str, ...]:
        """(10 S,) names of phi in the filter's state."""
        return tuple(f"inertia/{segment}/{name}" for segment in self.segments for name in INERTIA_NAMES)

    def phi(self, u: Array) -> Array:
        """(10 S,) kg, kg m (3), kg m^2 (6) a segment, about the segment's origin."""
        m, c, B = self._split(self.tie @ u)
        return np.asarray((m[:, None] * _per_kilogram(c, _covariance(self.root, B))).ravel())

    def jacobian(self, u: Array) -> Array:
        """d phi / d u (10 S, 10 G)."""
        return self._own_jacobian(self.tie @ u) @ self.tie

    def covariance(self, u: Array, spread: Array) -> Array:
        """(10 S, 10 S) of phi, to first order, where u has the covariance ``spread`` (10 G, 10 G)."""
        J = self._own_jacobian(self.tie @ u)
        return np.asarray(J @ (self.tie @ spread @ self.tie.T + np.diag(self.apart**2)) @ J.T)

    def masses(self, u: Array) -> Array:
        """(S,) kg."""
        return self.phi(u)[:: len(PARTS)]

    def centre_moves(self, u: Array) -> Array:
        """(S, 3) m by which each centre of mass left the table's."""
        return np.asarray((self.tie @ u).reshape(-1, len(PARTS))[:, 1:4])

    def _split(self, own: Array) -> tuple[Array, Array, Array]:
        """Masses (S,), centres (S, 3), B (S, 3, 3)."""
        each = own.reshape(-1, len(PARTS))
        B = np.zeros((len(each), 3, 3))
        for k, (i, j) in enumerate(_UPPER):
            B[:, i, j] = np.exp(each[:, 4 + k]) if i == j else each[:, 4 + k]
        return masses_of(self.total, self.mass, each[:, 0]), self.centre + each[:, 1:4], B

    def _own_jacobian(self, own: Array) -> Array:
        m, c, B = self._split(own)
        count = len(m)
        S = _covariance(self.root, B)
        J = np.zeros((count, 10, count, 10))
        J[:, :, :, 0] = np.einsum("ik,ij->ikj", _per_kilogram(c, S), np.diag(m) - np.outer(m, m) / self.total)
        k = np.arange(count)
        for axis in range(3):
            J[k, 1 + axis, k, 1 + axis] = m
            cross = np.zeros((count, 3, 3))
            cross[:, axis, :] = c
            J[k, 4:, k, 1 + axis] = m[:, None] * _six(cross + cross.swapaxes(1, 2))
        for part, (i, j) in enumerate(_UPPER):
            dB = np.zeros((count, 3, 3))
            dB[:, i, j] = B[:, i, j] if i == j else 1.0
            half = self.root @ dB @ B.swapaxes(1, 2) @ self.root.swapaxes(1, 2)
            J[k, 4:, k, 4 + part] = m[:, None] * _six(half + half.swapaxes(1, 2))
        return J.reshape(own.size, own.size)


def _covariance(root: Array, B: Array) -> Array:
    half = root @ B
    return np.asarray(half @ half.swapaxes(1, 2))


def _upper(spread: Array) -> Array:
    """Upper triangular A (S, 3, 3) with A A' = spread."""
    return np.asarray(np.linalg.cholesky(spread[:, ::-1, ::-1])[:, ::-1, ::-1])


def _per_kilogram(c: Array, S: Array) -> Array:
    """(S, 10) numbers of a body of 1 kg, about the origin."""
    return np.concatenate([np.ones((len(c), 1)), c, _six(S + c[:, :, None] * c[:, None, :])], axis=1)


def _six(second: Array) -> Array:
    """Entries (S, 6) of the inertia tr(s) 1 - s of second moments s (S, 3, 3)."""
    x, y, z = (second[:, k, k] for k in range(3))
    products = (-second[:, 0, 1], -second[:, 0, 2], -second[:, 1, 2])
    return np.column_stack([y + z, x + z, x + y, *products])
