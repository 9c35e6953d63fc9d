"""A walk across three plates: where a stance foot is beside them, the wrench is neither fed nor judged."""

from __future__ import annotations

import numpy as np
import pytest

import dynakin
from dynakin.filter.estimator import Estimator
from dynakin.filter.measurements import Measurements
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.recordings.feet.assignment import foot_loads
from dynakin.recordings.recording import Recording
from dynakin.results.measures.metrics import evaluation_window
from dynakin.simulation.trial import simulate
from dynakin.studies.tuning.trial import prepare
from dynakin.units import COMPONENTS
from dynakin.validation.held_out import Blind, judge, measured_wrench
from dynakin.validation.yardsticks import Judged

WRONG = 1e6


@pytest.fixture(scope="module")
def walk() -> Recording:
    return simulate("fullbody", "gait", 3, 5.0, 50.0).recording


@pytest.fixture(scope="module")
def estimator() -> Estimator:
    subject = dynakin.Subject(mass_kg=70.0, height_m=1.75, sex="male")
    return Estimator(dynakin.load_model("fullbody", subject))


@pytest.fixture(scope="module")
def initial(walk: Recording, estimator: Estimator) -> CalibratedModel:
    return estimator.start(walk).calibrated


@pytest.fixture(scope="module")
def known(walk: Recording, initial: CalibratedModel) -> np.ndarray:
    found = foot_loads(walk, initial.ground, initial.foot_markers).total_known
    judged = found[evaluation_window(walk.time)]
    assert judged.any() and not judged.all()
    return found


def test_one_mask_feeds_and_judges(
    walk: Recording, estimator: Estimator, initial: CalibratedModel, known: np.ndarray
) -> None:
    _, fed, _ = estimator.measured(walk, initial)
    for wrench in (fed, measured_wrench(walk, initial)[0], prepare(walk, estimator).wrench):
        assert np.array_equal(np.isfinite(wrench).all(axis=1), known)


def test_frames_beside_the_plates_are_not_judged(walk: Recording, initial: CalibratedModel, known: np.ndarray) -> None:
    """A prediction that is right where the total is known, and absurd elsewhere, has no error."""
    wrench = initial.ground.wrench_to_ground(walk.total_wrench())
    wrench[~known] = WRONG
    rows = judge(Blind(walk, initial, {"right where known": wrench}, ()), walk)
    assert {row.quantity for row in rows} == set(COMPONENTS)
    assert all(row.rms.mean == 0.0 for row in rows)
    measured = Measurements(walk.time, np.empty((walk.n_frames, 0, 3)), measured_wrench(walk, initial)[0])
    assert set(Judged(initial, measured).wrench("", "right where known", wrench).values()) == {0.0}
