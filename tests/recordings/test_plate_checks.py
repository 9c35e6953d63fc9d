"""Plate checks and the containers themselves."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dynakin.errors import ModelError, RecordingError
from dynakin.model.calibration.body import find_mass
from dynakin.recordings.checks import PlateCheck, check_plates
from dynakin.recordings.feet.assignment import foot_loads
from dynakin.recordings.frame import find_ground_frame
from dynakin.recordings.hull import distance_to_hull
from dynakin.recordings.plates.axes import turned_feet
from dynakin.recordings.recording import Recording
from dynakin.settings.subject import Subject
from dynakin.units import GRAVITY_M_S2
from support.made_recordings import standing, unseen

FEET = {"left": ["LHEE", "LTOE"], "right": ["RHEE", "RTOE"]}


def check(recording: Recording, mass_kg: float | None = None) -> PlateCheck:
    return check_plates(recording, find_ground_frame(recording, vertical="+Y"), mass_kg, FEET)


def warnings(found: PlateCheck) -> list[str]:
    return [text for text in map(str, found.messages) if text.startswith("Warning:")]


def test_a_good_recording_is_not_doubted_and_gives_the_mass() -> None:
    found = check(standing(70.0), 70.0)
    assert found.refusal is None and not warnings(found)
    assert found.mass_kg_from_plates == pytest.approx(70.0)
    said = " ".join(map(str, found.messages))
    assert "686.5 N" in said
    assert "plate 1: centre of pressure under the left foot" in said
    assert "plate 2: centre of pressure under the right foot" in said
    assert "free moment 2.00 N m" in said


def test_another_mass_is_a_warning_with_numbers() -> None:
    found = check(standing(70.0), 78.6)
    assert found.refusal is None
    (said,) = warnings(found)
    assert said.startswith("Warning: the plates read 70.00 kg, the declared mass is 78.6 kg (-10.9 %)")


@pytest.mark.parametrize(
    ("recording", "mass", "words"),
    [
        (
            standing(70.0, sign=-1.0),
            None,
            ["vertical force is -686.5 N", "expected a positive one", "turn the signs of"],
        ),
        (
            standing(70.0, cop_shift_m=0.9),
            None,
            ["plate 1: centre of pressure 800 mm away", "expected it under"],
        ),
        (standing(0.0), 70.0, ["vertical force is 0.0 N"]),
        (standing(700.0), None, ["700 kg"]),
        (standing(700.0), 70.0, ["700.00 kg", "declared mass is 70 kg"]),
        (replace(standing(), plates=()), None, ["no force plates"]),
    ],
)
def test_refusals_give_the_number(recording: Recording, mass: float | None, words: list[str]) -> None:
    found = check(recording, mass)
    assert found.refusal is not None
    for word in words:
        assert word in found.refusal


@pytest.mark.parametrize(
    ("factor", "words"),
    [
        (-1.0, "turn the signs of all forces"),
        (1.0 / 70.0, "N per kg of body mass"),
        (1.0 / (70.0 * GRAVITY_M_S2), "body weights"),
        (0.001, "kN"),
    ],
)
def test_where_the_mass_is_missing_forces_of_another_sign_or_unit_are_what_is_to_be_corrected(
    factor: float, words: str
) -> None:
    made = standing(70.0)
    plates = tuple(replace(p, force=factor * p.force, moment=factor * p.moment) for p in made.plates)
    trial = made.with_plates(plates)
    with pytest.raises(ModelError, match=words) as refused:
        find_mass(Subject(), [(trial, find_ground_frame(made, vertical="+Y"))], FEET, [], None)
    assert "correct the forces first" in refused.value.message


@pytest.mark.parametrize(("shift_m", "warned"), [(1.5, False), (0.0, True), (None, True)])
def test_plates_that_nobody_loads_are_left_out_with_a_warning_unless_they_lie_elsewhere(
    shift_m: float | None, warned: bool
) -> None:
    made = standing(1.0)
    x, z = 0.3, 0.25
    corners = np.array([[x, 0.0, z], [-x, 0.0, z], [-x, 0.0, -z], [x, 0.0, -z]])
    heels = {"plate 1": made.marker("LHEE")[0], "plate 2": made.marker("RHEE")[0]}
    if shift_m is not None:  # else the file does not say where they lie
        places = {name: corners + heel * [1.0, 0.0, 1.0] + [shift_m, 0.0, 0.0] for name, heel in heels.items()}
        made = made.with_plates(tuple(replace(plate, corners=places[plate.name]) for plate in made.plates))
    found = check(made)
    assert found.refusal is None and found.mass_kg_from_plates is None
    assert bool(warnings(found)) == warned
    assert str(found.messages[-1]).startswith(
        "Warning: the plates carry nobody" if warned else "Nobody steps on the plates"
    )


def test_a_threshold_that_empties_the_plates_is_named() -> None:
    found = check(replace(standing(1.0), read_with={"force_threshold_n": 5000.0}))
    (said,) = warnings(found)
    assert "--force-threshold-n) takes all below 5000 N for nothing" in str(said)


@pytest.mark.parametrize(("shift_m", "weighs"), [(0.0, True), (-0.25, False)])
def test_who_stands_over_a_plates_edge_is_not_weighed(shift_m: float, weighs: bool) -> None:
    made = standing(70.0)
    x, z = 0.3, 0.15
    corners = np.array([[x, 0.0, z], [-x, 0.0, z], [-x, 0.0, -z], [x, 0.0, -z]])
    places = {
        "plate 1": (made.marker("LHEE"), made.marker("LTOE")),
        "plate 2": (made.marker("RHEE"), made.marker("RTOE")),
    }
    plates = tuple(
        replace(
            plate,
            corners=corners
            + 0.5 * (places[plate.name][0][0] + places[plate.name][1][0]) * [1.0, 0.0, 1.0]
            + [shift_m * (plate.name == "plate 1"), 0.0, 0.0],
        )
        for plate in made.plates
    )
    found = check(made.with_plates(plates))
    assert found.refusal is None
    assert found.mass_kg_from_plates == (pytest.approx(70.0) if weighs else None)
    said = [text for text in map(str, found.messages) if "over the edge of plate 1" in text]
    assert bool(said) != weighs


@pytest.mark.parametrize(("rows", "axis"), [([0, 2, 1], r"\+Z"), ([1, 0, 2], r"\+X")])
def test_forces_in_other_axes_than_the_markers_are_named(rows: list[int], axis: str) -> None:
    """They passed for plates that nobody loads, whose channels were to be looked at."""
    made = standing(70.0)
    plates = tuple(replace(plate, force=plate.force[:, rows]) for plate in made.plates)
    found = check(made.with_plates(plates))
    assert found.refusal is not None
    assert re.search(rf"the forces lie along {axis} \(6[0-9]+ N .*, vertical is \+Y: give the forces in", found.refusal)
    assert re.search(rf"of a person who lies, give the vertical \(--vertical {axis}\)", found.refusal)


def test_a_heel_on_a_plate_of_who_is_taken_for_upright_names_the_vertical() -> None:
    """Of who lies, with the feet on a plate, the body's own axis was up: "the plates carry nobody"."""
    made = standing(70.0)
    light = [replace(plate, force=np.tile([60.0, 2.0, 0.0], (made.n_frames, 1))) for plate in made.plates]
    said = " ".join(map(str, check(made.with_plates(tuple(light))).messages))
    assert "carry nobody" in said and "pushed along +X (120 N on average)" in said and "--vertical +X" in said


