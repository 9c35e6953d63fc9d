"""The constrained extended Kalman filter, dense and as in a textbook: the paper's (2)-(8), and what was added to it.

No sparsity, no chunks: one F, one H, one S a frame, the missing rows cut out of them.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from support.oracle import measurement, process, projection, sensors, sigmoid
from support.oracle.state import Layout


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
    process_density: NDArray | None = None  # (n,) white noise on each element's rate
    decay_rate: NDArray | None = None  # (n,) 1/s
    equality: NDArray | None = None  # (k, n) with projection
    equality_value: NDArray | None = None  # (k,)
    marker_gate: list[float] | None = None  # for 1 to 6 rows
    wrench_gate: list[float] | None = None
    wrench_needs_markers: bool = False


@dataclass
class Report:
    n_rows: int
    nis: float
    log_likelihood: float
    constrained: int
    verdicts: list[str]
    innovation: NDArray  # (3 M + 6,), 3 a marker, then the plates'; NaN: not measured
    innovation_sd: NDArray
    test_ratio: NDArray  # (M + 1,) 0: no gate


class Filter:
    """x (n,) and P (n, n); ``predict``, ``update``, ``step`` and nothing else."""

    def __init__(self, spec: Any, settings: Any, x0: NDArray, P0: NDArray) -> None:
        self.spec, self.settings = spec, settings
        self.layout = Layout(spec)
        self.state = np.array(x0, float)
        self.covariance = np.array(P0, float)

    def predict(self, dt: float) -> None:
        nothing = np.zeros(self.layout.size)
        density, decay = self.settings.process_density, self.settings.decay_rate
        F, Q = process.transition(
            self.layout, nothing if density is None else density, nothing if decay is None else decay, dt
        )
        self.state = F @ self.state
        self.covariance = F @ self.covariance @ F.T + Q + np.diag(self.settings.process_variance)

    def measurement_rows(
        self, markers: NDArray, wrench: NDArray, wrench_covariance: NDArray | None = None
    ) -> tuple[NDArray, NDArray, NDArray]:
        """z, R of all 3 M + 7 rows (R of absent ones is arbitrary) and which are present."""
        return sensors.rows(self.spec, self.settings, markers, wrench, wrench_covariance)

    def update(
        self,
        markers: NDArray,
        wrench: NDArray,
        wrench_covariance: NDArray | None = None,
        wrench_effects: NDArray | None = None,
    ) -> Report:
        """``wrench_covariance`` (6, 6), ``wrench_effects`` (6, 6 C): how this frame's total wrench is measured."""
        z, R, present = self.measurement_rows(markers, wrench, wrench_covariance)
        h, H = measurement.value_and_jacobian(self.layout, self.state, wrench_effects)
        x, P, v = self.state, self.covariance, z - h
        judged = sensors.reports(self.settings, v, H, P, R, present)
        use = sensors.believed(self.settings, judged["verdicts"], present)
        v, H, R = v[use], H[use], R[np.ix_(use, use)]
        S = H @ P @ H.T + R
        K = np.linalg.solve(S, H @ P).T
        weighted = np.linalg.solve(S, v)  # S^-1 v
        nis = float(v @ weighted)
        m = len(v)
        log_likelihood = -0.5 * (nis + np.linalg.slogdet(S)[1] + m * np.log(2 * np.pi))
        if self.settings.constraint == "sigmoid":
            bounds = sigmoid.Map(*self.bounds())
            self.state, self.covariance = sigmoid.update(bounds, x, P, v, H, R)
            return Report(m, nis, log_likelihood, int(bounds.at_edge(self.state).sum()), **judged)
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
        P = I_KH @ P @ I_KH.T + K @ R @ K.T  # Joseph: right for every gain
        self.state, self.covariance = updated, (P + P.T) / 2
        constrained = self.project() if self.settings.constraint == "projection" else len(beyond)
        return Report(m, nis, log_likelihood, constrained, **judged)

    def project(self) -> int:
        """Equalities condition mean and covariance, inequalities move the mean; how many of the latter bind."""
        s = self.settings
        if s.equality is not None:
            self.state, P = projection.condition(self.state, self.covariance, s.equality, s.equality_value)
            self.covariance = (P + P.T) / 2
        A, b = projection.bounds_as_rows(*self.bounds())
        self.state, active = projection.nearest(self.state, self.covariance, A, b)
        return int(active.sum())

    def bounds(self) -> tuple[NDArray, NDArray]:
        """(n,) each, infinite where there is none."""
        s, n = self.settings, self.layout.size
        lower = np.full(n, -np.inf) if s.lower is None else np.asarray(s.lower)
        upper = np.full(n, np.inf) if s.upper is None else np.asarray(s.upper)
        return lower, upper

    def beyond_bounds(self, x: NDArray) -> tuple[NDArray, NDArray]:
        """Indices of the elements that the constraint (9) stops, and the bound that each lands on."""
        if self.settings.constraint != "gain":
            return np.zeros(0, int), np.zeros(0)
        clipped = np.clip(x, *self.bounds())
        beyond = np.flatnonzero(clipped != x)
        return beyond, clipped[beyond]

    def step(self, dt: float, *measured: NDArray) -> Report:
        self.predict(dt)
        return self.update(*measured)

    def run(
        self,
        time: NDArray,
        markers: NDArray,
        wrench: NDArray,
        wrench_covariance: NDArray | None = None,
        wrench_effects: NDArray | None = None,
    ) -> dict[str, NDArray]:
        """Over a trial; the first frame only updates. Keys as the core's ``run``, plus the covariances."""
        frames = []
        given = [a for a in (wrench_covariance, wrench_effects) if a is not None]
        for k in range(len(time)):
            if k > 0:
                self.predict(time[k] - time[k - 1])
            before = {"state_predicted": self.state}
            report = vars(self.update(markers[k], wrench[k], *(a[k] for a in given)))
            frames.append(before | report | {"state": self.state, "covariance": self.covariance})
        out = {key: np.array([frame[key] for frame in frames]) for key in frames[0]}
        out["state_sd"] = np.sqrt(np.diagonal(out["covariance"], axis1=1, axis2=2))
        for when, x in (("predicted", out["state_predicted"]), ("estimated", out["state"])):
            out[f"markers_{when}"] = measurement.marker_positions(self.layout, x)
        out["wrench_predicted"] = np.array(
            [
                measurement.plates(self.layout, x, None if wrench_effects is None else wrench_effects[k])
                for k, x in enumerate(out["state_predicted"])
            ]
        )
        out["wrench_estimated"] = measurement.wrench(self.layout, out["state"])
        out["moments"] = measurement.joint_moments(self.layout, out["state"])
        return out
