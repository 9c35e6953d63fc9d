"""What is known of the ground: a seat, a box, a belt, no plates at all; flags follow from plates and motion alone."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import xarray as xr

import dynakin
from dynakin import Estimate, Estimator, Subject, load_model
from dynakin.arrays import runs
from dynakin.bindings import _core
from dynakin.cli.prepared import assumed
from dynakin.errors import RecordingError
from dynakin.filter.events import impossible
from dynakin.filter.ground.closure import closure
from dynakin.filter.ground.ground import Ground
from dynakin.filter.ground.needed import Needed
from dynakin.filter.sight import LiveSight
from dynakin.filter.sources import ContactSources, with_sources
from dynakin.recordings.feet.assignment import foot_loads
from dynakin.recordings.feet.contact import NO_CONTACT, ON_PLATE, SHARED_PLATE, UNMEASURED
from dynakin.recordings.feet.loads import MEASURED as FOOT_MEASURED
from dynakin.recordings.feet.loads import SHARED as FOOT_SHARED
from dynakin.recordings.feet.loads import SWING
from dynakin.recordings.feet.loads import UNKNOWN as FOOT_UNKNOWN
from dynakin.recordings.formats.mot import read_table
from dynakin.recordings.frame import GroundFrame
from dynakin.recordings.plates.pressure import Surface, plate_from_wrench
from dynakin.recordings.recording import Plate, Recording
from dynakin.report.insights import insights
from dynakin.results.estimate import tree_of
from dynakin.results.measures.feet import foot_sources
from dynakin.results.measures.metrics import compute_metrics
from dynakin.results.measures.sources import ABSENT, DERIVED, MEASURED, PRIOR, out_of_sight, taken_back, wrench_sources
from dynakin.settings.settings import Settings
from dynakin.units import GRAVITY_M_S2
from support.estimates.walking import make_walker
from support.simulated import simulate

WEIGHT = 70.0 * GRAVITY_M_S2


def person(model: str) -> Estimator:
    return Estimator(load_model(model, Subject(mass_kg=70.0, height_m=1.75, sex="male")))


def ground_of(recording: Recording, estimator: Estimator) -> Ground:
    return estimator.measured(recording, estimator.start(recording).calibrated)[2]


def with_loads(recording: Recording, factor: np.ndarray) -> Recording:
    """Plates that read so much (T,) of what they carry."""
    plates = [
        replace(p, force=p.force * factor[:, None], moment=p.moment * factor[:, None], free_moment=p.free_moment)
        for p in recording.plates
    ]
    return recording.with_plates(tuple(plates))


def sources(found: Estimate, coordinate: str) -> np.ndarray:
    return found.data["moment_source"].sel(coordinate=coordinate).values


@pytest.mark.parametrize(
    ("model", "motion"), [("sagittal7", "squat"), ("squat7", "sit-to-stand"), ("fullbody", "squat")]
)
@pytest.mark.parametrize("seed", [11, 12])
def test_plates_that_carry_the_person_are_found_to(model: str, motion: str, seed: int) -> None:
    """The seat has its own plate here."""
    recording = simulate(model, motion, seed, 12.0).recording
    estimator = person(model)
    initial = estimator.start(recording).calibrated
    markers, wrench, ground = estimator.measured(recording, initial)
    found = closure(Needed(initial, recording.time, markers), wrench, np.ones(len(wrench), dtype=bool))
    assert found is not None and not found.undeclared.any() and not ground.undeclared.any()
    assert np.sqrt(np.nanmean(found.excess**2, axis=0)).max() < 0.02 * WEIGHT
    assert found.load_ratio == pytest.approx(1.0, abs=0.02)


def test_what_cannot_be_judged_beside_unclaimed_frames_is_as_what_is_judged_beside_it() -> None:
    """A rail that bears a tenth in all of a stretch, 42 ms of which lie too near to frames that nobody claims."""
    recording = simulate("fullbody", "squat", 11, 12.0).recording
    estimator = person("fullbody")
    initial = estimator.start(recording).calibrated
    markers, wrench, _ = estimator.measured(recording, initial)
    time = recording.time - recording.time[0]
    rail = (time >= 4.0) & (time < 6.0)
    less = wrench - np.outer(rail, [0.0, 0.1 * WEIGHT, 0.0, 0.0, 0.0, 0.0])
    claimed = (time < 3.8) | rail | (time >= 6.2)
    found = closure(Needed(initial, recording.time, markers), less, claimed)
    assert found is not None and (found.undeclared == rail).all()
    short = claimed & (np.mod(time, 1.0) < 0.05)  # too near to unclaimed frames, all of them
    assert closure(Needed(initial, recording.time, markers), wrench, short) is None


@pytest.mark.parametrize(("away_m", "borne"), [(0.0, False), (0.8, True)])
def test_without_plates_nothing_is_the_feets_alone_where_they_are_not_under_the_person(
    away_m: float, borne: bool
) -> None:
    """The feet had all of who is on hands and toes: L5/S1 was "measured" to 9 N m, and 171 off."""
    recording = simulate("fullbody", "squat", 11, 12.0).recording
    estimator = person("fullbody")
    initial = estimator.start(recording).calibrated
    feet = [recording.marker_names.index(name) for own in initial.foot_markers.values() for name in own]
    markers = recording.markers.copy()
    markers[:, feet] += np.array([away_m, 0.0, 0.0])
    _, _, ground = estimator.measured(replace(recording.with_plates(()), markers=markers), initial)
    assert (ground.undeclared == borne).all()
    assert any("bears the person beyond both feet" in message.text for message in ground.notes) == borne


@pytest.mark.parametrize(("break_s", "pulls"), [(0.3, 1), (1.5, 2)])
def test_a_short_break_in_what_pulls_is_none(break_s: float, pulls: int) -> None:
    """Of a stroller that was pushed arms were measured in breaks of 0.1 s: elbows 4 N m off, said to 0.9."""
    recording = simulate("sagittal7", "squat", 11, 12.0).recording
    estimator = person("sagittal7")
    initial = estimator.start(recording).calibrated
    markers, wrench, _ = estimator.measured(recording, initial)
    time = recording.time - recording.time[0]
    pulled = (time > 3.0) & (time < 7.0) & ~((time > 5.0) & (time < 5.0 + break_s))
    more = wrench + np.outer(pulled, [0.1 * WEIGHT, 0.0, 0.0, 0.0, 0.0, 0.0])
    found = closure(Needed(initial, recording.time, markers), more, np.ones(len(wrench), dtype=bool))
    assert found is not None and len(runs(found.undeclared)) == pulls


@pytest.fixture(scope="module")
def running() -> SimpleNamespace:
    """Somebody whom stances of 0.22 s throw up, 0.12 s of flight between them: what the plates read of a squat, and
    its markers, with what such stances add. ``stance`` (T,): number of the stance, -1 in flight."""
    recording = simulate("sagittal7", "squat", 11, 12.0).recording
    estimator = person("sagittal7")
    initial = estimator.start(recording).calibrated
    markers, wrench, _ = estimator.measured(recording, initial)
    time = recording.time - recording.time[0]
    stance, at = np.divmod(time, 0.34)
    push = np.where(at < 0.22, np.sin(np.pi * np.minimum(at, 0.22) / 0.22), 0.0)
    more = WEIGHT * (push / push.mean() - 1.0)
    speed = np.cumsum(more) / 70.0 * (time[1] - time[0])
    path = np.append(0.0, np.cumsum(speed - speed.mean()))[:-1] * (time[1] - time[0])
    wrench = wrench + np.outer(more, [0.0, 1.0, 0.0, 0.0, 0.0, 0.0])
    return SimpleNamespace(
        initial=initial, time=recording.time, markers=markers, wrench=wrench, up=np.outer(path, [0.0, 1.0, 0.0]),
        stance=np.where(at < 0.22, stance, -1.0),
    )  # fmt: skip


@pytest.mark.parametrize(("skin", "scale"), [(0.0, 1.0), (0.14, 1.0), (0.0, 1.05), (0.14, 1.05)])
def test_what_a_runner_weighs_is_the_mean_of_what_plates_and_motion_say(
    running: SimpleNamespace, skin: float, scale: float
) -> None:
    """By the peaks, of which a low-pass takes a part and to which skin adds one, a right mass was 2 kg too small."""
    markers = running.markers + (1.0 + skin) * running.up[:, None]
    whole = np.ones(len(markers), dtype=bool)
    found = closure(Needed(running.initial, running.time, markers), scale * running.wrench, whole)
    assert found is not None and not found.undeclared.any()
    assert found.load_ratio == pytest.approx(scale, abs=0.008)
    half_second = (running.time > running.time[0] + 5.0) & (running.time < running.time[0] + 5.5)
    less = scale * running.wrench - np.outer(half_second, [0.0, 0.4 * WEIGHT, 0.0, 0.0, 0.0, 0.0])
    found = closure(Needed(running.initial, running.time, markers), less, whole)
    assert found is not None and found.undeclared[half_second].mean() > 0.8


def test_a_flight_between_stances_off_the_plates_accuses_no_plate(running: SimpleNamespace) -> None:
    """Feet stand there by their markers from 0.03 s too late until 0.10 s too late, and what a low-pass leads into the
    frames between was "291 N less than the motion needs"."""
    beside = (running.stance >= 0.0) & np.isin(running.stance % 4.0, [2.0, 3.0])
    off = beside & np.append([False] * 3, beside[:-3])
    for later in range(1, 11):
        off |= np.append([False] * later, beside[:-later])
    wrench = np.where(beside[:, None], 0.0, running.wrench)
    markers = running.markers + running.up[:, None]
    found = closure(Needed(running.initial, running.time, markers), wrench, ~off)
    assert found is not None and not found.undeclared.any()
    assert found.load_ratio == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize("seed", [11, 12])
def test_a_seat_that_nothing_measures_is_noticed_and_leaves_no_moments(seed: int) -> None:
    recording = simulate("squat7", "sit-to-stand", seed, 12.0).recording
    seat = np.asarray(recording.plates[2].force[:, 1])
    assert recording.plates[2].name == "plate 3" and seat.max() > 0.25 * WEIGHT
    found = person("squat7").run(recording.with_plates(recording.plates[:2]))
    absent = sources(found, "knee") == ABSENT
    assert absent[seat > 0.2 * WEIGHT].all() and not absent[seat < 0.01 * WEIGHT][50:-50].mean() > 0.1
    assert np.array_equal(np.isnan(found.data["moments"].sel(coordinate="knee").values), absent)
    assert np.isnan(found.data["wrench_measured"].values[absent]).all()
    said = [text for text in map(str, found.messages) if "no plate measures" in text]
    assert len(said) == 1 and "less upwards" in said[0]


@pytest.mark.parametrize("bears", [False, True])
def test_what_a_plate_reads_beside_the_feet_is_its_zero_unless_the_weight_asks_for_it(bears: bool) -> None:
    """A hand's plate that bears 6.5 % of the weight, and a plate of which nobody knew that it reads so much."""
    recording = simulate("fullbody", "squat", 11, 12.0).recording
    beside, n = 0.065 * WEIGHT, recording.n_frames
    force = np.tile([0.0, beside, 0.0], (n, 1))
    floor = Surface(np.zeros(3), np.array([0.0, 1.0, 0.0]))
    moment = np.cross([3.0, 0.0, 3.0], force)
    rail = plate_from_wrench("rail", force, moment, floor, corners=None, threshold_n=10.0, zero_unloaded=False)
    others = with_loads(recording, np.full(n, 1.0 - beside / WEIGHT if bears else 1.0)).plates
    said = [str(text) for text in ground_of(recording.with_plates((*others, rail)), person("fullbody")).notes]
    assert any("rail reads" in text and "taken off" in text for text in said) != bears


