"""Frames that were dropped while the times were numbered on are warned of; whole recordings are not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dynakin.recordings.formats.trajectories import clean_markers
from dynakin.simulation.trial import simulate
from support.real_trials import real_trials

SAID = "frames were left out"


def warned(markers: np.ndarray, time: np.ndarray) -> list[str]:
    names = tuple(f"M{k}" for k in range(markers.shape[1]))
    return [note for note in map(str, clean_markers(names, markers, time, Path("a.trc"))[1]) if SAID in note]


@pytest.mark.parametrize("motion", ["gait", "squat"])
@pytest.mark.parametrize("seed", [3, 8])
def test_dropped_frames(motion: str, seed: int) -> None:
    recording = simulate("fullbody", motion, seed, 5.0 if motion == "squat" else 2.5, markers="opencap").recording
    markers, time = recording.markers, recording.time
    assert not warned(markers, time)
    if motion == "squat":
        return
    for count in (1, 2):
        less = np.delete(markers, np.arange(100, 100 + count), axis=0)
        (text,) = warned(less, time[: len(less)])
        assert f"between frames 100 and 101 (0.990 s, as in {count + 1})" in text
        assert not warned(less, np.delete(time, np.arange(100, 100 + count)))  # their times are right


def test_stamps_that_scatter_are_no_dropped_frames() -> None:
    """What lies a third of a step late makes the next step look short."""
    recording = simulate("fullbody", "gait", 3, 2.5, markers="opencap").recording
    late = np.random.default_rng(1).random(recording.n_frames) < 0.05
    assert not warned(recording.markers, recording.time + 0.008 * late)


def test_real_recordings_are_whole(data_dir: Path) -> None:
    for recording in real_trials(data_dir):
        assert not [note for note in map(str, recording.notes) if SAID in note], recording.name
