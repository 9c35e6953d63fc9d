"""The paper's constrained extended Kalman filter, dense and as in a textbook: (2)-(8).

No sparsity, no chunks: one F, one H, one S a frame, the missing rows cut out of them.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from oracle import measurement
from oracle.state import Layout


@dataclass
class Settings:
    """Attribute names as the core's FilterSettings."""

    process_variance: NDArray  # (n,) added each step
    marker_variance: NDArray  # (M,) m^2; inf: as if the marker were missing
    wrench_covariance: NDArray  # (6, 6) at the reference point; infinite variance: missing
    reference_point: NDArray = field(default_factory=lambda: np.zeros(3))  # (3,) m, ground frame
    total_mass: float | None = None
    total_mass_variance: float = 1.0
    lower: NDArray | None = None
    upper: NDArray | None = None
    constraint: str = "gain"


@dataclass
class Report:
    n_rows: int
    nis: float
    log_likelihood: float
    constrained: int


def carried_to_origin(covariance: NDArray, r: NDArray) -> NDArray:
    """From a wrench about the point r to the same wrench about the origin: m_O = m_r + r x f; (6, 6)."""
    x, y, z = r
    carry = np.eye(6)
    carry[3:, :3] = [[0, -z, y], [z, 0, -x], [-y, x, 0]]
    return carry @ covariance @ carry.T


class Filter:
    """x (n,) and P (n, n); ``predict``, ``update``, ``step`` and nothing else."""

    def __init__(self, spec: Any, settings: Any, x0: NDArray, P0: NDArray) -> None:
        self.spec, self.settings = spec, settings
        self.layout = Layout(spec)
        self.state = np.array(x0, float)
        self.covariance = np.array(P0, float)

    def transition(self, dt: float) -> NDArray:
        """F of (4): constant acceleration for the coordinates, constant everything else."""
        F = np.eye(self.layout.size)
        q, qd, qdd = (
            np.arange(self.layout.size)[self.layout.block(b)] for b in ("coordinates", "speeds", "accelerations")
        )
        F[q, qd] = dt
        F[qd, qdd] = dt
        F[q, qdd] = dt**2 / 2
        return F

    def predict(self, dt: float) -> None:
        F = self.transition(dt)
        self.state = F @ self.state
        self.covariance = F @ self.covariance @ F.T + np.diag(self.settings.process_variance)

    def measurement_rows(self, markers: NDArray, wrench: NDArray) -> tuple[NDArray, NDArray, NDArray]:
        """z, R of all 3 M + 7 rows (R of absent ones is arbitrary) and which are present."""
        s, n_markers = self.settings, len(self.spec.markers)
        rows = 3 * n_markers + 7
        z, R, present = np.zeros(rows), np.eye(rows), np.zeros(rows, bool)
        for k, marker in enumerate(self.spec.markers):
            here = slice(3 * k, 3 * k + 3)
            measured = np.array(marker.measured, bool)
            seen = np.isfinite(markers[k][measured]).all() and np.isfinite(s.marker_variance[k])
            present[here] = measured & seen
            z[here] = markers[k]
            if seen:
                R[here, here] = np.eye(3) * s.marker_variance[k]
        here = slice(3 * n_markers, 3 * n_markers + 6)
        R[here, here], known = self.wrench_noise()
        present[here] = np.array(self.spec.wrench_measured, bool) & np.isfinite(wrench) & known
        z[here] = wrench
        if s.total_mass is not None and np.isfinite(s.total_mass_variance):
            z[-1], R[-1, -1], present[-1] = s.total_mass, s.total_mass_variance, True
        return z, R, present

    def wrench_noise(self) -> tuple[NDArray, NDArray]:
        """Covariance at the origin, and which components have a finite variance there.

        An infinite variance of a force is carried by its lever into the moments, which are then unknown too.
        """
        block = np.array(self.settings.wrench_covariance, float)
        infinite = np.isinf(np.diag(block))
        block[infinite, :] = 0.0
        block[:, infinite] = 0.0
        reached = carried_to_origin(np.diag(infinite.astype(float)), self.settings.reference_point)
        return carried_to_origin(block, self.settings.reference_point), np.diag(reached) == 0

    def update(self, markers: NDArray, wrench: NDArray) -> Report:
        z, R, present = self.measurement_rows(markers, wrench)
        h, H = measurement.value_and_jacobian(self.layout, self.state)
        z, h, H, R = z[present], h[present], H[present], R[np.ix_(present, present)]
        x, P = self.state, self.covariance
        v = z - h
        S = H @ P @ H.T + R
        K = np.linalg.solve(S, H @ P).T
        weighted = np.linalg.solve(S, v)  # S^-1 v
        nis = float(v @ weighted)
        m = len(v)
        log_likelihood = -0.5 * (nis + np.linalg.slogdet(S)[1] + m * np.log(2 * np.pi))
        updated = x + K @ v
        beyond, limit = self.beyond_bounds(updated)
        if len(beyond) and nis > 0:
            # (7), (8): the gain that lands on the bounds, used from the prediction.
            A = np.eye(self.layout.size)[beyond]
            excess = A.T @ np.linalg.solve(A @ A.T, A @ updated - limit)
            K = K - np.outer(excess, weighted) / nis
            updated = x + K @ v
        updated[beyond] = limit  # equal but for rounding; with nothing measured the mean alone moves
        I_KH = np.eye(self.layout.size) - K @ H
        self.covariance = I_KH @ P @ I_KH.T + K @ R @ K.T  # Joseph: right for every gain
        self.covariance = (self.covariance + self.covariance.T) / 2
        self.state = updated
        return Report(m, nis, log_likelihood, len(beyond))

    def beyond_bounds(self, x: NDArray) -> tuple[NDArray, NDArray]:
        """Indices of the elements that the constraint (9) stops, and the bound that each lands on."""
        n = self.layout.size
        s = self.settings
        if s.constraint != "gain":
            return np.zeros(0, int), np.zeros(0)
        lower = np.full(n, -np.inf) if s.lower is None else np.asarray(s.lower)
        upper = np.full(n, np.inf) if s.upper is None else np.asarray(s.upper)
        clipped = np.clip(x, lower, upper)
        beyond = np.flatnonzero(clipped != x)
        return beyond, clipped[beyond]

    def step(self, dt: float, markers: NDArray, wrench: NDArray) -> Report:
        self.predict(dt)
        return self.update(markers, wrench)

    def run(self, time: NDArray, markers: NDArray, wrench: NDArray) -> dict[str, NDArray]:
        """Over a trial; the first frame only updates. Keys as the core's ``run``, plus the covariances."""
        frames = []
        for k in range(len(time)):
            if k > 0:
                self.predict(time[k] - time[k - 1])
            before = {"state_predicted": self.state}
            report = vars(self.update(markers[k], wrench[k]))
            frames.append(before | report | {"state": self.state, "covariance": self.covariance})
        out = {key: np.array([frame[key] for frame in frames]) for key in frames[0]}
        out["state_sd"] = np.sqrt(np.diagonal(out["covariance"], axis1=1, axis2=2))
        for when, x in (("predicted", out["state_predicted"]), ("estimated", out["state"])):
            out[f"markers_{when}"] = measurement.marker_positions(self.layout, x)
            out[f"wrench_{when}"] = measurement.wrench(self.layout, x)
        out["moments"] = measurement.joint_moments(self.layout, out["state"])
        return out