@pytest.fixture(scope="module")
def blind() -> Estimate:
    """A walk without plates."""
    walk = simulate("fullbody", "gait", 3, 4.0, 50.0).recording
    return person("fullbody").run(walk.with_plates(()), lag_s=0.0)


def test_without_plates_one_foot_that_may_stand_is_derived_and_two_are_a_prior(blind: Estimate) -> None:
    contact = blind.data["foot_contact"].transpose("time", "foot").values
    assert set(np.unique(contact)) == {NO_CONTACT, UNMEASURED}
    standing = contact == UNMEASURED
    expected = np.where(standing, np.where(standing.all(axis=1), PRIOR, DERIVED)[:, None], MEASURED)
    assert set(np.unique(expected)) == {MEASURED, DERIVED, PRIOR}
    np.testing.assert_array_equal(foot_sources(blind.data), expected)
    for k, side in enumerate("rl"):
        for joint in ("hip_flexion", "knee_angle", "ankle_angle"):
            np.testing.assert_array_equal(sources(blind, f"{joint}_{side}"), expected[:, k])
            deviation = blind.data["moments_sd"].sel(coordinate=f"{joint}_{side}").values
            assert (deviation > 0.0).all() and np.isfinite(deviation).all()
        ankle = blind.data["moments_sd"].sel(coordinate=f"ankle_angle_{side}").values
        assert np.median(ankle[standing[:, k]]) > 5.0 * np.median(ankle[~standing[:, k]])
        assert (sources(blind, f"elbow_flex_{side}") == MEASURED).all()
    assert np.isfinite(blind.data["moments"].values).all() and np.isfinite(blind.data["joint_loads"].values).all()


