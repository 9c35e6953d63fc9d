"""The default preset on simulated squats: truth, faults, plates that lag or err, smoothing and live use."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import dynakin
from dynakin.errors import ConfigError
from dynakin.filter.measurements import Measurements
from dynakin.filter.samples import marker_paths, total_wrench
from dynakin.messages import about
from dynakin.pipeline.result import Result
from dynakin.report.insights import insights
from dynakin.results.estimate import Estimate
from dynakin.results.measures.metrics import compute_metrics
from dynakin.simulation.output import SimulatedTrial
from dynakin.simulation.sensors.sizes import SensorNoise
from support.simulated import simulate_squat
from support.squat_estimator import estimator, samples, with_markers

START_S = 3.0


@pytest.fixture(scope="module")
def trial() -> SimulatedTrial:
    return simulate_squat(seed=3, duration_s=10.0)


@pytest.fixture(scope="module")
def plain(trial: SimulatedTrial) -> Estimate:
    return estimator().run(trial.recording, lag_s=0.0)


@pytest.fixture(scope="module")
def smoothed(trial: SimulatedTrial) -> Estimate:
    return estimator().run(trial.recording, lag_s=np.inf)


def rms(estimate: Estimate, trial: SimulatedTrial, name: str) -> np.ndarray:
    window = trial.recording.time >= START_S
    error = (estimate.data[name] - trial.truth.data[name]).transpose("time", "coordinate").values[window]
    return np.sqrt(np.mean((error - (error.mean(axis=0) if name == "coordinates" else 0.0)) ** 2, axis=0))


def test_angles_speeds_and_moments_are_near_the_truth(plain: Estimate, trial: SimulatedTrial) -> None:
    angle = dict(zip(plain.coordinate_names, np.degrees(rms(plain, trial, "coordinates")), strict=True))
    assert angle["ankle"] < 1.5 and angle["knee"] < 1.5, angle
    assert rms(plain, trial, "speeds").mean() < 0.12
    leg = [plain.coordinate_names.index(name) for name in ("ankle", "knee", "hip")]
    assert rms(plain, trial, "moments")[leg].mean() < 5.0


def test_lengths_are_as_sure_as_skin_allows(plain: Estimate, trial: SimulatedTrial) -> None:
    """Skin that follows an angle looks like a length: what is reported of a length covers the truth, the filter's own
    part alone would not."""
    lengths = [p for p in plain.parameters if p.kind == "length"]
    error = np.array([p.value - trial.truth.parameters[p.name] for p in lengths])
    reported, own = (np.array([getattr(p, name) for p in lengths]) for name in ("sd", "posterior_sd"))
    thigh = next(p for p in lengths if p.name == "length/thigh")
    assert thigh.skin_sd == pytest.approx(0.6 * 0.018)  # 0.6 of the 18 mm that the marker set declares of the thigh
    assert thigh.sd == pytest.approx(np.hypot(thigh.skin_sd, thigh.posterior_sd))
    assert np.mean((error / reported) ** 2) < 1.5 and np.mean((error / own) ** 2) > 2.0
    assert all(p.skin_sd == 0.0 for p in plain.parameters if p.kind != "length")


def test_smoothing_comes_closer_to_the_truth_and_is_surer(
    plain: Estimate, smoothed: Estimate, trial: SimulatedTrial
) -> None:
    assert rms(smoothed, trial, "speeds").mean() < 0.8 * rms(plain, trial, "speeds").mean()
    assert rms(smoothed, trial, "accelerations").mean() < 0.6 * rms(plain, trial, "accelerations").mean()
    for name, more in (("state_sd", 1e-9), ("moments_sd", 0.05)):  # what is reported of moments has factors of its own
        live, after = plain.data[name].values, smoothed.data[name].values
        assert (after <= live * (1.0 + more)).all(), name
        assert (after.mean(axis=0) < live.mean(axis=0)).all(), name
    np.testing.assert_array_equal(smoothed.data["nis"].values, plain.data["nis"].values)
    assert smoothed.config["lag_s"] == smoothed.lag_s == np.inf and smoothed.smoothed


def test_smoothing_needs_bounds_that_have_a_smoother(trial: SimulatedTrial) -> None:
    with pytest.raises(ConfigError, match="lag_s: bounds are kept by constraint 'gain'"):
        estimator(noise=dynakin.presets.paper()).run(trial.recording, lag_s=np.inf)


def test_a_recording_is_smoothed_unless_the_settings_have_no_smoother(
    smoothed: Estimate, trial: SimulatedTrial, tmp_path
) -> None:
    by_default = estimator().run(trial.recording)
    np.testing.assert_array_equal(by_default.data["state"].values, smoothed.data["state"].values)
    assert not about(by_default.messages, "smoothing")
    paper = estimator(noise=dynakin.presets.paper())
    refused, live = paper.run(trial.recording), paper.run(trial.recording, lag_s=0.0)
    np.testing.assert_array_equal(refused.data["state"].values, live.data["state"].values)
    assert refused.lag_s == live.lag_s == 0.0
    (said,) = about(refused.messages, "smoothing")
    assert "'gain', which has no smoother" in said.text and "as it would be live" in said.text
    assert not about(live.messages, "smoothing")  # it was asked for


def test_what_only_describes_live_estimates_is_no_headline_of_a_smoothed_one(
    plain: Estimate, smoothed: Estimate
) -> None:
    live, after = ({i.title: i for i in insights(e, compute_metrics(e))} for e in (plain, smoothed))
    assert live["Adaptation"].text and compute_metrics(plain)["adaptation"]["verdict"]
    assert "Adaptation" not in after and compute_metrics(smoothed)["adaptation"]["verdict"] == ""
    assert "Speeds" not in after and after["One frame ahead"].level in ("good", "note")
    for found in (live, after):  # true of both: it is the filter's covariance
        assert found["Uncertainty"].level == "good" and "this recording" in found["Uncertainty"].text
    assert "Settled" not in " ".join(i.text for i in after.values())


def test_the_delayed_frame_is_the_smoothers_of_what_was_seen(trial: SimulatedTrial) -> None:
    live = estimator().start(trial.recording, lag_s=0.15)
    assert live.delayed() is None
    for sample in samples(trial.recording)[:120]:
        now = live.step(sample)
        delayed = live.delayed()
        assert (delayed is None) == (sample.time_s < 0.15 - 1e-9)
    assert delayed is not None and delayed.time_s == pytest.approx(now.time_s - 0.15)
    offline = estimator().start(trial.recording)
    markers = marker_paths(trial.recording, offline.calibrated)
    wrench = total_wrench(trial.recording, offline.calibrated)
    arrays = offline.run_smoothed_arrays(Measurements(trial.recording.time, markers, wrench).first(120))
    np.testing.assert_allclose(delayed.speeds, arrays["state"][104, 7:14], atol=1e-8)
    with pytest.raises(ConfigError, match=r"expected Estimator\.start\(\.\.\., lag_s=SECONDS\)"):
        offline.delayed()


def test_a_recording_with_a_lag_is_what_live_use_with_that_lag_gives(trial: SimulatedTrial, plain: Estimate) -> None:
    late = estimator().run(trial.recording, lag_s=0.05)
    assert late.lag_s == pytest.approx(0.05) and not late.smoothed and "50 ms late" in repr(late)
    live = estimator().start(trial.recording, lag_s=0.05)
    data = late.data
    for k, sample in enumerate(samples(trial.recording)[:400]):
        live.step(sample)
        if k < 5 or k % 37:
            continue
        delayed, sd = live.delayed(), live.deviations(delayed=True)
        assert delayed is not None and delayed.time_s == pytest.approx(late.time[k - 5])
        for name in ("coordinates", "speeds", "accelerations", "moments"):
            np.testing.assert_allclose(delayed.values[name], data[name].values[k - 5], rtol=1e-9, atol=1e-9)
            np.testing.assert_allclose(sd[name].values, data[f"{name}_sd"].values[k - 5], rtol=1e-7, atol=1e-12)
    # the last frame has none after it
    np.testing.assert_allclose(data["state"].values[-1], plain.data["state"].values[-1], atol=1e-12)
    assert (data["state_sd"].values <= plain.data["state_sd"].values * (1.0 + 1e-9)).all()
    assert rms(late, trial, "accelerations").mean() < 0.8 * rms(plain, trial, "accelerations").mean()


@pytest.mark.parametrize("lag_s", [-0.1, 1.5, 20, float("nan"), "0.05", True])
def test_lags_that_nothing_can_hold(trial: SimulatedTrial, lag_s: float) -> None:
    for use in (estimator().run, estimator().start):
        with pytest.raises(ConfigError, match=r"lag_s is .*, expected seconds \(no longer frames\), 0 to 1"):
            use(trial.recording, lag_s=lag_s)


def test_a_lag_of_a_calibrated_model_needs_the_rate_of_its_samples(trial: SimulatedTrial) -> None:
    calibrated = estimator().calibrate(trial.recording)
    with pytest.raises(ConfigError, match="expected rate_hz"):
        estimator().start(calibrated, lag_s=0.05)
    assert [estimator().start(calibrated, lag_s=0.05, rate_hz=rate).lag for rate in (100.0, 60.0, 5.0)] == [5, 3, 1]
    with pytest.raises(ConfigError, match="all frames are known of a recording alone"):
        estimator().start(trial.recording, lag_s=np.inf)


def test_deviations_on_demand_are_those_of_the_run(trial: SimulatedTrial, plain: Estimate) -> None:
    live = estimator().start(trial.recording)
    for sample in samples(trial.recording)[:50]:
        live.step(sample)
    found = live.deviations()
    for name in ("coordinates", "speeds", "accelerations", "moments"):
        np.testing.assert_allclose(found[name], plain.data[f"{name}_sd"].values[49], rtol=1e-8)
    known = np.isfinite(plain.data["wrench_sd"].values[49])
    np.testing.assert_allclose(found["wrench"][known], plain.data["wrench_sd"].values[49][known], rtol=1e-8)


def test_plates_that_lag_are_brought_into_step() -> None:
    late = simulate_squat(seed=3, duration_s=10.0, noise=SensorNoise(plate_lag_s=0.04))
    result = estimator().run(late.recording)
    said = [text for text in map(str, result.messages) if text.startswith("The plates are ")]
    assert len(said) == 1 and said[0].endswith("they were brought into step.")
    lag_ms = float(said[0].split()[3])
    assert lag_ms == pytest.approx(40.0, abs=4.0) and "behind" in said[0]
    aside = estimator(noise=dynakin.presets.default().changed(plate_delay_sd_s=0.0)).run(late.recording)
    assert rms(result, late, "moments").mean() < 0.6 * rms(aside, late, "moments").mean()


def test_an_offset_of_the_plates_is_found(trial: SimulatedTrial) -> None:
    def pushed(recording: dynakin.Recording, newtons: float) -> dynakin.Recording:
        first, *others = recording.plates
        forward = estimator().calibrate(recording).ground.forward
        return recording.with_plates((dataclasses.replace(first, force=first.force + newtons * forward), *others))

    result = estimator().run(pushed(trial.recording, 8.0))
    offset = next(p for p in result.parameters if p.name == "plates/fx")
    assert offset.unit == "N" and offset.value == pytest.approx(8.0, abs=3.0 * offset.sd)
    assert abs(offset.value - 8.0) < 3.0


def test_plates_that_carry_something_else_are_not_used(trial: SimulatedTrial) -> None:
    heavier = [dataclasses.replace(p, force=1.4 * p.force, moment=1.4 * p.moment) for p in trial.recording.plates]
    result = estimator().run(trial.recording.with_plates(tuple(heavier)))
    warning = [text for text in map(str, result.messages) if "The plates are not used" in text]
    assert len(warning) == 1 and "where the person weighs 70.0 kg" in warning[0]
    assert np.isnan(result.data["wrench_measured"].values).all()
    assert (result.data["n_rows"].values <= 34).all()


def test_swapped_and_flying_markers_are_refused_and_said(trial: SimulatedTrial, plain: Estimate) -> None:
    """Given two markers swapped for 1 s and one that flies off, when it is over, then the constants have not moved."""
    names = trial.recording.marker_names
    knee, hip, wrist = (names.index(name) for name in ("r_knee", "r.ASIS", "C7"))

    def faults(markers: np.ndarray) -> None:
        markers[400:500, [knee, hip]] = markers[400:500, [hip, knee]]
        markers[600:700, wrist] += [0.3, 0.4, 0.0]

    result = estimator().run(with_markers(trial.recording, faults))
    refused = {event.subject: event for event in result.events if event.kind == "gated"}
    assert {"r_knee", "r.ASIS", "C7"} <= set(refused)
    assert refused["C7"].time_s == pytest.approx(6.0) and "100 frames" in refused["C7"].message
    for before, after in zip(plain.parameters, result.parameters, strict=True):
        if before.kind in ("length", "inertia"):
            assert abs(after.value - before.value) < before.sd, before.name


def test_a_motion_that_nobody_saw_is_found_again(trial: SimulatedTrial) -> None:
    """Given 1 s without any marker in the middle of a squat, when they come back, then the motion is found and said."""

    def blind(markers: np.ndarray) -> None:
        markers[450:550] = np.nan

    result = estimator().run(with_markers(trial.recording, blind))
    words = [event.message for event in result.events if event.subject == "motion"]
    assert any("lost" in text for text in words) and any("found" in text for text in words)
    assert np.isfinite(result.data["state"].values).all()
    error = (result.data["coordinates"] - trial.truth.data["coordinates"]).transpose("time", "coordinate").values
    assert np.degrees(np.abs(error[560:]).max()) < 25.0


def test_a_joint_that_nobody_sees_is_held_and_comes_back(trial: SimulatedTrial) -> None:
    """Given 3 s without the forearm's only marker, then the elbow is held, is unsure, and returns."""
    wrist = trial.recording.marker_names.index("R_wrist_radius")

    def hidden(markers: np.ndarray) -> None:
        markers[400:700, wrist] = np.nan

    without = with_markers(trial.recording, hidden)
    result = estimator(side="right").run(without, lag_s=0.0)
    elbow = result.data["coordinates"].sel(coordinate="elbow").values
    sd = result.data["state_sd"].sel(element="elbow").values
    known = np.isfinite(result.data["coordinates_sd"].sel(coordinate="elbow").values)
    assert not known[400:700].any() and np.delete(known, np.arange(400, 700)).all()
    assert (sd[480:700] > 0.2).all() and sd[720] < 0.1
    assert any(event.subject == "elbow" and "held" in event.message for event in result.events)
    whole = estimator(side="right").run(trial.recording, lag_s=0.0).data["coordinates"].sel(coordinate="elbow").values
    assert np.degrees(np.abs(elbow - whole)[400:700]).max() < 60.0  # carried on, it would be at its joint limit
    later = np.abs(elbow - whole)[750:]
    assert (later < 3.0 * sd[750:]).all()
    smoothed = estimator(side="right").run(without, lag_s=np.inf).data
    assert np.isfinite(smoothed["state"].values).all()
    assert (smoothed["state_sd"].sel(element="elbow").values[400:700] <= sd[400:700] + 1e-12).all()