def test_a_declared_contacts_plate_may_be_pushed_across_the_vertical() -> None:
    """A lone wall plate at a rail; of a foot's plate it is other axes."""
    made = standing(70.0)
    wall = replace(made.plates[0], force=np.tile([400.0, 0.0, 0.0], (made.n_frames, 1)), corners=None)
    recording = made.with_plates((wall,))
    ground = find_ground_frame(recording, vertical="+Y")
    loads = foot_loads(recording, ground, FEET, assigned={wall.name: "rail"}, others=["rail"])
    assert "the forces lie along +X (400 N" in (check(recording).refusal or "")
    assert check_plates(recording, ground, None, FEET, loads).refusal is None


def test_pressure_somewhat_off_the_foot_is_a_warning() -> None:
    found = check(standing(70.0, cop_shift_m=0.3))
    assert found.refusal is None
    assert any(text.startswith("Warning: plate 1: centre of pressure 200 mm away") for text in map(str, found.messages))


def raised(recording: Recording, by_m: float) -> Recording:
    """Its plates thought so much higher than they are."""
    up = np.array([0.0, by_m, 0.0])
    plates = [replace(p, cop=p.cop + up, moment=p.moment + np.cross(up, p.force)) for p in recording.plates]
    return recording.with_plates(tuple(plates))