def test_a_prior_is_in_every_file_with_its_flag_and_in_no_figure_as_measured(blind: Estimate, tmp_path: Path) -> None:
    result = dynakin.Result(blind)
    folder = result.save(tmp_path / "out")
    tables = {path.name: read_table(path) for path in folder.glob("*.sto")}
    codes = tables["moments_source.sto"]
    leg = [str(name).startswith(("hip_", "knee_", "ankle_")) for name in codes.names]
    assert (codes.values[:, leg] == PRIOR).any(axis=0).all() and not (codes.values == ABSENT).any()
    for name in ("moments.sto", "powers.sto", "joint_reactions.sto", "feet.sto", "uncertainty.sto"):
        assert np.isfinite(tables[name].values).all(), name
    assert (tables["feet_source.sto"].values == PRIOR).any(axis=0).all()
    assert (tables["joint_reactions_source.sto"].values == PRIOR).any()
    force = tables["uncertainty.sto"].values[:, list(tables["uncertainty.sto"].names).index("ground_force_r_vy")]
    aloft = foot_sources(blind.data)[:, 0] == MEASURED
    assert not force[aloft].any() and (force[~aloft] > 10.0).all()
    metrics = result.metrics()
    assert metrics["moments"]["legs"]["right"]["prior"] > 0 and metrics["feet"]["prior_frames"] > 0
    assert "estimated with a prior in" in metrics["moments"]["verdict"]
    for block in ("peak_moments_per_kg", "work"):
        assert not any(name.startswith(("hip_", "knee_", "ankle_")) for name in metrics[block])
    assert set(metrics["asymmetry"]["feet"].values()) == {None}
    with (folder / "repetitions.csv").open() as file:
        rows = [row["quantity"] for row in csv.DictReader(file) if int(row["n"])]
    assert "knee_angle_r" in rows and not any(name.endswith("/moment") and name.startswith("knee") for name in rows)
    page = (folder / "report.html").read_text()
    assert "prior: load sharing assumed" in page and "A dotted arrow, and a moment with ≈?" in page


def test_a_walk_whose_file_has_a_wrong_rate_has_no_derived_forces() -> None:
    """Everything then happens faster than it did: feet push with four times the weight, and pull."""
    walk = simulate("fullbody", "gait", 3, 4.0, 50.0).recording
    fast = replace(walk.with_plates(()), time=walk.time / 2.5)
    found = person("fullbody").run(fast, lag_s=0.0)
    derived = found.data["foot_contact"].transpose("time", "foot").values == UNMEASURED
    assert (foot_sources(found.data)[derived] == ABSENT).all()
    assert (sources(found, "knee_angle_r")[derived[:, 0]] == ABSENT).all()
    assert np.isnan(found.data["moments"].sel(coordinate="knee_angle_r").values[derived[:, 0]]).all()
    assert np.isnan(found.data["wrench_estimated"].values[derived.any(axis=1)]).all()
    (said,) = [text for text in map(str, found.messages) if "no ground gives" in text]
    reasons = compute_metrics(found)["moments"]["reasons"]
    assert said.startswith("Warning: ") and any("ground gives" in text for text in reasons)
    findings = {one.title: one for one in insights(found, compute_metrics(found)) if one.level == "warning"}
    assert "ground gives" in findings["Recording"].text


@pytest.mark.parametrize(
    ("push", "flies", "expected"), [(1.6, False, False), (4.0, False, True), (4.0, True, False), (6.5, True, True)]
)
def test_a_foot_takes_no_more_than_people_do_and_a_landing_more_than_a_walk(
    push: float, flies: bool, expected: bool
) -> None:
    time, wrench = np.arange(200) / 100.0, np.zeros((200, 2, 6))
    contact = np.full((200, 2), UNMEASURED, dtype=np.uint8)
    wrench[:, :, 1], wrench[100, 0, 1] = 0.5 * WEIGHT, push * WEIGHT
    contact[70:80] = NO_CONTACT if flies else UNMEASURED
    feet: Any = SimpleNamespace(contact=contact, segments=("foot_r", "foot_l"))
    found = impossible(feet, wrench, time, WEIGHT, ("foot_r", "foot_l"))
    assert found.tolist() == [expected and 95 <= k <= 105 for k in range(200)]
    wrench[100, 0, 1] = -0.4 * WEIGHT  # the ground pulls nobody
    assert impossible(feet, wrench, time, WEIGHT, ("foot_r", "foot_l")).sum() == 11
    contact[:, 0] = ON_PLATE  # a plate may measure what it measures
    assert not impossible(feet, wrench, time, WEIGHT, ("foot_r", "foot_l")).any()


