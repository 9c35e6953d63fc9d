"""What belongs to a recording in its folder is found by its name and by what is in it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dynakin.recordings.companions import another_person, companion_forces, companion_static
from dynakin.recordings.read import read
from dynakin.recordings.recording import Recording
from dynakin.results.files.markers import write_trc
from dynakin.simulation.trial import simulate

# The limit `_SAME_M` was set with these recordings in view.
PAIRS = {
    "opencap_subject4/walking1.trc": ("walking1_grf.mot", "static1.trc"),
    "opencap_subject4/static1.trc": ("static1_grf.mot", None),
    "rajagopal/motion_capture_run.trc": ("grf_run.mot", "static_run.trc"),
    "rajagopal/motion_capture_walk.trc": ("grf_walk.mot", "static_walk_2.trc"),
    "rajagopal/static_run.trc": (None, None),
    "gait2354/subject01_walk1.trc": ("subject01_walk1_grf.mot", "subject01_static.trc"),
    "plugin_gait/GaitNormal_1.c3d": (None, None),  # another person stands next to it
    "plugin_gait/S1_FlywheelSquat.c3d": (None, "S1_StandingRef.c3d"),
    "c3d_parser/RBWH/bfnd w1.c3d": (None, "Max Cal 01.c3d"),
    "functional/right_knee.c3d": (None, "anat_pose_ECH.c3d"),
}


@pytest.mark.parametrize("trial", PAIRS)
def test_of_recordings(trial: str, data_dir: Path) -> None:
    path = data_dir / trial
    recording = read(path)
    found = companion_forces(path), companion_static(path, recording)
    assert tuple(each and each.name for each in found) == PAIRS[trial]


@pytest.fixture(scope="module")
def people() -> dict[str, Recording]:
    """A squat of one person, who stands at its start, and of another one."""
    heights = {"one": 1.80, "other": 1.62}
    return {name: simulate("fullbody", "squat", 1, 6.0, height_m=height).recording for name, height in heights.items()}


def _write(path: Path, recording: Recording, frames: slice = slice(None)) -> None:
    write_trc(path, recording.time[frames], list(recording.marker_names), recording.markers[frames], unit="mm")


def test_another_person_is_not_taken(people: dict[str, Recording], tmp_path: Path) -> None:
    _write(tmp_path / "squat.trc", people["one"])
    _write(tmp_path / "static.trc", people["other"], slice(0, 80))
    assert companion_static(tmp_path / "squat.trc", people["one"]) is None
    _write(tmp_path / "standing.trc", people["one"], slice(0, 80))
    found = companion_static(tmp_path / "squat.trc", people["one"])
    assert found is not None and found.name == "standing.trc"


def test_who_stands_is_found_under_any_name(people: dict[str, Recording], tmp_path: Path) -> None:
    _write(tmp_path / "t07.trc", people["one"])
    _write(tmp_path / "t02.trc", people["one"], slice(0, 80))
    _write(tmp_path / "t03.trc", people["one"], slice(150, 400))
    (tmp_path / "t04.trc").write_text("no recording")
    found = companion_static(tmp_path / "t07.trc", people["one"])
    assert found is not None and found.name == "t02.trc"
    assert companion_static(tmp_path / "t02.trc", read(tmp_path / "t02.trc")) is None


@pytest.mark.parametrize(
    ("names", "expected"),
    [
        (["walk2_grf.mot", "walk1_ik.mot"], None),
        (["walk1_grf.mot", "walk_grf.mot"], "walk1_grf.mot"),
        (["Walk1 Forces.STO"], "Walk1 Forces.STO"),
        (["grf.mot"], None),
    ],
)
def test_forces_by_their_names(names: list[str], expected: str | None, tmp_path: Path) -> None:
    for name in names:
        (tmp_path / name).write_text("")
    found = companion_forces(tmp_path / "walk1.trc")
    assert (found and found.name) == expected


def test_a_folder_that_is_not_there(tmp_path: Path) -> None:
    assert companion_forces(tmp_path / "none" / "walk.trc") is None
    still = Recording("a", None, np.arange(3.0), ("x",), np.zeros((3, 1, 3)))
    assert companion_static(tmp_path / "none" / "walk.trc", still) is None


def test_of_another_marker_set_nothing_shows_whose_it_is(people: dict[str, Recording]) -> None:
    trial = people["one"]
    few = replace(trial, marker_names=tuple(name if k < 20 else f"x{k}" for k, name in enumerate(trial.marker_names)))
    assert another_person(trial, trial) == ""
    assert another_person(trial, few).startswith("only 20 markers are in both ")
    more = np.concatenate([trial.markers, np.full((trial.n_frames, 60, 3), np.nan)], axis=1)
    names = (*trial.marker_names, *(f"x{k}" for k in range(60)))
    assert another_person(replace(trial, markers=more, marker_names=names), trial) == ""
