"""The nearest state in the metric of P^-1 that keeps its constraints.

With P = L L' and y = x + L z, the problem min (y - x)' P^-1 (y - x), A y >= b, is one of least distance:
min |z|, A L z >= b - A x, which Lawson and Hanson (1974, ch. 23) solve by one non-negative least-squares problem.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls


class Infeasible(ValueError):
    """No state keeps all constraints."""


def bounds_as_rows(lower: NDArray, upper: NDArray) -> tuple[NDArray, NDArray]:
    """A, b of A y >= b."""
    identity = np.eye(len(lower))
    A = np.vstack([identity[np.isfinite(lower)], -identity[np.isfinite(upper)]])
    return A, np.concatenate([lower[np.isfinite(lower)], -upper[np.isfinite(upper)]])


def nearest(x: NDArray, P: NDArray, A: NDArray, b: NDArray) -> tuple[NDArray, NDArray]:
    """The state, and which rows hold it back."""
    sd = np.sqrt(np.diag(P))
    L = sd[:, None] * np.linalg.cholesky(P / np.outer(sd, sd))
    missing = b - A @ x
    G = A @ L
    size = np.linalg.norm(G, axis=1)
    E = np.column_stack([G, missing]) / size[:, None]
    f = np.zeros(len(x) + 1)
    f[-1] = 1.0
    u, distance = nnls(E.T, f, maxiter=100 * len(b) + 100)
    if distance < 1e-9:
        raise Infeasible
    active = u > 0
    if not active.any():
        return x.copy(), active
    # The rows are known now; what they ask for, solved again without the detour.
    Ga = G[active] / size[active, None]
    z = Ga.T @ np.linalg.solve(Ga @ Ga.T, missing[active] / size[active])
    return x + L @ z, active


def condition(x: NDArray, P: NDArray, A: NDArray, b: NDArray) -> tuple[NDArray, NDArray]:
    """Mean and covariance given that A x = b: a measurement without noise, all rows at once."""
    gain = np.linalg.solve(A @ P @ A.T, A @ P).T
    return x + gain @ (b - A @ x), P - gain @ (A @ P)
