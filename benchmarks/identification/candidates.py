"""Ways to identify a subject, each as a function from trials to (inertia, geometry): what the study compares."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress

import numpy as np

from dynakin.arrays import wrench_about
from dynakin.bindings import _core
from dynakin.errors import DynakinError, RecordingError
from dynakin.filter.estimator import Estimator
from dynakin.identification.batch import FIRST_SIGMA, Posterior, at_start, identify_batch
from dynakin.identification.trials import Common, MeasuredTrial
from dynakin.identification.unknowns import Unknowns
from dynakin.recordings.recording import Recording
from dynakin.settings import presets
from dynakin.validation.freeze import final_values
from dynakin.validation.reference.base_parameters import base_parameters
from dynakin.validation.reference.condensed import stacked
from dynakin.validation.reference.least_squares import free_parameters

Array = np.ndarray


def filtered(common: Common, recordings: Sequence[Recording], preset: str) -> Array | None:
    """phi that a filter ends with, mean over the trials that it does not lose; None where it loses all."""
    names, found = Unknowns.of(common).inertial.names, []
    for recording in recordings:
        given = common.estimator
        estimator = Estimator(given.model, presets.preset(preset), side=given.side, vertical=given.vertical)
        try:
            values = final_values(estimator.run(recording, static=common.static, lag_s=0.0))
        except DynakinError:
            continue
        found.append([values[name] for name in names])
    return np.mean(found, axis=0) if found else None


def regressor(common: Common, trial: MeasuredTrial) -> Array:
    """(T, r, e) about the trial's reference point: the wrench is linear in phi."""
    unknowns = Unknowns.of(common)
    rows = np.array([_core.wrench_jacobian(common.core, x) for x in trial.movement.states])[:, :, unknowns.inertia]
    return wrench_about(rows.swapaxes(1, 2), trial.reference).swapaxes(1, 2)[:, common.rows]


def known(common: Common, trial: MeasuredTrial) -> tuple[Array, Array, Array]:
    """Regressor (T, r, e), wrench (T, r) and the frames (T,) in which it is known."""
    wrench = wrench_about(trial.wrench, trial.reference)[:, common.rows]
    return regressor(common, trial), wrench, np.isfinite(wrench).all(axis=1)


def prior_spread(common: Common) -> Array:
    """(e, e) A with phi = table + A z, z of unit variance: what the table may be wrong by."""
    inertial = Unknowns.of(common).inertial
    P = inertial.covariance(np.zeros(len(inertial.sd)), np.diag(inertial.sd**2))
    values, vectors = np.linalg.eigh(P)
    return vectors * np.sqrt(np.maximum(values, 0.0))


def free(common: Common, trials: Sequence[MeasuredTrial]) -> Array:
    """Free least squares with the declared weights; what no frame sees stays at the table."""
    inertial = Unknowns.of(common).inertial
    table = inertial.phi(np.zeros(len(inertial.sd)))
    scale = np.linalg.norm(prior_spread(common), axis=1)
    every = np.ones(len(table), dtype=bool)
    parts = [(Y[on], y[on]) for Y, y, on in (known(common, trial) for trial in trials)]
    Y, y = (np.concatenate(values) for values in zip(*parts, strict=True))
    sigma = FIRST_SIGMA[common.rows].tolist()
    problem = stacked(inertial.names, table, scale, every, Y, y, mass_kg=inertial.total, sigma=sigma)
    return free_parameters(problem, base_parameters(problem).rank)


def base_estimate(common: Common, trials: Sequence[MeasuredTrial], like: Posterior) -> Array:
    """Base parameters with the prior that the table's spread gives them, weights as in ``like``; no body is asked to be
    possible. What the base parameters do not hold stays where it moves with them in the prior."""
    inertial = Unknowns.of(common).inertial
    table, spread = inertial.phi(np.zeros(len(inertial.sd))), prior_spread(common)
    H, g = np.eye(spread.shape[1]), np.zeros(spread.shape[1])
    for k, trial in enumerate(trials):
        step = float(np.median(np.diff(trial.movement.time)))
        weight = step / (like.sigma[k] ** 2 * like.tau_s[k])
        Y, y, on = known(common, trial)
        A, left = Y[on] @ spread, y[on] - Y[on] @ table
        H += np.einsum("tki,k,tkj->ij", A, weight, A, optimize=True)
        g += np.einsum("tki,k,tk->i", A, weight, left)
    return table + spread @ np.linalg.solve(H, g)


def predicted(common: Common, states: Array, phi: Array, geometry: Posterior | None = None) -> Array:
    """(T, 6) with these inertial parameters, and lengths and zeros of ``geometry``."""
    posterior = geometry or at_start(Unknowns.of(common, inertia=False))
    moved = posterior.unknowns.states(states, posterior.theta)
    moved[:, posterior.unknowns.inertia] = phi
    return np.array([_core.wrench(common.core, x) for x in moved])


def batch(common: Common, trials: Sequence[MeasuredTrial], *, inertia: bool, geometry: bool) -> Posterior:
    """The library's estimate."""
    return identify_batch(common, trials, Unknowns.of(common, inertia=inertia, geometry=geometry))


def all_candidates(
    common: Common, trials: Sequence[MeasuredTrial], recordings: Sequence[Recording], filters: Sequence[str] = ()
) -> dict[str, tuple[Array, Posterior | None]]:
    """phi and geometry by name of the candidate."""
    geometry = batch(common, trials, inertia=False, geometry=True)
    inertia = batch(common, trials, inertia=True, geometry=False)
    both = batch(common, trials, inertia=True, geometry=True)
    found: dict[str, tuple[Array, Posterior | None]] = {"table": (geometry.phi, None)}
    for preset in filters:
        phi = filtered(common, recordings, preset)
        if phi is not None:
            found[f"filter, {preset}"] = (phi, None)
    with suppress(RecordingError):  # fewer frames than parameters
        found["least squares, free"] = (free(common, trials), None)
    found["base parameters, prior"] = (base_estimate(common, trials, inertia), None)
    found["inertia"] = (inertia.phi, None)
    found["geometry"] = (geometry.phi, geometry)
    found["geometry and inertia"] = (both.phi, both)
    return found
