"""The right marker set is recognised however it is spelt, and labels that are not where they say are named."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from itertools import combinations
from pathlib import Path
from weakref import ref

import numpy as np
import pytest

from dynakin.errors import ModelError, RecordingError
from dynakin.messages import Message
from dynakin.model.definition import load_model
from dynakin.model.markers.draft import draft
from dynakin.model.markers.fit import choose_marker_set
from dynakin.model.markers.marker_set import available_marker_sets, load_marker_set
from dynakin.model.markers.match import MarkerMatch, match_markers
from dynakin.model.markers.recognise import Recognised, _without_swap, recognise, recognise_standing
from dynakin.model.markers.sides import other_letter, side_letters
from dynakin.model.markers.swaps import Swap
from dynakin.recordings.frame import find_ground_frame
from dynakin.recordings.landmarks import FacingPairs
from dynakin.recordings.orientation import find_forward
from dynakin.recordings.read import read
from dynakin.recordings.recording import Recording
from dynakin.settings.subject import Subject
from dynakin.simulation.bodies.markers import marker_positions
from dynakin.simulation.bodies.registry import choose_body
from dynakin.simulation.bodies.subject import Spread
from dynakin.simulation.contacts import mechanical_state
from dynakin.simulation.mechanics import TreeMotion
from dynakin.simulation.motions.registry import choose_movement
from dynakin.simulation.streams import Streams

Array = np.ndarray
SEED, WHO = 5, (62.0, 1.66, "female", Spread())
# The limits of recognition (`_GAIN`, `_IMPOSSIBLE`) were set with these recordings in view: that there is no false
# alarm on them shows that they still hold, not that they hold elsewhere.
SETS = [name for name in available_marker_sets() if not name.endswith("-all")]
WITH_LEGS = [name for name in SETS if {"thigh", "shank"} <= {m.segment for m in load_marker_set(name).markers}]
OF_REAL = {
    "c3d_parser/FMC/MH0222_BP01.c3d": "plug-in-gait-lower-body",
    "c3d_parser/FMC/MH0222_BP06.c3d": "plug-in-gait-lower-body",
    "c3d_parser/FMC/MH0222_BP08.c3d": "plug-in-gait-lower-body",
    "c3d_parser/FMC/MH0222_BP15.c3d": "plug-in-gait-lower-body",
    "c3d_parser/MH/MH_Cal 01.c3d": "plug-in-gait-lower-body",
    "c3d_parser/MH/MH_Dynamic_BF08.c3d": "plug-in-gait-lower-body",
    "c3d_parser/RBWH/Max Cal 01.c3d": "plug-in-gait",
    "c3d_parser/RBWH/bfnd w1.c3d": "plug-in-gait",
    "functional/anat_pose_ECH.c3d": "biobuddy",
    "functional/right_hip.c3d": "biobuddy",
    "functional/right_knee.c3d": "biobuddy",
    "gait2354/subject01_static.trc": "gait2354",
    "gait2354/subject01_walk1.trc": "gait2354",
    "opencap_subject4/DJ1.trc": "opencap",
    "opencap_subject4/STS1.trc": "opencap",
    "opencap_subject4/squats1.trc": "opencap",
    "opencap_subject4/static1.trc": "opencap",
    "opencap_subject4/walking1.trc": "opencap",
    "plugin_gait/GaitNormal_1.c3d": "plug-in-gait",
    "plugin_gait/S1_FlywheelSquat.c3d": "plug-in-gait",
    "plugin_gait/S1_StandingRef.c3d": "plug-in-gait",
    "pycgm/Movement_trial.c3d": "plug-in-gait",
    "pycgm/Static_trial.c3d": "plug-in-gait",
    "rajagopal/motion_capture_run.trc": "rajagopal-run",
    "rajagopal/motion_capture_walk.trc": "rajagopal-walk",
    "rajagopal/static_run.trc": "rajagopal-run",
    "rajagopal/static_walk_1.trc": "rajagopal-walk",
    "rajagopal/static_walk_2.trc": "rajagopal-walk",
}


@cache
def _walk() -> tuple[Array, TreeMotion, float]:
    streams = Streams(SEED)
    body = choose_body("fullbody", streams, *WHO)
    time = np.arange(100) / 25.0
    movement = choose_movement("gait", body, streams["motion"], 4.0, 6.0)
    return time, mechanical_state(body, movement, time).moving, body.floor_m


@cache
def walking(marker_set: str) -> Recording:
    """A woman of 1.66 m, unlike the average, who walks with all of a set on; 1 mm of noise."""
    time, moving, floor_m = _walk()
    sites = choose_body("fullbody", Streams(SEED), *WHO, markers=marker_set).sites
    markers = marker_positions(sites, moving) - [0.0, floor_m, 0.0]
    markers = markers + 1e-3 * np.random.default_rng(1).standard_normal(markers.shape)
    return Recording(marker_set, None, time, tuple(site.name for site in sites), markers)


@cache
def recognised(marker_set: str) -> Recognised:
    return recognise(walking(marker_set))


def test_what_is_found_is_kept_with_the_recording_and_no_longer() -> None:
    recording = replace(walking("plug-in-gait"))
    found, asked = recognise(recording), recognise(recording, load_marker_set("plug-in-gait"))
    assert recognise(recording) is found is not asked
    assert recognise(recording, load_marker_set("plug-in-gait")) is asked
    legs = [k for k, name in enumerate(recording.marker_names) if "KNE" not in name]
    names = tuple(recording.marker_names[k] for k in legs)
    fewer = recognise(replace(recording, marker_names=names, markers=recording.markers[:, legs]))
    assert fewer.match.names != found.match.names
    gone = ref(recording)
    del recording
    assert gone() is None


def exchanged(recording: Recording, one: str, other: str, frames: slice = slice(None)) -> Recording:
    i, j = (recording.marker_names.index(name) for name in (one, other))
    markers = recording.markers.copy()
    markers[frames, i], markers[frames, j] = recording.markers[frames, j], recording.markers[frames, i]
    return replace(recording, markers=markers)


def renamed(recording: Recording, spelt: Callable[[str], str]) -> Recording:
    return replace(recording, marker_names=tuple(spelt(name) for name in recording.marker_names))


def warnings_of(messages: tuple[Message, ...]) -> list[str]:
    return [str(message) for message in messages if message.level == "warning"]


@pytest.mark.parametrize("name", WITH_LEGS)
def test_every_set_is_recognised_on_a_walking_person_and_nothing_is_found_wrong(name: str) -> None:
    recording, found = walking(name), recognised(name)
    assert found.match.marker_set.name == name
    assert not warnings_of(found.messages)
    assert str(found.messages[0]).startswith(f"Marker set {name}: {len(found.match.names)} of its ")
    assert len(found.match.names) >= 0.95 * len(recording.marker_names)


# Names of laboratories for places that Qualisys calls otherwise: the best set knows half of them.
OWN_NAMES = {
    "visual3d-6dof": ("{S}ASIS {S}PSIS {S}LFC {S}MFC {S}LMAL {S}MMAL {S}CAL {S}MT1 {S}MT5", "CLAV STRN"),
    "modified-helen-hayes": (
        "{s}_ASIS {s}_PSIS {s}_knee_lat {s}_knee_med {s}_ankle_lat {s}_ankle_med {s}_heel {s}_first_met {s}_fifth_met",
        "CLAV STRN",
    ),
    "ior-full-body": ("{S}_IAS {S}_IPS {S}_FLE {S}_FME {S}_FAL {S}_TAM {S}_FCC {S}_FM1 {S}_FM5", "CLAV STRN"),
}
PLACES = ("ASI", "PSI", "KNE", "KNM", "ANK", "ANM", "HEE", "MT1", "MT5")


def _in_own_names(set_name: str) -> tuple[Recording, dict[tuple[str, str], str]]:
    whole, match = walking("qualisys-gait"), recognised("qualisys-gait").match
    legs, trunk = (text.split() for text in OWN_NAMES[set_name])
    names = {
        (place, side): spelt.format(S=side[0].upper(), s=side[0])
        for side in ("right", "left")
        for place, spelt in zip(PLACES, legs, strict=True)
    }
    names |= {(place, "centre"): place for place in trunk}
    columns = [whole.marker_names.index(match.names[key]) for key in names]
    return replace(whole, marker_names=tuple(names.values()), markers=whole.markers[:, columns]), names


@pytest.mark.parametrize("set_name", OWN_NAMES)
def test_names_that_the_best_set_does_not_know_are_used_by_what_they_say(set_name: str) -> None:
    recording, names = _in_own_names(set_name)
    found = recognise(recording)
    assert found.match.marker_set.name == set_name
    assert found.match.names == names
    assert "used by what their names say: " in found.messages[0].text and "CLAV (CLAV)" in found.messages[0].text
    guesses = {name for name in names.values() if name.endswith("_met")}  # the others are names of some set
    assert set(found.match.guessed) == guesses
    said = warnings_of(found.messages)
    assert len(said) == bool(guesses) and all("4 of 20 markers (r_first_met (MT1)" in text for text in said)
    assert [len(own) for own in found.match.foot_markers.values()] == [3, 3]


def test_a_name_that_says_a_place_where_it_does_not_lie_is_not_used() -> None:
    """Nor one of two names that say the same place."""
    recording, names = _in_own_names("visual3d-6dof")
    markers = recording.markers.copy()
    markers[:, recording.marker_names.index("RLFC")] += [0.0, 0.5, 0.3]
    found = recognise(replace(recording, markers=markers))
    assert set(names) - set(found.match.names) == {("KNE", "right")} and not warnings_of(found.messages)
    again = replace(
        recording,
        marker_names=(*recording.marker_names, "R_FLE"),
        markers=np.concatenate([recording.markers, recording.markers[:, :1]], axis=1),
    )
    assert {"R_FLE", "RLFC"}.isdisjoint(recognise(again).match.names.values())


def test_a_misplaced_marker_stays_left_out_where_names_add_others() -> None:
    recording, _ = _in_own_names("visual3d-6dof")
    markers = recording.markers.copy()
    markers[:, recording.marker_names.index("RASIS")] += [0.0, 0.5, 0.3]
    found = recognise(replace(recording, markers=markers))
    assert ("ASI", "right") in found.match.left_out and "RASIS" not in found.match.names.values()
    assert "used by what their names say" in found.messages[0].text
    assert any("RASIS is left out: check its label" in text for text in warnings_of(found.messages))
    assert found.wrong_n == 1


def added(recording: Recording, beside: str, at: dict[str, tuple[float, float, float]]) -> Recording:
    """With further markers, or others in place of its own, so far (m, laboratory) from one of its markers."""
    here = recording.marker(beside)
    places = {name: recording.marker(name) for name in recording.marker_names}
    places |= {name: here + np.array(offset) for name, offset in at.items()}
    return replace(recording, marker_names=tuple(places), markers=np.stack(list(places.values()), axis=1))


def test_a_plate_of_markers_on_the_sacrum_is_of_the_pelvis() -> None:
    whole = walking("helen-hayes")
    plate = added(whole, "SACR", {"SACR1": (0.0, 0.02, 0.02), "SACR2": (0.0, 0.02, -0.02), "SACR3": (0.0, -0.03, 0.0)})
    gone = plate.marker_names.index("SACR")
    names = tuple(name for name in plate.marker_names if name != "SACR")
    found = recognise(replace(plate, marker_names=names, markers=np.delete(plate.markers, gone, axis=1)))
    pelvis = {
        name for (key, _), name in found.match.names.items() if found.match.marker_set.marker(key).segment == "pelvis"
    }
    assert pelvis == {"RASI", "LASI", "SACR1", "SACR2", "SACR3"} and not warnings_of(found.messages)


@pytest.mark.parametrize("ahead_m", [0.0, 0.045])
def test_a_cluster_may_be_anywhere_on_its_segment(ahead_m: float) -> None:
    """On the heel, where the midfoot is not, and nearer to where another marker is expected than this one itself."""
    moved = walking("oxford-foot")
    for side in "RL":
        moved = added(moved, f"{side}HEE", {f"{side}CPG": (-0.03, 0.0, 0.0), f"{side}PCA": (0.004, 0.025, 0.0)})
        moved = added(moved, f"{side}STL", {f"{side}STL": (ahead_m, 0.0, 0.0)})
    assert not warnings_of(recognise(moved).messages)


def test_a_place_that_is_exchanged_with_a_cluster_is_named() -> None:
    recording = walking("oxford-foot")
    for one, other in (("RHEE", "RCPG"), ("RKNE", "RSHN")):
        (said,) = warnings_of(recognise(exchanged(recording, one, other)).messages)
        assert one in said and said.count("left out") == 1


def test_names_that_only_the_standing_trial_has_are_known_by_what_they_say() -> None:
    """Unless a set was asked for: who has one says what its names are."""
    whole = walking("gait2354")
    ends = {"Knee.Lat": "LatEpi", "Knee.Med": "MedEpi", "Ankle.Lat": "LatMal", "Ankle.Med": "MedMal"}
    own = {f"{side}.{end}": f"{side}{odd}" for side in "RL" for end, odd in ends.items()}
    assert own.keys() <= set(whole.marker_names)
    static = renamed(whole, lambda name: own.get(name, name))
    moving = [k for k, name in enumerate(whole.marker_names) if name not in own]
    trial = replace(whole, marker_names=tuple(whole.marker_names[k] for k in moving), markers=whole.markers[:, moving])
    chosen = recognise(trial)
    found = recognise_standing(static, trial, chosen)
    known = {
        static.marker_names[whole.marker_names.index(name)]: key
        for key, name in recognised("gait2354").match.names.items()
    }
    assert {name: key for key, name in found.match.names.items() if name in own.values()} == {
        name: known[name] for name in own.values()
    }
    assert chosen.match.names.items() <= found.match.names.items()
    (said,) = warnings_of(found.messages)
    assert "8 of" in said and "RLatEpi (KNE)" in said
    asked = recognise(trial, load_marker_set("gait2354"))
    unknown = recognise_standing(static, trial, asked).match.unexplained
    assert set(own.values()) <= set(unknown)


def test_where_markers_lie_is_asked_only_where_a_name_may_be_used(monkeypatch: pytest.MonkeyPatch) -> None:
    """That takes as long as all else of a recognition, and nothing that follows a forearm is ever used."""
    plain = recognised("opencap").match
    assert set(plain.unexplained) == {"R_forearm", "L_forearm"}

    def asked(recording: Recording) -> None:
        raise AssertionError

    monkeypatch.setattr(draft, "guess_markers", asked)
    assert recognise(replace(walking("opencap"))).match.names == plain.names
    with pytest.raises(AssertionError):
        recognise(renamed(walking("opencap"), lambda name: name.replace("forearm", "thigh9")))


def test_names_of_joint_centres_beside_a_marked_pelvis_are_on_the_skin() -> None:
    """RKnee of somebody who wears RASIS is no joint centre; a hip's marker may be anywhere and is not used."""
    whole, match = walking("qualisys-gait"), recognised("qualisys-gait").match
    spelt = {"ASI": "ASIS", "PSI": "PSIS", "KNE": "Knee", "ANK": "Ankle", "HEE": "Heel"}
    names = {(p, s): f"{s[0].upper()}{spelt[p]}" for s in ("right", "left") for p in spelt}
    names |= {("MT1", s): f"{s[0].upper()}BigToe" for s in ("right", "left")}
    columns = [whole.marker_names.index(match.names[key]) for key in names]
    hips = [whole.marker_names.index(match.names["ASI", s]) for s in ("right", "left")]
    recording = replace(
        whole,
        marker_names=(*names.values(), "RHip", "LHip"),
        markers=np.concatenate([whole.markers[:, columns], whole.markers[:, hips] - [0.0, 0.1, 0.0]], axis=1),
    )
    found = recognise(recording).match
    assert {key: name for key, name in found.names.items() if name[1:] in ("Knee", "Ankle", "Hip")} == {
        (place, side): names[place, side] for place in ("KNE", "ANK") for side in ("right", "left")
    }


