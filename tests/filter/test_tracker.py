"""An estimator that does not change, trackers that do, and results by name."""

import dataclasses

import numpy as np
import pytest

import dynakin
from dynakin.errors import ModelError, RecordingError
from dynakin.simulation.trial import simulate_squat
from support.squat_estimator import estimator, samples


@pytest.fixture(scope="module")
def recording() -> dynakin.Recording:
    return simulate_squat(seed=2, duration_s=5.0).recording


def test_an_estimator_does_not_change(recording: dynakin.Recording) -> None:
    made = estimator()
    with pytest.raises(dataclasses.FrozenInstanceError):
        made.side = "left"  # type: ignore[misc]
    other = dataclasses.replace(made, side="right", vertical="+Z")
    assert (made.side, other.side, other.vertical) == ("auto", "right", "+Z")
    assert other.noise is made.noise and other.model is made.model


def test_trackers_of_one_estimator_do_not_see_each_other(recording: dynakin.Recording) -> None:
    calibrated = estimator().calibrate(recording)
    one, other = estimator().start(calibrated), estimator().start(calibrated)
    begun = other.state
    for sample in samples(recording)[:20]:
        one.step(sample)
    np.testing.assert_array_equal(other.state, begun)
    assert not np.array_equal(one.state, begun)
    np.testing.assert_array_equal(one.fresh().state, begun)
    np.testing.assert_array_equal(one.fresh().covariance, other.covariance)


def test_a_calibrated_model_starts_as_its_recording_does(recording: dynakin.Recording) -> None:
    made = estimator()
    own, given = made.start(recording), made.start(made.calibrate(recording))
    assert own.calibrated.names == given.calibrated.names
    np.testing.assert_array_equal(own.calibrated.x0, given.calibrated.x0)
    again = made.start(own.calibrated)  # what the noise adds is there already
    for name in ("x0", "sd0", "lower", "upper", "unmodelled_m"):
        np.testing.assert_array_equal(getattr(again.calibrated, name), getattr(own.calibrated, name))
    np.testing.assert_array_equal(again.covariance, own.covariance)


def test_the_latest_is_the_start_and_then_each_step(recording: dynakin.Recording) -> None:
    tracker = estimator().start(recording)
    start = tracker.latest
    assert np.isnan(start.time_s) and start.report is None
    assert start.coordinates["knee"] == tracker.state[tracker.calibrated.names.index("knee")]
    step = tracker.step(samples(recording)[0])
    assert tracker.latest is step and step.report is not None


def test_results_have_names(recording: dynakin.Recording) -> None:
    tracker = estimator().start(recording)
    for sample in samples(recording)[:5]:
        step = tracker.step(sample)
    names = tracker.core_model.coordinate_names
    for kind in ("coordinates", "speeds", "accelerations", "moments"):
        found = getattr(step, kind)
        assert [found[name] for name in names] == list(step.values[kind]) == list(found.as_dict().values())
        assert found["knee"] == found[names.index("knee")]
    assert step.wrench["fy"] == step.values["wrench"][1]
    knee = [marker.name for marker in tracker.calibrated.spec.markers].index("r_knee")
    np.testing.assert_array_equal(step.markers["r_knee"], step.values["markers"][knee])
    sd = tracker.deviations()["coordinates"]
    assert 0.0 < sd["knee"] == sd[names.index("knee")]
    with pytest.raises(ModelError, match=r"'kne': unknown \(did you mean 'knee'\?\); expected one of toe, ankle, knee"):
        step.moments["kne"]


def test_named_results_are_arrays_as_well(recording: dynakin.Recording) -> None:
    step = estimator().start(recording).step(samples(recording)[0])
    q = step.values["coordinates"]
    assert np.asarray(step.coordinates) is q and len(step.coordinates) == len(q)
    np.testing.assert_array_equal(2.0 * step.coordinates - q, q)
    np.testing.assert_array_equal(np.sin(step.coordinates), np.sin(q))
    np.testing.assert_array_equal(np.stack([step.coordinates, q]), np.stack([q, q]))
    assert (step.coordinates == q).all() and step.coordinates[-1] == q[-1]
    assert np.array(step.coordinates, copy=True) is not q
    assert "knee" in repr(step.coordinates)


def test_a_plate_that_a_sample_lacks_is_not_known(recording: dynakin.Recording) -> None:
    """Not empty: the plates' sum would be half of the weight."""
    whole = samples(recording)[:20]
    unknown = {name: [np.nan] * 6 for name in whole[0].plates}
    calibrated = estimator().calibrate(recording)
    for start in (recording, calibrated):  # whose plates are known at once, or from the first sample on
        one, other = estimator().start(start), estimator().start(start)
        for k, sample in enumerate(whole):
            first = dict(list(sample.plates.items())[: 1 if k else 2])
            given = one.step(dataclasses.replace(sample, plates=first))
            expected = other.step(sample if not k else dataclasses.replace(sample, plates=unknown))
            np.testing.assert_array_equal(given.moments, expected.moments)
    strange = dataclasses.replace(whole[0], plates={"FP1": [0.0] * 6})
    with pytest.raises(RecordingError, match="plate 'FP1' is unknown, expected plate 1, plate 2, as in the recording"):
        estimator().start(recording).step(strange)
