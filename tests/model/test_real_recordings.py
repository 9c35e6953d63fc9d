"""Real people: the models take them, and find lengths, angles and masses that a person can have."""

from __future__ import annotations

from dataclasses import replace
from importlib import resources
from pathlib import Path

import numpy as np
import pytest

from dynakin.errors import ModelError
from dynakin.model.calibration.how import Calibration
from dynakin.model.definition import load_model
from dynakin.recordings.formats.mot import read_table
from dynakin.recordings.read import read
from dynakin.recordings.recording import Recording
from dynakin.settings.subject import Subject

OPENCAP = "opencap_subject4"
PIG = "plugin_gait"


def opencap(data_dir: Path, name: str) -> Recording:
    return read(data_dir / OPENCAP / f"{name}.trc", data_dir / OPENCAP / f"{name}_grf.mot")


def test_squats1(data_dir: Path) -> None:
    recording = opencap(data_dir, "squats1")
    found = load_model("sagittal7", Subject(mass_kg=60.05), "opencap").calibrate(recording)
    plan = found.measured_plan()
    assert found.side == "right"
    assert len(plan.sites) == 17
    expected = {
        "foot": 0.155,
        "shank": 0.413,
        "thigh": 0.389,
        "pelvis": 0.095,
        "trunk": 0.450,
        "upper_arm": 0.332,
    }
    assert plan.geometry.lengths == pytest.approx(expected, abs=2e-3)
    assert not plan.geometry.locked
    assert sum(body.mass for body in plan.inertia.values()) == pytest.approx(60.05, rel=1e-12)
    assert all(body.possible_in_plane() for body in plan.inertia.values())
    # the other system's 3D angles of the same frame (radians in the file): a plane and another pelvis frame
    # apart
    other = read_table(data_dir / OPENCAP / "squats1_ik.mot")
    angles = dict(zip(other.names, other.values[0], strict=True))
    assert plan.start["knee"] == pytest.approx(angles["knee_angle_r"], abs=np.deg2rad(5.0))
    assert plan.start["ankle"] == pytest.approx(angles["ankle_angle_r"], abs=np.deg2rad(8.0))
    assert plan.start["hip"] == pytest.approx(angles["hip_flexion_r"], abs=np.deg2rad(12.0))


@pytest.mark.parametrize("name", ["DJ1", "STS1", "squats1", "walking1"])
def test_height_is_that_of_the_standing_trial(data_dir: Path, name: str) -> None:
    """1.70 m. DJ1, a jump from a box, had 2.15 m: the highest shoulder of the trial over its lowest marker."""
    found = load_model("fullbody", Subject(mass_kg=60.05), "opencap").calibrate(opencap(data_dir, name))
    assert found.height_m == pytest.approx(1.703, abs=0.03)


@pytest.mark.parametrize("named", ["plug-in-gait", "cast", "helen-hayes"])
def test_a_named_set_that_knows_far_fewer_markers_than_another_is_refused(data_dir: Path, named: str) -> None:
    """Held knees put a hip 57 deg off, and moments were absent."""
    with pytest.raises(ModelError, match=rf"{named} knows \d of the 51 markers, opencap knows 47; expected --markers"):
        load_model("fullbody", Subject(mass_kg=60.05), named).calibrate(opencap(data_dir, "walking1"))


def test_a_named_set_of_a_part_of_the_body_is_taken(data_dir: Path) -> None:
    recording = read(data_dir / PIG / "GaitNormal_1.c3d")
    found = load_model("fullbody", Subject(mass_kg=60.05, height_m=1.7), "plug-in-gait-lower-body").calibrate(recording)
    assert len(found.measured_plan().sites) == 18


def test_knees_that_are_held_between_pelvis_and_foot_are_a_warning(data_dir: Path, tmp_path: Path) -> None:
    """A set of one's own knows what it wants, and its knees may not be marked all the same."""
    own = Path(str(resources.files("dynakin.model"))) / "markers" / "sets" / "plug-in-gait.toml"
    mine = tmp_path / "mine.toml"
    mine.write_text(own.read_text(encoding="utf-8").replace('name = "plug-in-gait"', 'name = "mine"'), encoding="utf-8")
    found = load_model("fullbody", Subject(mass_kg=60.05), mine).calibrate(opencap(data_dir, "walking1"))
    (said,) = [message for message in found.messages if message.topic == "held"]
    assert said.level == "warning" and "the right knee and the left knee" in said.text
    whole = load_model("fullbody", Subject(mass_kg=60.05)).calibrate(opencap(data_dir, "walking1"))
    assert not [message for message in whole.messages if message.topic == "held"]


