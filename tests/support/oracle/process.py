"""How the state moves between frames, by the matrix exponential of its linear differential equation (Van Loan 1978).

dx = A x dt + noise of the declared densities. Each coordinate with its derivatives, and every other element, moves
alone, so A is cut into blocks: [[0 1 0], [0 0 1], [0 0 0]] for a coordinate, minus the decay rate for the others.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from support.oracle.state import Layout


def van_loan(A: NDArray, density: NDArray, dt: float) -> tuple[NDArray, NDArray]:
    """exp(A dt) and the covariance that white noise of these densities (k,) leaves after dt; batches (..., k, k)."""
    k = A.shape[-1]
    both = np.zeros((*A.shape[:-2], 2 * k, 2 * k))
    both[..., :k, :k] = -A
    both[..., :k, k:] = density[..., :, None] * np.eye(k)
    both[..., k:, k:] = np.swapaxes(A, -1, -2)
    solved = expm(both * dt)
    F = np.swapaxes(solved[..., k:, k:], -1, -2)
    return F, F @ solved[..., :k, k:]


def transition(layout: Layout, density: NDArray, decay: NDArray, dt: float) -> tuple[NDArray, NDArray]:
    """F and Q (n, n) over dt."""
    F, Q = np.zeros((layout.size, layout.size)), np.zeros((layout.size, layout.size))
    nq = layout.blocks["coordinates"][1]
    chains = np.arange(3 * nq).reshape(3, nq).T
    others = np.arange(3 * nq, layout.size)[:, None]
    for elements in (chains, others):
        k = elements.shape[1]
        A = np.broadcast_to(np.eye(k, k=1), (len(elements), k, k)) - decay[elements][..., None] * np.eye(k)
        where = elements[:, :, None], elements[:, None, :]
        F[where], Q[where] = van_loan(A, density[elements], dt)
    return F, Q