@pytest.mark.parametrize("spelt", [
    lambda name: f"S01:{name}", lambda name: f"Jane_Doe_{name}", str.lower, str.upper,
    lambda name: name.replace(".", "_"), lambda name: name.replace("_", " "),
], ids=["colon", "prefix", "lower", "upper", "dots", "blanks"])  # fmt: skip
@pytest.mark.parametrize("name", WITH_LEGS)
def test_every_set_is_recognised_however_it_is_spelt(name: str, spelt: Callable[[str], str]) -> None:
    plain = recognised(name).match
    other = recognise(renamed(walking(name), spelt)).match
    assert other.marker_set.name == name
    assert other.names == {key: spelt(own) for key, own in plain.names.items()}


@pytest.mark.parametrize("name", WITH_LEGS)
def test_right_for_left_is_named_in_every_set_and_mended(name: str) -> None:
    recording, match = walking(name), recognised(name).match
    places = [place for place in ("KNE", "KJ", "ANK", "AJ") if {(place, "right"), (place, "left")} <= set(match.names)]
    assert places
    for place in places:
        pair = [match.names.get((place, side)) for side in ("right", "left")]
        if pair[0] and pair[1]:
            found = recognise(exchanged(recording, pair[0], pair[1]))
            said = warnings_of(found.messages)
            assert len(said) == 1
            assert f"{pair[0]} and {pair[1]} look swapped" in said[0] or f"{pair[1]} and {pair[0]}" in said[0]
            assert "each is used as the other" in said[0] and not found.match.left_out
            assert found.match.names == match.names | {(place, "right"): pair[1], (place, "left"): pair[0]}


