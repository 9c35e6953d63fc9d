"""The batch estimate: exact data give the truth back, plates are not looked at for kinematics, coloured errors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dynakin.identification.batch import identify_batch, integrated_autocorrelation
from dynakin.identification.decision import decide
from dynakin.identification.trials import MeasuredTrial
from dynakin.identification.unknowns import Unknowns
from support.identification import Case

PLANE = [0, 1, 5]


def exact(case: Case, theta: np.ndarray) -> list[MeasuredTrial]:
    """Trials whose plates say what the model says for theta."""
    unknowns = Unknowns.of(case.common)
    return [
        replace(trial, wrench=unknowns.wrench(case.common.core, trial.movement.states, theta)) for trial in case.trials
    ]


def test_exact_plates_give_back_the_wrench_of_the_truth(case: Case, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where no error is held to last, so that the data outweigh the prior."""
    monkeypatch.setattr("dynakin.identification.batch.LEAST_TAU_S", 0.0)
    unknowns = Unknowns.of(case.common, geometry=False)
    theta = np.where(unknowns.free, unknowns.sd, 0.0) * np.random.default_rng(5).normal(size=len(unknowns.sd))
    trials = exact(case, theta)
    found = identify_batch(case.common, trials[:1], unknowns)
    states = trials[1].movement.states
    before = np.sqrt(((trials[1].wrench - unknowns.wrench(case.common.core, states, 0.0 * theta))[:, 5] ** 2).mean())
    after = np.sqrt(((trials[1].wrench - found.wrench(case.common, states))[:, 5] ** 2).mean())
    assert after < 0.15 * before


def test_what_is_not_free_stays_and_the_mass_is_kept(case: Case) -> None:
    unknowns = Unknowns.of(case.common, geometry=False)
    found = identify_batch(case.common, case.trials, unknowns)
    assert not found.theta[~unknowns.free].any()
    assert found.phi[0::4].sum() == pytest.approx(case.common.initial.mass_kg, rel=1e-9)
    sure = identify_batch(case.common, case.trials, replace(unknowns, considered_sd=0.0 * unknowns.sd))
    assert (np.diag(sure.covariance) <= unknowns.sd**2 * (1 + 1e-9)).all()
    np.testing.assert_array_equal(sure.theta, found.theta)
    wider = np.linalg.eigvalsh(found.covariance - sure.covariance)
    assert wider.min() > -1e-12 and wider.max() > 0.0


def test_kinematics_do_not_depend_on_the_plates(case: Case) -> None:
    recording = case.sims[1].recording
    loads = tuple(replace(plate, force=3.0 * plate.force, moment=-plate.moment) for plate in recording.plates)
    np.testing.assert_array_equal(
        case.common.see(replace(recording, plates=loads)).states, case.trials[1].movement.states
    )


def test_frames_without_plates_are_left_out(case: Case) -> None:
    unknowns = Unknowns.of(case.common, geometry=False)
    trial = case.trials[0]
    gone = trial.wrench.copy()
    gone[::2] = np.nan
    found = identify_batch(case.common, [replace(trial, wrench=gone)], unknowns)
    assert np.isfinite(found.theta).all()
    residual = (trial.wrench - found.wrench(case.common, trial.movement.states))[:, PLANE]
    assert np.sqrt(np.nanmean(residual[:, 2] ** 2)) < 10.0


def test_no_error_is_taken_for_short(case: Case) -> None:
    """Errors of geometry come back with each repetition, so more frames do not average them out."""
    found = identify_batch(case.common, case.trials, Unknowns.of(case.common, geometry=False))
    assert (found.tau_s >= 0.25 - 1e-9).all()


def test_autocorrelation_of_a_first_order_process() -> None:
    rng, rho, count = np.random.default_rng(0), 0.9, 40_000
    x = np.zeros(count)
    for k, e in enumerate(rng.normal(size=count)[1:], start=1):
        x[k] = rho * x[k - 1] + e
    assert integrated_autocorrelation(x) == pytest.approx((1 + rho) / (1 - rho), rel=0.15)
    assert integrated_autocorrelation(rng.normal(size=count)) == pytest.approx(1.0, abs=0.1)


def test_where_the_table_is_right_it_is_kept(case: Case) -> None:
    """Plates that say what the table says, with errors that last: nothing that others fit to them may be used."""
    rng = np.random.default_rng(3)
    unknowns = Unknowns.of(case.common)
    trials = []
    for trial in exact(case, np.zeros(len(unknowns.sd))):
        count = len(trial.movement.time)
        slow = np.repeat(rng.normal(size=(count // 10 + 1, 6)), 10, axis=0)[:count]
        trials.append(replace(trial, wrench=trial.wrench + slow * [5.0, 5.0, 0.0, 0.0, 0.0, 3.0]))
    decision = decide(case.common, trials)
    assert decision.use == "table"
    assert decision.in_words()[-1].startswith("The table is kept: held-out gain")
