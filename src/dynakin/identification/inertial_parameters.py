"""Inertial parameters of segments in coordinates in which every value is a possible body.

A segment's mass density has a mean, the centre of mass c, and a covariance per kilogram S; the pseudo-inertia is
m [[S + c c', c], [c', 1]], so any m > 0, any c and any positive definite S is a body of positive density, and nothing
else is. Deviations from the table (Rucker and Wensing 2022, Smooth parameterization of rigid-body inertia, whose
log-Cholesky numbers these are, with the centre in metres and the mass held in a sum):

    m_i = M m0_i exp(a_i) / sum_j m0_j exp(a_j),   c = c0 + (cx, cy, cz),   S = A B B' A',   A A' = S0,
    B = [[exp d1, s12, s13], [0, exp d2, s23], [0, 0, exp d3]].

About the table the entropic (affine-invariant) metric of S (Lee and Park 2018) is 2 |d|^2 + |s|^2, so a prior that is
round in it has standard deviations in the ratio 1 : sqrt(2).

A planar model is the case in which only (a, cx, cy, k) of a segment move, d1 = d2 = k: mass, mx, my and izz of a rod's
cross-section with the table's radius of gyration, izz = m (|c|^2 + r0^2 exp(2 k)).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from dynakin.arrays import Array
from dynakin.errors import ModelError
from dynakin.filter.uncertainty.upright import trunks_of
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.model.inertia import INERTIA_NAMES, PLANAR_INERTIA, RigidBody
from dynakin.settings.model import Priors

_PLANAR = ("mass", "mx", "my", "izz")
PARTS = ("a", "cx", "cy", "cz", "d1", "d2", "d3", "s12", "s13", "s23")
_MIRROR = np.array([1.0, 1.0, 1.0, -1.0, 1.0, 1.0, 1.0, 1.0, -1.0, -1.0])  # z of the centre, and products with z
_UPPER = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))  # of B, in the order of PARTS
_ROD = np.sqrt(12.0)  # length of a rod over its radius of gyration


@dataclass(frozen=True)
class InertialPriors:
    """Standard deviations about the table, a segment."""

    log_mass: float = 0.10
    """Of the logarithm of each mass, before the total is held: tables differ by that much."""
    centre_fraction: float = 0.03
    """Of the centre of mass along each axis, over the segment's length. Tables differ by 2 to 5 %."""
    log_gyration: float = 0.07
    """Of the logarithm of the radius of gyration about the centre of mass."""
    sides_apart: float = 0.25
    """Of what a left segment may differ by from the right one, over the deviations above: 2.5 % of a mass."""
    trunk_centre: float = 0.1
    """Part of its deviation by which the trunk's centre of mass may be identified, where its joint on the pelvis is
    known to 30 mm (`Sizes.spine_centre`) and the table is for persons of this physique. Plates show where it lies
    in the room; moments of the joint need how far it lies from the joint, and in the table both go together. L5/S1 of
    fast walks 40 and 42 was 7.9 and 7.0 N m off with 1, 4.5 and 5.8 with 0.1 (4.6 and 5.0 with the table); judged on
    41, 44 and `truth3d` 3 and 4 (docs/identification.md)."""


