"""fullbody on people who are marked in part: what is completed, what is held, and what is refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dynakin.errors import ModelError
from dynakin.model.calibration.completion import Proportions
from dynakin.model.definition import load_model
from dynakin.settings.subject import Subject
from support.joint_centres import marker_set, seen
from support.made_in_space import CENTRE, RATE, SIDES, WHO, definition, measured, standing, states
from support.made_recordings import unseen

UPPER = [*CENTRE, *(side + name for name in ("SHO", "UPA", "ELB", "WRA", "WRB", "FHD", "BHD") for side in "RL")]
LEFT_LEG = [f"L{name}" for name in ("THI", "KNE", "TIB", "ANK", "HEE", "TOE", "MT5")]
LEG = ("hip_flexion", "hip_adduction", "hip_rotation", "knee_angle", "ankle_angle", "subtalar_angle")


def test_proportions_are_those_of_a_person() -> None:
    places = Proportions.load().landmarks
    for name, place in places.items():
        other = name[:-2] + ("_l" if name.endswith("_r") else "_r")
        if name.endswith(("_r", "_l")):
            np.testing.assert_allclose(places[other], place * [1.0, 1.0, -1.0])
        else:
            assert place[2] == 0.0
        assert 0.0 <= place[1] <= 1.0
    for upper, lower, length in (
        ("hip_r", "knee_r", 0.235),
        ("knee_r", "ankle_r", 0.246),
        ("shoulder_r", "elbow_r", 0.160),
        ("elbow_r", "wrist_r", 0.157),
        ("cervical", "lumbar", 0.268),
    ):
        assert np.linalg.norm(places[upper] - places[lower]) == pytest.approx(length, abs=0.004), upper


def test_without_the_upper_body_the_legs_are_the_same_and_the_mass_is_all_there() -> None:
    full, found = measured(), definition().calibrate(unseen(standing(), *UPPER))
    assert found.plan is not None and full.plan is not None
    for name in LEG:
        for side in "rl":
            assert found.plan.start[f"{name}_{side}"] == pytest.approx(full.plan.start[f"{name}_{side}"], abs=2e-3)
    for name in ("thigh", "shank", "pelvis"):
        assert found.plan.geometry.lengths[name] == pytest.approx(full.plan.geometry.lengths[name], abs=1e-6)
    assert sum(body.mass for body in found.plan.inertia.values()) == pytest.approx(70.0)
    upper = {"torso", "head", *(f"{part}_{side}" for part in ("upper_arm", "forearm", "hand") for side in "rl")}
    assert found.unmarked_kg == pytest.approx(sum(found.plan.inertia[name].mass for name in upper))
    assert full.unseen_kg == 0.0 < found.unseen_kg < found.unmarked_kg
    held = {"lumbar_extension", "arm_flex_l", "elbow_flex_r", "neck_bending"}
    assert held <= set(found.held) and not {f"{name}_r" for name in LEG} & set(found.held)
    assert {"lumbar", "torso", "shoulder", "upper_arm", "forearm"} <= found.plan.fixed_lengths
    assert not {"hip_forward", "hip_up", "hip_outward", "thigh", "shank"} & found.plan.fixed_lengths
    said = next(text for text in map(str, found.messages) if text.startswith("From the proportions"))
    assert "1.75 m" in said and "cervical" in said and "knee_r" not in said


def test_the_trunk_stands_where_the_marked_one_does() -> None:
    full, found = measured(), definition().calibrate(unseen(standing(), *UPPER))
    assert found.plan is not None and full.plan is not None
    apart = found.plan.geometry.lengths["torso"] - full.plan.geometry.lengths["torso"]
    assert abs(apart) < 0.04
    assert found.plan.start["lumbar_bending"] == pytest.approx(0.0, abs=1e-6)
    leans = found.plan.start["lumbar_extension"] - full.plan.start["lumbar_extension"]
    assert abs(np.rad2deg(leans)) < 8.0


def test_a_leg_without_markers_takes_the_other_ones_lengths_and_hangs_as_it_does() -> None:
    full, found = measured(), definition().calibrate(unseen(standing(), *LEFT_LEG))
    assert found.plan is not None and full.plan is not None
    for name in ("thigh", "shank"):
        assert found.plan.geometry.lengths[name] == pytest.approx(full.plan.geometry.lengths[name], abs=2e-3)
        assert name not in found.plan.fixed_lengths  # the right leg shows it
    for name in LEG:
        assert f"{name}_l" in found.held and f"{name}_r" not in found.held
        apart = found.plan.start[f"{name}_l"] - full.plan.start[f"{name}_l"]
        assert abs(np.rad2deg(apart)) < 3.5, name  # measured: ankle 3.1, how differently the two feet stand
    assert found.unmarked_feet == {"left": "foot_l"}
    np.testing.assert_allclose(found.plan.inertia["thigh_l"].mass, found.plan.inertia["thigh_r"].mass)


@pytest.mark.parametrize("gone", [["RWRA", "RWRB"], ["RSHO", "LSHO"], ["LPSI", "RPSI"], ["RHEE"], ["RKNE"], ["LASI"]])
def test_a_few_markers_less_change_what_they_show_and_little_else(gone: list[str]) -> None:
    full, found = measured(), definition().calibrate(unseen(standing(), *gone))
    assert found.plan is not None and full.plan is not None
    for name in ("hip_flexion_l", "knee_angle_l", "ankle_angle_l", "pelvis_tilt"):
        apart = found.plan.start[name] - full.plan.start[name]
        assert abs(np.rad2deg(apart)) < (10.0 if "PSI" in gone[0] or "ASI" in gone[0] else 1.0), name
    for name, length in found.plan.geometry.lengths.items():
        leg = name in ("thigh", "shank")
        assert length == pytest.approx(full.plan.geometry.lengths[name], abs=0.03 if leg else 0.07), name


def test_a_person_without_height_or_mass_is_measured_by_the_markers() -> None:
    nobody = load_model("fullbody", Subject(), markers="plug-in-gait")
    found = nobody.calibrate(unseen(standing(), *UPPER))
    assert found.height_m == pytest.approx(1.75, abs=0.12)
    assert found.mass_kg == pytest.approx(23.0 * found.height_m**2)
    assert any(text.startswith("Warning: mass") and "mean adult" in text for text in map(str, found.messages))


def test_a_marker_that_is_seen_only_where_another_is_not() -> None:
    """Left out of the joint centres, with a sentence; the centre is then as if it had never been there."""
    base, k = standing(), standing().marker_names.index("RKNE")
    medial = np.concatenate([base.markers, base.markers[:, [k]] - [0.0, 0.0, 0.1]], axis=1)
    whole = replace(base, marker_names=(*base.marker_names, "RKNM"), markers=medial)
    found = definition().calibrate(unseen(unseen(whole, "RKNM", frames=slice(0, 90)), "LKNE", frames=slice(90, None)))
    plain, with_it = measured(), definition().calibrate(whole)
    assert found.plan is not None and plain.plan is not None and with_it.plan is not None
    lengths = [one.plan.geometry.lengths["thigh"] for one in (found, plain, with_it) if one.plan is not None]
    assert lengths[0] == pytest.approx(lengths[1], abs=1e-6) and abs(lengths[2] - lengths[1]) > 1e-4
    said = next(text for text in map(str, found.messages) if "no frame of standing shows all markers" in text)
    assert said.startswith("Warning: ") and "measured without RKNM, which is not seen" in said
    assert "RKNM" in found.recorded_markers
    assert not any("no frame of" in text for text in map(str, with_it.messages))

    knee = definition().calibrate(unseen(unseen(base, "RKNE", frames=slice(0, 60)), "LANK", frames=slice(60, None)))
    assert any("measured without RKNE, which is not seen" in text for text in map(str, knee.messages))
    assert any(text.startswith("From the proportions") and "knee_r" in text for text in map(str, knee.messages))
    assert "RKNE" in knee.recorded_markers

    apart = base
    for name in ("RASI", "LASI", "RPSI", "LPSI"):
        apart = unseen(apart, name, frames=slice(50, None))
    for name in (name for name in base.marker_names if name[1:] not in ("ASI", "PSI")):
        apart = unseen(apart, name, frames=slice(0, 50))
    with pytest.raises(ModelError, match=r"nothing on the pelvis.*expected a frame with pelvis and leg"):
        definition().calibrate(apart)


def test_a_static_recording_of_another_person_is_doubted() -> None:
    own = standing()
    for size, doubted in ((1.0, False), (0.9, True)):
        other = replace(own, name="other", markers=own.markers * size)
        said = [
            text for text in map(str, definition().calibrate(own, static=other).messages) if "another person" in text
        ]
        assert len(said) == doubted and all(text.startswith("Warning: distances between markers") for text in said)


def test_labels_that_are_exchanged_in_the_standing_trial_are_named() -> None:
    own = standing()
    names = [{"RKNE": "RTHI", "RTHI": "RKNE"}.get(name, name) for name in own.marker_names]
    said = [str(m) for m in definition().calibrate(own, static=replace(own, marker_names=tuple(names))).messages]
    assert any("standing trial standing: " in text and "look swapped" in text for text in said)


def test_names_of_the_standing_trial_that_nobody_knows_are_said_where_they_would_help() -> None:
    own = standing()
    ends = {"KNE": "Q1", "ANK": "Q2"}
    names = tuple(name[0] + ends[name[1:]] if name[1:] in ends else name for name in own.marker_names)
    trial, static = unseen(own, "RKNE", "LKNE", "RANK", "LANK"), replace(own, marker_names=names)
    (said,) = (str(m) for m in definition().calibrate(trial, static=static).messages if m.topic == "joints")
    assert "does not know" in said and all(name in said for name in ("RQ1", "LQ1", "RQ2", "LQ2"))
    assert "dynakin markers new standing" in said and "Give a standing trial" not in said


def test_a_pelvis_that_two_markers_show_is_said_to_turn_unseen() -> None:
    for gone, seen_by in ((("LPSI", "RPSI"), "RASI and LASI"), (("LPSI",), "")):
        said = [m.text for m in definition().calibrate(unseen(standing(), *gone)).messages if m.topic == "angles"]
        assert len(said) == bool(seen_by) and all(f"seen by {seen_by} alone" in text for text in said)


def test_a_pelvis_whose_spines_only_the_standing_trial_has_is_known() -> None:
    """In motion the crests and a plate on the sacrum show it."""
    whole = standing()
    more = {"RILC": (0.0, 1.07, 0.13), "LILC": (0.0, 1.07, -0.13)}
    more |= {"SAC1": (-0.12, 1.03, 0.02), "SAC2": (-0.12, 1.03, -0.02), "SAC3": (-0.12, 0.98, 0.0)}
    markers = np.concatenate(
        [whole.markers, np.repeat(np.array([list(more.values())]), len(whole.time), axis=0)], axis=1
    )
    static = replace(whole, marker_names=(*whole.marker_names, *more), markers=markers)
    found = load_model("fullbody", WHO).calibrate(unseen(static, "LASI", "RASI", "LPSI", "RPSI"), static=static)
    assert {"SAC1", "SAC2", "SAC3"} <= set(found.recorded_markers) and found.plan is not None
    assert found.plan.start["pelvis_tilt"] == pytest.approx(measured().plan.start["pelvis_tilt"], abs=0.01)  # type: ignore[union-attr]


def test_a_marker_of_a_foot_that_only_the_standing_trial_has_is_named() -> None:
    own = standing()
    heel = next(name for name in own.marker_names if name.startswith("R") and "HEE" in name)
    said = [str(message) for message in definition().calibrate(unseen(own, heel), static=own).messages]
    assert sum(f"{heel} of the right foot is in " in text for text in said) == 1
    assert not any(" foot is in " in str(message) for message in definition().calibrate(own, static=own).messages)


def test_too_little_of_the_pelvis_is_refused_in_words() -> None:
    pelvis = ["LASI", "RASI", "LPSI", "RPSI"]
    with pytest.raises(ModelError, match=r"segment 'pelvis' .* has 0 of the landmarks .*hip_r.*expected 2 or more"):
        definition().calibrate(unseen(standing(), *pelvis))


@pytest.mark.parametrize("turn_rad", [0.0, 1.0])
def test_joint_centres_alone_hold_what_they_do_not_show(tmp_path: Path, turn_rad: float) -> None:
    initial, time = measured(), np.arange(100) / RATE
    wave = np.sin(2.0 * np.pi * time)
    motion = {f"hip_flexion_{side}": sign * 0.4 * wave for side, sign in (("r", 1.0), ("l", -1.0))}
    motion |= {f"knee_angle_{side}": 0.4 + 0.3 * wave for side in "rl"}
    motion |= {f"elbow_flex_{side}": np.full_like(wave, 0.4) for side in "rl"}
    x = states(initial, motion, turn_rad, np.array([0.3, 0.0, 0.4]), time)
    recording = seen(initial, x, time, foot=True)
    model = load_model("fullbody", WHO, markers=marker_set(tmp_path, foot=True))
    found = model.calibrate(recording)
    shown = {"neck_extension", "neck_bending", "neck_rotation"}  # no markers on the head
    assert set(found.held) - shown == {"pro_sup_r", "pro_sup_l", "lumbar_extension"}
    assert any(text.startswith("Held where they stand") and "pro_sup_r" in text for text in map(str, found.messages))
    assert found.plan is not None and initial.plan is not None
    for name in ("thigh", "shank", "upper_arm", "forearm"):
        assert found.plan.geometry.lengths[name] == pytest.approx(initial.plan.geometry.lengths[name], abs=2e-3)


def test_nothing_of_whole_marker_sets_is_held_or_completed() -> None:
    found = measured()
    assert not found.held and not any("proportions" in text for text in map(str, found.messages))
    assert len(SIDES) * 2 + len(CENTRE) == len(found.recorded_markers)
