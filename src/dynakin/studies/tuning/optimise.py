"""The smallest of a smooth cost of a few numbers, each evaluation dear, many at a time cheap.

A quasi-Newton method (SciPy's L-BFGS-B) on central differences, all points of a gradient at once. Measured against
Nelder-Mead, Powell, CMA-ES and Optuna's sampler on a real trial (docs/tuning.md): fewest evaluations, and the only one
whose evaluations can be shared out.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.optimize import minimize

from dynakin.arrays import Array

Costs = Callable[[Sequence[Array]], Array]

STEP = 0.02
"""Of the differences, in ln(setting): wide enough that bounds which come and go do not show, narrow for a curvature."""
CURVATURE_STEP = 0.15
LOST = 0.1
"""A cost this much above the best, as a share of it, is no more than that: a line search draws parabolas through it."""
PATIENCE = 8
"""Gradients in a row without a gain after which the search ends."""
SETTLED = 0.5
"""Change of the cost in an iteration at which the search ends; in nats, half of what matters to anyone."""

MOST_ITERATIONS = 60


@dataclass(frozen=True, eq=False)
class Optimum:
    """point: (k,). cost: there. evaluations: points tried. at_limit: (k,) bool. converged: as the optimiser says."""

    point: Array
    cost: float
    evaluations: int
    at_limit: npt.NDArray[np.bool_]
    converged: bool


class _Settled(Exception):
    """Nothing is gained any more."""


def minimise(costs: Costs, start: Array, reach: float, *, settled: float = SETTLED) -> Optimum:
    """Search from ``start`` (k,), each element within ``reach`` of 0, until little is gained.

    Args:
        settled: the search ends where ``PATIENCE`` gradients in a row bring less than this: a line search that looks
            for more than the differences can show would go on for long.
    """
    count, idle = 1, 0
    best_point = np.array(start, dtype=float)
    best = first = before = float(costs([best_point])[0])
    scale = 1.0 / max(abs(first), 1.0)

    def with_gradient(theta: Array) -> tuple[float, Array]:
        nonlocal count, idle, best, best_point, before
        # one-sided at a limit: no point beyond it
        above, below = (np.clip(theta + sign * STEP, -reach, reach) for sign in (1.0, -1.0))
        points = [theta]
        for k in range(len(theta)):
            for side in (above, below):
                moved = theta.copy()
                moved[k] = side[k]
                points.append(moved)
        values = costs(points)
        values = np.minimum(values, best + LOST * abs(best))
        count += len(points)
        if values[0] < best:
            best, best_point = float(values[0]), theta.copy()
        idle += 1
        if best < before - settled:
            idle, before = 0, best
        if idle > PATIENCE:
            raise _Settled
        slopes = (values[1::2] - values[2::2]) / (above - below)
        return float(values[0]) * scale, slopes * scale

    bounds = [(-reach, reach)] * len(start)
    options = {"maxiter": MOST_ITERATIONS, "ftol": 1e-15, "gtol": 1e-12}
    try:
        converged = bool(
            minimize(with_gradient, start, jac=True, method="L-BFGS-B", bounds=bounds, options=options).success
        )
    except _Settled:
        converged = True
    return Optimum(best_point, best, count, np.abs(best_point) > reach - STEP, converged)


def curvature(costs: Costs, point: Array) -> Array:
    """Second derivatives (k, k) of the cost by central differences."""
    k, h = len(point), CURVATURE_STEP
    unit = h * np.eye(k)
    points = [point]
    points += [point + sign * unit[i] for i in range(k) for sign in (1.0, -1.0)]
    pairs = [(i, j) for i in range(k) for j in range(i)]
    points += [point + a * unit[i] + b * unit[j] for i, j in pairs for a in (1.0, -1.0) for b in (1.0, -1.0)]
    values = costs(points)
    middle, sides, corners = values[0], values[1 : 1 + 2 * k].reshape(k, 2), values[1 + 2 * k :].reshape(-1, 4)
    found = np.diag((sides.sum(axis=1) - 2.0 * middle) / h**2)
    for (i, j), (pp, pm, mp, mm) in zip(pairs, corners, strict=True):
        found[i, j] = found[j, i] = (pp - pm - mp + mm) / (4.0 * h**2)
    return found


def deviations(hessian: Array) -> Array:
    """Standard deviations (k,) of the elements by a cost's second derivatives: sqrt diag H^-1.

    Directions along which the cost does not rise, as can be at a limit, are taken for not known at all: infinite.
    """
    values, vectors = np.linalg.eigh(hessian)
    flat = values <= 1e-9 * max(float(np.abs(values).max()), 1e-300)
    variance = (vectors[:, ~flat] ** 2 / values[~flat]).sum(axis=1)
    unknown = (vectors[:, flat] ** 2).sum(axis=1) > 1e-3
    return np.where(unknown, np.inf, np.sqrt(variance))
