"""Inertial parameters of planar segments in coordinates in which every value is a possible body."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from dynakin.errors import ModelError
from dynakin.identification.body_priors import BodyPriors, masses_of
from dynakin.identification.spatial_bodies import SpatialBodies
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.model.inertia import INERTIA_NAMES, PLANAR_INERTIA

Array = npt.NDArray[np.float64]

_PLANAR = ("mass", "mx", "my", "izz")


@dataclass(frozen=True, eq=False)
class PlanarBodies:
    """phi (4 S,) as a function of u (4 S,), [a, cx, cy, k] a segment, deviations from the table.

    m_i = M m0_i exp(a_i) / sum_j m0_j exp(a_j) (softmax: positive, and the sum is M), c_i = c0_i + (cx, cy),
    izz_i = m_i (|c_i|^2 + r0_i^2 exp(2 k)). So m > 0 and m izz > mx^2 + my^2 whatever u is.

    Attributes:
        segments: S names. total: M, kg. mass, centre, gyration: (S,) kg, (S, 2) m, (S,) m of the table.
        sd: (4 S,) prior standard deviations of u.
    """

    segments: tuple[str, ...]
    total: float
    mass: Array
    centre: Array
    gyration: Array
    sd: Array

    @classmethod
    def of(cls, initial: CalibratedModel, priors: BodyPriors | None = None) -> PlanarBodies:
        """The bodies that a measured planar model estimates; those that are held keep their mass."""
        priors = priors or BodyPriors()
        chosen = [segment for segment in initial.spec.segments if any(segment.inertia_estimated)]
        held = sum(float(s.inertia[0]) for s in initial.spec.segments if not any(s.inertia_estimated))
        table = np.array([[s.inertia[INERTIA_NAMES.index(name)] for name in _PLANAR] for s in chosen], dtype=float)
        mass, centre = table[:, 0], table[:, 1:3] / table[:, :1]
        gyration = np.sqrt(table[:, 3] / mass - (centre**2).sum(axis=1))
        reach = initial.measured_plan().reach
        sd = [
            (priors.log_mass, *(2 * [priors.centre_fraction * reach[s.name]]), priors.log_gyration) for s in chosen
        ]  # fmt: skip
        total = initial.weighed_kg - held
        return cls(tuple(s.name for s in chosen), total, mass, centre, gyration, np.array(sd).ravel())

    @property
    def unknowns(self) -> tuple[str, ...]:
        """(4 S,) names of u."""
        return tuple(f"body/{segment}/{part}" for segment in self.segments for part in ("a", "cx", "cy", "k"))

    @property
    def names(self) -> tuple[str, ...]:
        """(4 S,) names of phi in the filter's state."""
        return tuple(f"inertia/{segment}/{name}" for segment in self.segments for name in _PLANAR)

    def phi(self, u: Array) -> Array:
        """(4 S,) kg, kg m, kg m, kg m^2 a segment."""
        m, c, r = self._split(u)
        izz = m * ((c**2).sum(axis=1) + r**2)
        return np.column_stack([m, m[:, None] * c, izz]).ravel()

    def jacobian(self, u: Array) -> Array:
        """d phi / d u (4 S, 4 S)."""
        m, c, r = self._split(u)
        count = len(m)
        J = np.zeros((count, 4, count, 4))
        square = (c**2).sum(axis=1) + r**2
        each = np.column_stack([np.ones(count), c, square])  # phi over m
        J[:, :, :, 0] = np.einsum("ik,ij->ikj", each, np.diag(m) - np.outer(m, m) / self.total)
        k = np.arange(count)
        J[k, 1, k, 1] = J[k, 2, k, 2] = m
        J[k, 3, k, 1], J[k, 3, k, 2] = 2.0 * m * c[:, 0], 2.0 * m * c[:, 1]
        J[k, 3, k, 3] = 2.0 * m * r**2
        return J.reshape(4 * count, 4 * count)

    def covariance(self, u: Array, spread: Array) -> Array:
        """(4 S, 4 S) of phi, to first order, where u has the covariance ``spread`` (4 S, 4 S)."""
        J = self.jacobian(u)
        return np.asarray(J @ spread @ J.T)

    def masses(self, u: Array) -> Array:
        """(S,) kg."""
        return self._split(u)[0]

    def centre_moves(self, u: Array) -> Array:
        """(S, 2) m by which each centre of mass left the table's."""
        return np.column_stack([u[1::4], u[2::4]])

    def _split(self, u: Array) -> tuple[Array, Array, Array]:
        a, c, k = u[0::4], np.column_stack([u[1::4], u[2::4]]), u[3::4]
        return masses_of(self.total, self.mass, a), self.centre + c, self.gyration * np.exp(k)


Bodies = PlanarBodies | SpatialBodies


def bodies_of(initial: CalibratedModel, priors: BodyPriors | None = None) -> Bodies:
    """The bodies of a measured model, in the plane or in space, by the numbers of each that it estimates.

    Raises:
        ModelError: it estimates none, or neither the four of the plane nor all ten.
    """
    flags = [tuple(segment.inertia_estimated) for segment in initial.spec.segments if any(segment.inertia_estimated)]
    wanted = {name for flag in flags for name, on in zip(INERTIA_NAMES, flag, strict=True) if on}
    if len(set(flags)) == 1 and wanted == set(PLANAR_INERTIA):
        return PlanarBodies.of(initial, priors)
    if len(set(flags)) == 1 and wanted == set(INERTIA_NAMES):
        return SpatialBodies.of(initial, priors)
    raise ModelError(
        f"model {initial.spec.name}: identification needs segments that estimate mass, mx, my and izz (in the plane) "
        f"or all ten inertial numbers (in space), this one estimates {', '.join(sorted(wanted)) or 'no inertia'}"
    )