def test_plates_that_carry_nobody_are_as_none_and_warned_of() -> None:
    walk = simulate("fullbody", "gait", 3, 4.0, 50.0).recording
    idle = [replace(p, force=0.0 * p.force, moment=0.0 * p.moment, cop=np.nan * p.cop) for p in walk.plates]
    found, none = (ground_of(walk.with_plates(plates), person("fullbody")) for plates in (tuple(idle), ()))
    assert found.loads is not None and none.loads is not None and not found.usable
    assert [each.name for each in found.loads.plates] == [each.name for each in idle]
    np.testing.assert_array_equal(found.loads.reason, none.loads.reason)
    assert str(found.notes[0]).startswith("Warning: the plates carry nobody") and found.notes[1:] == none.notes


def test_a_walk_whose_plates_have_no_numbers_while_they_are_empty_is_measured() -> None:
    walk = simulate("fullbody", "gait", 3, 4.0, 50.0).recording
    gaps = [(plate.force[:, 1] < 20.0)[:, None] for plate in walk.plates]
    blank = tuple(
        replace(p, force=np.where(gap, np.nan, p.force), moment=np.where(gap, np.nan, p.moment))
        for p, gap in zip(walk.plates, gaps, strict=True)
    )
    found, full = (ground_of(walk.with_plates(plates), person("fullbody")) for plates in (blank, walk.plates))
    assert found.loads is not None and full.loads is not None and found.usable
    both = found.loads.total_known, full.loads.total_known  # less where a foot sets down or leaves below 20 N
    assert np.count_nonzero(both[0]) > 0.8 * np.count_nonzero(both[1]) and not (both[0] & ~both[1]).any()
    assert any("taken as empty there" in text for text in map(str, found.notes))


def test_a_walk_beside_plates_that_carry_nobody_runs_from_file_to_result() -> None:
    """What indexes the assignment by the recording's plates finds them there, with nobody on any."""
    walk = simulate("fullbody", "gait", 3, 4.0, 50.0).recording
    idle = tuple(replace(p, force=0.0 * p.force + 3.0, moment=0.0 * p.moment, cop=np.nan * p.cop) for p in walk.plates)
    estimator = person("fullbody")
    ready = estimator.prepare(walk.with_plates(idle))
    assert dict(assumed(ready, Settings()))["Plates"] == "3: no foot stands on any."
    found = estimator.run(walk.with_plates(idle))
    assert (wrench_sources(found.data) != MEASURED).all()
    assert any("carry nobody" in text for text in map(str, found.messages))


def test_two_feet_on_one_plate_are_a_prior_and_their_sum_is_measured() -> None:
    squat = simulate("fullbody", "squat", 4, 6.0, 50.0).recording
    right, left = squat.plates
    force, moment = right.force + left.force, right.moment + left.moment
    cop = (right.cop * right.force[:, [1]] + left.cop * left.force[:, [1]]) / force[:, [1]]
    free = moment - np.cross(cop, force)
    found = person("fullbody").run(squat.with_plates((Plate("one", force, moment, cop, free, None),)), lag_s=0.0)
    assert (found.data["foot_contact"].values == SHARED_PLATE).all()
    assert (foot_sources(found.data) == PRIOR).all() and not wrench_sources(found.data).any()
    for joint in ("hip_flexion", "knee_angle", "ankle_angle"):
        assert (sources(found, f"{joint}_r") == PRIOR).all() and (sources(found, f"{joint}_l") == PRIOR).all()
    assert (sources(found, "elbow_flex_r") == MEASURED).all()
    total = found.data["foot_wrench"].sel(component="fy").sum("foot").values
    assert np.sqrt(np.mean((total - force[:, 1]) ** 2)) < 0.03 * WEIGHT
    sd = found.data["foot_wrench_sd"].sel(component="fy").values
    assert (sd > 0.02 * WEIGHT).all()  # of the parts
    figures = compute_metrics(found)
    assert figures["feet"]["prior_frames"] > 0 and "a prior" in figures["feet"]["verdict"]
    assert not any(name.startswith(("hip_", "knee_", "ankle_")) for name in figures["peak_moments_per_kg"])


def test_a_box_that_nothing_measures_is_no_flight() -> None:
    """Someone who stands while the plates read nothing stands on something."""
    recording = simulate("fullbody", "squat", 4, 6.0, 50.0).recording
    off = recording.time < 2.0
    found = person("fullbody").run(with_loads(recording, np.where(off, 0.0, 1.0)), lag_s=0.0)
    contact = found.data["foot_contact"].transpose("time", "foot").values
    early, late = recording.time < 1.9, recording.time > 2.4
    assert (contact[early] == UNMEASURED).all() and (contact[late] == ON_PLATE).all()
    assert (foot_sources(found.data)[early] == ABSENT).all() and np.isnan(found.data["foot_wrench"].values[early]).all()
    assert (sources(found, "knee_angle_r")[early] == ABSENT).all()
    assert np.isnan(found.data["moments"].sel(coordinate="knee_angle_r").values[early]).all()
    assert (sources(found, "elbow_flex_r")[early] == ABSENT).all()  # it may be a rail as well
    assert (sources(found, "knee_angle_r")[late] == 0).all()


def test_half_of_a_foots_load_that_is_missing_is_said_of_that_foot() -> None:
    recording = simulate("fullbody", "squat", 4, 6.0, 50.0).recording
    part = np.where((recording.time > 2.0) & (recording.time < 4.0), 0.4, 1.0)[:, None]
    one, *others = recording.plates
    recording = recording.with_plates((replace(one, force=part * one.force, moment=part * one.moment), *others))
    found = ground_of(recording, person("fullbody"))
    inside = (recording.time > 2.2) & (recording.time < 3.8)
    assert found.loads is not None and found.undeclared[inside].all()
    assert np.isnan(found.loads.wrench[inside]).all(axis=2).any(axis=1).all()


