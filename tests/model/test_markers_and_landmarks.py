"""Names are found whatever their spelling; landmarks follow their published recipes."""

from __future__ import annotations

import numpy as np
import pytest

from dynakin.errors import ModelError
from dynakin.model.calibration.landmarks import LandmarkFinder
from dynakin.model.markers.fit import choose_marker_set
from dynakin.model.markers.marker_set import load_marker_set
from dynakin.model.markers.match import MarkerMatch, match_markers

PELVIS = {
    ("ASI", "right"): np.array([0.0, 1.0, 0.12]),
    ("ASI", "left"): np.array([0.0, 1.0, -0.12]),
    ("PSI", "right"): np.array([-0.16, 1.0, 0.05]),
    ("PSI", "left"): np.array([-0.16, 1.0, -0.05]),
}
NAMES = ("RASI", "LASI", "RPSI", "LPSI", "RTOE", "RKNE", "C7", "CLAV")


def matched(names: tuple[str, ...] = NAMES, marker_set: str = "plug-in-gait") -> MarkerMatch:
    return match_markers(load_marker_set(marker_set), names, [True] * len(names), "trial")


@pytest.mark.parametrize("spelling", ["RKNE", "S1:RKNE", "rkne", "R.KNE", "R_kne", "R KNE"])
def test_prefix_case_dots_and_underscores_do_not_count(spelling: str) -> None:
    assert matched((spelling, "LTOE")).names["KNE", "right"] == spelling


def test_two_subjects_in_one_file_are_refused() -> None:
    with pytest.raises(ModelError, match="S1:RKNE and S2:RKNE both fit"):
        matched(("S1:RKNE", "S2:RKNE"))


def test_a_marker_that_is_blank_everywhere_is_absent() -> None:
    match = match_markers(load_marker_set("plug-in-gait"), ("RKNE", "LKNE"), [True, False], "trial")
    assert set(match.names) == {("KNE", "right")}


def test_the_set_is_chosen_by_the_names() -> None:
    pig = [f"{side}{name}" for side in "RL" for name in ("TOE", "HEE", "ANK", "TIB", "KNE", "THI", "ASI", "PSI", "SHO")]
    assert choose_marker_set(pig).name == "plug-in-gait"
    opencap = load_marker_set("opencap-all")
    names = [alias for marker in opencap.markers for alias in (*marker.right, *marker.left, *marker.centre)]
    assert choose_marker_set(names).name == "opencap"
    with pytest.raises(ModelError, match="no marker set fits"):
        choose_marker_set(["head", "nose"])


def test_variances_are_table_1_and_the_others_say_why() -> None:
    table_1 = {
        "TOE": 1e-3,
        "ANK": 10e-3,
        "TIB": 15e-3,
        "KNE": 30e-3,
        "ASI": 17e-3,
        "T10": 10.7e-3,
        "STRN": 15e-3,
        "SHO": 10e-3,
    }
    markers = {marker.name: marker for marker in load_marker_set("plug-in-gait").markers if not marker.landmark_only}
    for name, marker in markers.items():
        if name in table_1:
            assert marker.variance == table_1[name]
            assert marker.reason.startswith("Table I")
        else:
            assert marker.reason.startswith("not in Table I")


def test_opencap_has_seventeen_sites_a_side() -> None:
    marker_set = load_marker_set("opencap")
    names = tuple(alias for marker in marker_set.markers for alias in (*marker.right, *marker.left, *marker.centre))
    assert len(matched(names, "opencap").sites("right")) == 17
    assert len(matched(names, "opencap").sites("both")) == 33


def test_hip_centre_is_harrington_2007() -> None:
    finder = LandmarkFinder(matched(), "right", "male", planar=False)
    hip = finder.find(PELVIS)["hip"]
    depth, width = 0.16, 0.24
    np.testing.assert_allclose(
        hip - [0.0, 1.0, 0.0], [-0.24 * depth - 0.0099, -0.30 * width - 0.0109, 0.33 * width + 0.0073]
    )
    left = LandmarkFinder(matched(), "left", "male", planar=False).find(PELVIS)["hip"]
    np.testing.assert_allclose(left, hip * [1.0, 1.0, -1.0])


def test_lumbar_centre_by_sex_and_the_mean() -> None:
    found = {
        sex: LandmarkFinder(matched(), "right", sex, planar=True).find(PELVIS)["lumbar"]  # type: ignore[arg-type]
        for sex in ("male", "female", None)
    }
    np.testing.assert_allclose(found["male"], [-0.335 * 0.24, 1.0 - 0.032 * 0.24, 0.0])
    np.testing.assert_allclose(found["female"], [-0.340 * 0.24, 1.0 + 0.049 * 0.24, 0.0])
    np.testing.assert_allclose(found[None], 0.5 * (found["male"] + found["female"]))


def test_cervical_centre_is_turned_up_from_the_line_to_the_sternum() -> None:
    places = PELVIS | {
        ("C7", "centre"): np.array([0.0, 1.5, 0.0]),
        ("CLAV", "centre"): np.array([0.12, 1.5, 0.0]),
    }
    cervical = LandmarkFinder(matched(), "right", "male", planar=True).find(places)["cervical"]
    distance, angle = 0.55 * 0.12, np.deg2rad(8.0)
    np.testing.assert_allclose(cervical, [distance * np.cos(angle), 1.5 + distance * np.sin(angle), 0.0])


def test_pelvis_landmarks_turn_with_the_pelvis() -> None:
    angle = np.deg2rad(40.0)
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    finder = LandmarkFinder(matched(), "right", None, planar=False)
    before, after = finder.find(PELVIS), finder.find({key: turn @ place for key, place in PELVIS.items()})
    for name in ("hip", "lumbar", "mid_asis"):
        np.testing.assert_allclose(after[name], turn @ before[name], atol=1e-12)


def test_an_absent_marker_is_named_with_its_aliases() -> None:
    finder = LandmarkFinder(matched(("RTOE", "C7")), "right", None, planar=True)
    assert not finder.known("ankle")
    with pytest.raises(ModelError) as error:
        finder.require({"ankle": "segment 'shank'", "toe": "segment 'foot'", "knee": "segment 'thigh'"})
    assert "'toe'" not in error.value.message
    for word in (
        "trial",
        "'ankle' (segment 'shank')",
        "marker ANK",
        "tried RANK, LANK",
        "marker KNE",
        "it has RTOE, C7",
    ):
        assert word in error.value.message


def test_a_missing_marker_gives_no_landmark_never_zero() -> None:
    places = dict(PELVIS)
    places["ASI", "left"] = np.full(3, np.nan)
    assert "hip" not in LandmarkFinder(matched(), "right", None, planar=True).find(places)


def test_a_place_that_a_set_of_ones_own_has_on_one_side_gives_no_way_to_the_other_sides_joint() -> None:
    own, knees = load_marker_set("plug-in-gait"), ("KNE", "KNM", "KAX", "KD1", "KD2")
    markers = tuple(m.model_copy(update={"right": ()}) if m.name in knees else m for m in own.markers)
    names = ("RASI", "LASI", "RPSI", "LPSI", "RTHI", "RANK", "LKNE")
    match = match_markers(own.model_copy(update={"markers": markers}), names, [True] * len(names), "trial")
    finder = LandmarkFinder(match, "right", None, planar=False, in_space=True, height_m=1.7)
    assert finder.lacking("knee", "right") == []
    assert finder.lacking("knee", "left")