@pytest.mark.parametrize("name", WITH_LEGS)
def test_a_mirrored_person_is_refused_in_every_set_that_shows_the_front(name: str) -> None:
    recording, pairs = walking(name), recognised(name).match.facing_pairs
    if not pairs.heel_toe and not pairs.pelvis:
        pytest.skip("no place of this set shows where the front is")
    find_ground_frame(recording, pairs=pairs)
    mirrored = replace(recording, markers=recording.markers * [1.0, 1.0, -1.0])
    with pytest.raises(RecordingError, match="seen in a mirror"):
        find_ground_frame(mirrored, pairs=recognise(mirrored).match.facing_pairs)


@pytest.mark.parametrize(
    ("one", "other"), [("RKNE", "RTHI"), ("RANK", "RHEE"), ("LASI", "LPSI"), ("RELB", "RSHO"), ("C7", "T10")]
)
def test_exchanged_neighbours_are_named(one: str, other: str) -> None:
    found = recognise(exchanged(walking("plug-in-gait"), one, other))
    (said,) = warnings_of(found.messages)
    assert one in said.split("look swapped")[0]
    assert other in said.split("look swapped")[0]
    assert "correct the labels" in said
    assert {one, other}.isdisjoint(found.match.names.values())
    name = one.lstrip("RL") if one != "LASI" else "ASI"
    assert f"marker {name} cannot be used" in found.match.absent(name)


