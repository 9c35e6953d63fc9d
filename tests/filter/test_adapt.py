"""Noise that calibrates itself: what it leaves alone, what it recovers, what it says of frames it has not seen."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dynakin.filter.adapt import LEAST_FRAMES, calibrated_noise, frames_that_show, nis_per_row
from dynakin.filter.augment import initial_covariance
from dynakin.filter.estimator import Estimator
from dynakin.filter.noise import LATE_SHARE, joint_groups
from dynakin.filter.prepared import Prepared
from dynakin.model.definition import load_model
from dynakin.recordings.feet.contact import UNMEASURED
from dynakin.recordings.recording import Recording
from dynakin.results.files.config import write_parameters
from dynakin.results.records import REFUSED
from dynakin.settings.noise import Noise
from dynakin.settings.subject import Subject
from dynakin.simulation.sensors.sizes import SensorNoise
from support.simulated import simulate

SUBJECT = Subject(mass_kg=70.0, height_m=1.75, sex="male")


def standing(camera_sd_m: float) -> Recording:
    """Ten seconds of quiet standing, seen by cameras of this noise and without skin."""
    noise = SensorNoise(marker_sd_m=camera_sd_m, soft_tissue=0.0)
    return simulate("sagittal7", "sway", 3, 10.0, noise=noise).recording


def planar(noise: Noise) -> Estimator:
    return Estimator(load_model("sagittal7", SUBJECT), noise)


def found(ready: Prepared, frames: np.ndarray | None = None) -> tuple[Noise, dict[str, np.ndarray]]:
    tracker = ready.tracker.fresh()
    trial = ready.measured
    arrays = tracker.run_arrays(trial)
    noise = calibrated_noise(tracker, arrays, trial, frames)
    assert noise is not None
    return noise, tracker.changed(noise).run_arrays(trial)


def test_the_scale_of_all_variances_leaves_the_movement_alone() -> None:
    # The gain depends on the ratio of the variances. Without plates nothing is left that the scale is not on.
    blind = Noise(adapt=False, force_variance_n2=np.inf, moment_variance_n2_m2=np.inf)
    recording = standing(0.001)
    runs = [planar(blind.changed(variance_scale=s)).run(recording) for s in (1.0, 0.09)]
    for name in ("coordinates", "speeds", "accelerations"):
        first, second = (run.data[name].values for run in runs)
        np.testing.assert_allclose(second, first, rtol=1e-5, atol=1e-7)
    first, second = (run.data["coordinates_sd"].values for run in runs)
    np.testing.assert_allclose(second, 0.3 * first, rtol=1e-4)
    # what is not known of lengths and places is no noise, and does not shrink with it
    for before, after in zip(runs[0].parameters, runs[1].parameters, strict=True):
        if before.estimated and before.kind != "plates":
            assert after.sd == pytest.approx(before.sd, rel=1e-3)
            assert after.prior_sd == pytest.approx(before.prior_sd, rel=1e-6)


def test_twice_the_noise_of_the_cameras_is_four_times_the_variance() -> None:
    # Standing, without skin, all else follows the cameras; 10 %: ten seconds are a sample.
    scales = []
    for sd in (0.0005, 0.001):
        noise, _ = found(planar(Noise()).prepare(standing(sd)))
        scales.append(noise.variance_scale)
    assert scales[1] / scales[0] == pytest.approx(4.0, rel=0.1)


@pytest.fixture(scope="module")
def walk() -> Prepared:
    made = simulate("fullbody", "gait", 5, 3.0)
    subject = made.truth.subject
    model = load_model("fullbody", Subject(mass_kg=subject.mass_kg, height_m=subject.height_m, sex="male"))
    return Estimator(model).prepare(made.recording)


def test_it_holds_on_frames_that_it_has_not_seen(walk: Prepared) -> None:
    seen = np.floor(walk.recording.time / 0.3) % 2 == 0
    noise, arrays = found(walk, seen)
    declared = walk.tracker.fresh().run_arrays(walk.measured)
    before, after = nis_per_row(declared, ~seen), nis_per_row(arrays, ~seen)
    assert before is not None and after is not None
    assert before < 0.5 and 0.7 < after < 1.3
    assert set(noise.jerk_scale) == {"pelvis", "trunk_rotation", "upper_body", "hips", "knees", "feet"}


def test_without_plates_the_scale_leaves_priors_their_weight_beside_the_markers(walk: Prepared) -> None:
    # What is expected of the feet, what the model does not explain and the markers are all there is, and are scaled.
    blind = replace(walk.recording.window(0.0, 0.5), plates=())
    model = load_model("fullbody", Subject(mass_kg=walk.calibrated.mass_kg, height_m=1.75, sex="male"))
    noise = Noise(adapt=False)
    first, second = (Estimator(model, noise.changed(variance_scale=s)).run(blind) for s in (1.0, 0.1))
    assert (first.data["foot_contact"] == UNMEASURED).any(dim="foot").all()
    # unscaled errors of the contacts: 2.9e-3 rad, 1.5 rad/s2, 12 N apart
    inner = slice(25, None)  # how fast people move when a recording begins is not scaled
    for name, apart in (("coordinates", 1e-3), ("accelerations", 0.4), ("wrench_estimated", 5.0)):
        np.testing.assert_allclose(
            second.data[name].values[inner], first.data[name].values[inner], rtol=0.0, atol=apart
        )
    # and deviations of what rests on the feet stay those by the declared variances
    for name in ("foot_wrench_sd", "wrench_sd"):
        sds = [run.data[name].median().item() for run in (first, second)]
        assert sds[1] == pytest.approx(sds[0], rel=0.05)


def test_a_walk_that_begins_is_as_unsure_of_its_speeds_however_small_the_noise(walk: Prepared) -> None:
    initial = walk.calibrated
    sds = [np.sqrt(np.diag(initial_covariance(initial, Noise(variance_scale=s)))) for s in (1.0, 0.01)]
    for block, least in (("speed", 3.0), ("acceleration", 40.0)):
        own = np.array([name.endswith(f"/{block}") for name in initial.names])
        assert (sds[0][own] >= least).all()
        np.testing.assert_array_equal(sds[0][own], sds[1][own])


@pytest.mark.parametrize("rate_hz", [25.0, 100.0])
def test_the_first_frame_of_somebody_who_stands_is_as_sure_as_the_next(rate_hz: float) -> None:
    """A speed of which nothing is known moves nobody so far within a frame that the motion would be held."""
    made = simulate("fullbody", "squat", 3, 5.0, rate_hz)
    subject = made.truth.subject
    model = load_model("fullbody", Subject(mass_kg=subject.mass_kg, height_m=subject.height_m, sex="male"))
    found = Estimator(model, Noise(adapt=False, variance_scale=0.002)).run(made.recording.window(0.0, 0.8))
    sd = found.data["speeds_sd"].values
    moves = sd[1] > 0.0
    assert (sd[0, moves] < 10.0 * sd[1, moves]).all()


def test_joints_are_grouped_by_where_they_are(walk: Prepared) -> None:
    groups = joint_groups(walk.calibrated)
    expected = {
        "pelvis_tx": "pelvis", "pelvis_list": "pelvis", "lumbar_bending": "upper_body", "elbow_flex_l": "upper_body",
        "lumbar_rotation": "trunk_rotation",
        "hip_rotation_r": "hips", "knee_angle_l": "knees", "ankle_angle_r": "feet", "subtalar_angle_l": "feet",
    }  # fmt: skip
    assert {name: groups[name] for name in expected} == expected
    assert not joint_groups(planar(Noise()).calibrate(standing(0.001)))


def test_what_was_found_is_written_and_a_preset_fixes_it(tmp_path: Path) -> None:
    recording = standing(0.0005)
    estimate = planar(Noise(adapt=True)).run(recording)
    scale = estimate.config["noise_used"]["variance_scale"]
    assert 0.1 < scale < 0.7
    write_parameters(estimate, tmp_path / "parameters.json")
    assert json.loads((tmp_path / "parameters.json").read_text())["noise"]["variance_scale"] == scale
    fixed = planar(Noise(adapt=False, variance_scale=0.5)).run(recording)
    assert fixed.config["noise_used"]["variance_scale"] == 0.5
    # a model that is fixed in the ground keeps the declared noise unless asked; without a lag less is believed
    assert planar(Noise()).run(recording).config["noise_used"]["variance_scale"] == 1.0
    at_once = planar(Noise(adapt=True)).run(recording, lag_s=0.0).config["noise_used"]["variance_scale"]
    assert at_once == pytest.approx(scale**LATE_SHARE)


def test_frames_in_which_limbs_are_astray_say_nothing_of_the_noise() -> None:
    """More than a third of the markers refused is a lost frame: of some the rest is as before, of most nothing is."""
    ready = planar(Noise()).prepare(standing(0.001))
    tracker = ready.tracker.fresh()
    trial = ready.measured
    arrays = tracker.run_arrays(trial)
    for share, kept in ((0.3, True), (0.7, False)):
        astray = np.arange(len(trial.time)) >= (1.0 - share) * len(trial.time)
        verdicts, nis = arrays["verdicts"].copy(), arrays["nis"].copy()
        verdicts[np.ix_(astray, np.arange(0, verdicts.shape[1] - 1, 2))] = REFUSED
        nis[astray] *= 100.0
        noise = calibrated_noise(tracker, arrays | {"verdicts": verdicts, "nis": nis}, trial)
        alone = calibrated_noise(tracker, arrays, trial, ~astray)
        assert alone is not None
        assert (noise and noise.variance_scale) == (alone.variance_scale if kept else None)


def test_too_few_frames_leave_the_noise_as_declared() -> None:
    recording = standing(0.001).window(0.0, 0.3 + 0.005 * LEAST_FRAMES)
    assert planar(Noise(adapt=True)).run(recording).config["noise_used"]["variance_scale"] == 1.0


def test_as_much_of_a_recording_is_looked_at_as_shows_its_movement() -> None:
    time = np.arange(4000) / 100.0
    always = np.sin(2.0 * np.pi * time)[:, None, None] * np.ones((1, 3, 3))
    assert frames_that_show(time[:900], always[:900]) == 900
    assert frames_that_show(time, always) == pytest.approx(1000, abs=20)
    late = np.where(time[:, None, None] < 20.0, 0.0, always)
    assert frames_that_show(time, late) == pytest.approx(3333, abs=50)  # (t - 20) / t is 0.8 of a half
    late[:, 1] = np.nan
    assert frames_that_show(time, late) == pytest.approx(3333, abs=50)
    assert frames_that_show(time, np.zeros_like(late)) == pytest.approx(1000, abs=20)
