"""Joint angles from a standing zero, under clinical names and signs; symmetry index and work in figures."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import dynakin
from dynakin.errors import RecordingError
from dynakin.filter.zero import standing_zero
from dynakin.pipeline.result import Result
from dynakin.recordings.formats.mot import read_table
from dynakin.recordings.standing import standing_window
from dynakin.results.estimate import Estimate
from dynakin.results.failures import Failures
from dynakin.results.measures.angles import CONVENTIONS, convention_of, with_angles
from dynakin.results.measures.metrics import compute_metrics
from dynakin.results.measures.power import work_of
from dynakin.results.measures.pressure import centre_of_pressure
from dynakin.results.measures.symmetry import symmetry_index
from dynakin.simulation.trial import simulate_squat
from dynakin.validation.case import Setup
from dynakin.validation.methods import compare_trial, estimate_each


def test_signs_and_zero_of_the_table(estimate: Estimate, tmp_path: Path) -> None:
    zero = {"knee": np.radians(5.0), "lumbar": np.radians(-3.0)}
    asked = with_angles(estimate, zero, "clinical")
    Result(asked).save(tmp_path / "out")
    table = read_table(tmp_path / "out" / "angles.sto")
    degrees = np.degrees(estimate.data["coordinates"].values)
    columns = dict(zip(table.names, table.values.T, strict=True))
    np.testing.assert_allclose(columns["knee_flexion"], degrees[:, 2] - 5.0, rtol=5e-8, atol=1e-9)
    np.testing.assert_allclose(columns["trunk_flexion"], -(degrees[:, 4] + 3.0), rtol=5e-8, atol=1e-9)
    assert "slide" not in columns  # a translation is no angle
    assert compute_metrics(asked)["angles"]["zero_deg"]["knee"] == pytest.approx(5.0)
    written = (tmp_path / "out" / "angles.sto").read_text()
    assert "knee_flexion: + flexion, - extension; zero at 5.00 deg of the model" in written
    assert "trunk_flexion: + flexion, - extension; zero at -3.00 deg of the model" in written  # the sign is turned
    assert compute_metrics(estimate)["angles"] is None
    np.testing.assert_array_equal(asked.data["coordinates"].values, estimate.data["coordinates"].values)


def test_opensims_names_stay_with_opensims_signs(estimate: Estimate, tmp_path: Path) -> None:
    Result(with_angles(estimate, {}, "opensim")).save(tmp_path / "out")
    table = read_table(tmp_path / "out" / "angles.sto")
    assert list(table.names) == estimate.coordinate_names[:-1]
    np.testing.assert_allclose(
        table.values[:, 2], np.degrees(estimate.data["coordinates"].values[:, 2]), rtol=5e-8, atol=1e-9
    )


def test_sides_keep_their_letter() -> None:
    assert convention_of("ankle_angle_l") == (CONVENTIONS["ankle_angle"], "_l")
    assert convention_of("pelvis_tilt") == (CONVENTIONS["pelvis_tilt"], "")
    assert convention_of("mtp_angle_r") is None


def test_clinical_signs_of_the_pelvis_and_trunk() -> None:
    """By turning a body about OpenSim's axes: Z to the right, X forward, Y up."""

    def turned(axis: int, angle: float, v: np.ndarray) -> np.ndarray:
        k = np.eye(3)[axis]
        return v + np.sin(angle) * np.cross(k, v) + (1 - np.cos(angle)) * np.cross(k, np.cross(k, v))

    forward, up, right = np.eye(3)
    assert turned(2, 0.2, up) @ forward < 0 and CONVENTIONS["pelvis_tilt"].sign == -1  # the top goes back: posterior
    assert turned(0, 0.2, right) @ up < 0 and CONVENTIONS["pelvis_list"].sign == -1  # the right side goes down
    assert turned(1, 0.2, right) @ forward > 0 and CONVENTIONS["pelvis_rotation"].sign == 1  # it goes forward