def test_an_exchange_from_a_frame_on_is_named_with_its_time() -> None:
    recording = walking("plug-in-gait")
    found = recognise(exchanged(recording, "RKNE", "LKNE", slice(60, None)))
    (said,) = warnings_of(found.messages)
    assert "look swapped from 2.40 to 3.96 s" in said
    assert "used as they are" in said and not found.match.left_out  # the filter refuses them there


@pytest.mark.parametrize("place", ["THI", "KNE", "TIB", "ANK", "HEE"])
@pytest.mark.parametrize("start", [47, 40])
def test_right_for_left_from_about_the_middle_on_is_named_and_nothing_else(place: str, start: int) -> None:
    """A marker that is on the other leg for half of the trial is anywhere there: which half is right, the length that
    returns shows."""
    found = recognise(exchanged(walking("plug-in-gait"), f"R{place}", f"L{place}", slice(start, None)))
    (said,) = warnings_of(found.messages)
    assert f"R{place} and L{place} look swapped" in said or f"L{place} and R{place} look swapped" in said
    assert set(found.match.left_out) <= {(place, "right"), (place, "left")}


def test_a_refusal_for_want_of_exchanged_markers_names_the_exchange() -> None:
    recording = exchanged(walking("plug-in-gait"), "RANK", "RHEE", slice(45, None))
    with pytest.raises(ModelError, match=r"no marker shows right ankle.* RANK.* look swapped.*the labels corrected"):
        load_model("fullbody", subject=Subject(mass_kg=62.0, height_m=1.66)).calibrate(recording)


