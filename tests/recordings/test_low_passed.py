"""Markers that were low-passed before they were given: found, and raw ones are not."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dynakin.recordings.low_passed import LowPass, found_low_pass
from dynakin.recordings.read import read
from dynakin.recordings.recording import Recording
from dynakin.recordings.resampling import low_pass
from dynakin.simulation.trial import simulate


def low_passed(recording: Recording, cutoff_hz: float) -> Recording:
    """As a laboratory does it, written to 0.001 mm."""
    flat = recording.markers.reshape(recording.n_frames, -1)
    smooth = np.round(low_pass(flat, recording.rate, cutoff_hz), 6)
    return replace(recording, markers=smooth.reshape(recording.markers.shape))


@pytest.fixture(scope="module")
def gait() -> Recording:
    return simulate("fullbody", "gait", 7, 4.0, markers="opencap").recording


def test_raw_markers_are_raw(gait: Recording) -> None:
    assert found_low_pass(gait) is None


@pytest.mark.parametrize("cutoff_hz", [4.0, 6.0, 8.0, 10.0, 15.0])
def test_cutoff_is_found_to_a_quarter(gait: Recording, cutoff_hz: float) -> None:
    found = found_low_pass(low_passed(gait, cutoff_hz))
    assert found is not None
    assert found.cutoff_hz == pytest.approx(cutoff_hz, rel=0.27)


def test_who_stands_has_nothing_to_lose() -> None:
    standing = simulate("fullbody", "gait", 7, 2.5, markers="opencap").recording
    still = replace(standing, markers=np.repeat(standing.markers[:1], standing.n_frames, axis=0))
    noise = 1e-6 * np.random.default_rng(0).normal(size=still.markers.shape)
    assert found_low_pass(replace(still, markers=still.markers + noise)) is None


def test_frames_without_any_marker_are_passed_over(gait: Recording) -> None:
    found = low_passed(gait, 6.0)
    markers = found.markers.copy()
    markers[100:105] = np.nan
    assert found_low_pass(replace(found, markers=markers)) is not None
    assert found_low_pass(replace(found, markers=np.full_like(markers, np.nan))) is None


def test_too_short_says_nothing(gait: Recording) -> None:
    assert found_low_pass(low_passed(gait, 6.0).window(1.0, 1.4)) is None


def test_what_was_taken_of_a_sine_is_what_the_filter_takes() -> None:
    rate, cutoff, f = 100.0, 6.0, 4.0
    time = np.arange(600) / rate
    whole = np.sin(2 * np.pi * f * time)[:, None]
    left = low_pass(whole, rate, cutoff)
    found = LowPass(cutoff, rate).taken(left)
    middle = slice(100, 500)
    assert np.abs(found - (whole - left))[middle].max() < 0.01
    speed = LowPass(cutoff, rate).taken(left, 1)
    assert LowPass(cutoff, rate).size(speed)[middle].mean() == pytest.approx(
        2 * np.pi * f * np.sqrt(0.5) * np.abs(whole - left)[middle].max(), rel=0.05
    )


@pytest.mark.parametrize(
    ("name", "cutoff_hz"),
    [
        ("opencap_subject4/walking1.trc", 7.0),
        ("c3d_parser/FMC/MH0222_BP06.c3d", 7.0),
        ("rajagopal/motion_capture_walk.trc", None),
        ("plugin_gait/GaitNormal_1.c3d", None),
        ("functional/right_knee.c3d", None),
    ],
)
def test_real_recordings(data_dir: Path, name: str, cutoff_hz: float | None) -> None:
    found = found_low_pass(read(data_dir / name))
    assert (found is None) == (cutoff_hz is None)
    if found is not None and cutoff_hz is not None:
        assert found.cutoff_hz == pytest.approx(cutoff_hz, rel=0.3)


def test_rows_that_the_file_lacks_are_no_noise(gait: Recording) -> None:
    found = low_passed(gait, 6.0)
    kept = np.r_[0:150, 153 : gait.n_frames]
    lacking = replace(found, time=found.time[kept], markers=found.markers[kept], plates=())
    known = found_low_pass(lacking)
    assert known is not None and known.cutoff_hz == pytest.approx(6.0, rel=0.27)


def test_of_a_second_that_is_cut_by_blank_frames_the_longer_part_counts(gait: Recording) -> None:
    found = low_passed(gait, 6.0).window(0.0, 1.31)
    markers = found.markers.copy()
    markers[60:63] = np.nan
    assert found_low_pass(replace(found, markers=markers)) is not None