def test_a_belt_moves_the_feet_and_they_keep_their_plates() -> None:
    """A walk as a treadmill shows it: the person stays, the floor moves; no foot ever stands still."""
    walk = simulate("fullbody", "gait", 5, 4.0, 100.0).recording
    still, belt = ground_of(walk, person("fullbody")), ground_of(on_a_belt(walk), person("fullbody"))
    assert still.loads is not None and belt.loads is not None
    known = still.loads.total_known & belt.loads.total_known
    assert known.sum() > 0.5 * still.loads.total_known.sum()
    np.testing.assert_allclose(belt.loads.wrench[known][..., 1], still.loads.wrench[known][..., 1], atol=25.0)
    assert (belt.loads.wrench[known][..., 1] > 300.0).any(axis=0).all()


def on_a_belt(walk: Recording) -> Recording:
    hips = walk.markers[:, [walk.marker_names.index(name) for name in ("r.ASIS", "L.ASIS")]].mean(axis=1)
    speed = (hips[-1] - hips[0]) / (walk.time[-1] - walk.time[0]) * [1.0, 0.0, 1.0]
    shift = -(walk.time - walk.time[0])[:, None] * speed
    plates = tuple(
        Plate(p.name, p.force, p.moment + np.cross(shift, p.force), p.cop + shift, p.free_moment, None)
        for p in walk.plates
    )
    return replace(walk, markers=walk.markers + shift[:, None], plates=plates)


@pytest.mark.parametrize("lag_s", [0.0, pytest.param(np.inf, marks=pytest.mark.nightly)])
def test_a_foot_beside_the_plates_alone_is_derived(lag_s: float) -> None:
    walk = simulate("fullbody", "gait", 3, 4.0, 50.0).recording
    found = person("fullbody").run(walk.with_plates(walk.plates[1:]), lag_s=lag_s)
    codes = sources(found, "ankle_angle_r"), sources(found, "ankle_angle_l")
    assert any((code == DERIVED).any() for code in codes)
    moments = found.data["moments"].sel(coordinate=["ankle_angle_r", "ankle_angle_l"]).values
    assert np.array_equal(np.isnan(moments), np.stack(codes, axis=1) == ABSENT)


class TestRealRecordings:
    """Recordings that 0.1 saved with exit code 0 and leg moments that lack the ground."""

    def test_a_chair_that_no_plate_measures(self, data_dir: Path) -> None:
        folder = data_dir / "opencap_subject4"
        recording = dynakin.read(folder / "STS1.trc", folder / "STS1_grf.mot").window(0.0, 5.2)
        model = load_model("fullbody", Subject(mass_kg=60.05, height_m=1.7), markers="opencap")
        found = Estimator(model).run(recording, lag_s=0.0)
        time = found.time
        seated = (time < 0.8) | ((time > 2.6) & (time < 3.5))
        alone = ((time > 1.07) & (time < 2.26)) | ((time > 3.74) & (time < 4.89))
        for side in "rl":
            assert (sources(found, f"hip_flexion_{side}")[seated] == ABSENT).all()
            assert (sources(found, f"hip_flexion_{side}")[alone] == 0).all()
            assert (sources(found, f"ankle_angle_{side}")[alone] == 0).all()
        pressed = np.min([p.force[:, 1] for p in recording.plates[:2]], axis=0) > 25.0  # seated too
        assert (pressed & seated).sum() > 40 and (sources(found, "ankle_angle_r")[pressed] == 0).all()
        assert any("m or more from the feet" in text for text in map(str, found.messages))

    def test_a_drop_from_a_box(self, data_dir: Path) -> None:
        folder = data_dir / "opencap_subject4"
        recording = dynakin.read(folder / "DJ1.trc", folder / "DJ1_grf.mot")
        model = load_model("fullbody", Subject(mass_kg=60.05, height_m=1.7), markers="opencap")
        ground = ground_of(recording, Estimator(model))
        on_the_box, flight = recording.time < 0.9, (recording.time > 2.2) & (recording.time < 2.5)
        assert ground.loads is not None
        assert np.isnan(ground.loads.wrench[on_the_box]).all()
        assert not ground.undeclared[flight].any() and (ground.loads.reason[flight] == 0).all()

    @pytest.mark.nightly
    def test_a_run_on_a_treadmill_finds_its_plates_and_keeps_its_clock(self, data_dir: Path) -> None:
        """A delay of the plates grew to 958 ms; ankles 4676 N m."""
        folder = data_dir / "rajagopal"
        recording = dynakin.read(folder / "motion_capture_run.trc", folder / "grf_run.mot").window(0.2, 2.5)
        model = load_model(str(folder / "subject_scaled_run.osim"), Subject(mass_kg=72.84, height_m=1.8))
        found = Estimator(model).run(recording, lag_s=np.inf)
        names, reference = storage(folder / "run_id.sto")
        inner = (found.time > 0.5) & (found.time < 2.2)
        sources = found.data["moment_source"]
        toes = [name for name in sources.coordinate.values if "mtp" in str(name)]  # nobody measures what is under them
        assert (sources.drop_sel(coordinate=toes).values[inner] == 0).all()
        for side in "rl":
            for joint, least in (("ankle_angle", 0.95), ("knee_angle", 0.95), ("hip_flexion", 0.9)):
                column = reference[:, names.index(f"{joint}_{side}_moment")]
                wanted = np.interp(found.time, reference[:, 0], column)[inner]
                ours = found.data["moments"].sel(coordinate=f"{joint}_{side}").values[inner]
                assert np.corrcoef(ours, wanted)[0, 1] > least

    def test_the_oldest_example_of_opensim(self, data_dir: Path) -> None:
        """Times rounded to 0.1 ms, a treadmill, markers with names of its own: 718 N were left at the pelvis."""
        folder = data_dir / "gait2354"
        recording = dynakin.read(folder / "subject01_walk1.trc", folder / "subject01_walk1_grf.mot")
        model = load_model(str(folder / "subject01_simbody.osim"), Subject(mass_kg=72.6, height_m=1.8))
        found = Estimator(model).run(recording)
        sources = found.data["moment_source"]
        toes = [name for name in sources.coordinate.values if "mtp" in str(name)]
        assert (sources.drop_sel(coordinate=toes).values == 0).all()
        assert (sources.sel(coordinate=toes).values == ABSENT).any()  # nobody measures what lies under the toes
        names, reference = storage(folder / "inverse_dynamics.sto")
        inner = (found.time > 0.4) & (found.time < 1.6)
        for side in "rl":
            wanted = np.interp(found.time, reference[:, 0], reference[:, names.index(f"ankle_angle_{side}_moment")])
            ours = found.data["moments"].sel(coordinate=f"ankle_angle_{side}").values
            assert np.corrcoef(ours[inner], wanted[inner])[0, 1] > 0.98


