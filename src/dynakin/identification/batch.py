"""Batch identification: all trials of a subject at once, by Gauss-Newton from priors about the table.

The cost is sum over trials and frames of r' W r + theta' P^-1 theta, r = measured - predicted wrench. W is not the
plates' noise: r is the model's own error, which lasts for many frames, so each component weighs 1 / (s^2 tau): s is its
RMS over the trial and tau the frames that its error lasts, measured on the residuals of the pass before, tau not below
a quarter of a second. The covariance counts what is held as uncertain too (Schmidt 1966, "consider" parameters): a
length that is wrong shows as a mass that is wrong, however many frames there are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.linalg import cho_factor, cho_solve

from dynakin.arrays import Array, rms, wrench_about
from dynakin.errors import RecordingError
from dynakin.identification.trials import SHORTEST_S, Common, MeasuredTrial
from dynakin.identification.unknowns import Unknowns
from dynakin.recordings.times import step_of

PASSES = 4  # linearised anew, and weights measured anew, at each
FIRST_SIGMA = np.array([10.0, 20.0, 10.0, 10.0, 10.0, 10.0])
"""N, N m (fx ... mz): size of a model's error before anything is known of it."""
LEAST_SIGMA = 1.0  # N or N m: a residual that was fitted is smaller than the error
LEAST_TAU_S = 0.25
"""An error is taken to last as long at least, and at first: so long does it on real squats (0.16 to 0.27 s). Errors of
geometry and skin follow the posture: they come back with each repetition, with both signs, and look shorter than they
are; without a floor long trials are believed too much (docs/identification.md)."""


@dataclass(frozen=True, eq=False)
class Posterior:
    """What the trials say.

    Attributes:
        unknowns: what was asked. theta: (U,) deviations from the start. covariance: (U, U), 0 for those held.
        sigma: (N, r) RMS residual by trial and component of `Common.rows`, N and N m. tau_s: (N, r) seconds that a
            residual lasts.
    """

    unknowns: Unknowns
    theta: Array
    covariance: Array
    sigma: Array
    tau_s: Array

    @property
    def phi(self) -> Array:
        """(e,) inertial parameters, by ``unknowns.inertial.names``."""
        return self.unknowns.inertial.phi(self.unknowns.split(self.theta)[0])

    def phi_covariance(self) -> Array:
        """(e, e) of ``phi``, to first order."""
        u = self.unknowns.split(self.theta)[0]
        return self.unknowns.inertial.covariance(u, self.covariance[: len(u), : len(u)])

    def wrench(self, common: Common, states: Array) -> Array:
        """Predicted (T, 6) of a movement's states."""
        return self.unknowns.wrench(common.core, states, self.theta)


def at_start(unknowns: Unknowns) -> Posterior:
    """The table and the geometry as measured, with the prior."""
    nothing = np.zeros((0, len(unknowns.nuisance_sd) - 1))
    covariance = np.diag(np.where(unknowns.free, unknowns.sd, 0.0) ** 2)
    return Posterior(unknowns, np.zeros(len(unknowns.sd)), covariance, nothing, nothing)