def test_exchanges_that_share_a_marker_are_said_one_by_one() -> None:
    """By the second RTHI and LTHI are each other's, and by the first LTHI is left out."""
    match = recognised("plug-in-gait").match
    one, other = (("KNE", "left"), ("THI", "left")), (("THI", "right"), ("THI", "left"))
    for pairs in ((one, other), (other, one)):
        left = match
        for pair in pairs:
            left, said = _without_swap(left, Swap((pair,), "they", "far apart"), 0.0)
            assert "they look swapped" in said.text
        assert ("THI", "left") not in left.names and ("KNE", "left") not in left.names


def test_several_exchanges_of_any_markers_end_in_words() -> None:
    whole = walking("plug-in-gait")
    draw = np.random.default_rng(3)
    for _ in range(12):
        recording = whole
        for _ in range(int(draw.integers(1, 4))):
            start = int(draw.integers(35, 60))
            one, other = (str(name) for name in draw.choice(whole.marker_names, 2, replace=False))
            recording = exchanged(recording, one, other, slice(start, None))
        try:
            assert recognise(recording).match.names
        except ModelError as error:
            assert "expected" in error.message


def test_an_exchange_at_the_start_leaves_both_out() -> None:
    """Places are measured there."""
    found = recognise(exchanged(walking("plug-in-gait"), "RKNE", "LKNE", slice(0, 40)))
    assert any("look swapped from 0.00" in said and "left out" in said for said in warnings_of(found.messages))
    assert set(found.match.left_out) == {("KNE", "right"), ("KNE", "left")}


