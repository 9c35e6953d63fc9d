"""Textbook smoothers of a linear-Gaussian problem: one dense regression over all frames, and Rauch-Tung-Striebel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve


@dataclass
class Frame:
    """x = F x_before + noise of covariance Q (not in the first frame), then z = H x + noise of covariance R."""

    F: NDArray
    Q: NDArray
    H: NDArray
    R: NDArray
    z: NDArray


def solve_scaled(S: NDArray, b: NDArray) -> NDArray:
    """S^-1 b of a covariance whose variances differ by orders of magnitude."""
    d = 1.0 / np.sqrt(np.diag(S))
    scaled = (d[:, None] * S) * d
    return d[:, None] * cho_solve(cho_factor(scaled), (d[:, None] * b))


def batch(x0: NDArray, P0: NDArray, frames: list[Frame]) -> tuple[NDArray, NDArray]:
    """Means (T, n) and covariances (T, n, n) of all states given all z: the joint Gaussian of states and z."""
    n, T = len(x0), len(frames)
    mean, joint = np.zeros(T * n), np.zeros((T * n, T * n))
    for k, frame in enumerate(frames):
        here = slice(k * n, k * n + n)
        if k == 0:
            mean[here], joint[here, here] = x0, P0
            continue
        before = slice(k * n - n, k * n)
        mean[here] = frame.F @ mean[before]
        joint[here, : k * n] = frame.F @ joint[before, : k * n]
        joint[: k * n, here] = joint[here, : k * n].T
        joint[here, here] = frame.F @ joint[before, before] @ frame.F.T + frame.Q
    rows = [len(frame.z) for frame in frames]
    at = np.concatenate([[0], np.cumsum(rows)])
    H, R = np.zeros((at[-1], T * n)), np.zeros((at[-1], at[-1]))
    for k, frame in enumerate(frames):
        H[at[k] : at[k + 1], k * n : k * n + n] = frame.H
        R[at[k] : at[k + 1], at[k] : at[k + 1]] = frame.R
    z = np.concatenate([frame.z for frame in frames])
    HJ = H @ joint
    S = HJ @ H.T + R
    both = solve_scaled(S, np.column_stack([z - H @ mean, HJ]))
    mean = mean + HJ.T @ both[:, 0]
    covariances = [
        joint[i : i + n, i : i + n] - HJ[:, i : i + n].T @ both[:, 1 + i : 1 + i + n] for i in range(0, T * n, n)
    ]
    return mean.reshape(T, n), np.array(covariances)


def rauch_tung_striebel(
    x: NDArray, P: NDArray, x_predicted: NDArray, P_predicted: NDArray, F: list[NDArray]
) -> tuple[NDArray, NDArray]:
    """Smoothed means and covariances from the filter's; ``F[k]`` and the predictions lead to frame k."""
    xs, Ps = x.copy(), P.copy()
    for k in range(len(x) - 2, -1, -1):
        C = solve_scaled(P_predicted[k + 1], F[k + 1] @ P[k]).T
        xs[k] = x[k] + C @ (xs[k + 1] - x_predicted[k + 1])
        Ps[k] = P[k] + C @ (Ps[k + 1] - P_predicted[k + 1]) @ C.T
    return xs, Ps