def storage(path: Path) -> tuple[list[str], np.ndarray]:
    lines = path.read_text().splitlines()
    head = next(k for k, line in enumerate(lines) if line.strip().casefold() == "endheader")
    return lines[head + 1].split(), np.array([line.split() for line in lines[head + 2 :] if line.strip()], dtype=float)


def test_plates_of_twice_the_scale_give_no_moments() -> None:
    """Given a walk whose plates read double, then the scale is said and no foot that stands is measured."""
    whole = simulate("fullbody", "gait", 5, 4.0, 50.0).recording
    doubled = [
        replace(plate, force=2.0 * plate.force, moment=2.0 * plate.moment, free_moment=2.0 * plate.free_moment)
        for plate in whole.plates
    ]
    found = ground_of(whole.with_plates(tuple(doubled)), person("fullbody"))
    assert any(
        "times what the motion needs" in text and "their scale or the mass" in text for text in map(str, found.reasons)
    )
    assert found.loads is not None
    assert not found.loads.total_known.any()
    assert not np.isin(found.loads.reason, [FOOT_MEASURED, FOOT_SHARED]).any() and found.undeclared.all()
    right = ground_of(whole, person("fullbody"))
    assert not any("their scale" in text for text in map(str, right.reasons))


def vertical_alone(plate: Plate) -> Plate:
    """What a plate that measures the vertical force and where it presses says, the laboratory's y up."""
    force = plate.force * [0.0, 1.0, 0.0]
    moment = np.cross(np.nan_to_num(plate.cop), force)
    return replace(plate, force=force, moment=moment, free_moment=np.zeros_like(force))


def test_of_plates_that_measure_the_vertical_force_alone_no_leg_is_measured() -> None:
    """The deviations of what is derived instead hold what plates say that measure all of it."""
    recording = simulate("fullbody", "gait", 5, 4.0, 50.0).recording
    estimator = person("fullbody")
    whole = estimator.run(recording)
    found = estimator.run(recording.with_plates(tuple(vertical_alone(plate) for plate in recording.plates)))
    assert [m.level for m in found.messages if m.topic == "vertical only"] == ["warning"]
    assert any(i.title == "Plates' horizontal forces" for i in insights(found, compute_metrics(found)))
    assert not any(m.topic == "vertical only" for m in whole.messages)
    assert np.isnan(found.data["wrench_measured"].values).all()
    for k, side in enumerate("rl"):
        on = whole.data["foot_contact"].values[:, k] == ON_PLATE
        assert on.sum() > 20 and np.isnan(found.data["foot_wrench_measured"].values[on, k]).all()
        push, measured = (each.data["foot_wrench"].values[on, k, 1] for each in (found, whole))
        assert np.sqrt(np.mean((push - measured) ** 2)) < 0.03 * WEIGHT  # of which they are of use
        for joint in ("hip_flexion", "knee_angle", "ankle_angle"):
            name = f"{joint}_{side}"
            assert (sources(whole, name)[on] == MEASURED).all() and (sources(found, name)[on] != MEASURED).all()
            moment, sd, reference = (
                each.sel(coordinate=name).values[on]
                for each in (found.data["moments"], found.data["moments_sd"], whole.data["moments"])
            )
            assert np.mean(np.abs(moment - reference) < 1.96 * sd) > 0.9


def test_a_model_that_takes_all_of_the_force_refuses_the_vertical_one_alone() -> None:
    recording = simulate("sagittal7", "squat", 11, 12.0).recording
    plates = tuple(vertical_alone(plate) for plate in recording.plates)
    with pytest.raises(RecordingError, match="measure the vertical force only"):
        ground_of(recording.with_plates(plates), person("sagittal7"))


def test_a_pause_in_the_times_is_no_seat() -> None:
    whole = simulate("fullbody", "squat", 4, 8.0, 50.0).recording
    later = replace(whole, time=np.where(whole.time < 4.0, whole.time, whole.time + 30.0))
    assert not ground_of(later, person("fullbody")).undeclared.any()


def test_hidden_pelvis_markers_hide_no_seat() -> None:
    recording = simulate("squat7", "sit-to-stand", 11, 12.0).recording
    seat = np.asarray(recording.plates[2].force[:, 1])
    seated = seat > 0.25 * WEIGHT
    markers = recording.markers.copy()
    hidden = [k for k, name in enumerate(recording.marker_names) if "ASI" in name]
    assert hidden and seated.sum() > 100
    markers[np.ix_(seated, hidden)] = np.nan
    blind = replace(recording, markers=markers).with_plates(recording.plates[:2])
    assert ground_of(blind, person("squat7")).undeclared[seated].mean() > 0.95


