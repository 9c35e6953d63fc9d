"""Deviations hold what a laboratory's low-pass took of the movement, and the run says so."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dynakin.filter.estimator import Estimator
from dynakin.messages import about
from dynakin.model.definition import load_model
from dynakin.recordings.resampling import low_pass
from dynakin.report.findings.said import warned
from dynakin.results.estimate import Estimate
from dynakin.settings.subject import Subject
from support.simulated import simulate

LEGS = ("hip_flexion", "knee_angle", "ankle_angle")


def estimate_and_held(cutoff_hz: float | None) -> tuple[Estimate, float]:
    """A walk, and the part of its legs' true speeds within 95 % intervals."""
    trial = simulate("fullbody", "gait", 7, 2.5, markers="opencap")
    recording = trial.recording
    if cutoff_hz is not None:
        flat = low_pass(recording.markers.reshape(recording.n_frames, -1), recording.rate, cutoff_hz)
        recording = replace(recording, markers=np.round(flat, 6).reshape(recording.markers.shape))
    static = simulate("fullbody", "squat", 7, 5.0, markers="opencap").recording
    definition = load_model("fullbody", Subject(mass_kg=70.0, height_m=1.75, sex="male"), markers="opencap")
    estimate = Estimator(definition).run(recording, static=static)
    names = [f"{joint}_{side}" for joint in LEGS for side in "rl"]
    said, truth = (data.sel(coordinate=names).isel(time=slice(50, -20)) for data in (estimate.data, trial.truth.data))
    off = np.abs(said["speeds"].values - truth["speeds"].transpose("time", "coordinate").values)
    return estimate, float(np.mean(off < 1.96 * said["speeds_sd"].values))


def test_speeds_of_low_passed_markers_hold_the_truth() -> None:
    estimate, held = estimate_and_held(6.0)
    assert held > 0.85
    assert [message.level for message in about(estimate.messages, "low-passed")] == ["warning"]
    assert [finding.title for finding in warned(estimate, {})].count("Low-passed markers") == 1


def test_raw_markers_are_left_alone() -> None:
    estimate, held = estimate_and_held(None)
    assert held > 0.80
    assert not about(estimate.messages, "low-passed")


@pytest.mark.parametrize("cutoff_hz", [20.0])
def test_what_takes_little_is_no_warning(cutoff_hz: float) -> None:
    estimate, _ = estimate_and_held(cutoff_hz)
    assert [message.level for message in about(estimate.messages, "low-passed")] == ["note"]
