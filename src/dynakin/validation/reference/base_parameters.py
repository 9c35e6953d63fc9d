"""Base parameters: the combinations of inertial parameters that the wrench depends on, found numerically.

Source: Gautier 1991 (J Robot Syst 8:485-506), as used for people by Ayusawa et al. 2013 [14]: a column of the stacked
regressor that depends on the columns before it is regrouped into them. In a chain that hangs on the ground by a hinge,
each further hinge hides one number (a mass at the hinge may belong to either neighbour): 28 - 6 = 22 of seven segments.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg

from dynakin.arrays import Array
from dynakin.validation.reference.condensed import Condensed


@dataclass(frozen=True, eq=False)
class BaseParameters:
    """beta = K phi, the least-squares estimate of beta, and what says how well it is excited.

    Attributes:
        names: (r,) the parameter that each beta is named after; the others are added to these by K.
        K: (r, e) over ``over``, the names of the parameters estimated; SI.
        values: (r,) kg, kg m or kg m^2. sd: (r,) if the errors of all frames were independent with the declared sigma;
            model errors are not, so the truth is wider.
        singular_values: (e,) of the regressor in units of sigma, columns scaled by the table's sizes, all frames
            stacked; the last e - r are rounding.
    """

    names: tuple[str, ...]
    over: tuple[str, ...]
    K: Array
    values: Array
    sd: Array
    singular_values: Array

    @property
    def rank(self) -> int:
        """Number of base parameters."""
        return len(self.names)

    @property
    def condition(self) -> float:
        """Largest over smallest singular value that is not rounding: how unevenly the motion excites them."""
        return float(self.singular_values[0] / self.singular_values[self.rank - 1])

    def of(self, parameters: dict[str, float]) -> Array:
        """beta (r,) of given inertial parameters by name, the table's or the truth's."""
        return np.asarray(self.K @ np.array([parameters[name] for name in self.over]))

    def in_words(self) -> list[str]:
        """Each beta as the sum that it is: "inertia/foot/mass + 1 inertia/shank/mass + ..."."""
        found = []
        for name, row in zip(self.names, self.K, strict=True):
            others = [(c, n) for c, n in zip(row, self.over, strict=True) if n != name and abs(c) > 1e-6]
            found.append(name + "".join(f" {'+' if c > 0 else '-'} {abs(c):.4g} {n}" for c, n in others))
        return found


def base_parameters(problem: Condensed) -> BaseParameters:
    """Rank, regrouping and estimate, with the total mass held where the problem holds it.

    The rank is that of A with its columns scaled; a singular value counts where it exceeds the largest times the
    number of rows times the rounding unit (about 1e-12): the regressor is an exact function of the kinematics, noisy or
    not, so what depends on each other does so to rounding.
    """
    singular: Array = np.asarray(np.linalg.svd(problem.A, compute_uv=False), dtype=float)
    rank = int((singular > problem.tolerance * singular[0]).sum())
    kept = _independent(problem.A, rank)
    rest = [k for k in range(problem.A.shape[1]) if k not in kept]
    K = np.zeros((rank, problem.A.shape[1]))
    K[range(rank), kept] = 1.0
    K[:, rest] = np.linalg.lstsq(problem.A[:, kept], problem.A[:, rest], rcond=None)[0]
    A, b = problem.with_mass()
    x, *_ = np.linalg.lstsq(A[:, kept], b, rcond=None)
    R = np.linalg.qr(A[:, kept], mode="r")  # A'A = R'R, whose condition is the square of R's
    sd = np.linalg.norm(scipy.linalg.solve_triangular(R, np.eye(rank)), axis=1)  # of (R'R)^-1 the diagonal's roots
    names = [name for name, wanted in zip(problem.names, problem.estimated, strict=True) if wanted]
    scale = problem.scale[problem.estimated]
    return BaseParameters(
        tuple(names[k] for k in kept),
        tuple(names),
        scale[kept, None] * K / scale,
        scale[kept] * x,
        scale[kept] * sd,
        singular,
    )


def _independent(A: Array, rank: int) -> list[int]:
    """The first ``rank`` columns that are no combination of the columns before them, or as nearly as can be."""
    basis = np.zeros((A.shape[0], 0))
    new = np.zeros(A.shape[1])
    for k, column in enumerate(A.T):
        left = column - basis @ (basis.T @ column)
        left -= basis @ (basis.T @ left)  # twice is enough for orthogonality to rounding
        size = np.linalg.norm(column)
        new[k] = np.linalg.norm(left) / size if size > 0.0 else 0.0
        if new[k] > 1e-9:  # between rounding (1e-14) and the weakest excitation seen (1e-5)
            basis = np.column_stack([basis, left / np.linalg.norm(left)])
    return sorted(int(k) for k in np.argsort(-new, kind="stable")[:rank])
