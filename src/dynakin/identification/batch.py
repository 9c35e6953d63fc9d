"""Batch identification: all trials of a subject at once, by Gauss-Newton from priors about the table.

The cost is sum over trials and frames of r' W r + theta' P^-1 theta, r = measured - predicted wrench. W is not the
plates' noise: r is the model's own error, which lasts for many frames, so each component weighs
1 / (s^2 tau), s its RMS over the trial and tau the frames that its error lasts, both measured on the residuals of
the pass before. The covariance counts what is held as uncertain too (Schmidt 1966, "consider" parameters): a length
that is wrong shows as a mass that is wrong, however many frames there are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.linalg import cho_factor, cho_solve

from dynakin.errors import RecordingError
from dynakin.identification.coloured import integrated_autocorrelation
from dynakin.identification.trials import Common, MeasuredTrial
from dynakin.identification.unknowns import NUISANCE, Unknowns

Array = npt.NDArray[np.float64]

PASSES = 4  # linearised anew, and weights measured anew, at each
FIRST_SIGMA = (10.0, 20.0, 10.0)  # N, N, N m: size of a planar model's error before anything is known of it
LEAST_SIGMA = (1.0, 1.0, 1.0)  # a residual that was fitted is smaller than the error
FIRST_TAU_S = 0.25
PLANE = [0, 1, 5]  # fx, fy, mz


@dataclass(frozen=True, eq=False)
class Posterior:
    """What the trials say.

    Attributes:
        unknowns: what was asked. theta: (U,) deviations from the start. covariance: (U, U), 0 for those held.
        sigma: (N, 3) RMS residual by trial, N and N m. tau_s: (N, 3) seconds that a residual lasts.
        nuisance: (N, 4) each trial's slow errors of fx, fy, mz and its delay.
    """

    unknowns: Unknowns
    theta: Array
    covariance: Array
    sigma: Array
    tau_s: Array
    nuisance: Array

    @property
    def phi(self) -> Array:
        """(4 S,) inertial parameters, by ``unknowns.bodies.names``."""
        return self.unknowns.bodies.phi(self.unknowns.split(self.theta)[0])

    def phi_covariance(self) -> Array:
        """(4 S, 4 S) of ``phi``, to first order."""
        u = self.unknowns.split(self.theta)[0]
        J = self.unknowns.bodies.jacobian(u)
        return np.asarray(J @ self.covariance[: len(u), : len(u)] @ J.T)

    def wrench(self, common: Common, states: Array) -> Array:
        """Predicted (T, 6) of a movement's states."""
        return self.unknowns.wrench(common.core, states, self.theta)


def at_start(unknowns: Unknowns) -> Posterior:
    """The table and the geometry as measured, with the prior."""
    nothing = np.zeros((0, 3))
    covariance = np.diag(np.where(unknowns.free, unknowns.sd, 0.0) ** 2)
    return Posterior(unknowns, np.zeros(len(unknowns.sd)), covariance, nothing, nothing, np.zeros((0, NUISANCE)))


def identify_batch(common: Common, trials: Sequence[MeasuredTrial], unknowns: Unknowns) -> Posterior:
    """Fit what is free in ``unknowns`` to all trials.

    Raises:
        RecordingError: no trial has a second of frames with the wrench.
    """
    chosen = [_known(trial) for trial in trials]
    step = [float(np.median(np.diff(trial.movement.time))) for trial in trials]
    if not any(len(rows) * dt >= 1.0 for rows, dt in zip(chosen, step, strict=True)):
        raise RecordingError("identification: no trial has a second of frames with the plates' wrench, expected one")
    sigma = np.tile(np.array(FIRST_SIGMA), (len(trials), 1))
    tau = np.array([[max(1.0, FIRST_TAU_S / dt)] * 3 for dt in step])
    free, count = unknowns.free, int(unknowns.free.sum())
    theta = np.zeros(len(unknowns.sd))
    size = count + NUISANCE * len(trials)
    prior = np.concatenate([unknowns.sd[free], np.tile(unknowns.nuisance_sd, len(trials))])
    x = np.zeros(size)
    for _ in range(PASSES):
        H, g, stacked = np.diag(prior**-2.0), np.zeros(size), []
        C = np.zeros((size, int((~free).sum())))
        theta[free] = x[:count]
        for k, (trial, rows) in enumerate(zip(trials, chosen, strict=True)):
            own = slice(count + NUISANCE * k, count + NUISANCE * (k + 1))
            A, b = _rows(common, trial, rows, unknowns, theta)
            columns = np.zeros((len(rows), 3, size))
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
                sigma[k] = np.maximum(np.sqrt((left**2).mean(axis=0)), LEAST_SIGMA)
                tau[k] = [integrated_autocorrelation(left[:, c]) for c in range(3)]
    theta[free] = x[:count]
    covariance = np.zeros((len(theta), len(theta)))
    through = cho_solve(factor, C) * unknowns.considered_sd[~free]  # errors of what is held, on what is free
    spread = cho_solve(factor, np.eye(size)) + through @ through.T
    covariance[np.ix_(free, free)] = spread[:count, :count]
    seconds = tau * np.array(step)[:, None]
    return Posterior(unknowns, theta, covariance, sigma, seconds, x[count:].reshape(-1, NUISANCE))


def _known(trial: MeasuredTrial) -> npt.NDArray[np.intp]:
    return np.flatnonzero(np.isfinite(trial.wrench[:, PLANE]).all(axis=1))


def _rows(
    common: Common, trial: MeasuredTrial, frames: npt.NDArray[np.intp], unknowns: Unknowns, theta: Array
) -> tuple[Array, Array]:
    """d (fx, fy, mz) / d [theta; nuisance] (T, 3, U + 4), and what is left of the measurement (T, 3)."""
    states = trial.movement.states
    if len(frames) == 0:
        return np.zeros((0, 3, len(theta) + NUISANCE)), np.zeros((0, 3))
    predicted = unknowns.wrench(common.core, states, theta)[:, PLANE]
    slope = np.gradient(predicted, trial.movement.time, axis=0)[frames]
    J = unknowns.jacobian(common.core, states[frames], theta)[:, PLANE]
    own = np.concatenate([np.tile(np.eye(3), (len(frames), 1, 1)), -slope[:, :, None]], axis=2)
    return np.concatenate([J, own], axis=2), trial.wrench[frames][:, PLANE] - predicted[frames]
