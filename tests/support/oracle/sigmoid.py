"""Smooth bounds (Joukov et al. 2015): an element between bounds is lower + width / (1 + exp(-theta)), and the filter's
state is theta. An extended Kalman filter in theta has H diag(dx/dtheta) and keeps P of theta.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

EDGE = 1e-3  # of the width, as in the core: nearer to a bound the map would let nothing move


class Map:
    """x of theta; elements without two finite bounds are their own theta."""

    def __init__(self, lower: NDArray, upper: NDArray) -> None:
        self.bounded = np.isfinite(lower) & np.isfinite(upper) & (upper > lower)
        self.lower = np.where(self.bounded, lower, 0.0)
        self.width = np.where(self.bounded, upper - self.lower, 1.0)

    def theta(self, x: NDArray) -> NDArray:
        share = np.clip((x - self.lower) / self.width, EDGE, 1 - EDGE)
        return np.where(self.bounded, np.log(share / (1 - share)), x)

    def x(self, theta: NDArray) -> NDArray:
        with np.errstate(over="ignore"):
            share = np.clip(1 / (1 + np.exp(-theta)), EDGE, 1 - EDGE)
        return np.where(self.bounded, self.lower + self.width * share, theta)

    def slope(self, x: NDArray) -> NDArray:
        """dx/dtheta at x."""
        share = np.clip((x - self.lower) / self.width, EDGE, 1 - EDGE)
        return np.where(self.bounded, self.width * share * (1 - share), 1.0)

    def at_edge(self, x: NDArray) -> NDArray:
        share = (x - self.lower) / self.width
        return self.bounded & (np.minimum(share, 1 - share) < EDGE + 1e-12)


def update(bounds: Map, x: NDArray, P: NDArray, v: NDArray, H: NDArray, R: NDArray) -> tuple[NDArray, NDArray]:
    """Mean and covariance of x after an update of theta with the innovation v at x."""
    D = np.diag(bounds.slope(x))
    P_theta = np.linalg.solve(D, np.linalg.solve(D, P).T)
    H_theta = H @ D
    K = np.linalg.solve(H_theta @ P_theta @ H_theta.T + R, H_theta @ P_theta).T
    moved = bounds.x(bounds.theta(x) + K @ v)
    I_KH = np.eye(len(x)) - K @ H_theta
    P_theta = I_KH @ P_theta @ I_KH.T + K @ R @ K.T
    D = np.diag(bounds.slope(moved))
    return moved, D @ P_theta @ D
