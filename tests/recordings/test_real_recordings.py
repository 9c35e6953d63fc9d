"""What is known of the real recordings: masses, axes, feet."""

from __future__ import annotations

from pathlib import Path

import ezc3d
import numpy as np
import pytest

from dynakin.errors import RecordingError
from dynakin.model.markers.recognise import foot_markers_of
from dynakin.recordings.checks import check_plates
from dynakin.recordings.frame import find_ground_frame
from dynakin.recordings.read import read
from dynakin.recordings.recording import Recording
from dynakin.recordings.resampling import low_pass
from dynakin.recordings.standing import standing_window

G = 9.80665


def opencap(data_dir: Path, name: str) -> Recording:
    folder = data_dir / "opencap_subject4"
    return read(folder / f"{name}.trc", folder / f"{name}_grf.mot")


def test_opencap_standing_weighs_60_05_kg(data_dir: Path) -> None:
    recording = opencap(data_dir, "static1")
    assert (recording.n_frames, len(recording.marker_names), recording.length_unit) == (517, 55, "m")
    assert standing_window(recording) == slice(0, 517)
    frame = find_ground_frame(recording)
    assert frame.vertical == "+Y"
    assert frame.forward @ [1, 0, 0] > 0.995
    found = check_plates(recording, frame, 60.05, foot_markers_of(recording))
    assert found.refusal is None and not any(text.startswith("Warning:") for text in map(str, found.messages))
    assert found.mass_kg_from_plates == pytest.approx(60.05, abs=0.05)
    said = " ".join(map(str, found.messages))
    assert "plate 1: centre of pressure under the right foot" in said
    assert "plate 2: centre of pressure under the left foot" in said


def test_opencap_forces_pass_through_untouched(data_dir: Path) -> None:
    recording = opencap(data_dir, "squats1")
    table = np.loadtxt(data_dir / "opencap_subject4" / "squats1_grf.mot", skiprows=7)
    for k, plate in enumerate(recording.plates):
        force, point, free = np.split(table[:, 1 + 9 * k : 10 + 9 * k], 3, axis=1)
        np.testing.assert_array_equal(plate.force, force)
        np.testing.assert_array_equal(plate.moment, np.cross(point, force) + free)
    assert len(recording.plates) == 3
    mean = recording.total_wrench()[:, 1].mean() / G  # squats begin and end at rest
    assert mean == pytest.approx(60.05, abs=0.2)


def test_opencap_walking_has_blank_cells_and_walks_forward(data_dir: Path) -> None:
    recording = opencap(data_dir, "walking1")
    assert np.isnan(recording.marker("r_thigh5")).any()
    assert standing_window(recording) is None
    frame = find_ground_frame(recording)
    assert frame.forward @ [1, 0, 0] > 0.99
    assert any("walking direction" in sentence and "agrees" in sentence for sentence in frame.how)


def test_s1_standing(data_dir: Path) -> None:
    recording = read(data_dir / "plugin_gait" / "S1_StandingRef.c3d")
    frame = find_ground_frame(recording)
    assert frame.vertical == "+Z"
    assert any("Y_SCREEN says -Z" in sentence for sentence in frame.how)
    assert np.degrees(np.arctan2(frame.forward[1], frame.forward[0])) == pytest.approx(-61, abs=3)
    found = check_plates(recording, frame, 78.6, foot_markers_of(recording))
    assert found.refusal is None and not any(text.startswith("Warning:") for text in map(str, found.messages))
    assert found.mass_kg_from_plates == pytest.approx(81.3, abs=0.1)
    for plate, foot in zip(recording.plates, ("left", "right"), strict=True):
        assert any(
            f"{plate.name}: centre of pressure under the {foot} foot" in text for text in map(str, found.messages)
        )