def test_a_standing_trial_gives_the_zero() -> None:
    trial = simulate_squat(seed=3, duration_s=6.0)
    subject = dynakin.Subject(mass_kg=70.0, height_m=1.75, sex="male")
    estimator = dynakin.Estimator(dynakin.load_model("sagittal7", subject=subject, markers="opencap"))
    estimate = estimator.run(trial.recording, lag_s=0.0)
    window = standing_window(trial.recording)
    assert window is not None
    still = trial.recording.window(float(trial.recording.time[0]), float(trial.recording.time[window.stop - 1]))
    own, other = standing_zero(estimator, estimate, None), standing_zero(estimator, estimate, still)
    whole = estimator.run(trial.recording, lag_s=np.inf)  # its places are those of the end in every frame
    for name in ("ankle", "knee", "hip", "lumbar"):
        mean = float(whole.data["coordinates"].sel(coordinate=name).values[window].mean())
        assert standing_zero(estimator, whole, None)[name] == pytest.approx(mean, abs=1e-12)
        assert np.degrees(abs(own[name] - mean)) < 1.5, name  # skin stands as it likes in both
        assert np.degrees(abs(other[name] - own[name])) < 0.01, name
    asked = with_angles(estimate, other, "opensim")
    assert asked.data["zero_offset"].sel(coordinate="toe") == 0.0  # the root places the whole body
    moving = trial.recording.window(2.0, 6.0)
    shaken = replace(moving, markers=moving.markers + np.sin(40.0 * moving.time)[:, None, None] * 0.02)
    with pytest.raises(RecordingError, match="nobody stands still"):
        standing_zero(estimator, estimate, shaken)


def test_a_zero_that_nobody_stands_for_is_refused_before_any_estimate(monkeypatch: pytest.MonkeyPatch) -> None:
    """In a batch it was once each trial was estimated, as a part that failed; in a comparison, too."""
    monkeypatch.setattr("dynakin.filter.estimator.Estimator.follow", None)
    moving = simulate_squat(seed=3, duration_s=6.0).recording.window(2.0, 6.0)
    shaken = replace(moving, markers=moving.markers + np.sin(40.0 * moving.time)[:, None, None] * 0.006)
    subject = dynakin.Subject(mass_kg=70.0, height_m=1.75, sex="male")
    estimator = dynakin.Estimator(dynakin.load_model("sagittal7", subject=subject, markers="opencap"))
    setup = Setup(estimator, zero="standing")
    with pytest.raises(RecordingError, match=r"nobody stands still.*\(--static\)"):
        estimate_each(shaken, setup, failures=Failures())
    with pytest.raises(RecordingError, match="nobody stands still"):
        compare_trial(shaken, setup)


def test_symmetry_index() -> None:
    assert symmetry_index(1.1, 0.9) == pytest.approx(20.0)
    assert symmetry_index(0.9, 1.1) == pytest.approx(-20.0)
    assert symmetry_index(3.0, 0.0) == 200.0
    assert symmetry_index(0.0, 0.0) is None and symmetry_index(float("nan"), 1.0) is None


def test_work_of_a_known_power() -> None:
    time = np.linspace(0.0, 2.0 * np.pi, 20001)
    own = work_of(time, 50.0 * np.sin(time))
    assert own.positive_j == pytest.approx(100.0, rel=1e-6) and own.negative_j == pytest.approx(-100.0, rel=1e-6)
    assert (own.peak_w, own.lowest_w) == pytest.approx((50.0, -50.0), rel=1e-6)
    broken = np.where(time > np.pi, np.nan, 50.0 * np.sin(time))
    assert work_of(time, broken).negative_j == 0.0 and work_of(time, broken).positive_j == pytest.approx(100.0)


def test_centre_of_pressure_of_known_wrenches() -> None:
    point, force = np.array([0.2, -0.05, 0.1]), np.array([20.0, 700.0, -15.0])
    wrench = np.concatenate([force, np.cross(point, force) + np.array([0.0, 3.0, 0.0])])
    planar = np.where([True, True, False, False, False, True], wrench, np.nan)
    light = 0.01 * wrench
    found, free = centre_of_pressure(np.stack([wrench, planar, light]), -0.05)
    np.testing.assert_allclose(found[0], point)
    assert free[0] == pytest.approx(3.0)
    np.testing.assert_allclose(found[1, :2], point[:2])
    assert np.isnan([found[1, 2], free[1], *found[2], free[2]]).all()
