"""Joint centres and axes from functional trials, on simulated persons and real recordings.

Thresholds were set on seeds 1 to 12, deviations on 101 to 130; those here are others.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dynakin.arrays import Array
from dynakin.errors import ModelError
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.model.calibration.frames import MarkedTrial
from dynakin.model.calibration.functional import functional_landmarks
from dynakin.model.calibration.how import AUTO
from dynakin.model.calibration.joint_motion import JointMotion, angle_deg, joint_axis, joint_centre, rigid_motion
from dynakin.model.calibration.landmarks import LandmarkFinder
from dynakin.model.definition import ModelDefinition, load_model
from dynakin.model.markers.marker_set import load_marker_set
from dynakin.model.markers.match import match_markers
from dynakin.recordings.read import read
from dynakin.recordings.recording import Recording
from dynakin.settings.subject import Subject
from dynakin.simulation.sensors.sizes import SensorNoise
from support.functional_trials import STANDING, functional_trial
from support.made_recordings import unseen

PELVIS = ("r.ASIS", "L.ASIS", "r.PSIS", "L.PSIS")
THIGH = ("r_knee", "r_thigh1", "r_thigh2", "r_thigh3", "r_thigh4")
SHANK = ("r_ankle", "r_sh2", "r_sh3", "r_shank_antsup")
SEEDS = range(201, 209)
WHO = Subject(mass_kg=70.0, height_m=1.75, sex="male")


def joint_motion(recording: Recording, proximal: tuple[str, ...], distal: tuple[str, ...]) -> JointMotion:
    paths = [np.stack([recording.marker(name) for name in names], axis=1) for names in (proximal, distal)]
    return JointMotion.between(*(rigid_motion(np.median(path[STANDING], axis=0), path) for path in paths))


def definition(**functional: Recording) -> ModelDefinition:
    found = load_model("fullbody", WHO, markers="opencap")
    assert isinstance(found, ModelDefinition)
    return replace(found, functional=functional)


def renamed(recording: Recording, names: dict[str, str]) -> Recording:
    return replace(recording, marker_names=tuple(names.get(name, name) for name in recording.marker_names))


@pytest.mark.parametrize(("noise", "within_mm", "within_deg"), [
    (SensorNoise.none(), 0.01, 0.01),
    (replace(SensorNoise.none(), marker_sd_m=0.0005), 0.5, 0.5),
])  # fmt: skip
def test_rigid_segments(noise: SensorNoise, within_mm: float, within_deg: float) -> None:
    recording, centre, _ = functional_trial(101, "hip", noise)
    assert 1e3 * np.linalg.norm(joint_centre(joint_motion(recording, PELVIS, THIGH)).point - centre) < within_mm
    recording, _, axis = functional_trial(101, "knee", noise)
    assert angle_deg(joint_axis(joint_motion(recording, THIGH, SHANK)).direction, axis, True) < within_deg


def test_soft_tissue_and_deviations() -> None:
    errors, stated = np.empty((2, len(SEEDS))), np.empty((2, len(SEEDS)))
    for k, seed in enumerate(SEEDS):
        recording, centre, _ = functional_trial(seed, "hip", SensorNoise())
        found = joint_centre(joint_motion(recording, PELVIS, THIGH))
        errors[0, k], stated[0, k] = 1e3 * np.linalg.norm(found.point - centre), 1e3 * found.sd_m
        recording, _, axis = functional_trial(seed, "knee", SensorNoise())
        line = joint_axis(joint_motion(recording, THIGH, SHANK))
        errors[1, k], stated[1, k] = angle_deg(line.direction, axis, True), line.sd_deg
    rms, expected = np.sqrt((errors**2).mean(axis=1)), np.sqrt((stated**2).mean(axis=1))
    print("rms error (mm, deg)", rms, "stated", expected)
    assert rms[0] < 12.0 and rms[1] < 5.0
    assert (rms < 1.5 * expected).all() and (rms > 0.4 * expected).all()


def _hip(found: CalibratedModel) -> Array:
    plan = found.measured_plan()
    return plan.geometry.placement(next(s for s in plan.model.segments if s.name == "thigh_r"))


def test_a_regression_that_is_off_is_replaced() -> None:
    """Hip centres 12 mm off along each axis come nearer to where they are; the sentence says by how much they move."""
    noise, errors = replace(SensorNoise(), hip_regression_sd_m=0.012), []
    for seed in SEEDS[:4]:
        hip, centre, _ = functional_trial(seed, "hip", noise)
        match = match_markers(load_marker_set("opencap"), hip.marker_names, [True] * len(hip.marker_names), hip.name)
        ground = AUTO.find_ground(hip, match.facing_pairs, None, floating=True)
        trial = MarkedTrial.of(hip, match, ground).facing()
        finder = LandmarkFinder(match, "both", "male", planar=False, in_space=True, height_m=1.75)
        before = finder.find_in_space(trial.median(STANDING))
        after, said = functional_landmarks({"hip_r": hip}, before, finder, trial, STANDING)
        truth = trial.ground.points_to_ground(centre)
        errors.append([float(np.linalg.norm(one["hip_r"] - truth)) for one in (before, after)])
        moved = 1e3 * float(np.linalg.norm(after["hip_r"] - before["hip_r"]))
        assert f"{moved:.1f} mm from the marker set's" in said[0].text and "standard deviation" in said[0].text
        assert np.allclose(after["hip"], 0.5 * (after["hip_r"] + after["hip_l"]))
        assert np.array_equal(after["hip_l"], before["hip_l"]) and np.array_equal(after["knee_r"], before["knee_r"])
    before_m, after_m = np.sqrt((np.array(errors) ** 2).mean(axis=0))
    assert after_m < 0.014 and after_m < 0.7 * before_m, (before_m, after_m)


def test_the_knee_turns_about_the_axis_found() -> None:
    """A medial epicondyle that is put on 25 mm too far forward turns the markers' axis; the trial's is not turned."""
    knee, _, axis = functional_trial(102, "knee", SensorNoise())
    markers = knee.markers.copy()
    markers[:, knee.marker_names.index("r_mknee")] += [0.025, 0.0, 0.0]
    off = replace(knee, markers=markers)
    for functional, low, high in (({}, 9.0, 20.0), ({"knee_r": off}, 0.0, 6.0)):
        found = definition(**functional).calibrate(off).measured_plan()
        thigh = found.start  # of the first frame: the person stands with all angles zero
        assert low <= abs(np.rad2deg(thigh["hip_rotation_r"])) <= high
    assert abs(axis[2]) > 0.99


def test_markers_that_the_set_does_not_know() -> None:
    """A thigh of which the set knows one marker is found by those that lie along it and move with it."""
    hip, _, _ = functional_trial(203, "hip", SensorNoise())
    unknown = renamed(hip, {f"r_thigh{k}": f"X{k}" for k in (1, 2, 3, 4)})
    found = []
    for one in (hip, unknown):
        after, before = definition(hip_r=one).calibrate(one), definition().calibrate(one)
        assert any(text.startswith("Hip centre right: from simulated") for text in map(str, after.messages))
        found.append(_hip(after) - _hip(before))
    assert np.linalg.norm(found[1] - found[0]) < 0.010 and np.linalg.norm(found[1]) > 1e-4


def test_refusals_say_what_to_do() -> None:
    noise = SensorNoise()
    good, _, _ = functional_trial(104, "hip", noise)
    knee, _, _ = functional_trial(104, "knee", noise)
    small, _, _ = functional_trial(104, "hip", noise, size=0.3)
    stiff, _, _ = functional_trial(104, "knee", noise, size=0.2)
    few = unseen(good, "r_thigh3", "r_thigh4")
    swapped = renamed(few, {"r_thigh1": "r_thigh2", "r_thigh2": "r_knee", "r_knee": "r_thigh1"})
    bare = unseen(good, *(f"r_thigh{k}" for k in (1, 2, 3, 4)))
    for joint, trial, words in (
        ("hip_r", small, "about two axes"),
        ("knee_r", stiff, "the knee turns through"),
        ("hip_l", good, "the thigh turns through"),
        ("hip_r", knee, "deg or more about two axes"),
        ("hip_r", swapped, "labels swapped"),
        ("hip_r", bare, "2 markers of the right thigh"),
    ):
        with pytest.raises(ModelError, match=words) as caught:
            definition(**{joint: trial}).calibrate(good)
        assert "\n" not in caught.value.message and f"for {joint}" in caught.value.message
    lame = unseen(knee, "r_knee", "r_mknee", "r_ankle", "r_mankle")  # clusters alone, as in a CAST trial
    with pytest.raises(ModelError, match=r"right knee centre and lateral epicondyle .*--static") as caught:
        definition(knee_r=lame).calibrate(lame)
    assert "\n" not in caught.value.message and "for knee_r" in caught.value.message
    few = unseen(good, "r_knee", "r_mknee", "r_thigh1", "r_thigh2")
    with pytest.raises(ModelError, match="2 markers of the right thigh"):
        definition(hip_r=few).calibrate(few)
    armless = unseen(good, "r.ASIS", "L.ASIS")
    with pytest.raises(ModelError, match="2 markers of the pelvis"):
        definition(hip_r=armless).calibrate(armless)
    with pytest.raises(ModelError, match="planar"):
        replace(load_model("squat7", WHO, "opencap"), functional={"hip_r": good}).calibrate(good)


def test_trials_of_other_people_are_refused() -> None:
    """The limit was set on seeds 401 to 414; these are others. Of one that is just as tall the deviation tells."""
    own, _, _ = functional_trial(1, "hip", SensorNoise())
    for seed, height_m, words in (
        (7, 1.75, r"standard deviation of 3. mm, expected at most 18 mm"),
        (8, 1.60, "another person, or markers put on anew"),
        (9, 1.90, "another person, or markers put on anew"),
    ):
        other, _, _ = functional_trial(seed, "hip", SensorNoise(), height_m=height_m)
        with pytest.raises(ModelError, match=words):
            definition(hip_r=other).calibrate(own)
        said = definition(hip_r=other).calibrate(other).messages
        assert any(message.text.startswith("Hip centre right: from simulated") for message in said)
    short, _, _ = functional_trial(8, "knee", SensorNoise(), height_m=1.60)
    with pytest.raises(ModelError, match=r"for knee_r: distances .* another person"):
        definition(knee_r=short).calibrate(own)


def test_real_hip_and_knee(data_dir: Path) -> None:
    """One person, clusters of three: the hip lies within 25 mm of Harrington's regression; in `right_hip` the labels of
    the epicondyles change places at half time, which the reader puts right (as the standing trial has them)."""
    standing, hip, knee = (
        read(data_dir / f"functional/{name}.c3d") for name in ("anat_pose_ECH", "right_hip", "right_knee")
    )
    window = slice(0, 800)

    def motion(trial: Recording, names: tuple[str, ...]) -> tuple[Array, ...]:
        shape = np.array([np.nanmedian(standing.marker(name)[window], axis=0) for name in names])
        return shape, np.stack([trial.marker(name) for name in names], axis=1)

    pelvis, thigh = ("RASIS", "LASIS", "RPSIS", "LPSIS"), ("RTHI1", "RTHI2", "RTHI3")
    found = joint_centre(JointMotion.between(rigid_motion(*motion(hip, pelvis)), rigid_motion(*motion(hip, thigh))))
    assert 5.0 < 1e3 * found.residual_m < 12.0 and 6.0 < 1e3 * found.sd_m < 20.0
    assert np.percentile(rigid_motion(*motion(hip, (*thigh, "RLFE"))).misfit_m, 90) < 0.010
    shank = ("RLEG1", "RLEG2", "RLEG3")
    line = joint_axis(JointMotion.between(rigid_motion(*motion(knee, thigh)), rigid_motion(*motion(knee, shank))))
    worn = rigid_motion(*motion(knee, thigh)).rotations[::20].transpose(0, 2, 1)
    apart = (knee.marker("RLFE") - knee.marker("RMFE"))[::20]
    epicondyles = (worn @ (apart / np.linalg.norm(apart, axis=1)[:, None])[:, :, None])[:, :, 0].mean(axis=0)
    assert angle_deg(line.direction, epicondyles / np.linalg.norm(epicondyles), True) < 12.0