def test_a_foot_on_a_pedal_is_not_in_the_air() -> None:
    """It goes round 17 cm, fast, and never stands still: whatever it presses on moves with it."""
    time = np.arange(600) / 100.0
    names, paths = [], []
    for side, z, phase in (("R", 0.1, 0.0), ("L", -0.1, np.pi)):
        turn = 2.0 * np.pi * 80.0 / 60.0 * time + phase
        for marker, x in (("HEE", -0.1), ("TOE", 0.1)):
            names.append(side + marker)
            paths.append(np.stack([x + 0.17 * np.cos(turn), 0.4 + 0.17 * np.sin(turn), np.full(600, z)], axis=1))
    ground = GroundFrame(np.eye(3), np.zeros(3), "+Y", np.array([1.0, 0.0, 0.0]))
    markers = {"right": ["RHEE", "RTOE"], "left": ["LHEE", "LTOE"]}
    loads = foot_loads(Recording("bicycle", None, time, tuple(names), np.stack(paths, axis=1), ()), ground, markers)
    assert (loads.reason == FOOT_UNKNOWN).all() and np.isnan(loads.wrench).all()


@pytest.mark.parametrize("frames", [1, 9, 30])
def test_a_recording_too_short_to_judge_is_weighed(frames: int) -> None:
    whole = simulate("fullbody", "squat", 4, 5.0, 100.0).recording
    short = with_loads(whole, np.full(whole.n_frames, 0.2)).window(2.0, 2.0 + (frames - 0.5) / 100.0)
    assert short.n_frames == frames
    ground = ground_of(short, person("fullbody"))
    assert ground.undeclared.all() and any("not used for the total" in text for text in map(str, ground.reasons))


def _known(data: xr.Dataset) -> ContactSources:
    """Of the model whose labels the dataset has; the ground acts on nothing, and all of it is marked."""
    segments = [str(name) for name in data["joint_segment"].values]
    moved = [segments.index(str(name)) for name in data["coordinate_segment"].values]
    return ContactSources(tree_of(data), moved, (), (), np.zeros(len(moved), dtype=bool), ())


def test_beside_something_undeclared_a_foot_off_its_plate_is_absent() -> None:
    """Alone it would follow from the motion; with a seat next to it nobody knows what each of them takes."""
    data = make_walker((2,)).data
    data = data.assign_coords(coordinate_segment=("coordinate", ["pelvis", "foot_r", "foot_l", *["upper_arm_r"] * 2]))
    feet: Any = SimpleNamespace(contact=data["foot_contact"].values, segments=("foot_r", "foot_l"))
    off = feet.contact[:, 1] == UNMEASURED
    undeclared = off & (data["time"].values > 2.0)
    found = with_sources(data, _known(data), feet, undeclared)
    expected = np.where(undeclared, ABSENT, np.where(off, DERIVED, MEASURED))
    assert 0 < undeclared.sum() < off.sum()
    np.testing.assert_array_equal(foot_sources(found)[:, 1], expected)
    np.testing.assert_array_equal(found["moment_source"].sel(coordinate="knee_angle_l"), expected)
    np.testing.assert_array_equal(found["joint_source"].sel(joint="foot_l"), expected)
    assert (found["joint_source"].sel(joint="shank_l").values[undeclared] == ABSENT).all()
    assert (found["joint_source"].sel(joint="torso").values[undeclared] == ABSENT).all()
    assert (foot_sources(found)[:, 0] == MEASURED).all()
    lacking = np.isnan(found["moments"].sel(coordinate="arm_flex_l").values)
    np.testing.assert_array_equal(lacking, undeclared)


def test_what_nobody_sees_for_longer_than_a_gap_is_absent() -> None:
    """A shank and what hangs on it; a foot that is missing while its shank is seen takes its ankle along only."""
    data = make_walker((2,)).data
    data = data.assign_coords(coordinate_segment=("coordinate", ["pelvis", "shank_r", "shank_l", *["upper_arm_r"] * 2]))
    time, segments = data["time"].values, [str(name) for name in data["joint_segment"].values]
    owners = ["pelvis", "shank_r", "shank_r", "foot_r", "shank_l", "foot_l", "foot_l", "upper_arm_r"]
    seen = np.ones((len(time), len(owners)), dtype=bool)
    long, short = (time > 1.0) & (time < 1.5), (time > 2.0) & (time < 2.1)
    seen[long | short, 1:4] = False
    hidden = out_of_sight(seen, owners, time)
    np.testing.assert_array_equal(hidden["shank_r"], long)
    feet: Any = SimpleNamespace(contact=np.zeros_like(data["foot_contact"].values), segments=("foot_r", "foot_l"))
    found = with_sources(data, _known(data), feet, np.zeros(len(time), dtype=bool), hidden)
    lacking = {segments[k] for k in np.flatnonzero((found["joint_source"].values == ABSENT)[long].all(axis=0))}
    assert lacking == {"shank_r", "foot_r"}
    own = data["coordinate_segment"].values == "shank_r"
    np.testing.assert_array_equal(np.isnan(found["moments"].values[:, own]).all(axis=1), long)
    np.testing.assert_array_equal(np.isnan(found["coordinates_sd"].values[:, own]).all(axis=1), long)
    assert np.isfinite(found["coordinates_sd"].values[:, ~own]).all()


@pytest.mark.parametrize("seen", [1, 2])
def test_a_foot_that_is_seen_once_at_the_start_may_stand_there(seen: int) -> None:
    """One frame has no speed, so that it seemed to swing: a moment that is measured as that of a foot in the air."""
    walk = simulate("fullbody", "gait", 3, 4.0, 50.0).recording
    whole = ground_of(walk, person("fullbody")).loads
    assert whole is not None
    stands = int(np.flatnonzero(whole.reason[0] != SWING)[0])
    side = "r" if whole.feet[stands] == "right" else "L"
    names = [f"{side}_{place}" for place in ("toe", "5meta", "calc", "ankle", "mankle")]
    markers = walk.markers.copy()
    markers[seen : seen + 6, [walk.marker_names.index(name) for name in names]] = np.nan
    found = ground_of(replace(walk, markers=markers), person("fullbody")).loads
    assert found is not None and (found.reason[: seen + 6, stands] != SWING).all()