@pytest.mark.parametrize(
    ("by_m", "said", "refused"),
    [
        (0.03, "", False),
        (0.06, "20 mm above", False),
        (0.15, "110 mm above", False),
        (0.40, "360 mm above", True),
        (-0.07, "", False),
        (-0.15, "190 mm below", False),
        (-0.50, "540 mm below", True),
    ],
)
def test_a_plate_at_another_height_than_the_soles_is_told(by_m: float, said: str, refused: bool) -> None:
    found = check(raised(standing(70.0), by_m))
    texts = (found.refusal or "").split("; ") if refused else warnings(found)
    about = [text for text in texts if "its surface lies" in text]
    assert len(about) == (2 if said else 0) and (found.refusal is not None) == refused
    for text, plate, foot in zip(about, ("plate 1", "plate 2"), ("left", "right"), strict=False):
        assert f"{plate}: its surface lies {said} the lowest marker of the {foot} foot" in text
        assert "Correct its height in the file" in text and ("unless a box" in text) == (0.0 > by_m > -0.3)


def test_a_foot_without_a_low_marker_accuses_no_plate() -> None:
    """One that shows its ankle alone, with 0.11 m of shoe and ankle under the marker."""
    made = standing(70.0)
    markers = made.markers.copy()
    for name in ("LHEE", "RHEE"):
        markers[:, made.marker_names.index(name)] += [0.06, 0.07, 0.0]
    feet = {"left": ["LHEE"], "right": ["RHEE"]}
    recording = replace(made, markers=markers)
    found = check_plates(recording, find_ground_frame(recording, vertical="+Y"), 70.0, feet)
    assert found.refusal is None and not any("surface" in text for text in map(str, found.messages))


def test_both_plates_under_one_foot_and_big_free_moments_are_told() -> None:
    good = standing(70.0)
    doubled = replace(good, plates=(good.plates[0], replace(good.plates[0], name="plate 2")))
    assert any(
        "both have their centre of pressure under the left foot" in text for text in map(str, check(doubled).messages)
    )
    twisted = replace(good.plates[0], free_moment=good.plates[0].free_moment + np.array([8.0, 30.0, 0.0]))
    said = " ".join(map(str, check(replace(good, plates=(twisted, good.plates[1]))).messages))
    assert "free moment 32.0 N m is large" in said
    assert "8.0 N m about horizontal axes" in said


def test_an_idle_plate_and_missing_foot_markers_are_told() -> None:
    good = standing(70.0)
    idle = replace(good.plates[0], name="plate 3", force=np.zeros((101, 3)), moment=np.zeros((101, 3)))
    found = check(replace(good, plates=(*good.plates, idle)))
    assert found.refusal is None and not warnings(found)
    assert any("plate 3 carries nothing" in text for text in map(str, found.messages))
    frame = find_ground_frame(good)
    other = check_plates(good, frame, foot_markers={"left": ["NONE"]})
    assert any("no foot markers" in text for text in map(str, other.messages))


