"""Measuring a model on a made-up person whose joints are known: given / when / then."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dynakin.errors import ModelError
from dynakin.model.calibration.body import check_body_mass, find_height
from dynakin.model.calibration.frames import MarkedTrial
from dynakin.model.calibration.how import Calibration
from dynakin.model.definition import load_model
from dynakin.model.markers.marker_set import load_marker_set
from dynakin.model.markers.match import match_markers
from dynakin.recordings.frame import find_ground_frame
from dynakin.recordings.recording import Recording
from dynakin.settings.model import Bounds, Priors
from dynakin.settings.subject import Subject
from support.made_person import FOOT_DIRECTION, LENGTHS, make, stand
from support.made_recordings import unseen, without

PERSON = Subject(mass_kg=70.0, height_m=1.75, sex="male")


def test_lengths_angles_and_places_of_a_known_person(standing_person: Recording) -> None:
    found = load_model("sagittal7", PERSON).calibrate(standing_person)
    plan = found.measured_plan()
    for name, length in LENGTHS.items():
        assert plan.geometry.lengths[name] == pytest.approx(length, abs=1e-9)
    np.testing.assert_allclose(plan.geometry.directions["shank"][0][:2], FOOT_DIRECTION, atol=1e-9)
    degrees = {name: np.rad2deg(value) for name, value in plan.start.items()}
    assert degrees["toe"] == pytest.approx(0.0, abs=1e-6)
    assert degrees["ankle"] == pytest.approx(5.0, abs=1e-6)
    assert degrees["knee"] == pytest.approx(8.0, abs=1e-6)
    assert degrees["hip"] == pytest.approx(10.0, abs=1e-6)
    places = {site.name: site.position for site in plan.sites}
    np.testing.assert_allclose(places["r_sh2"], [0.04, 0.21, 0.0], atol=1e-9)
    np.testing.assert_allclose(places["r_thigh1"], [0.05, 0.28, 0.0], atol=1e-9)
    np.testing.assert_allclose(places["r.ASIS"], [0.06, 0.09, 0.0], atol=1e-9)
    assert [site.recorded for site in plan.sites][:2] == ["R_toe", "R_5meta"]
    assert len(plan.sites) == 17
    toe = standing_person.marker("R_toe")[0]
    np.testing.assert_allclose(found.ground.origin_L, toe, atol=1e-12)
    assert any("standing from 0.00 to 0.99 s" in message for message in map(str, found.messages))


def test_signs_are_opensims() -> None:
    """Given a deep squat with the heels off the ground, when it starts there, then all flexions are
    positive."""
    standing, deep = stand(), stand(ankle=30.0, knee=100.0, hip=90.0, heel_rise=15.0)
    recording = make([deep] * 30)
    plan = load_model("sagittal7", PERSON).calibrate(recording, static=make([standing] * 100, "static")).measured_plan()
    degrees = {name: np.rad2deg(value) for name, value in plan.start.items()}
    assert degrees["toe"] == pytest.approx(15.0, abs=1e-6)
    assert degrees["ankle"] == pytest.approx(30.0, abs=1e-6)
    assert degrees["knee"] == pytest.approx(100.0, abs=1e-6)
    assert degrees["hip"] == pytest.approx(90.0, abs=1e-6)
    assert plan.geometry.lengths["thigh"] == pytest.approx(LENGTHS["thigh"], abs=1e-9)


def test_another_laboratory_frame_changes_nothing(standing_person: Recording) -> None:
    """Given the same person in a laboratory with Z up, turned about it, when measured, then the plan is the
    same."""
    a = np.deg2rad(130.0)
    R_LG = np.array([[np.cos(a), 0.0, np.sin(a)], [np.sin(a), 0.0, -np.cos(a)], [0.0, 1.0, 0.0]])
    turned = replace(standing_person, markers=standing_person.markers @ R_LG.T + [3.0, -2.0, 0.5])
    plan = load_model("sagittal7", PERSON).calibrate(standing_person).measured_plan()
    found = load_model("sagittal7", PERSON).calibrate(turned)
    again = found.measured_plan()
    assert found.ground.vertical == "+Z"
    assert again.start == pytest.approx(plan.start, abs=1e-9)
    for one, other in zip(plan.sites, again.sites, strict=True):
        np.testing.assert_allclose(other.position, one.position, atol=1e-9)


def test_side_auto_takes_the_side_with_fewer_gaps(standing_person: Recording) -> None:
    definition = load_model("sagittal7", PERSON)
    assert definition.calibrate(standing_person).side == "right"
    gap = unseen(standing_person, "R_knee", frames=slice(40, 60))
    found = definition.calibrate(gap)
    plan = found.measured_plan()
    assert found.side == "left"
    assert plan.sites[0].recorded == "L_toe"
    assert definition.calibrate(gap, how=Calibration(side="right")).side == "right"
    with pytest.raises(ModelError, match="side is 'middle', expected auto, right, left or both"):
        definition.calibrate(gap, how=Calibration(side="middle"))


def test_both_sides_are_separate_sites(standing_person: Recording) -> None:
    plan = load_model("sagittal7", PERSON).calibrate(standing_person, how=Calibration(side="both")).measured_plan()
    assert len(plan.sites) == 33  # 16 a side and C7
    assert np.rad2deg(plan.start["knee"]) == pytest.approx(8.0, abs=1e-6)


def test_a_start_without_markers_is_later(standing_person: Recording) -> None:
    gap = unseen(unseen(standing_person, "R_knee", frames=slice(0, 25)), "L_knee", frames=slice(0, 30))
    found = load_model("sagittal7", PERSON).calibrate(gap)
    plan = found.measured_plan()
    assert any("Start from frame 25 (0.25 s)" in message for message in map(str, found.messages))
    assert np.rad2deg(plan.start["knee"]) == pytest.approx(8.0, abs=1e-6)


def test_a_marker_seen_only_later_is_placed_there(standing_person: Recording) -> None:
    moving = [stand(knee=8.0 + k, ankle=5.0 + 0.5 * k) for k in range(60)]
    recording = make(moving)
    for side in "RL":
        recording = unseen(recording, f"{side}_thigh2", frames=slice(0, 40))
    found = load_model("sagittal7", PERSON).calibrate(recording)
    plan = found.measured_plan()
    place = next(site.position for site in plan.sites if site.name == "r_thigh2")
    np.testing.assert_allclose(place[:2], [0.06, 0.17], atol=2e-3)
    assert any(
        "R_thigh2 is not seen in the calibration frames: placed from 0.40 s" in m for m in map(str, found.messages)
    )


def test_a_moving_toe_is_refused_with_the_distance() -> None:
    frames = []
    for k in range(100):
        frame = stand()
        for name in frame:
            frame[name] = frame[name] + [0.01 * k, 0.0, 0.0]
        frames.append(frame)
    with pytest.raises(ModelError, match=r"marker R_toe moves 79\d mm .* toe fixed in the ground \(at most 40 mm\)"):
        load_model("sagittal7", PERSON).calibrate(make(frames))


def test_a_needed_marker_absent_everywhere(standing_person: Recording) -> None:
    lacking = without(standing_person, "R_ankle", "L_ankle")
    with pytest.raises(ModelError) as error:
        load_model("sagittal7", PERSON, "opencap").calibrate(lacking)
    for word in ("segment 'shank'", "'ankle'", "marker ANK ", "r_ankle", "L_ankle", "R_toe"):
        assert word in error.value.message


def test_without_a_virtual_hip_marker_the_regression_is_used(standing_person: Recording) -> None:
    lacking = without(standing_person, "R_HJC_reg", "L_HJC_reg")
    plan = load_model("sagittal7", PERSON, "opencap").calibrate(lacking).measured_plan()
    depth, width = 0.20, 0.24
    to_asis = np.array([0.24 * depth + 0.0099, 0.30 * width + 0.0109])
    place = next(site.position for site in plan.sites if site.name == "r.ASIS")
    np.testing.assert_allclose(place[:2], to_asis, atol=1e-9)


def test_an_arm_without_markers_hangs_and_is_locked(standing_person: Recording) -> None:
    arms = [f"{side}_{name}" for side in "RL" for name in ("elbow_lat", "wrist_radius")]
    found = load_model("sagittal7", PERSON, "opencap").calibrate(without(standing_person, *arms))
    plan = found.measured_plan()
    assert plan.geometry.locked == {"shoulder": 0.0, "elbow": 0.0}
    assert "upper_arm" in plan.fixed_lengths
    assert plan.geometry.lengths["upper_arm"] == pytest.approx(1.75 * 0.1618, rel=1e-3)
    assert any("Segment upper_arm has no markers: locked to trunk" in message for message in map(str, found.messages))
    assert sum(body.mass for body in plan.inertia.values()) == pytest.approx(70.0)


def test_an_abdomen_without_markers_is_locked_to_the_thorax(standing_person: Recording) -> None:
    found = load_model("squat7", PERSON, "opencap").calibrate(standing_person)
    plan = found.measured_plan()
    assert list(plan.geometry.locked) == ["thoracic"]
    assert plan.geometry.locked["thoracic"] == pytest.approx(0.0, abs=1e-9)  # on one line by the proportion
    assert plan.fixed_lengths == {"abdomen"}
    assert any("Segment abdomen has no markers: locked to thorax" in message for message in map(str, found.messages))


def test_a_segment_without_markers_and_without_a_rule_is_refused(standing_person: Recording) -> None:
    trunk = [name for name in standing_person.marker_names if any(w in name for w in ("Sternum", "C7", "Shoulder"))]
    with pytest.raises(ModelError, match=r"segment 'trunk' has no marker \(tried R_Sternum.*it has R_toe"):
        load_model("sagittal7", PERSON, "opencap").calibrate(without(standing_person, *trunk))


def test_mass_is_needed_and_height_is_estimated(standing_person: Recording) -> None:
    with pytest.raises(ModelError, match=r"mass_kg is not given .*made has no force plates"):
        load_model("sagittal7").calibrate(standing_person)
    found = load_model("sagittal7", Subject(mass_kg=70.0)).calibrate(standing_person)
    places = stand()
    lowest = min(place[1] for place in places.values())
    assert found.height_m == pytest.approx((places["R_Shoulder"][1] - lowest) / 0.818, abs=1e-9)
    text = " ".join(map(str, found.messages))
    assert "Height" in text
    assert "not given, estimated from SHO " in text
    assert "Sex not given: regressions and table are the mean of both sexes" in text


def test_a_height_is_taken_from_one_frame_with_a_foot_on_the_ground() -> None:
    """From a box of 0.4 m through the air, the feet pointing down: the box is no part of the person."""
    places = stand()
    lowest = min(place[1] for place in places.values())
    frames = []
    for k in range(100):
        up = 0.4 if k < 40 else max(0.0, 0.4 - (k - 40) * 0.02)
        down = 0.1 if up > 0.0 and k >= 40 else 0.0  # in the air
        frames.append(
            {n: place + np.array([0.0, up - (down if place[1] < 0.2 else 0.0), 0.0]) for n, place in places.items()}
        )
    recording = make(frames)
    match = match_markers(load_marker_set("opencap"), recording.marker_names, [True] * len(places), "made")
    ground = find_ground_frame(recording, vertical="+Y", forward="+X")
    height, _ = find_height(Subject(), [recording], MarkedTrial.of(recording, match, ground))
    assert height == pytest.approx((places["R_Shoulder"][1] - lowest) / 0.818, abs=1e-9)


def test_a_mass_that_is_none_of_that_height_names_the_unit_that_would_explain_it() -> None:
    with pytest.raises(ModelError, match=r"14.0 kg by plates .*\(--mass\), or .* pounds of force they would be 62"):
        check_body_mass(Subject(height_m=1.70), 14.0, 1.70)
    with pytest.raises(ModelError, match=r"expected mass_kg of the subject \(--mass\)$"):
        check_body_mass(Subject(height_m=1.70), 2.5, 1.70)


def test_a_height_that_is_none_of_that_mass_is_refused(standing_person: Recording) -> None:
    crouched = replace(standing_person, markers=standing_person.markers * 0.5)
    with pytest.raises(ModelError, match=r"height_m is not given, and 0\.8\d m .*of 70\.0 kg .*10 to 60\).*--height"):
        load_model("sagittal7", Subject(mass_kg=70.0)).calibrate(crouched)


def test_one_frame_is_enough() -> None:
    plan = (
        load_model("sagittal7", PERSON, "opencap")
        .calibrate(make([stand()]), how=Calibration(forward="+X", vertical="+Y"))
        .measured_plan()
    )
    assert np.rad2deg(plan.start["ankle"]) == pytest.approx(5.0, abs=1e-6)


def test_priors_are_finite_and_bounds_hold_the_start(standing_person: Recording) -> None:
    plan = load_model("sagittal7", PERSON).calibrate(standing_person).measured_plan()
    sd = plan.prior(Priors())
    assert all(np.isfinite(value) and value > 0.0 for value in sd.values())
    assert sd["length/thigh"] == pytest.approx(0.05 * 0.40)
    assert sd["knee"] == pytest.approx(np.deg2rad(5.0))
    bounds = plan.bounds(Bounds())
    values = plan.table_values() | plan.start
    values |= {f"length/{name}": value for name, value in plan.geometry.lengths.items()}
    for name, value in values.items():
        assert bounds[name][0] <= value <= bounds[name][1], name
    assert bounds["length/thigh"] == pytest.approx((0.32, 0.48))
    mass = plan.inertia["thigh"].mass
    assert bounds["inertia/thigh/mass"] == pytest.approx((0.8 * mass, 1.2 * mass))
    low, high = bounds["inertia/thigh/mx"]
    assert high - low == pytest.approx(2 * 0.2 * mass * 0.40)  # of mass times length, not of the value
    low, high = bounds["marker/r_sh2/x"]
    assert (low, high) == pytest.approx((-0.06, 0.14))
    assert bounds["knee"] == pytest.approx((np.deg2rad(-15.0), np.deg2rad(165.0)))
    with pytest.raises(Exception, match="mass_fraktion"):
        Priors(mass_fraktion=0.1)  # type: ignore[call-arg]


SPATIAL = """
schema_version = 1
name = "leg3d"
[[lengths]]
name = "thigh"
between = ["knee", "hip"]
[[lengths]]
name = "shank"
between = ["knee", "ankle"]
[[coordinates]]
name = "tx"
[[coordinates]]
name = "ty"
[[coordinates]]
name = "tz"
[[coordinates]]
name = "flexion"
[[coordinates]]
name = "adduction"
[[coordinates]]
name = "rotation"
locked = true
[[coordinates]]
name = "knee"
minimum_deg = -10.0
maximum_deg = 160.0
[[segments]]
name = "thigh"
origin = "hip"
frame = { main = "y", y = ["knee", "hip"], z = ["left_hip", "right_hip"] }
parts = ["thigh"]
axes = [
  { coordinate = "tx", kind = "translation", direction = [1, 0, 0] },
  { coordinate = "ty", kind = "translation", direction = [0, 1, 0] },
  { coordinate = "tz", kind = "translation", direction = [0, 0, 1] },
  { coordinate = "flexion", direction = [0, 0, 1] },
  { coordinate = "adduction", direction = [1, 0, 0] },
  { coordinate = "rotation", direction = [0, 1, 0] },
]
[[segments]]
name = "shank"
parent = "thigh"
origin = "knee"
frame = { y = ["ankle", "knee"] }
parts = ["shank"]
placement = [{ length = "thigh", direction = [0, -1, 0] }]
axes = [{ coordinate = "knee", coefficients = [0, -1] }]
"""


def test_a_users_own_spatial_tree(tmp_path: Path, standing_person: Recording) -> None:
    """Given a free-floating leg in space with a locked axis, when measured, then its coordinates are the
    leg's."""
    (tmp_path / "leg.toml").write_text(SPATIAL, encoding="utf-8")
    source = Path(load_model("sagittal7").path).parents[1] / "markers" / "sets" / "opencap.toml"
    hips = "".join(f'\n{s}_hip = [{{ mean = ["HJC"], sides = "{s}" }}]' for s in ("left", "right"))
    text = source.read_text(encoding="utf-8") + f"\n[landmarks]{hips}\n"
    (tmp_path / "set.toml").write_text(text, encoding="utf-8")
    definition = load_model(tmp_path / "leg.toml", PERSON, tmp_path / "set.toml")
    for side, sign in (("right", 1.0), ("left", -1.0)):
        found = definition.calibrate(standing_person, how=Calibration(side=side))
        plan = found.measured_plan()
        letter = side[0].upper()
        hip, knee, ankle = (
            found.ground.points_to_ground(standing_person.marker(f"{letter}_{name}")[0])
            for name in ("HJC_reg", "knee", "ankle")
        )
        np.testing.assert_allclose([plan.start[name] for name in ("tx", "ty", "tz")], hip, atol=1e-6)
        assert plan.geometry.lengths["thigh"] == pytest.approx(np.linalg.norm(hip - knee), abs=1e-9)
        assert plan.geometry.lengths["shank"] == pytest.approx(np.linalg.norm(knee - ankle), abs=1e-9)
        lean = np.arcsin((hip - knee)[2] / np.linalg.norm(hip - knee))  # the thigh leans outwards, knee off the hip
        assert plan.start["adduction"] == pytest.approx(lean, abs=0.01)
        assert np.sign(plan.start["adduction"]) == -sign
        assert plan.start["rotation"] == 0.0
        assert np.rad2deg(plan.start["knee"]) == pytest.approx(8.0, abs=0.2)
    assert plan.estimated_axes() == (True, True, True)
    assert all(plan.estimated_inertia("shank"))
    assert any("of the body's 70.00 kg" in message for message in map(str, found.messages))
