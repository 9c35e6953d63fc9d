"""Joint centres that the movement may correct: lengths of zero with a standard deviation of their own."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError
from scipy.spatial.transform import Rotation

from dynakin.bindings import _core
from dynakin.filter.estimator import Estimator
from dynakin.filter.parameters import parameters_of
from dynakin.model.calibration.checks import fixed_lengths
from dynakin.model.plan import SUPPOSED_AXIS
from dynakin.model.schema import Length, ModelFile, Segment, kinds_of
from dynakin.report.findings.finding import Insight
from dynakin.report.insights import insights
from dynakin.results.estimate import Estimate
from dynakin.results.measures.metrics import compute_metrics
from dynakin.results.naming import shown_unit
from support.made_in_space import RATE, definition, measured, recording_of, standing, states

HIPS = ("hip_forward", "hip_up", "hip_outward")


def test_a_correction_of_zero_says_how_far_it_may_go() -> None:
    assert Length(name="out", value_m=0.0, sd_m=0.01).sd_m == 0.01
    with pytest.raises(ValidationError, match="expected sd_m"):
        Length(name="out", value_m=0.0)


def test_a_coordinate_that_turns_anything_is_a_rotation_whatever_comes_last() -> None:
    rolls = [
        {"coordinate": "knee", "kind": "translation", "direction": [1.0, 0.0, 0.0]},
        {"coordinate": "knee"},
        {"coordinate": "slide", "kind": "translation"},
    ]
    for axes in (rolls, rolls[::-1]):
        assert kinds_of([Segment(name="shank", axes=axes)]) == {"knee": "rotation", "slide": "translation"}


def test_limits_hold_the_value_that_a_length_starts_with() -> None:
    assert Length(name="roll", value_m=0.0, sd_m=0.01, minimum_m=-0.005).limits == (-0.005, np.inf)
    for value_m in (0.0, 0.04):
        with pytest.raises(ValidationError, match=rf"value_m is {value_m:g}, expected from minimum_m \(0.01\)"):
            Length(name="roll", value_m=value_m, sd_m=0.01, minimum_m=0.01, maximum_m=0.03)
    with pytest.raises(ValidationError, match="expected with value_m"):
        Length(name="thigh", between=("hip", "knee"), maximum_m=0.5)


def test_one_term_of_a_place_is_measured_at_most() -> None:
    terms: list[dict[str, Any]] = [{"length": "a", "direction": [1.0, 0.0, 0.0], "measured": True}]
    Segment(name="thigh", placement=[*terms, {"length": "b", "direction": [0.0, 1.0, 0.0]}])
    with pytest.raises(ValidationError, match="one length only"):
        Segment(name="thigh", placement=[*terms, *terms])


def test_the_hip_starts_where_the_markers_have_it_and_may_move_on_both_sides_alike() -> None:
    initial = measured()
    names = list(initial.names)
    for name in HIPS:
        k = names.index(f"length/{name}")
        assert initial.x0[k] == 0.0 and initial.sd0[k] == pytest.approx(0.010)
        assert (initial.lower[k], initial.upper[k]) == pytest.approx((-0.04, 0.04))
    assert "length/pelvis" not in names  # along its direction the three say the same
    core = _core.Model(initial.spec)
    x = core.initial_state()
    segments = list(core.segment_names)
    right, left = (segments.index(f"thigh_{side}") for side in "rl")
    R, before = _core.segment_poses(core, x)
    for name, axis, signs in (("hip_forward", 0, (1, 1)), ("hip_up", 1, (1, 1)), ("hip_outward", 2, (1, -1))):
        moved = x.copy()
        moved[names.index(f"length/{name}")] = 0.01
        change = (_core.segment_poses(core, moved)[1] - before) @ R[segments.index("pelvis")]
        for segment, sign in zip((right, left), signs, strict=True):
            expected = np.zeros(3)
            expected[axis] = 0.01 * sign
            np.testing.assert_allclose(change[segment], expected, atol=1e-12)


@pytest.mark.parametrize(("name", "value_m"), [("hip_up", 0.02), ("shank", 0.0)])
def test_corrections_start_at_zero_and_lengths_do_not(name: str, value_m: float) -> None:
    lengths = [length.model_dump() for length in definition().model.lengths]
    for length in lengths:
        if length["name"] == name:
            length |= {"between": None, "shared": False, "value_m": value_m, "sd_m": 0.01}
    with pytest.raises(ValidationError, match=f"{name}.*expected value_m = 0"):
        ModelFile.model_validate(definition().model.model_dump() | {"lengths": lengths})


def test_the_movement_finds_hips_that_the_pelvis_markers_misplace() -> None:
    initial = measured()
    time = np.arange(300) / RATE
    sway, swing = np.sin(2.0 * np.pi * time), np.sin(np.pi * time)
    motion = {"pelvis_list": 0.15 * sway, "hip_flexion_r": 0.7 * swing**2, "hip_flexion_l": 0.5 * sway**2}
    motion |= {f"hip_adduction_{side}": 0.2 * swing * sign for side, sign in (("r", 1.0), ("l", -1.0))}
    x = states(initial, motion, 0.0, np.zeros(3), time)
    hips = [list(initial.names).index(f"length/{name}") for name in HIPS]
    true = np.array([-0.012, 0.008, -0.012])
    x[:, hips] = true
    trial = recording_of(initial, x, time, plates=False, noise_m=0.0005)
    found = Estimator(definition(), vertical="+Y", estimate=["lengths"]).run(trial, static=standing())
    values = {parameter.name: parameter.value for parameter in found.parameters}
    np.testing.assert_allclose([values[f"length/{name}"] for name in HIPS], true, atol=0.004)


def test_the_ankle_turns_about_an_axis_whose_outer_end_is_lower() -> None:
    """10 deg, on both sides alike (Inman 1976)."""
    initial = measured()
    core = _core.Model(initial.spec)
    x, segments = core.initial_state(), list(core.segment_names)
    before = _core.segment_poses(core, x)[0]
    for side, out in (("r", 1.0), ("l", -1.0)):
        moved = x.copy()
        moved[list(core.layout.names).index(f"ankle_angle_{side}")] += 0.1
        foot, shank = segments.index(f"foot_{side}"), segments.index(f"shank_{side}")
        turn = Rotation.from_matrix(_core.segment_poses(core, moved)[0][foot] @ before[foot].T).as_rotvec() / 0.1
        axis = before[shank].T @ turn * out  # towards the outer side
        assert np.rad2deg(np.arcsin(axis[1])) == pytest.approx(-10.0, abs=1e-6)


def test_the_femur_rolls_back_on_the_tibia_on_both_sides_alike() -> None:
    initial = measured()
    names, core = list(initial.names), _core.Model(initial.spec)
    k = names.index("length/knee_roll")
    assert initial.x0[k] == 0.0 and initial.sd0[k] == pytest.approx(0.010)
    assert (initial.lower[k], initial.upper[k]) == pytest.approx((-0.005, 0.030))
    for bent in np.radians([-10.0, 30.0, 90.0, 140.0]):
        x = core.initial_state()
        x[[names.index(f"knee_angle_{side}") for side in "rl"]] = bent
        rolled = x.copy()
        rolled[k] = 0.02
        R, before = _core.segment_poses(core, x)
        change = _core.segment_poses(core, rolled)[1] - before
        for side in "rl":
            shank = list(core.segment_names).index(f"shank_{side}")
            np.testing.assert_allclose(change[shank], 0.02 * bent * R[shank, :, 0], atol=2e-4)


def squat_with(**amounts: float) -> Estimate:
    """Both knees bent to 92 deg, with these amounts true of them."""
    initial = measured()
    time = np.arange(300) / RATE
    bent = 1.6 * np.sin(np.pi * time / 3.0) ** 2
    motion = {
        f"{joint}_{side}": bent * share for side in "rl" for joint, share in (("knee_angle", 1.0), ("hip_flexion", 0.8))
    }
    x = states(initial, motion, 0.0, np.zeros(3), time)
    for name, amount in amounts.items():
        x[:, list(initial.names).index(f"length/{name}")] = amount
    trial = recording_of(initial, x, time, plates=False, noise_m=0.0005)
    return Estimator(definition(), vertical="+Y", estimate=["lengths"]).run(trial, static=standing())


def test_the_movement_finds_how_far_the_knee_rolls() -> None:
    found = squat_with(knee_roll=0.012)
    (roll,) = (parameter for parameter in found.parameters if parameter.name == "length/knee_roll")
    assert roll.value == pytest.approx(0.012, abs=0.003) and not roll.at_bound
    assert "knee roll" not in finding_on_bounds(found).text


def test_the_outer_end_of_a_knees_axis_may_lie_farther_forward_on_each_side_for_itself() -> None:
    initial = measured()
    names, core = list(initial.names), _core.Model(initial.spec)
    for side, out in (("r", 1.0), ("l", -1.0)):
        k, knee = names.index(f"length/knee_axis_{side}"), names.index(f"knee_angle_{side}")
        assert initial.x0[k] == 0.0 and initial.sd0[k] == pytest.approx(SUPPOSED_AXIS * 0.05)  # one marker on each knee
        shank, thigh = (list(core.segment_names).index(f"{part}_{side}") for part in ("shank", "thigh"))
        straight = core.initial_state()
        straight[knee] = 0.0
        turned = straight.copy()
        turned[k] = 0.1
        R, before = (_core.segment_poses(core, x)[0] for x in (turned, straight))
        np.testing.assert_allclose(R, before, atol=1e-12)  # an axis, no turn of the shank
        turned[knee] = 1e-6
        bend = Rotation.from_matrix(_core.segment_poses(core, turned)[0][shank] @ R[shank].T).as_rotvec() / -1e-6
        np.testing.assert_allclose(R[thigh].T @ bend, [np.sin(0.1) * out, 0.0, np.cos(0.1)], atol=1e-6)


def test_the_movement_finds_how_the_knees_axes_are_turned() -> None:
    found = squat_with(knee_axis_r=0.06, knee_axis_l=-0.04)
    values = {parameter.name: parameter.value for parameter in found.parameters}
    assert values["length/knee_axis_r"] == pytest.approx(0.06, abs=0.01)
    assert values["length/knee_axis_l"] == pytest.approx(-0.04, abs=0.01)


@pytest.mark.parametrize(("roll_m", "bound_m"), [(-0.020, -0.005), (0.045, 0.030)])
def test_a_knee_that_rolls_as_none_does_stops_at_the_bound_and_is_told(roll_m: float, bound_m: float) -> None:
    found = squat_with(knee_roll=roll_m)
    (roll,) = (parameter for parameter in found.parameters if parameter.name == "length/knee_roll")
    assert roll.at_bound and roll.value == pytest.approx(bound_m, abs=0.0005)
    finding = finding_on_bounds(found)
    assert finding.level == "warning" and re.search(r"lengths\): .*\bknee roll\b", finding.text)
    assert "knee roll length" not in finding.text and "mass" not in finding.advice


def test_an_amount_that_the_last_frame_moved_off_its_bound_a_little_is_on_it() -> None:
    initial = measured()
    k, thigh = (list(initial.names).index(f"length/{name}") for name in ("knee_roll", "thigh"))
    state, sd = initial.x0.copy(), initial.sd0
    for off, expected in ((0.05, True), (0.2, False)):
        for at in (k, thigh):
            state[at] = initial.lower[at] + off * sd[at]
        found = {p.name: p.at_bound for p in parameters_of(initial, state, sd, sd)}
        assert found["length/knee_roll"] == expected and not found["length/thigh"]


def test_amounts_have_units_of_their_own() -> None:
    initial = measured()
    units = {p.name: p.unit for p in parameters_of(initial, initial.x0, initial.sd0, initial.sd0)}
    names = ("length/knee_roll", "length/knee_axis_r", "length/thigh")
    assert tuple(units[name] for name in names) == ("m/rad", "rad", "m")
    assert shown_unit("m/rad") == (1000.0, "mm/rad") and shown_unit("m") == (1000.0, "mm")
    assert shown_unit("rad") == (pytest.approx(57.29578), "deg")
    assert shown_unit("kg m2") == (1.0, "kg m²")


def finding_on_bounds(found: Estimate) -> Insight:
    return next(each for each in insights(found, compute_metrics(found)) if each.title == "Bounds")


def test_a_knee_that_no_marker_shows_does_not_roll() -> None:
    model = definition().model
    assert "knee_roll" not in fixed_lengths(model, set(), set())
    assert "knee_roll" not in fixed_lengths(model, {"shank_r", "foot_r"}, set())  # the other knee shows it
    assert "knee_roll" in fixed_lengths(model, {"shank_r", "foot_r", "shank_l", "foot_l"}, set())


def test_the_axis_of_a_knee_that_no_marker_shows_stays_where_it_is() -> None:
    fixed = fixed_lengths(definition().model, {"shank_r", "foot_r"}, set())
    assert "knee_axis_r" in fixed and "knee_axis_l" not in fixed
