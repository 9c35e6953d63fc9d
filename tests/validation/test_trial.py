"""A trial made from an estimate that is there already, and its repetitions by method."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import dynakin
from dynakin.errors import ModelError, RecordingError
from dynakin.model.identified import IdentifiedSubject
from dynakin.recordings.frame import find_ground_frame
from dynakin.results.measures.mean_curves import MEASURED
from dynakin.results.measures.repetitions import body_paths, find_repetitions
from dynakin.simulation.output import SimulatedTrial
from dynakin.validation.case import Setup
from dynakin.validation.methods import ComparedTrial, trial_of
from dynakin.validation.reference.chain import PlanarChain
from dynakin.validation.reference.classical import classical_angles, landmark_paths


@pytest.fixture(scope="module")
def initial(simulated: SimulatedTrial, setup: Setup) -> dynakin.CalibratedModel:
    return setup.estimator("default").start(simulated.recording).calibrated


def test_a_comparison_starts_from_the_identified_subject(setup: Setup) -> None:
    subject = IdentifiedSubject.model_construct(use="table")
    assert replace(setup, common=replace(setup.common, parameters=subject)).estimator("default").parameters is subject


def test_nothing_is_filtered_again(compared: ComparedTrial, initial: dynakin.CalibratedModel, setup: Setup) -> None:
    again = trial_of(compared.estimates, initial, setup.definition)
    for one, other in zip(compared.methods, again.methods, strict=True):
        assert one.name == other.name
        np.testing.assert_array_equal(one.wrench, other.wrench)
        np.testing.assert_array_equal(one.markers, other.markers)
    assert again.methods[0].data is compared.estimates["default"].data


def test_repetitions_lie_after_the_adaptation_and_every_method_has_their_curves(compared: ComparedTrial) -> None:
    assert compared.repetitions.movement == "squat" and compared.repetitions.items
    assert all(compared.window[r.first : r.last + 1].all() for r in compared.repetitions.items)
    curves = compared.curves()
    names = [method.name for method in compared.methods]
    assert {c.method for c in curves if c.quantity == "knee/moment"} == set(names)
    assert {c.method for c in curves if c.quantity == "fy"} == {*names, MEASURED}
    (measured,) = [c for c in curves if (c.method, c.quantity) == (MEASURED, "fy")]
    assert measured.mean_per_kg is not None
    assert measured.mean_per_kg.mean() == pytest.approx(
        9.8, abs=0.7
    )  # over a squat the person rises as far as it sinks


def test_a_reference_that_cannot_be_had_is_a_note_where_the_run_asks_for_whatever_there_is(
    compared: ComparedTrial, initial: dynakin.CalibratedModel, setup: Setup
) -> None:
    with pytest.raises(RecordingError, match="80 Hz is not possible at 100 Hz"):
        trial_of(compared.estimates, initial, setup.definition, 80.0)
    alone = trial_of(compared.estimates, initial, setup.definition, 80.0, tolerant=True)
    assert [method.name for method in alone.methods] == ["EKF (default)"]
    (note,) = alone.notes
    assert note.text.startswith("AT and the classical method are left out: ") and "\n" not in note.text


def test_a_landmark_that_the_recording_does_not_give_is_named(
    simulated: SimulatedTrial, initial: dynakin.CalibratedModel, setup: Setup
) -> None:
    landmarks = landmark_paths(simulated.recording, initial, setup.definition)
    del landmarks["hip"]
    with pytest.raises(ModelError, match=r"of thigh needs the landmarks .* do not give hip"):
        classical_angles(PlanarChain.of(initial.plan), initial.plan, landmarks)


def test_a_walk_has_curves_of_each_foot(data_dir: Path, compared: ComparedTrial) -> None:
    recording = dynakin.read(data_dir / "plugin_gait" / "GaitNormal_1.c3d")
    found = find_repetitions(body_paths(recording, find_ground_frame(recording)))
    short = {"time": recording.time, "repetitions": found}
    methods = tuple(
        replace(
            m,
            coordinates=m.coordinates[:215],
            moments=m.moments[:215],
            wrench=m.wrench[:215],
            data=m.data.isel(time=slice(215)),  # says of each moment where it comes from
        )
        for m in compared.methods
    )
    walk = replace(compared, methods=methods, measured_wrench=compared.measured_wrench[:215], **short)
    assert {(c.side, c.movement) for c in walk.curves()} == {("left", "gait"), ("right", "gait")}