@dataclass(frozen=True, eq=False)
class InertialParameters:
    """phi (K S,), K inertial numbers a segment, as a function of u (U,): each segment's own, or shared by a right and a
    left one.

    Attributes:
        segments: S names. total: kg. mass, centre: (S,) kg, (S, 3) m of the table. root: (S, 3, 3) m, upper
            triangular A. sd: (U,) prior standard deviations of u. tie: (10 S, U) from u to each segment's own ten.
        apart: (10 S,) standard deviations of what is not asked for: a segment of a pair may differ from what both
            share, and the trunk's centre of mass from the table's.
        unknowns: (U,) names of u. inertia: names of the K numbers that the model estimates of each segment.
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
    inertia: tuple[str, ...] = INERTIA_NAMES

    @classmethod
    def of(cls, initial: CalibratedModel, known: Priors | None = None) -> InertialParameters:
        """The segments of a calibrated model, in the plane or in space, by the numbers of each that it estimates; those
        that are held keep their mass.

        Args:
            known: of the runs that the model is for: what segments may have more (shoes, clothes).

        Raises:
            ModelError: it estimates none, or neither the four of the plane nor all ten; a body of the table is not
                possible.
        """
        chosen = [segment for segment in initial.spec.segments if any(segment.inertia_estimated)]
        held = sum(float(s.inertia[0]) for s in initial.spec.segments if not any(s.inertia_estimated))
        names, total, priors = tuple(s.name for s in chosen), initial.weighed_kg - held, InertialPriors()
        flags = {tuple(segment.inertia_estimated) for segment in chosen}
        wanted = {name for flag in flags for name, on in zip(INERTIA_NAMES, flag, strict=True) if on}
        if len(flags) == 1 and wanted == set(PLANAR_INERTIA):
            table = np.array([[s.inertia[INERTIA_NAMES.index(name)] for name in _PLANAR] for s in chosen], dtype=float)
            mass, centre = table[:, 0], table[:, 1:3] / table[:, :1]
            gyration = np.sqrt(table[:, 3] / mass - (centre**2).sum(axis=1))
            reach = initial.measured_plan().reach
            return cls.in_plane(names, total, mass, centre, gyration, np.array([reach[n] for n in names]), priors)
        if len(flags) != 1 or wanted != set(INERTIA_NAMES):
            raise ModelError(
                f"model {initial.spec.name}: identification needs segments that estimate mass, mx, my and izz (in the "
                "plane) or all ten inertial numbers (in space), this one estimates "
                f"{', '.join(sorted(wanted)) or 'no inertia'}"
            )
        tables = [RigidBody.from_vector(segment.inertia) for segment in chosen]
        for segment, body in zip(chosen, tables, strict=True):
            if not body.possible():
                raise ModelError(
                    f"model {initial.spec.name}: the inertia of segment {segment.name} is that of no body (its "
                    "pseudo-inertia is not positive definite), expected one that a prior can stand about"
                )
        mass = np.array([body.mass for body in tables])
        centre = np.array([body.centre for body in tables])
        spread = np.array([body.pseudo_inertia[:3, :3] / body.mass for body in tables])
        spread -= centre[:, :, None] * centre[:, None, :]
        worn, spines = initial.plan.worn_kg(known or Priors()) if initial.plan else {}, trunks_of(initial)
        return cls.in_space(
            names, total, mass, centre, _upper(spread), priors,
            worn_kg=np.array([worn.get(name, 0.0) for name in names]),
            # a run may be told a height that was measured here
            trunks=[] if initial.plan is None or initial.heavy_as_measured else [name in spines for name in names],
        )  # fmt: skip

    @classmethod
    def in_plane(
        cls,
        names: tuple[str, ...],
        total: float,
        mass: Array,
        centre: Array,
        gyration: Array,
        reach: Array,
        priors: InertialPriors,
    ) -> InertialParameters:
        """About a table of the plane: centre (S, 2) m, gyration and reach (S,) m, the segment's length."""
        sd = np.tile([priors.log_mass, 0.0, 0.0, priors.log_gyration], (len(names), 1))
        sd[:, 1:3] = (priors.centre_fraction * reach)[:, None]
        to_own = np.zeros((len(PARTS), 4))
        to_own[[0, 1, 2, 4, 5], [0, 1, 2, 3, 3]] = 1.0
        tie = np.asarray(np.kron(np.eye(len(names)), to_own), dtype=np.float64)
        half = np.asarray(gyration / np.sqrt(2.0))  # izz takes x and y together; z is any
        root = np.asarray(half[:, None, None] * np.eye(3), dtype=np.float64)
        parts = ("a", "cx", "cy", "k")
        unknowns = tuple(f"body/{name}/{part}" for name in names for part in parts)
        flat = np.column_stack([centre, np.zeros(len(names))])
        return cls(names, total, mass, flat, root, sd.ravel(), tie, np.zeros(len(tie)), unknowns, _PLANAR)

    @classmethod
    def in_space(
        cls,
        names: tuple[str, ...],
        total: float,
        mass: Array,
        centre: Array,
        root: Array,
        priors: InertialPriors,
        *,
        worn_kg: Array | float = 0.0,
        trunks: Sequence[bool] = (),
    ) -> InertialParameters:
        """About a table of space: arguments as the attributes.

        Args:
            worn_kg: (S,) standard deviation of what each segment may weigh more or less regardless of its size, which
                lies anywhere in it (`state_priors.inertia_covariance`). trunks: (S,) whose centre is held.
        """
        spread = root @ root.swapaxes(1, 2)
        length = _ROD * np.sqrt(np.linalg.norm(spread, ord=2, axis=(1, 2)))
        worn = worn_kg / mass
        own = np.empty((len(names), len(PARTS)))
        own[:, 0] = np.hypot(priors.log_mass, worn)
        wide = np.sqrt(np.diagonal(spread, axis1=1, axis2=2))
        own[:, 1:4] = np.hypot((priors.centre_fraction * length)[:, None], worn[:, None] * wide)
        own[:, 4:7] = priors.log_gyration
        own[:, 7:] = np.sqrt(2.0) * priors.log_gyration
        first = [names.index(_paired_with(name, names) or name) for name in names]
        group = [k for k in range(len(names)) if first[k] == k]
        tie = np.zeros((len(names), len(PARTS), len(group), len(PARTS)))
        at = np.arange(len(PARTS))
        paired = np.array([first.count(first[k]) == 2 for k in range(len(names))])
        for k in range(len(names)):
            tie[k, at, group.index(first[k]), at] = 1.0 if first[k] == k else _MIRROR
        asked = np.ones_like(own)
        asked[np.flatnonzero(trunks), 1:4] = priors.trunk_centre
        apart = np.where(paired[:, None], priors.sides_apart, np.sqrt(1.0 - asked**2))
        words = [names[k].removesuffix("_r") if paired[k] else names[k] for k in group]
        return cls(
            names,
            total,
            mass,
            centre,
            root,
            (asked * own)[group].ravel(),
            tie.reshape(own.size, -1),
            (apart * own).ravel(),
            tuple(f"body/{word}/{part}" for word in words for part in PARTS),
        )

    @property
    def names(self) -> tuple[str, ...]:
        """(K S,) names of phi in the filter's state."""
        return tuple(f"inertia/{segment}/{name}" for segment in self.segments for name in self.inertia)

    def phi(self, u: Array) -> Array:
        """(K S,) kg, kg m, kg m^2 a segment, about the segment's origin."""
        m, c, B = self._split(self.tie @ u)
        return np.asarray((m[:, None] * _per_kilogram(c, _covariance(self.root, B))).ravel()[self._kept])

    def jacobian(self, u: Array) -> Array:
        """d phi / d u (K S, U)."""
        return self._own_jacobian(self.tie @ u) @ self.tie

    def covariance(self, u: Array, spread: Array) -> Array:
        """(K S, K S) of phi, to first order, where u has the covariance ``spread`` (U, U)."""
        J = self._own_jacobian(self.tie @ u)
        return np.asarray(J @ (self.tie @ spread @ self.tie.T + np.diag(self.apart**2)) @ J.T)

    def masses(self, u: Array) -> Array:
        """(S,) kg."""
        return self.phi(u)[:: len(self.inertia)]

    def centre_moves(self, u: Array) -> Array:
        """(S, 3) m by which each centre of mass left the table's, (S, 2) in the plane."""
        axes = 3 if "mz" in self.inertia else 2
        return np.asarray((self.tie @ u).reshape(-1, len(PARTS))[:, 1 : 1 + axes])

    @property
    def _kept(self) -> npt.NDArray[np.intp]:
        """(K S,) places of phi among ten numbers a segment."""
        each = [INERTIA_NAMES.index(name) for name in self.inertia]
        return np.add.outer(len(INERTIA_NAMES) * np.arange(len(self.segments)), each).ravel()

    def _split(self, own: Array) -> tuple[Array, Array, Array]:
        """Masses (S,), centres (S, 3), B (S, 3, 3)."""
        each = own.reshape(-1, len(PARTS))
        B = np.zeros((len(each), 3, 3))
        for k, (i, j) in enumerate(_UPPER):
            B[:, i, j] = np.exp(each[:, 4 + k]) if i == j else each[:, 4 + k]
        return _masses_of(self.total, self.mass, each[:, 0]), self.centre + each[:, 1:4], B

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
        return J.reshape(own.size, own.size)[self._kept]


def _masses_of(total: float, table: Array, a: Array) -> Array:
    """(S,) kg from logarithms a (S,): positive, and their sum is ``total``."""
    weight = table * np.exp(a - a.max())
    return np.asarray(total * weight / weight.sum())


def _paired_with(name: str, names: tuple[str, ...]) -> str | None:
    """The right segment (``_r``) of a left one (``_l``); None where there is none."""
    right = f"{name[:-2]}_r"
    return right if name.endswith("_l") and right in names else None


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