@pytest.mark.parametrize(("factor", "turned"), [(1.0, False), (-0.25, False), (-1.0, True)])
def test_exchanged_plates_push_the_feet_apart(factor: float, turned: bool) -> None:
    """20 N inwards on each foot are what legs do; exchanged plates show them outwards. 5 N may be anything."""
    recording = standing(70.0)
    plates = tuple(replace(plate, force=plate.force * [1.0, 1.0, factor]) for plate in recording.plates)
    found = turned_feet(plates, find_ground_frame(recording, vertical="+Y"), recording.rate)
    said = "the horizontal force of plate 1 and plate 2 pushes the feet apart or across: it lies 171 to 171 deg"
    assert (found is not None and found.startswith(said) and "or if the two were exchanged" in found) == turned
    assert (found is not None) == turned


@pytest.mark.parametrize("hidden", [slice(0, 60), slice(0, 30)])
def test_a_plate_is_not_held_against_the_other_foot_while_its_own_is_not_seen(hidden: slice) -> None:
    """Loaded in the first 60 frames, in all or half of which nobody sees the foot on it."""
    recording = standing(70.0)
    left, right = recording.plates
    pressed = (np.arange(recording.n_frames) < 60)[:, None]
    right = replace(right, force=right.force * pressed, moment=right.moment * pressed)
    found = check(unseen(recording, "RHEE", "RTOE", "RMT5", frames=hidden).with_plates((left, right)), 70.0)
    assert found.refusal is None
    said = " ".join(map(str, found.messages))
    assert ("plate 2 bears load only while a foot is not seen" in said) == (hidden.stop == 60)
    assert ("plate 2: centre of pressure under the right foot, 15 mm outside" in said) == (hidden.stop == 30)


def test_without_standing_the_mass_is_only_told() -> None:
    good = standing(70.0)
    hop = good.markers + np.array([0, 0.1, 0]) * np.sin(2 * np.pi * 2 * good.time)[:, None, None]
    found = check(replace(good, markers=hop), 70.0)
    assert found.mass_kg_from_plates is None
    assert any("does not stand still" in text for text in map(str, found.messages))
    assert found.refusal is None


SQUARE = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])


@settings(max_examples=60, deadline=None)
@given(x=st.floats(-2, 3), y=st.floats(-2, 3), order=st.permutations(range(4)))
def test_distance_to_a_square(x: float, y: float, order: list[int]) -> None:
    expected = np.hypot(max(-x, 0, x - 1), max(-y, 0, y - 1))
    found = distance_to_hull(np.array([[x, y]]), SQUARE[order][None])
    assert found[0] == pytest.approx(expected, abs=1e-9)


def test_distance_with_missing_corners() -> None:
    corners = SQUARE[None].repeat(3, axis=0).copy()
    corners[1, 2] = np.nan
    corners[2] = np.nan
    found = distance_to_hull(np.array([[0.9, 0.9]] * 3), corners)
    assert found[0] == 0
    assert found[1] == pytest.approx(0.8 / np.sqrt(2))
    assert np.isnan(found[2])


def test_recording_window_marker_and_shapes() -> None:
    recording = standing()
    part = recording.window(0.2, 0.5)
    assert part.n_frames == 31
    assert part.time[0] == pytest.approx(0.2)
    assert part.plates[0].force.shape == (31, 3)
    assert recording.rate == pytest.approx(100.0)
    with pytest.raises(RecordingError, match="no frame between 5 s and 6 s; it runs from 0 s to 1 s"):
        recording.window(5, 6)
    with pytest.raises(RecordingError, match="no marker 'XYZ'; it has LHEE, LTOE"):
        recording.marker("XYZ")
    with pytest.raises(RecordingError, match=r"markers have shape \(2, 1, 3\), expected \(3, 1, 3\)"):
        Recording("a", None, np.arange(3.0), ("A",), np.zeros((2, 1, 3)))
    with pytest.raises(RecordingError, match="plate 1 has arrays of shapes"):
        recording.with_plates((part.plates[0],))


def test_plates_that_are_never_measured_together_are_said_so() -> None:
    made = standing(70.0)
    first = made.plates[0]
    made = made.with_plates((replace(first, force=np.full_like(first.force, np.nan)), *made.plates[1:]))
    found = check(made)
    assert found.unused and any("measured together in no frame" in str(said) for said in warnings(found))