def test_a_standing_trial_without_one_marker_of_the_trial_is_refused(data_dir: Path) -> None:
    trial, static = read(data_dir / "c3d_parser/FMC/MH0222_BP06.c3d"), read(data_dir / "functional/anat_pose_ECH.c3d")
    with pytest.raises(ModelError, match=r"none of its 73 markers is in MH0222_BP06; expected a standing trial"):
        load_model("fullbody").calibrate(trial, static=static)


@pytest.mark.parametrize(("one", "other"), [("LHEE", "LANK"), ("RHEE", "RANK"), ("LASI", "LPSI")])
def test_a_refusal_names_the_exchanged_labels(data_dir: Path, one: str, other: str) -> None:
    """Heel and ankle exchanged had a knee 9 deg off, without a word."""
    trial = read(data_dir / "c3d_parser/FMC/MH0222_BP06.c3d")
    swap = {one: other, other: one}
    names = tuple(swap.get(name, name) for name in trial.marker_names)
    with pytest.raises(ModelError, match=rf"{one} and {other} look swapped .*expected the labels corrected"):
        load_model("fullbody").calibrate(replace(trial, marker_names=names))


def test_a_missing_back_of_the_pelvis_is_said_for_all_that_needs_it(data_dir: Path) -> None:
    trial = read(data_dir / "c3d_parser/FMC/MH0222_BP06.c3d")
    kept = [k for k, name in enumerate(trial.marker_names) if name[1:] != "PSI"]
    less = replace(trial, marker_names=tuple(trial.marker_names[k] for k in kept), markers=trial.markers[:, kept])
    with pytest.raises(
        ModelError, match=r"without a marker on the back of the pelvis .* the hips, and with them right"
    ):
        load_model("fullbody").calibrate(less)
    swap = {"RKNE": "ROTT", "LKNE": "LOTT"}
    other = replace(trial, marker_names=tuple(swap.get(name, name) for name in trial.marker_names))
    with pytest.raises(ModelError, match=r"does not know ROTT, LOTT: if they mark what lacks, say so in a set"):
        load_model("fullbody").calibrate(other)


def test_static1_as_the_trial_and_as_the_static(data_dir: Path) -> None:
    static = opencap(data_dir, "static1")
    found = load_model("sagittal7", markers="opencap").calibrate(static)
    assert found.mass_kg == pytest.approx(60.05, abs=0.05)
    assert any("from the plates of static1" in message for message in map(str, found.messages))
    squats = opencap(data_dir, "squats1")
    definition = load_model("sagittal7", markers="opencap")
    own = load_model("sagittal7", Subject(mass_kg=60.05), "opencap").calibrate(squats).measured_plan()
    found = definition.calibrate(squats, static=static)
    plan = found.measured_plan()
    assert found.mass_kg == pytest.approx(60.05, abs=0.05)
    assert any("of static1 (517 frames)" in message for message in map(str, found.messages))
    for name, value in own.geometry.lengths.items():
        assert plan.geometry.lengths[name] == pytest.approx(value, rel=0.02), name
    assert abs(plan.start["knee"] - own.start["knee"]) < np.deg2rad(2.0)


