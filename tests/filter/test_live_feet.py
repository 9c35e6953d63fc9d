"""Step by step with the feet's wrenches: what the run over the whole recording gives."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from dynakin import Estimator, Subject, load_model
from dynakin.errors import ModelError
from dynakin.filter.contacts import ContactLoads
from dynakin.filter.ground.expected import ContactPaths, expected_loads
from dynakin.filter.ground.ground import Ground
from dynakin.filter.measurements import Measurements
from dynakin.filter.samples import Sample, marker_paths, total_wrench
from dynakin.filter.sources import ContactSources
from dynakin.filter.tracker import Tracker
from dynakin.filter.uncertainty.frames import Frames
from dynakin.filter.uncertainty.geometry import Blocks
from dynakin.recordings.feet.assignment import foot_loads
from dynakin.recordings.feet.contact import UNMEASURED
from dynakin.recordings.recording import Recording
from dynakin.results.measures.metrics import compute_metrics
from dynakin.results.measures.sources import ABSENT, DERIVED, MEASURED, PRIOR, legs_of
from dynakin.results.records import REFUSED
from dynakin.settings import presets
from support.simulated import simulate


def test_step_by_step_moments_bands_and_the_delayed_are_those_of_the_run() -> None:
    recording = simulate("fullbody", "squat", 1, 5.0).recording.window(2.0, 2.4)
    model = load_model("fullbody", Subject(mass_kg=70.0, height_m=1.75, sex="male"))
    live = Estimator(model, presets.default().changed(systematic_scale=0.0, adapt=False)).start(recording, lag_s=0.04)
    initial = live.calibrated
    feet = _feet(recording, live)
    markers, wrench = marker_paths(recording, initial), total_wrench(recording, initial)
    measured = Measurements(recording.time, markers, wrench, feet)
    for sample, part in zip(_samples(recording), _frames(feet), strict=True):
        now = live.step(sample, part)
    arrays = Estimator(model).start(initial).run_arrays(measured)
    np.testing.assert_allclose(now.moments, arrays["moments"][-1], atol=1e-6)
    np.testing.assert_allclose(live.deviations()["moments"], arrays["moments_sd"][-1], rtol=1e-6, atol=1e-9)
    smoothed = Estimator(model).start(initial).run_smoothed_arrays(measured)
    delayed = live.delayed()
    assert delayed is not None and np.abs(delayed.moments[6:]).max() > 30.0
    np.testing.assert_allclose(delayed.moments, smoothed["moments"][-5], atol=1e-5)
    with pytest.raises(ModelError, match="segment 'paw' is not in the model"):
        live.step(sample, replace(part, segments=("paw", "foot_l")))


def test_a_loop_gives_its_plates_to_the_feet_that_stand_on_them() -> None:
    """As a run does, without being told of feet; names of plates that the start did not have come with the samples."""
    recording = simulate("fullbody", "squat", 1, 5.0).recording.window(2.0, 2.4)
    model = load_model("fullbody", Subject(mass_kg=70.0, height_m=1.75, sex="male"))
    live = Estimator(model).start(recording)
    legs = [k for k, c in enumerate(live.calibrated.spec.coordinates) if c.name.startswith(("hip", "knee", "ankle"))]
    before = live.latest
    assert (before.moment_sources.values[legs] == ABSENT).all() and np.isnan(before.moments.values[legs]).all()
    assert before.moment_sources["elbow_flex_r"] == MEASURED
    told, unknown = live.fresh(), Estimator(model).start(live.calibrated)
    samples = _samples(recording)
    for sample, part in zip(samples, _frames(_feet(recording, live)), strict=True):
        now, there, found = live.step(sample), told.step(sample, part), unknown.step(sample)
        np.testing.assert_array_equal(found.moments, now.moments)
        np.testing.assert_allclose(now.moments.values[legs], there.moments.values[legs], atol=1.0)
        np.testing.assert_allclose(now.wrench, there.wrench, atol=1.0)
        assert (now.moment_sources.values[legs] == MEASURED).all()
    assert np.abs(now.moments.values[legs]).max() > 30.0
    np.testing.assert_allclose(
        live.deviations()["moments"].values[legs], told.deviations()["moments"].values[legs], 0.2
    )
    assert live.feet is not None and live.feet.whole and not live.feet.news()
    late = dict(samples[-1].plates)
    last = replace(samples[-1], time_s=samples[-1].time_s + 0.01)
    late.pop(next(iter(late)))
    assert (live.step(replace(last, plates=late)).moment_sources.values[legs] > MEASURED).any() and live.feet.news()
    assert (unknown.step(replace(last, plates={})).moment_sources.values[legs] > MEASURED).any()


def test_a_session_counts_measured_moments_more_once_a_foot_has_stood_off_the_plates() -> None:
    """As a recording does: late ones, in all frames from then on."""
    recording = simulate("fullbody", "squat", 1, 5.0).recording.window(2.0, 2.2)
    model = load_model("fullbody", Subject(mass_kg=70.0, height_m=1.75, sex="male"))
    for off_plates in (False, True):
        live = Estimator(model, presets.default()).start(recording, lag_s=0.04)
        samples, frames = _samples(recording), list(_frames(_feet(recording, live)))
        if off_plates:
            contact = frames[2].contact.copy()
            contact[0, 0] = UNMEASURED
            frames[2] = replace(frames[2], contact=contact)
        for sample, part in zip(samples, frames, strict=True):
            live.step(sample, part)
        before = {late: live.deviations(delayed=late)["moments"].values for late in (True, False)}
        assert live.systematic is not None
        live.systematic.sizes = replace(live.systematic.sizes, own_off_plates=25.0)
        after = {late: live.deviations(delayed=late)["moments"].values for late in (True, False)}
        np.testing.assert_array_equal(after[False], before[False])
        knee = [coordinate.name for coordinate in live.calibrated.spec.coordinates].index("knee_angle_l")
        assert (after[True][knee] > before[True][knee]) == off_plates


def test_moments_are_less_sure_by_the_clock_while_loads_change_late_as_at_once() -> None:
    recording = simulate("fullbody", "squat", 1, 5.0).recording.window(2.0, 2.2)
    model = load_model("fullbody", Subject(mass_kg=70.0, height_m=1.75, sex="male"))
    live = Estimator(model, presets.default()).start(recording, lag_s=0.04)
    for sample, part in zip(_samples(recording), _frames(_feet(recording, live)), strict=True):
        live.step(sample, part)
    assert live.systematic is not None
    for late in (True, False):
        with_clock = live.deviations(delayed=late)["moments"].values
        live.systematic.sizes = replace(live.systematic.sizes, clock=0.0)
        without = live.deviations(delayed=late)["moments"].values
        live.systematic.sizes = replace(live.systematic.sizes, clock=0.002)
        ankle = [coordinate.name for coordinate in live.calibrated.spec.coordinates].index("ankle_angle_l")
        assert with_clock[ankle] > without[ankle] > 0.0


def test_a_session_knows_constants_by_the_declared_noise(monkeypatch: pytest.MonkeyPatch) -> None:
    recording = simulate("fullbody", "squat", 1, 5.0).recording.window(2.0, 2.1)
    model = load_model("fullbody", Subject(mass_kg=70.0, height_m=1.75, sex="male"))
    live = Estimator(model, presets.default().changed(variance_scale=0.2)).start(recording)
    live.step(_samples(recording)[0])
    assert live.systematic is not None
    added = live.systematic.added

    def seen(frames: Frames) -> Blocks:
        np.testing.assert_array_equal(frames.known_sd, 1.0)
        np.testing.assert_array_equal(frames.known, live.covariance / 0.2)
        return {block: 2.0 * sd for block, sd in added(frames).items()}

    before = live.deviations()["speeds"].values
    monkeypatch.setattr(live.systematic, "added", seen)
    np.testing.assert_array_equal(live.deviations()["speeds"].values, 2.0 * before)


def test_a_limb_that_nobody_sees_is_absent_from_the_fifth_of_a_second_on() -> None:
    recording = simulate("fullbody", "squat", 1, 5.0).recording.window(2.0, 2.4)
    live = Estimator(load_model("fullbody", Subject(mass_kg=70.0, height_m=1.75, sex="male"))).start(recording)
    on_foot = {
        name
        for name, marker in zip(live.calibrated.recorded_markers, live.calibrated.spec.markers, strict=True)
        if marker.segment == "foot_r"
    }
    said = []
    for k, sample in enumerate(_samples(recording)):
        seen = {name: at for name, at in sample.markers.items() if name not in on_foot or not 5 <= k < 35}
        found = live.step(replace(sample, markers=seen))
        said.append(found.moment_sources["ankle_angle_r"] == ABSENT)
        assert bool(np.isnan(found.moments["ankle_angle_r"])) == said[-1]
        assert found.moment_sources["ankle_angle_l"] != ABSENT
        sd = live.deviations()
        for block in ("coordinates", "speeds", "accelerations", "moments"):
            assert bool(np.isnan(sd[block]["ankle_angle_r"])) == said[-1]
            assert np.isfinite(sd[block]["knee_angle_r"])
    assert np.flatnonzero(said).tolist() == list(range(26, 35))  # 0.21 s after frame 5


def test_where_plates_are_refused_what_stands_on_them_is_derived() -> None:
    """A plate twists by 500 N m more for 60 ms, which no other check asks for."""
    recording = simulate("fullbody", "squat", 1, 5.0).recording.window(1.8, 2.6)
    twist = np.zeros((recording.n_frames, 3))
    twist[60:66, 1] = 500.0
    first, *others = recording.plates
    twisted = replace(first, moment=first.moment + twist, free_moment=first.free_moment + twist)
    recording = recording.with_plates((twisted, *others))
    model = load_model("fullbody", Subject(mass_kg=70.0, height_m=1.75, sex="male"))
    found = Estimator(model).run(recording)
    refused = found.data["verdict"].values[:, -1] == REFUSED
    assert np.flatnonzero(refused).tolist() == [*range(60, 67)]
    assert ((found.data["foot_source"].values == DERIVED) == refused[:, None]).all()
    legs = [k for k, leg in enumerate(legs_of(found.data)) if leg and "toes" not in found.coordinate_names[k]]
    assert ((found.data["moment_source"].values[:, legs] == DERIVED) == refused[:, None]).all()
    arms = [k for k, name in enumerate(found.coordinate_names) if name.startswith("elbow")]
    assert (found.data["moment_source"].values[:, arms] == MEASURED).all()
    metrics = compute_metrics(found)
    assert {count["derived"] for count in metrics["moments"]["legs"].values()} == {7}
    assert "The plates contradict the motion in 7 of 81 frames" in metrics["moments"]["reasons"][0]
    assert metrics["feet"]["derived_frames"] == 7
    assert metrics["feet"]["left_at_root"]["grounded"]["moment_nm"] < 20.0
    live, said = Estimator(model).start(recording), []
    for sample, part in zip(_samples(recording), _frames(_feet(recording, live)), strict=True):
        codes = live.step(sample, part).moment_sources.values[legs]
        said.append(live.verdicts[-1] == "refused")  # by the declared noise, so not in all of these frames
        assert (codes == DERIVED).all() == (codes == DERIVED).any() == said[-1]
    assert 60 in np.flatnonzero(said) and not (np.array(said) & ~refused).any()


def test_a_session_says_where_moments_come_from_as_the_run_does() -> None:
    """With a foot off the plates, both, and something undeclared beside one that is."""
    recording = simulate("fullbody", "squat", 1, 5.0).recording.window(2.0, 2.4)
    estimator = Estimator(load_model("fullbody", Subject(mass_kg=70.0, height_m=1.75, sex="male")))
    live = estimator.start(recording)
    feet = _feet(recording, live)
    contact, known = feet.contact.copy(), feet.known.copy()
    contact[5:10, 0] = contact[10:15, :2] = contact[15:20, 1:] = UNMEASURED
    known[15:20] = False
    feet = replace(feet, contact=contact, known=known)
    run = estimator.run(recording, feet=lambda _: feet).data
    assert not (run["verdict"].values[:, -1] == REFUSED).any()
    steps = [live.step(*both).moment_sources.values for both in zip(_samples(recording), _frames(feet), strict=True)]
    np.testing.assert_array_equal(steps, run["moment_source"].values)
    np.testing.assert_array_equal(ContactSources.of(live.calibrated).moments(feet), run["moment_source"].values)
    assert set(np.unique(steps)) == {MEASURED, DERIVED, PRIOR, ABSENT}


def _feet(recording: Recording, live: Tracker) -> ContactLoads:
    """All of the recording seen."""
    initial, markers = live.calibrated, marker_paths(recording, live.calibrated)
    loads = foot_loads(recording, initial.ground, initial.foot_markers)
    paths, nothing = ContactPaths.of(initial).at(markers), np.zeros((len(markers), 0), bool)
    bearing = Ground(loads, np.zeros(len(markers), bool), nothing, usable=True)
    return expected_loads(bearing, initial, live.noise, paths)


def _frames(feet: ContactLoads) -> Iterator[ContactLoads]:
    names = [name for name, values in vars(feet).items() if isinstance(values, np.ndarray)]
    for k in range(len(feet.wrench)):
        yield replace(feet, **{name: getattr(feet, name)[k : k + 1] for name in names})


def _samples(recording: Recording) -> list[Sample]:
    return [
        Sample(
            time,
            dict(zip(recording.marker_names, recording.markers[k], strict=True)),
            {plate.name: np.hstack([plate.force[k], plate.moment[k]]) for plate in recording.plates},
        )
        for k, time in enumerate(recording.time)
    ]