RIGHT_LEG = ("RTHI", "RKNE", "RTIB", "RANK", "RHEE", "RTOE")


@pytest.mark.parametrize(
    ("one", "other"), [*combinations(RIGHT_LEG, 2), *((name, f"L{name[1:]}") for name in RIGHT_LEG), ("RASI", "LASI")]
)
def test_every_exchange_on_a_leg_in_the_middle_of_a_trial_is_named(one: str, other: str) -> None:
    found = recognise(exchanged(walking("plug-in-gait"), one, other, slice(40, 70)))
    (said,) = warnings_of(found.messages)
    assert f"{one} and {other} look swapped" in said or f"{other} and {one} look swapped" in said
    start, stop = (float(word) for word in re.findall(r"from (\S+) to (\S+) s", said)[0])
    assert abs(start - 1.60) < 0.09 and abs(stop - 2.76) < 0.09


@pytest.mark.parametrize("name", RIGHT_LEG)
def test_one_marker_that_is_off_for_a_while_is_no_exchange(name: str) -> None:
    recording = walking("plug-in-gait")
    for seed in range(3):
        markers = recording.markers.copy()
        away = np.random.default_rng(seed).standard_normal(3)
        markers[40:70, recording.marker_names.index(name)] += 0.12 * away / np.linalg.norm(away)
        assert not any("swapped" in said for said in map(str, recognise(replace(recording, markers=markers)).messages))


def test_without_what_is_exchanged_there_is_no_person() -> None:
    recording = walking("plug-in-gait-lower-body")
    for name in ("THI", "KNE", "TIB", "ANK", "HEE", "TOE"):
        recording = exchanged(recording, f"R{name}", f"L{name}")
    with pytest.raises(ModelError, match=r"all right and left labels of .* swapped .*the labels corrected"):
        recognise(recording)


def test_a_marker_in_a_wrong_place_is_named_with_what_was_found_and_expected() -> None:
    recording = walking("plug-in-gait")
    markers = recording.markers.copy()
    markers[:, recording.marker_names.index("RANK")] += [0.0, 0.0, 0.9]
    found = recognise(replace(recording, markers=markers))
    (said,) = warnings_of(found.messages)
    assert "RANK" in said
    assert "m apart, expected about" in said
    assert set(found.match.left_out) == {("ANK", "right")}


def test_names_on_other_places_are_no_set() -> None:
    recording = walking("plug-in-gait")
    order = np.random.default_rng(2).permutation(len(recording.marker_names))
    with pytest.raises(ModelError, match=r"not where it says|look swapped"):
        recognise(replace(recording, markers=recording.markers[:, order]))


@pytest.mark.parametrize("factor", [1000.0, 10.0, 0.1, 0.001, 0.0], ids=str)
def test_a_wrong_unit_of_length_is_named(factor: float) -> None:
    recording = walking("plug-in-gait")
    for asked in (None, load_marker_set("plug-in-gait")):
        with pytest.raises(ModelError, match=r"m tall .*expected 0.3 to 2.8 m: the unit of length"):
            recognise(replace(recording, markers=factor * recording.markers), asked)


def test_a_next_best_set_that_two_names_fit_does_not_refuse_the_recording() -> None:
    recording = walking("plug-in-gait")
    markers = recording.markers.copy()
    markers[:, recording.marker_names.index("RANK")] += [0.0, 0.0, 0.9]
    sacrum = 0.5 * sum(markers[:, [recording.marker_names.index(name)]] for name in ("RPSI", "LPSI"))
    found = recognise(
        replace(
            recording,
            marker_names=(*recording.marker_names, "SACR", "sacr"),
            markers=np.concatenate([markers, sacrum, sacrum + 0.001], axis=1),
        )
    )
    assert found.match.marker_set.name == "plug-in-gait"
    assert set(found.match.left_out) == {("ANK", "right")}


def test_nothing_seen_and_no_name_known_are_said_so() -> None:
    recording = walking("plug-in-gait")
    with pytest.raises(ModelError, match="no marker is seen in 100 frames"):
        recognise(replace(recording, markers=np.full_like(recording.markers, np.nan)))
    with pytest.raises(ModelError, match=r"none knows any of the names.*dynakin markers list"):
        choose_marker_set(["q1", "q2"])