def test_every_output_has_a_deviation_in_the_files(smoothed: Estimate, tmp_path) -> None:
    from dynakin.recordings.formats.mot import read_table

    Result(smoothed).save(tmp_path / "out")
    table = read_table(tmp_path / "out" / "uncertainty.sto")
    for name in ("knee", "knee_speed", "knee_acceleration", "knee_moment", "fx", "fy", "mz"):
        values = table.column(name)
        assert (values > 0.0).all(), name
    knee = smoothed.coordinate_names.index("knee")
    np.testing.assert_allclose(
        table.column("knee_moment"), smoothed.data["moments_sd"].values[:, knee], rtol=6e-3
    )  # three digits


def test_a_mass_that_the_plates_contradict_is_told_and_is_no_delay() -> None:
    late = simulate_squat(seed=3, duration_s=10.0, noise=SensorNoise(plate_lag_s=0.04))
    wrong = dynakin.Subject(mass_kg=78.0, height_m=1.75, sex="male")
    model = dynakin.load_model("sagittal7", wrong, markers="opencap")
    result = dynakin.Estimator(model, dynakin.presets.default()).run(late.recording)
    said = [text for text in map(str, result.messages) if text.startswith("Warning: the plates carry 70.")]
    assert len(said) == 1 and "78.0 kg (10.3 % apart" in said[0]
    assert not any("brought into step" in text for text in map(str, result.messages))
