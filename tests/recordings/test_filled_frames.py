"""Frames and gaps that a system filled are no measurements."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dynakin.errors import RecordingError
from dynakin.recordings.formats.trajectories import clean_markers

RATE = 100.0
NAMES = ("a", "b", "c", "d")


def moving(frames: int = 200, noise_m: float = 1e-4) -> tuple[np.ndarray, np.ndarray]:
    time = np.arange(frames) / RATE
    swing = 0.3 * np.sin(2.0 * np.pi * 0.8 * time[:, None] + np.arange(4))
    markers = np.stack([swing, 0.9 + 0.2 * swing**2, 1.2 * time[:, None] + 0.0 * swing], axis=2)
    return time, markers + np.random.default_rng(0).normal(0.0, noise_m, markers.shape)


def cleaned(time: np.ndarray, markers: np.ndarray) -> tuple[np.ndarray, list[str]]:
    return clean_markers(NAMES, markers, time, Path("walk.trc"))


def test_a_frame_that_repeats_the_one_before_is_missing() -> None:
    time, markers = moving()
    markers[100] = markers[99]
    found, notes = cleaned(time, markers)
    assert np.isnan(found[100]).all() and np.isfinite(np.delete(found, 100, axis=0)).all()
    assert any("1 of 200, the first is frame 101 (1.000 s)" in text for text in map(str, notes))


def test_a_rate_that_was_doubled_is_refused() -> None:
    time, markers = moving()
    markers[1::2] = markers[::2]
    with pytest.raises(RecordingError, match=r"walk\.trc: frames repeat .* expected each frame once, .* \(5\d Hz\?\)"):
        cleaned(time, markers)


def test_somebody_who_stands_as_a_statue_is_no_repetition() -> None:
    time, markers = moving()
    found, notes = cleaned(time, np.tile(markers[:1], (200, 1, 1)))
    assert np.isfinite(found).all() and not notes


@pytest.mark.parametrize("noise_m", [0.0, 1e-4])
def test_a_gap_that_was_filled_by_a_straight_line_is_one(noise_m: float) -> None:
    time, markers = moving(noise_m=noise_m)
    span = slice(81, 111)
    for axis in range(3):
        markers[span, 1, axis] = np.interp(time[span], time[[80, 111]], markers[[80, 111], 1, axis])
    found, notes = cleaned(time, markers)
    assert np.isnan(found[span, 1]).all()
    assert np.isfinite(np.delete(found, 1, axis=1)).all() and np.isfinite(found[:80, 1]).all()
    assert any("filled by straight lines: b, first at " in text for text in map(str, notes))


def test_smooth_markers_of_a_fast_system_are_no_lines() -> None:
    time = np.arange(2000) / 1000.0
    markers = np.stack([np.sin(2.0 * np.pi * time) + 0.1 * k + 2.0 for k in range(4)], axis=1)[..., None] * [
        0.3,
        0.1,
        0.2,
    ]
    found, notes = cleaned(time, np.round(markers, 5))
    assert np.isfinite(found).all() and not notes


def test_somebody_who_stands_in_a_coarse_file_is_no_repetition() -> None:
    rng = np.random.default_rng(1)
    time = np.arange(3000) / 1000.0
    sway = 0.004 * np.sin(2.0 * np.pi * 0.3 * time)[:, None, None] + rng.normal(0.0, 2e-4, (3000, 4, 3))
    found, notes = cleaned(time, np.round(np.arange(1.0, 5.0)[:, None] + sway, 3))
    assert np.isfinite(found).all() and not notes


@pytest.mark.parametrize("noise_m", [2e-6, 1e-4])
def test_a_foot_on_a_moving_belt_is_no_line(noise_m: float) -> None:
    rng = np.random.default_rng(2)
    time = np.arange(400) / RATE
    stands = (np.sin(2.0 * np.pi * time) > -0.2)[:, None]
    step = np.where(stands, -1.2 / RATE, 2.0 / RATE) * np.ones((1, 4))
    path = np.stack([np.cumsum(step, axis=0), 0.1 + np.where(stands, 0.0, 0.05) * np.ones((1, 4)), 0.1 + 0.0 * step], 2)
    found, notes = cleaned(time, np.round(path + rng.normal(0.0, noise_m, path.shape), 8))
    assert np.isfinite(found).all() and not notes


@pytest.mark.parametrize("frames", [2, 6, 15])
@pytest.mark.parametrize("noise_m", [0.0, 1e-4])
def test_a_gap_that_was_filled_by_the_last_place_is_one(frames: int, noise_m: float) -> None:
    time, markers = moving(noise_m=noise_m)
    span = slice(81, 81 + frames)
    markers[span, 1] = markers[80, 1]
    found, notes = cleaned(time, markers)
    assert np.isnan(found[span, 1]).all()
    assert np.isfinite(np.delete(found, 1, axis=1)).all() and np.isfinite(found[:81, 1]).all()
    assert any("filled by the last place before them, to the last digit: b, first at 0.810 s" in str(n) for n in notes)


def test_a_marker_that_is_held_to_the_end_while_the_person_goes_on_is_missing() -> None:
    time, markers = moving()
    markers[121:, 1] = markers[120, 1]
    found, _ = cleaned(time, markers)
    assert np.isnan(found[121:, 1]).all() and np.isfinite(found[:121]).all()


@pytest.mark.parametrize("digits", [3, 4, 9])
def test_a_foot_that_rests_in_a_file_of_few_digits_is_measured(digits: int) -> None:
    """It stands for 0.6 s of each step, to the last digit, while the others go on, and starts as feet do."""
    time, markers = moving(400, 0.0)
    phase = np.mod(time, 1.0)
    swing = np.clip((phase - 0.6) / 0.4, 0.0, 1.0)
    gone = np.floor(time) + 10 * swing**3 - 15 * swing**4 + 6 * swing**5
    markers[:, 1] = np.stack([0.1 + 0.0 * time, 0.05 + 0.1 * np.sin(np.pi * swing) ** 2, 1.2 * gone], axis=1)
    found, notes = cleaned(time, np.round(markers, digits))
    assert np.isfinite(found).all() and not notes