@pytest.mark.parametrize("side", ["auto", "right", "left", "both"])
def test_s1_squat_without_t10_and_arms(data_dir: Path, side: str) -> None:
    recording = read(data_dir / PIG / "S1_FlywheelSquat.c3d")
    subject = Subject(mass_kg=78.6, height_m=1.74, sex="male")
    found = load_model("squat7", subject).calibrate(recording, how=Calibration(side=side))
    plan = found.measured_plan()
    assert found.side == ("left" if side == "auto" else side)  # RSHO is missing for 68 frames
    assert set(plan.geometry.locked) == {"thoracic", "shoulder"}
    text = " ".join(map(str, found.messages))
    assert "Segment abdomen has no markers: locked to thorax" in text
    assert "Segment arm has no markers: locked to thorax" in text
    assert "T10" in text
    assert 0.40 < plan.geometry.lengths["shank"] < 0.48
    assert 0.40 < plan.geometry.lengths["thigh"] < 0.48
    assert all(np.isfinite(site.position).all() for site in plan.sites)
    assert all(np.isfinite(value) for value in plan.start.values())
    assert np.rad2deg(plan.start["knee"]) > 20.0  # the trial starts in a squat
    assert abs(np.rad2deg(plan.start["toe"])) < 5.0


def test_s1_squat_weighs_nobody_but_its_standing_trial_does(data_dir: Path) -> None:
    recording = read(data_dir / PIG / "S1_FlywheelSquat.c3d")
    with pytest.raises(ModelError, match="nobody stands still on the plates of S1_FlywheelSquat"):
        load_model("squat7").calibrate(recording)  # 129 kg on average: the flywheel's cable pulls too
    found = load_model("squat7").calibrate(recording, static=read(data_dir / PIG / "S1_StandingRef.c3d"))
    assert found.mass_kg == pytest.approx(81.3, abs=0.1)


@pytest.mark.parametrize("model", ["squat7", "sagittal7"])
def test_walking_is_refused_because_the_toe_moves(data_dir: Path, model: str) -> None:
    recording = read(data_dir / PIG / "GaitNormal_1.c3d")
    with pytest.raises(ModelError, match=r"GaitNormal_1\.c3d: marker [RL]TOE moves 1\d\d\d mm .*at most 40 mm"):
        load_model(model, Subject(mass_kg=66.0)).calibrate(recording)


def test_sagittal7_takes_plug_in_gait_without_arms(data_dir: Path) -> None:
    recording = read(data_dir / PIG / "S1_FlywheelSquat.c3d")
    plan = load_model("sagittal7", Subject(mass_kg=78.6)).calibrate(recording).measured_plan()
    assert set(plan.geometry.locked) == {"shoulder", "elbow"}
    assert "upper_arm" in plan.fixed_lengths


@pytest.mark.parametrize("table", ["dumas", "deleva"])
@pytest.mark.parametrize("markers", ["opencap", "opencap-all"])
def test_squat7_takes_opencap(data_dir: Path, table: str, markers: str) -> None:
    subject = Subject(mass_kg=60.05)
    plan = load_model("squat7", subject, markers, table).calibrate(opencap(data_dir, "squats1")).measured_plan()
    assert list(plan.geometry.locked) == ["thoracic"]
    assert sum(body.mass for body in plan.inertia.values()) == pytest.approx(60.05, rel=1e-12)


def test_a_wrong_marker_set_names_what_there_is(data_dir: Path) -> None:
    squats = opencap(data_dir, "squats1")
    kept = [k for k, name in enumerate(squats.marker_names) if "knee" not in name and "thigh" not in name]
    names = tuple(squats.marker_names[k] for k in kept)
    less = replace(squats, marker_names=names, markers=squats.markers[:, kept])
    with pytest.raises(ModelError, match=r"squats1\.trc.*it has C7, L\.ASIS") as error:
        load_model("squat7", Subject(mass_kg=60.0), "opencap").calibrate(less)
    assert "tried" in error.value.message or "has no marker" in error.value.message


def test_knees_that_nobody_sees_in_a_walk_are_warned_of(data_dir: Path) -> None:
    """OpenSim's oldest example has knee and ankle markers in its standing trial only."""
    walk, static = (read(data_dir / "gait2354" / f"subject01_{name}.trc") for name in ("walk1", "static"))
    model = load_model("fullbody", Subject(mass_kg=72.6, height_m=1.8))
    said = [
        text
        for text in map(str, model.calibrate(walk).messages)
        if "no marker shows left ankle, right ankle, left knee and right knee" in text
    ]
    assert len(said) == 1 and said[0].startswith("Warning: ") and "--static" in said[0]
    assert not any("no marker shows" in text for text in map(str, model.calibrate(walk, static=static).messages))