def identify_batch(common: Common, trials: Sequence[MeasuredTrial], unknowns: Unknowns) -> Posterior:
    """Fit what is free in ``unknowns`` to all trials.

    Raises:
        RecordingError: no trial has a second of frames with the wrench.
    """
    rows, own_count = common.rows, len(unknowns.nuisance_sd)
    chosen = [_known(trial, rows) for trial in trials]
    step = [step_of(trial.movement.time) for trial in trials]
    longest = max(map(known_s, trials))
    if longest < SHORTEST_S:
        raise RecordingError(
            f"identification: {longest:.2f} s of frames with the plates' wrench, expected {SHORTEST_S:g} s or more in "
            "one trial"
        )
    sigma = np.tile(FIRST_SIGMA[rows], (len(trials), 1))
    least = [max(1.0, LEAST_TAU_S / dt) for dt in step]
    tau = np.array([[frames] * len(rows) for frames in least])
    free, count = unknowns.free, int(unknowns.free.sum())
    theta = np.zeros(len(unknowns.sd))
    size = count + own_count * len(trials)
    prior = np.concatenate([unknowns.sd[free], np.tile(unknowns.nuisance_sd, len(trials))])
    x = np.zeros(size)
    for _ in range(PASSES):
        H, g, stacked = np.diag(prior**-2.0), np.zeros(size), []
        C = np.zeros((size, int((~free).sum())))
        theta[free] = x[:count]
        for k, (trial, frames) in enumerate(zip(trials, chosen, strict=True)):
            own = slice(count + own_count * k, count + own_count * (k + 1))
            A, b = wrench_rows(common, trial, frames, unknowns, theta)
            columns = np.zeros((len(frames), len(rows), size))
            columns[:, :, :count] = A[:, :, : len(free)][:, :, free]
            columns[:, :, own] = A[:, :, len(free) :]
            target = b + columns @ np.concatenate([x[:count], np.zeros(size - count)])
            weight = 1.0 / (sigma[k] ** 2 * tau[k])
            H += np.einsum("tki,k,tkj->ij", columns, weight, columns, optimize=True)
            g += np.einsum("tki,k,tk->i", columns, weight, target, optimize=True)
            held = A[:, :, : len(free)][:, :, ~free]
            C += np.einsum("tki,k,tkj->ij", columns, weight, held, optimize=True)
            stacked.append((columns, target))
        factor = cho_factor(H)
        x = cho_solve(factor, g)
        for k, (columns, target) in enumerate(stacked):
            left = target - columns @ x
            if len(left):
                sigma[k] = np.maximum(rms(left, axis=0), LEAST_SIGMA)
                tau[k] = [max(least[k], integrated_autocorrelation(left[:, c])) for c in range(len(rows))]
    theta[free] = x[:count]
    covariance = np.zeros((len(theta), len(theta)))
    through = cho_solve(factor, C) * unknowns.considered_sd[~free]  # errors of what is held, on what is free
    spread = cho_solve(factor, np.eye(size)) + through @ through.T
    covariance[np.ix_(free, free)] = spread[:count, :count]
    seconds = tau * np.array(step)[:, None]
    return Posterior(unknowns, theta, covariance, sigma, seconds)


def known_s(trial: MeasuredTrial) -> float:
    """Seconds of frames with the plates' wrench."""
    known = np.isfinite(trial.wrench).all(axis=1).sum()
    return float(known * step_of(trial.movement.time)) if len(trial.wrench) > 1 else 0.0


def _known(trial: MeasuredTrial, rows: npt.NDArray[np.intp]) -> npt.NDArray[np.intp]:
    return np.flatnonzero(np.isfinite(trial.wrench[:, rows]).all(axis=1))


def wrench_rows(
    common: Common, trial: MeasuredTrial, frames: npt.NDArray[np.intp], unknowns: Unknowns, theta: Array
) -> tuple[Array, Array]:
    """d wrench / d [theta; nuisance] (T, r, U + r + 1), and what is left of the measurement (T, r), about the trial's
    reference point."""
    states, rows = trial.movement.states, common.rows
    if len(frames) == 0:
        return np.zeros((0, len(rows), len(theta) + len(rows) + 1)), np.zeros((0, len(rows)))
    predicted = wrench_about(unknowns.wrench(common.core, states, theta), trial.reference)[:, rows]
    slope = np.gradient(predicted, trial.movement.time, axis=0)[frames]
    J = unknowns.jacobian(common.core, states[frames], theta)
    J = wrench_about(J.swapaxes(1, 2), trial.reference).swapaxes(1, 2)[:, rows]
    own = np.concatenate([np.tile(np.eye(len(rows)), (len(frames), 1, 1)), -slope[:, :, None]], axis=2)
    return np.concatenate([J, own], axis=2), wrench_about(trial.wrench[frames], trial.reference)[:, rows] - predicted[
        frames
    ]


_WINDOW = 5.0


def integrated_autocorrelation(residual: Array) -> float:
    """Frames (at least 1) that are worth one independent one, of a residual (T,) without NaN.

    1 + 2 sum rho(k), summed to the first lag of at least ``_WINDOW`` times the sum so far (Sokal 1997, Monte Carlo
    methods in statistical mechanics, section 3). The mean is not taken away: an error that never changes sign is the
    one that misleads most.
    """
    count = len(residual)
    power = float(residual @ residual)
    if count < 4 or power == 0.0:
        return 1.0
    spectrum = np.fft.rfft(residual, 2 * count)
    rho = np.fft.irfft(np.abs(spectrum) ** 2)[:count] / power
    total = 1.0 + 2.0 * np.cumsum(rho[1:])
    lags = np.arange(1, count)
    enough = np.flatnonzero(lags >= _WINDOW * total)
    at = int(enough[0]) if len(enough) else count - 2
    return float(np.clip(total[at], 1.0, count / 2))
