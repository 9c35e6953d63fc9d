"""The whole body in space, from trials to the filter."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import dynakin
from dynakin.errors import RecordingError
from dynakin.filter.augment import initial_covariance
from dynakin.identification.decision import estimate, rms_of
from dynakin.identification.subject import Identification, identify_subject
from dynakin.identification.trials import Common, measure_all
from dynakin.model.inertia import RigidBody
from dynakin.simulation.trial import simulate


def estimator() -> dynakin.Estimator:
    subject = dynakin.Subject(mass_kg=70.0, height_m=1.75, sex="male")
    return dynakin.Estimator(dynakin.load_model("fullbody", subject=subject, markers="opencap"))


@pytest.fixture(scope="module")
def identified() -> Identification:
    trials = [simulate("fullbody", "squat", 2, 6.0).recording, simulate("fullbody", "gait", 2, 4.0).recording]
    return identify_subject(estimator(), trials, static=simulate("fullbody", "squat", 2, 5.0).recording)


def test_bodies_are_possible_and_weigh_what_was_measured(identified: Identification) -> None:
    bodies = [RigidBody.from_vector(vector) for vector in np.array(identified.subject.batch.values).reshape(-1, 10)]
    assert len(bodies) == 15
    assert all(body.possible() for body in bodies)
    assert sum(body.mass for body in bodies) == pytest.approx(70.0, rel=1e-9)
    for text in ("FZ", "MX", "70.00 kg together", "right thigh"):
        assert text in " ".join(identified.subject.report)


def test_six_rows_fit_better_than_the_table_and_errors_are_about_the_feet(identified: Identification) -> None:
    common, trial = identified.common, identified.trials[0]
    assert common.rows.tolist() == [0, 1, 2, 3, 4, 5]
    assert np.linalg.norm(trial.reference - [0.4, 0.0, 0.4]) < 0.3
    table, fitted = 0.0, 0.0
    for each in identified.trials:
        before = estimate(common, identified.trials, "table").wrench(common, each.movement.states)
        table += float(rms_of(common, each, before) @ rms_of(common, each, before))
        after = rms_of(common, each, identified.posterior.wrench(common, each.movement.states))
        fitted += float(after @ after)
    assert fitted < table
    walked = identified.trials[1].wrench
    unknown = np.isnan(walked).any(axis=1)
    assert 0 < unknown.sum() < len(walked)  # where a foot is off the plates


def test_jacobian_of_the_wrench_is_the_central_difference(identified: Identification) -> None:
    unknowns, core = identified.posterior.unknowns, identified.common.core
    theta, h = 0.3 * unknowns.sd * np.random.default_rng(2).normal(size=len(unknowns.sd)), 1e-6
    states = identified.trials[1].movement.states[20:21]
    J = unknowns.jacobian(core, states, theta)
    assert not any(name.startswith("zero/pelvis") for name in unknowns.names)
    for k, name in enumerate(unknowns.names):
        step = np.zeros(len(theta))
        step[k] = h
        numeric = (unknowns.wrench(core, states, theta + step) - unknowns.wrench(core, states, theta - step)) / (2 * h)
        np.testing.assert_allclose(J[:, :, k], numeric, atol=2e-5, err_msg=name)


def test_the_filter_starts_from_it(identified: Identification) -> None:
    other = replace(estimator(), parameters=identified.subject.model_copy(update={"use": "bodies"}))
    after = other.start(identified.trials[0].movement.recording, static=identified.common.static).calibrated
    at = [after.names.index(name) for name in identified.subject.batch.names]
    np.testing.assert_allclose(after.x0[at], identified.subject.batch.values, rtol=1e-9)
    P = initial_covariance(after, other.noise)
    assert np.linalg.eigvalsh(P / np.sqrt(np.outer(np.diag(P), np.diag(P)))).min() > 0.0


def test_somebody_else_on_the_plates_is_refused_before_anything_takes_long() -> None:
    squat = simulate("fullbody", "squat", 2, 5.0)
    heavier = simulate("fullbody", "squat", 2, 5.0, mass_kg=76.0).recording
    common = Common.measure(estimator(), squat.recording)
    common.check(squat.recording)
    with pytest.raises(RecordingError, match=r"carry 76\.\d kg on average, the subject weighs 70\.0 kg"):
        common.check(heavier)


def test_a_walk_is_foretold_without_its_plates(identified: Identification) -> None:
    """Other plates under the judging trial: the same prediction to the last bit, another verdict."""
    common, (squat, walk) = identified.common, identified.trials
    recording = simulate("fullbody", "gait", 2, 4.0).recording
    plates = tuple(replace(plate, force=1.02 * plate.force, moment=0.9 * plate.moment) for plate in recording.plates)
    (changed,) = measure_all(common, [recording.with_plates(plates)])
    assert not np.array_equal(changed.wrench, walk.wrench, equal_nan=True)
    said = estimate(common, [squat], "bodies")
    for before, after in ((walk, changed), (walk.full_band(), changed.full_band())):
        wrenches = [said.wrench(common, each.movement.states) for each in (before, after)]
        np.testing.assert_array_equal(wrenches[1], wrenches[0])
        assert not np.array_equal(rms_of(common, after, wrenches[1]), rms_of(common, before, wrenches[0]))
