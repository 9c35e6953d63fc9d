"""Whether a half of a trial knows what predicts the other half."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import dynakin
from dynakin.filter.estimator import Estimator
from dynakin.identification.subject import with_subject
from dynakin.recordings.recording import Recording
from dynakin.simulation.trial import simulate_squat
from dynakin.validation.case import Setup
from dynakin.validation.held_out import Blind, IdentifyingTrial, halves, identify_on, judge, predict_blind


@pytest.fixture(scope="module")
def parts() -> tuple[Recording, Recording]:
    return halves(simulate_squat(seed=3, duration_s=12.0, mass_kg=70.0).recording)


@pytest.fixture(scope="module")
def fitted(parts: tuple[Recording, Recording]) -> IdentifyingTrial:
    subject = dynakin.Subject(mass_kg=70.0, height_m=1.75, sex="male")
    setup = Setup(Estimator(dynakin.load_model("sagittal7", subject, markers="opencap")))
    return identify_on(parts[0], setup, same_recording=True)


@pytest.fixture(scope="module")
def blind(fitted: IdentifyingTrial, parts: tuple[Recording, Recording]) -> Blind:
    chosen, said = with_subject(fitted)
    assert chosen.subject is not None and chosen.subject.use == "bodies" and "is used" in said[-1]
    return predict_blind(chosen, parts[1])


def test_what_is_chosen_is_no_worse_than_the_table(blind: Blind, parts: tuple[Recording, Recording]) -> None:
    rms = {(row.quantity, row.method): row.rms.mean for row in judge(blind, parts[1])}
    for component in ("fx", "fy", "mz"):
        chosen, table = (rms[component, f"EKF (default), {label}"] for label in ("chosen", "table"))
        assert chosen is not None and table is not None and chosen < 1.02 * table, component
    assert rms["fy", "EKF (default), chosen"] < rms["fy", "EKF (default), table"]  # type: ignore[operator]


def test_chosen_is_the_table_where_the_table_is_kept(
    fitted: IdentifyingTrial, blind: Blind, parts: tuple[Recording, Recording]
) -> None:
    subject = with_subject(fitted)[0].subject
    assert subject is not None
    kept = predict_blind(replace(fitted, subject=subject.model_copy(update={"use": "table"})), parts[1]).wrenches
    assert np.array_equal(kept["EKF (default), chosen"], kept["EKF (default), table"])
    assert np.array_equal(kept["EKF (default), batch inertia"], blind.wrenches["EKF (default), chosen"])
    assert not np.array_equal(kept["EKF (default), chosen"], blind.wrenches["EKF (default), chosen"])


def test_predictions_are_smoothed_unless_they_are_to_be_as_live(
    fitted: IdentifyingTrial, parts: tuple[Recording, Recording]
) -> None:
    live = replace(fitted, setup=replace(fitted.setup, lag_s=0.0))
    rms = [
        {(row.quantity, row.method): row.rms.mean for row in judge(predict_blind(one, parts[1]), parts[1])}
        for one in (fitted, live)
    ]
    smoothed, as_live = (figures["fy", "EKF (default), table"] for figures in rms)
    assert smoothed is not None and as_live is not None and smoothed < 0.5 * as_live
    assert ("fy", "EKF (default), chosen") not in rms[0]  # no subject was asked for


def test_where_nothing_can_be_identified_nothing_is_chosen_and_it_says_why(
    fitted: IdentifyingTrial, parts: tuple[Recording, Recording]
) -> None:
    start = float(parts[0].time[0])
    brief, said = with_subject(replace(fitted, recording=parts[0].window(start, start + 0.8)))
    assert brief.subject is None and said[0].startswith("No batch inertia, so nothing is chosen: ")