@pytest.mark.parametrize("left", [0, 1, 2])
def test_a_pelvis_whose_markers_vanish_is_as_unsure_as_it_errs_or_absent(left: int) -> None:
    """Legs and trunk carry it, with their skin: its deviations took its own markers for seen. None, or one alone, shows
    it no more, though legs and trunk hang on it: tilt and hips of squats were 21 deg off, said 4.3."""
    trial = simulate("fullbody", "gait", 3, 4.0, 50.0)
    on_pelvis = ("r.PSIS", "L.PSIS", "HJC", "L.ASIS", "r.ASIS")
    hidden = [
        k for k, name in enumerate(trial.recording.marker_names) if any(part in name for part in on_pelvis[: 5 - left])
    ]
    markers, gap = trial.recording.markers.copy(), slice(90, 115)
    markers[gap, hidden] = np.nan
    found = person("fullbody").run(replace(trial.recording, markers=markers))
    names = ["pelvis_tilt", "pelvis_list", "pelvis_rotation", "hip_flexion_r", "lumbar_extension"]
    error = found.data["coordinates"].sel(coordinate=names) - trial.truth.data["coordinates"].sel(coordinate=names)
    sd = found.data["coordinates_sd"].sel(coordinate=names).values
    error = np.abs(error.values - np.median(error.values, axis=0))
    if left < 2:
        assert np.isnan(sd[gap]).all() and np.isfinite(np.delete(sd, np.arange(90, 115), axis=0)).all()
        joint = found.data["joint_source"].isel(time=gap)
        lacking = [str(name) for name in joint["joint_segment"].values[(joint.values == ABSENT).all(axis=0)]]
        assert lacking == ["pelvis", "thigh_r", "thigh_l", "torso"]
        assert np.isfinite(found.data["coordinates_sd"].sel(coordinate="knee_angle_r")).all()
        return
    assert (error[gap] < 2.0 * sd[gap]).mean() > 0.9 and (error[gap].max(axis=0) < 3.0 * sd[gap].max(axis=0)).all()
    seen = person("fullbody").run(trial.recording).data["coordinates_sd"].sel(coordinate=names).values
    assert (sd[gap] > seen[gap]).all()


def test_live_a_pelvis_counts_as_unseen_while_fewer_than_two_of_its_markers_are_seen() -> None:
    walk = simulate("fullbody", "gait", 3, 4.0, 50.0).recording
    calibrated = person("fullbody").calibrate(walk)
    spec, state = calibrated.spec, calibrated.x0
    sight, markers = LiveSight(_core.Model(spec)), np.zeros((len(spec.markers), 3))
    own = [k for k, marker in enumerate(spec.markers) if marker.segment == "pelvis"]
    assert sight.look(0.0, markers, state) == {}
    markers[own[2:]] = np.nan
    assert sight.look(1.0, markers, state) == {}
    markers[own[1:]] = np.nan
    assert sight.look(1.1, markers, state) == {}  # the second was seen at 1.0 s
    assert [name for name, gone in sight.look(1.4, markers, state).items() if gone] == ["pelvis"]


def test_a_thigh_is_shown_by_its_shank_an_upper_arm_not_by_two_markers_at_the_wrist() -> None:
    """An arm may turn about the line from shoulder to wrist: it was up to 115 deg off, said 5, and its own markers,
    once back, were refused."""
    trial = simulate("fullbody", "gait", 3, 4.0, 50.0)
    names, gap = list(trial.recording.marker_names), slice(90, 115)
    of = ("R_elbow", "R_humerus", "r_knee", "r_mknee", "r_thigh")
    lost = [k for k, name in enumerate(names) if name.startswith(of)]
    markers = trial.recording.markers.copy()
    markers[gap, lost] = np.nan
    estimator = person("fullbody")
    found = estimator.run(replace(trial.recording, markers=markers))
    arm, leg = ["arm_flex_r", "arm_add_r", "arm_rot_r", "elbow_flex_r", "pro_sup_r"], ["hip_rotation_r", "knee_angle_r"]
    unknown = np.isnan(found.data["coordinates_sd"].sel(coordinate=arm).values)
    assert unknown[gap].all() and not unknown[:90].any() and not unknown[118:].any()
    assert np.isnan(found.data["moments"].sel(coordinate=arm).values[gap]).all()
    assert np.isnan(found.data["markers_sd"].sel(marker=["R_elbow_lat", "R_elbow_med"]).values[gap]).all()
    assert np.isfinite(found.data["coordinates_sd"].sel(coordinate=leg).values).all()
    assert np.isfinite(found.data["markers_sd"].sel(marker="R_wrist_ulna").values).all()
    assert not [event for event in found.events if event.kind in ("gated", "reset")]
    model = estimator.calibrate(trial.recording)
    sight = LiveSight(_core.Model(model.spec))
    full, without = np.zeros((len(model.spec.markers), 3)), np.zeros((len(model.spec.markers), 3))
    owned = [k for k, marker in enumerate(model.spec.markers) if marker.segment in ("thigh_r", "upper_arm_r")]
    without[owned] = np.nan
    sight.look(0.0, full, model.x0)
    assert [name for name, gone in sight.look(1.0, without, model.x0).items() if gone] == []
    assert [name for name, gone in sight.look(1.3, without, model.x0).items() if gone] == ["upper_arm_r"]


def test_what_comes_into_sight_again_and_is_refused_stays_unknown_and_is_not_accused() -> None:
    seen, refused = np.ones((20, 2), dtype=bool), np.zeros((20, 2), dtype=bool)
    seen[3:8, 0], refused[8:12, 0], refused[5:9, 1] = False, True, True
    expected = seen.copy()
    expected[8:12, 0] = False
    np.testing.assert_array_equal(taken_back(seen, refused), expected)


def test_a_segment_that_never_has_a_marker_in_sight_is_no_gap() -> None:
    time = np.arange(100) / 100.0
    hidden = out_of_sight(np.zeros((100, 1), dtype=bool), ["shank_r"], time)
    assert not hidden["shank_r"].any()