def test_a_part_of_a_set_is_enough_and_what_lacks_is_said_at_once() -> None:
    whole = walking("plug-in-gait")
    leg = ("RASI", "LASI", "RPSI", "LPSI", "RKNE", "RTHI", "RANK", "RTIB", "RHEE", "RTOE")
    columns = [whole.marker_names.index(name) for name in leg]
    found = recognise(replace(whole, marker_names=leg, markers=whole.markers[:, columns]))
    assert len(found.match.names) == len(leg)
    with pytest.raises(ModelError, match=r"lacks on the pelvis \(.*on the thigh \(.*dynakin markers new TRIAL"):
        choose_marker_set(["RTOE", "RHEE", "nose"])


def test_sides_before_and_behind_the_rest() -> None:
    set_ = load_marker_set("rajagopal-walk")
    for right in ("R.ASIS", "ASIS_R", "RASIS", "Right ASIS", "r_asis"):
        left = right.replace("Right", "Left").replace("R", "L", 1) if "r_" not in right else "l_asis"
        names = (right, {"ASIS_R": "ASIS_L", "Right ASIS": "Left ASIS"}.get(right, left))
        match = match_markers(set_, names, [True, True], "trial")
        assert match.names == {("ASI", "right"): names[0], ("ASI", "left"): names[1]}


SPELT = {  # right and left of a name "RASI", "LASI"
    "polish": lambda name: {"R": "P"}.get(name[0], name[0]) + name[1:],
    "slovene": lambda name: {"R": "D"}.get(name[0], name[0]) + name[1:],
    "spanish": lambda name: f"{name[1:]}_{'D' if name[0] == 'R' else 'I'}",
    "french": lambda name: f"{'d' if name[0] == 'R' else 'g'} {name[1:]}",
    "hungarian": lambda name: f"S01_{'J' if name[0] == 'R' else 'B'}_{name[1:]}",
}


@pytest.mark.parametrize("language", SPELT)
def test_sides_of_another_language_are_those_of_english(language: str) -> None:
    """One leg alone was known by them, and plates were blamed for what the other bore."""
    own = recognised("plug-in-gait-lower-body")
    foreign = renamed(walking("plug-in-gait-lower-body"), SPELT[language])
    found = recognise(foreign)
    assert found.match.names == {key: SPELT[language](name) for key, name in own.match.names.items()}
    assert warnings_of(found.messages) == warnings_of(own.messages) and not found.match.guessed
    assert any(re.fullmatch(r"[DPJ] is read as right and [LIGB] as left\.", m.text) for m in found.messages)


def test_letters_that_are_right_for_left_by_the_body_are_refused() -> None:
    foreign = renamed(walking("plug-in-gait-lower-body"), lambda name: {"L": "P", "R": "L"}[name[0]] + name[1:])
    with pytest.raises(RecordingError, match="seen in a mirror"):
        find_ground_frame(foreign, pairs=recognise(foreign).match.facing_pairs)


def test_half_a_body_in_an_unknown_language_is_refused() -> None:
    latvian = renamed(walking("plug-in-gait-lower-body"), lambda name: {"R": "L", "L": "K"}[name[0]] + name[1:])
    with pytest.raises(ModelError, match=r"L in names is read as left, K is not understood .*KANK, .*expected R and L"):
        recognise(latvian)


def test_letters_that_count_a_cluster_are_no_language() -> None:
    """Posterior and lateral markers of one leg: its names say right already."""
    leg = walking("plug-in-gait-lower-body")
    kept = [k for k, name in enumerate(leg.marker_names) if name[0] == "R" or name[1:] in ("ASI", "PSI")]
    names = (*(leg.marker_names[k] for k in kept), *(f"R{part}{end}" for part in ("TH", "SK", "FT") for end in "PL"))
    markers = np.concatenate([leg.markers[:, kept], leg.markers[:, kept[:6]] + 0.02], axis=1)
    found = recognise(replace(leg, marker_names=names, markers=markers))
    assert {side for _, side in found.match.names} == {"right", "left"}
    assert not any("is read as right" in m.text for m in found.messages)


STEMS = ("ASI", "PSI", "KNE", "ANK", "HEE", "TOE", "TIB")


@pytest.mark.parametrize(
    ("names", "read"),
    [
        ([f"{place}_{side}" for place in STEMS for side in "DI"], True),
        ([*(f"{place}_{side}" for place in STEMS for side in "DI"), *(f"U{k}" for k in range(100, 140))], True),
        ([f"R{part}{end}" for part in ("TH", "SK", "FT", "PV") for end in "DL"], False),  # distal and lateral, of R
        ([f"{letter}{k}" for k in range(1, 9) for letter in "DL"], False),  # numbers
    ],
)
def test_which_names_say_their_side_in_another_language(names: list[str], read: bool) -> None:
    assert (side_letters({name: name for name in names}) is not None) == read


