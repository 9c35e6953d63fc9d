"""Zeros of plates: FORCE_PLATFORM:ZERO of a C3D, and plates that were never zeroed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dynakin.recordings.checks import check_plates
from dynakin.recordings.formats.c3d import read_c3d
from dynakin.recordings.frame import find_ground_frame
from support.made_c3d import made_c3d
from support.made_recordings import standing

FRAMES, PER_FRAME = 200, 10
STEP = np.repeat(np.clip(np.sin(np.pi * (np.arange(FRAMES) - 50) / 80.0), 0.0, None), PER_FRAME)
STEP *= np.repeat((np.arange(FRAMES) > 50) & (np.arange(FRAMES) < 130), PER_FRAME)
PUSH = np.stack([60.0 * STEP, 0.0 * STEP, -800.0 * STEP, 40.0 * STEP, 20.0 * STEP, 0.0 * STEP])
CORNERS = np.array([[200.0, 300, 0], [-200, 300, 0], [-200, -300, 0], [200, -300, 0]])
UNITS = ["N"] * 3 + ["Nm"] * 3
OFFSET = np.array([[15.0], [-20.0], [60.0], [3.0], [2.0], [-0.5]])


@pytest.mark.parametrize(
    ("zero", "heel_m", "taken_off"),
    [
        ((1, 20), 0.6, True),
        ((20, 20), 0.6, True),
        ((1, 20), 0.05, False),  # somebody stands on it then
        ((1, 0), 0.6, False),
        ((0, 0), 0.6, False),
        ((100, 300), 0.6, False),  # frames that are not there
        ((), 0.6, False),
    ],
)
def test_the_zero_that_the_file_gives_is_taken_off(
    tmp_path: Path, zero: tuple[int, ...], heel_m: float, taken_off: bool
) -> None:
    def read(name: str, channels: np.ndarray, zero: tuple[int, ...]) -> np.ndarray:
        plate = {
            "USED": 1,
            "TYPE": [2],
            "CHANNEL": np.arange(1, 7).reshape(6, 1),
            "CORNERS": CORNERS.T[:, :, None],
            "ORIGIN": np.array([[0.0], [0.0], [-40.0]]),
        }
        path = made_c3d(
            tmp_path / name,
            {"LASI": np.full((FRAMES, 3), 500.0), "LHEE": np.full((FRAMES, 3), [0.0, 0.0, 1000.0 * heel_m])},
            {"FORCE_PLATFORM": plate | ({"ZERO": list(zero)} if zero else {}), "ANALOG": {"UNITS": UNITS}},
            analog=channels,
            per_frame=PER_FRAME,
        )
        recording = read_c3d(path)
        said = [note for note in map(str, recording.notes) if "FORCE_PLATFORM:ZERO" in note]
        assert len(said) == (zero in ((1, 20), (20, 20)))
        force: np.ndarray = recording.plates[0].force
        return force

    clean, found = read("a.c3d", PUSH, ()), read("b.c3d", PUSH + OFFSET, zero)
    apart = np.abs(found - clean)[60:120].max()
    assert apart < 1e-3 if taken_off else apart > 50.0


def test_a_plate_that_is_loaded_wherever_the_feet_are_is_to_be_zeroed() -> None:
    """It was refused for its place."""
    made = standing(70.0)
    plate = made.plates[0]
    at = plate.cop + np.array([0.0, 0.0, 2.0])
    force = np.tile([0.0, 60.0, 0.0], (made.n_frames, 1))
    never = replace(plate, name="plate 3", force=force, cop=at, moment=np.cross(at, force), corners=None)
    walks = made.markers + np.linspace(0.0, 1.5, made.n_frames)[:, None, None] * [0.0, 0.0, 1.0]
    recording = replace(made, markers=walks).with_plates((never,))
    found = check_plates(
        recording, find_ground_frame(recording, vertical="+Y"), None, {"left": ["LHEE", "LTOE"], "right": ["RHEE"]}
    )
    assert found.refusal is not None and "plate 3 reads 60 N and never nothing, wherever the feet are" in found.refusal
    assert "zero it with nobody on it" in found.refusal