def test_s1_flywheel_squat_is_a_warning_with_numbers(data_dir: Path) -> None:
    recording = read(data_dir / "plugin_gait" / "S1_FlywheelSquat.c3d")
    assert (recording.n_frames, len(recording.marker_names), len(recording.plates)) == (317, 26, 2)
    assert np.isnan(recording.marker("RSHO")).any()
    frame = find_ground_frame(recording)
    assert frame.vertical == "+Z"
    found = check_plates(recording, frame, 78.6, foot_markers_of(recording))
    assert found.refusal is None
    assert any("129.00 kg" in text and text.startswith("Warning") for text in map(str, found.messages))
    ground = frame.wrench_to_ground(recording.total_wrench())
    assert (ground[:, 1] > 500).all()


def test_gait_with_three_plates(data_dir: Path) -> None:
    recording = read(data_dir / "plugin_gait" / "GaitNormal_1.c3d")
    assert len(recording.plates) == 3
    frame = find_ground_frame(recording)
    assert frame.vertical == "+Y"
    assert frame.forward @ [1, 0, 0] > 0.99
    found = check_plates(recording, frame, 66.0, foot_markers_of(recording))
    assert found.refusal is None
    for k, foot in enumerate(("right", "left", "right")):
        assert any(
            f"plate {k + 1}: centre of pressure under the {foot} foot" in text for text in map(str, found.messages)
        )
    # Over one stride, from the middle of one right stance to the middle of the next, the mean force is m g.
    # The file's notes say 66 kg; its plates read 59 kg without offsets of -8 and -19 N of two of them.
    middles = [int(np.mean(np.flatnonzero(recording.plates[k].force[:, 1] > 50))) for k in (0, 2)]
    mass = recording.total_wrench()[slice(*middles), 1].mean() / G
    assert mass == pytest.approx(59.2, abs=0.2)
    assert any("plate 3 reads -19" in note for note in map(str, recording.notes))


@pytest.mark.parametrize("name", ["GaitNormal_1", "S1_StandingRef", "S1_FlywheelSquat"])
def test_wrenches_equal_those_of_ezc3d_at_the_analog_rate(data_dir: Path, name: str) -> None:
    """An independent computation of type 4: ezc3d's own, averaged over a frame's neighbourhood."""
    path = data_dir / "plugin_gait" / f"{name}.c3d"
    recording = read(path, plate_filter_hz=8.0, force_threshold_n=0.0)
    theirs = ezc3d.c3d(str(path), extract_forceplat_data=True)["data"]["platform"]
    per_frame = theirs[0]["force"].shape[1] // recording.n_frames
    for plate, other in zip(recording.plates, theirs, strict=True):
        force = other["force"].T
        moment = (other["moment"].T + np.cross(other["corners"].mean(axis=1), force)) * 1e-3
        wrench = np.hstack([force, moment])
        push = force[:, int(np.argmax(np.abs(force).mean(axis=0)))]
        empty = wrench[np.abs(push) < 50.0]
        if len(empty) and np.median(push[np.abs(push) < 50.0]) < -3.0:  # no plate pulls: its zero
            wrench = wrench - np.median(empty, axis=0)
        smooth = low_pass(wrench, 100.0 * per_frame, 8.0)[::per_frame]
        loaded = np.linalg.norm(plate.force, axis=1) > 20
        assert loaded.sum() > 40
        mine = np.hstack([plate.force, plate.moment])
        np.testing.assert_allclose(mine[loaded], smooth[loaded], atol=0.3)


def test_truncated_real_files(data_dir: Path, tmp_path: Path) -> None:
    for name in ("GaitNormal_1", "S1_StandingRef", "S1_FlywheelSquat"):
        data = (data_dir / "plugin_gait" / f"{name}.c3d").read_bytes()
        path = tmp_path / f"{name}.c3d"
        for share in (0.001, 0.01, 0.5, 0.99):
            path.write_bytes(data[: int(share * len(data))])
            with pytest.raises(RecordingError, match="truncated C3D"):
                read(path)


def test_forces_of_another_trial_are_refused(data_dir: Path) -> None:
    folder = data_dir / "opencap_subject4"
    with pytest.raises(RecordingError, match=r"131 rows .* expected to cover 1346 frames"):
        read(folder / "squats1.trc", folder / "walking1_grf.mot")