def test_only_a_letter_that_says_a_side_is_half_of_two() -> None:
    assert other_letter(["RTHI1", "RTIB1", "RFOO1"], ["RTHI2", "RTIB2", "RFOO2"]) is None
    assert other_letter(["LASI", "LKNE", "LANK"], ["KASI", "KKNE", "KANK"]) == ("L", "K", ["KANK", "KASI", "KKNE"])


def test_two_persons_are_refused() -> None:
    one = [f"S1_{name}" for name in walking("plug-in-gait").marker_names]
    both = [*one, *(name.replace("S1_", "S2_") for name in one)]
    with pytest.raises(ModelError, match="expected one subject"):
        match_markers(load_marker_set("plug-in-gait"), both, [True] * len(both), "trial")


@pytest.mark.parametrize("ends", [("_1", "_2"), (" (1)", " (2)")])
def test_two_persons_whose_names_differ_in_the_last_word_are_refused(ends: tuple[str, str]) -> None:
    recording = walking("plug-in-gait")
    names = tuple(name + end for end in ends for name in recording.marker_names)
    shifted = np.concatenate([recording.markers, recording.markers + np.array([0.0, 0.0, 1.2])], axis=1)
    both = replace(recording, marker_names=names, markers=shifted)
    with pytest.raises(ModelError, match="are a person's each; expected one subject in a recording"):
        recognise(both)


def test_facing_from_right_and_left_hip_alone() -> None:
    recording = walking("coco17")
    match = recognise(recording).match
    hips = tuple(match.names["HJ", side] for side in ("right", "left"))
    columns = [recording.marker_names.index(name) for name in hips]
    only = replace(recording, marker_names=hips, markers=recording.markers[:, columns])
    ahead, how = find_forward(only, np.array([0.0, 1.0, 0.0]), FacingPairs((), (), across=((hips[0], hips[1]),)))
    assert ahead[0] > 0.98
    assert "square to the line from right to left" in how[0]


def test_the_pelvis_shows_the_front_before_one_foot_that_is_turned_out() -> None:
    whole, up = walking("plug-in-gait"), np.array([0.0, 1.0, 0.0])
    markers = whole.markers.copy()
    heel, toe = (whole.marker_names.index(name) for name in ("RHEE", "RTOE"))
    c, s = np.cos(np.deg2rad(20.0)), np.sin(np.deg2rad(20.0))
    x, y, z = np.moveaxis(markers[:, toe] - markers[:, heel], -1, 0)
    markers[:, toe] = markers[:, heel] + np.stack([c * x - s * z, y, s * x + c * z], axis=-1)
    leg = ["RKNE", "RTHI", "RANK", "RTIB", "RHEE", "RTOE"]
    for pelvis, why in (
        (["RASI", "LASI", "RPSI", "LPSI"], "pelvis to its front."),
        (["RASI", "LASI"], "line from right to left."),
        (["RASI", "RPSI"], "(one foot only)."),
        ([], "(one foot only)."),
    ):
        names = (*pelvis, *leg)
        only = replace(whole, marker_names=names, markers=markers[:, [whole.marker_names.index(n) for n in names]])
        pairs = match_markers(load_marker_set("plug-in-gait"), names, [True] * len(names), "leg").facing_pairs
        ahead, how = find_forward(only, up, pairs)
        assert why in how[0]
        assert ahead[0] > (0.99 if len(pelvis) > 1 and "foot" not in why else 0.85)


def test_without_toe_the_metatarsals_show_the_front() -> None:
    match = match_markers(load_marker_set("plug-in-gait"), ("RHEE", "RMT5", "LHEE", "LTOE"), [True] * 4, "trial")
    assert isinstance(match, MarkerMatch)
    assert match.facing_pairs.heel_toe == (("RHEE", "RMT5"), ("LHEE", "LTOE"))


@pytest.mark.parametrize("trial", OF_REAL)
def test_real_recordings_have_their_set_and_no_false_alarm(trial: str, data_dir: Path) -> None:
    path = data_dir / trial
    if not path.exists():
        pytest.skip(f"{path} is absent")
    found = recognise(read(path))
    assert found.match.marker_set.name == OF_REAL[trial]
    assert not warnings_of(found.messages)
