"""Inertial parameters by least squares on filtered kinematics, offline, after the paper's [13] and [14].

What the extended Kalman filter does frame by frame is done here in one step from kinematics that are taken as known:
free (no bounds; what the wrench does not see stays at the table), within the bounds of (9), and base parameters.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from dynakin.arrays import Array
from dynakin.model.inertia import INERTIA_NAMES, RigidBody
from dynakin.model.plan import ModelPlan
from dynakin.settings.model import Bounds
from dynakin.validation.reference.base_parameters import BaseParameters, base_parameters
from dynakin.validation.reference.chain import Kinematics, PlanarChain
from dynakin.validation.reference.condensed import DECLARED_SIGMA, Condensed, stacked
from dynakin.validation.reference.regressor import (
    IN_PLANE,
    PLANAR_NAMES,
    parameter_names,
    parameter_scales,
    table_parameters,
    wrench_regressor,
)

_TO_TABLE = 1e-4
"""Pull to the table in units of each parameter's size, added to rows in sigma: decides only what no frame sees."""


@dataclass(frozen=True, eq=False)
class LeastSquares:
    """Inertial parameters, four a segment, by the names of the filter's state.

    Attributes:
        names, table: (p,) kg, kg m, kg m, kg m^2 a segment. free, bounded: (p,) the two estimates.
        at_bound: names that end on a bound of (9) in ``bounded``.
        base: base parameters, without bounds.
        frames: number of frames used.
    """

    names: tuple[str, ...]
    table: Array
    free: Array
    bounded: Array
    at_bound: tuple[str, ...]
    base: BaseParameters
    frames: int


def identify(
    chain: PlanarChain,
    plan: ModelPlan,
    kinematics: Kinematics,
    wrench: Array,
    *,
    mass_kg: float | None = None,
    sigma: tuple[float, float, float] = DECLARED_SIGMA,
    bounds: Bounds | None = None,
) -> LeastSquares:
    """Fit phi to the measured wrench.

    Args:
        chain, plan: of the model as measured. kinematics: filtered (T, C).
        wrench: (T, 6) ground on person about the ground origin, N and N m; frames with NaN are left out.
        mass_kg: total mass, held at each frame as the paper does; None: not held.
        sigma: declared standard deviations of fx, fy (N), mz (N m), the weights of the three components.
        bounds: half widths of (9), +-20 % where not given.

    Raises:
        RecordingError: too few frames with all coordinates and the wrench.
    """
    flags = [dict(zip(INERTIA_NAMES, plan.estimated_inertia(link.name), strict=True)) for link in chain.links]
    problem = stacked(
        parameter_names(chain),
        table_parameters(chain),
        parameter_scales(chain),
        np.array([entry[name] for entry in flags for name in PLANAR_NAMES]),
        wrench_regressor(chain, kinematics),
        wrench[:, IN_PLANE],
        mass_kg=mass_kg,
        sigma=sigma,
    )
    base = base_parameters(problem)
    free = free_parameters(problem, base.rank)
    bounded, at_bound = _bounded(problem, plan, bounds or Bounds())
    return LeastSquares(problem.names, problem.table, free, bounded, at_bound, base, problem.frames)


def free_parameters(problem: Condensed, rank: int) -> Array:
    """phi (p,) without bounds: the solution nearest to the table, in units of the parameters' sizes, of which ``rank``
    directions move."""
    start = problem.table[problem.estimated] / problem.scale[problem.estimated]
    seen = np.linalg.svd(problem.A)[2][:rank]  # (r, e): the directions that the wrench depends on
    A, b = problem.with_mass()
    moved, *_ = np.linalg.lstsq(A @ seen.T, b - A @ start, rcond=None)
    return problem.full(start + seen.T @ moved)


def _bounded(problem: Condensed, plan: ModelPlan, bounds: Bounds) -> tuple[Array, tuple[str, ...]]:
    limits = plan.bounds(bounds)
    size = problem.scale[problem.estimated]
    names = [name for name, wanted in zip(problem.names, problem.estimated, strict=True) if wanted]
    lower, upper = np.array([limits[name] for name in names]).T / size
    A, b = problem.with_mass()
    pull = _TO_TABLE * np.eye(len(names))
    start = problem.table[problem.estimated] / size
    fit = scipy.optimize.lsq_linear(
        np.vstack([A, pull]), np.append(b, _TO_TABLE * start), (lower, upper), method="bvls", tol=1e-12
    )  # fmt: skip
    on = tuple(name for name, active in zip(names, fit.active_mask, strict=True) if active)
    return problem.full(fit.x), on


def predicted_wrench(chain: PlanarChain, kinematics: Kinematics, parameters: Array) -> Array:
    """Wrench (T, 6) of a motion, of the same trial or of another, with given parameters (p,); NaN out of the plane."""
    Y = wrench_regressor(chain, kinematics)
    wrench = np.full((len(Y), 6), np.nan)
    wrench[:, IN_PLANE] = Y @ parameters
    return wrench


def inertia_of(chain: PlanarChain, parameters: Array) -> dict[str, RigidBody]:
    """Inertia of each segment with these parameters (p,), the numbers out of the plane as the table has them."""
    values = dict(zip(parameter_names(chain), parameters, strict=True))
    found = {}
    for link in chain.links:
        m, mx, my, izz = (values[f"inertia/{link.name}/{k}"] for k in ("mass", "mx", "my", "izz"))
        first, inertia = link.body.first_moment.copy(), link.body.inertia.copy()
        first[:2], inertia[2, 2] = (mx, my), izz
        found[link.name] = RigidBody(float(m), first, inertia)
    return found
