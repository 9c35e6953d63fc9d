"""What is not measured stays out of the figures, and says in every file what it is."""

from __future__ import annotations

import csv
import io
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from rich.console import Console

from dynakin.cli import summary
from dynakin.messages import note, warning
from dynakin.pipeline.result import Result
from dynakin.recordings.feet.contact import NO_CONTACT, ON_PLATE, SHARED_PLATE, UNMEASURED
from dynakin.recordings.formats.mot import read_table
from dynakin.report.insights import in_short, insights
from dynakin.results.estimate import Estimate
from dynakin.results.measures.mean_curves import curve_points, mean_curves, signals, write_curves
from dynakin.results.measures.metrics import compute_metrics
from dynakin.results.measures.repetitions import Repetition
from dynakin.results.measures.sources import (
    ABSENT,
    DERIVED,
    PRIOR,
    contact_sources,
    legs_of,
    measured_moments,
    moment_figures,
    moment_sources,
    refused_for_long,
)
from dynakin.results.measures.stances import counted, phases
from dynakin.results.measures.tracking import without_lost
from dynakin.results.records import REFUSED
from dynakin.units import GRAVITY_M_S2
from support.estimates.walking import MASS_KG, STANCE_S, make_walker

PEAK_N = 700.0
ALL = (0, 1, 2, 3)
"""Every stance of the left foot."""


def test_phases_are_whole_between_touch_down_and_toe_off() -> None:
    walker = make_walker((2,))
    found = phases(walker, "left", np.ones(301, dtype=bool))
    assert [(p.first, p.end, p.stance, p.whole, p.measured) for p in found] == [
        (0, 30, True, False, True),
        (30, 70, False, True, True),
        (70, 130, True, True, True),
        (130, 170, False, True, True),
        (170, 230, True, True, False),
        (230, 270, False, True, True),
        (270, 301, True, False, True),
    ]


def test_a_symmetric_walker_is_symmetric_where_both_feet_have_a_whole_measured_stance() -> None:
    found = compute_metrics(make_walker((2,)))["asymmetry"]
    assert found["stances"] == {"right": 3, "left": 1} and found["reason"] is None
    assert found["feet"] == pytest.approx({"peak_vertical_force": 0.0, "impulse": 0.0}, abs=1e-9)
    assert found["coordinates"]["knee_angle"] == pytest.approx(
        {"range": 0.0, "peak_moment": 0.0, "positive_work": 0.0, "negative_work": 0.0}, abs=0.5
    )


@pytest.mark.parametrize("code", [DERIVED, PRIOR, ABSENT])
def test_without_a_whole_measured_stance_of_one_foot_nothing_is_compared(code: int) -> None:
    """A plate is missing under the left foot: today's +100 % and more are of the plates, not of the person."""
    found = compute_metrics(make_walker((1, 2), code=code))["asymmetry"]
    assert found["feet"] == {"peak_vertical_force": None, "impulse": None}
    knee, arm = found["coordinates"]["knee_angle"], found["coordinates"]["arm_flex"]
    assert knee["peak_moment"] is knee["positive_work"] is knee["negative_work"] is None
    assert knee["range"] == pytest.approx(0.0, abs=0.5)
    assert arm["peak_moment"] is not None and arm["negative_work"] is not None
    assert "The left foot has no stance that is measured from touch-down to toe-off" in found["reason"]


@pytest.mark.parametrize("code", [DERIVED, PRIOR])
def test_peaks_and_work_are_of_whole_measured_stances_and_swings(code: int) -> None:
    metrics = compute_metrics(make_walker((2,), code=code))
    peaks, work = metrics["peak_moments_per_kg"], metrics["work"]
    assert peaks["knee_angle_l"]["largest"] == pytest.approx(
        0.1 * PEAK_N / MASS_KG, rel=0.01
    )  # in the other: 1.5 times
    assert peaks["knee_angle_r"]["frames"] == 301 and peaks["knee_angle_l"]["frames"] == 60 + 3 * 40
    assert work["knee_angle_l"]["frames"] == 180 and work["arm_flex_l"]["frames"] == 301
    assert work["knee_angle_l"]["positive_j"] == pytest.approx(work["knee_angle_r"]["positive_j"] / 3.0, rel=0.02)
    nothing = compute_metrics(make_walker(ALL, code=ABSENT))
    for found in (nothing["peak_moments_per_kg"], nothing["work"]):  # swings alone have no peak of a leg
        assert "knee_angle_l" not in found and {"knee_angle_r", "arm_flex_l"} <= set(found)


def test_standing_on_a_plate_that_fails_for_a_frame_has_no_peak() -> None:
    walker = make_walker()
    data = walker.data.copy(deep=True)
    data["foot_contact"][:] = 1
    data["foot_contact"][100, 1] = UNMEASURED
    data["moment_source"][100, 2] = data["foot_source"][100, 1] = DERIVED
    standing = replace(walker, data=data)
    assert counted(standing, np.ones(301, dtype=bool)).sum(axis=0).tolist() == [301, 301, 0, 301, 301]
    found = compute_metrics(standing)["asymmetry"]
    assert found["feet"]["impulse"] is None and found["stances"] is None
    assert "not measured in every frame" in found["reason"]


def test_what_a_contact_is_called_follows_from_plates_and_contacts_alone() -> None:
    contact = np.array(
        [
            [ON_PLATE, ON_PLATE],
            [ON_PLATE, UNMEASURED],
            [NO_CONTACT, UNMEASURED],
            [UNMEASURED, UNMEASURED],
            [SHARED_PLATE, SHARED_PLATE],
            [SHARED_PLATE, ON_PLATE],
            [ON_PLATE, UNMEASURED],
        ],
        dtype=np.uint8,
    )
    seat = np.array([0, 0, 0, 0, 0, 0, 1], dtype=bool)  # it may be what the foot stands on
    expected = [[0, 0], [0, DERIVED], [0, DERIVED], [PRIOR, PRIOR], [PRIOR, PRIOR], [PRIOR, 0], [0, ABSENT]]
    np.testing.assert_array_equal(contact_sources(contact, seat), expected)


def test_a_prior_of_the_feet_is_counted_and_said() -> None:
    feet = compute_metrics(make_walker((2,), code=PRIOR))["feet"]
    assert (feet["derived_frames"], feet["prior_frames"], feet["unknown_frames"]) == (0, 60, 0)
    assert "In 60 of 301 frames several contacts were not measured each on its own" in feet["verdict"]
    assert "absent" not in feet["verdict"]
    walker = make_walker()
    data = walker.data.copy(deep=True)
    data["foot_contact"][:], data["foot_source"][:] = SHARED_PLATE, PRIOR
    data["moment_source"][:, :3] = PRIOR
    shared = compute_metrics(replace(walker, data=data))
    assert "in the 295 of 301 frames in which every contact" in shared["feet"]["verdict"]  # their sum is measured
    assert shared["feet"]["adjustment_rms"] == {"right": None, "left": None}
    assert shared["asymmetry"]["feet"] == {"peak_vertical_force": None, "impulse": None}
    assert not {"knee_angle_r", "knee_angle_l"} & {*shared["peak_moments_per_kg"], *shared["work"]}


@pytest.mark.parametrize("window", [(0, 31), (0, 10), (25, 60), (60, 75), (100, 101)])
def test_a_foot_that_changes_once_in_the_window_or_never_has_no_stance_to_count(window: tuple[int, int]) -> None:
    walker = make_walker(ALL)  # the left knee is nowhere measured in a stance
    frames = np.zeros(301, dtype=bool)
    frames[slice(*window)] = True
    found, measured = counted(walker, frames), moment_sources(walker.data) == 0
    throughout = measured[frames].all(axis=0)
    np.testing.assert_array_equal(throughout, [False, True, False, True, True])
    assert (found[frames] == throughout).all() and not found[~frames].any()


def test_a_stance_that_the_window_cuts_off_does_not_count() -> None:
    """The knee is measured in it, and derived in the swing before: neither is whole in the window."""
    walker = make_walker()
    data = walker.data.copy(deep=True)
    data["moment_source"][60:70, 2] = DERIVED
    frames = np.zeros(301, dtype=bool)
    frames[60:80] = True
    assert not counted(replace(walker, data=data), frames)[:, 2].any()
    frames[60:160] = True  # from 70 to 130 it is whole
    np.testing.assert_array_equal(np.flatnonzero(counted(replace(walker, data=data), frames)[:, 2]), np.arange(70, 130))


def test_frames_are_counted_by_leg_and_said_with_the_reason() -> None:
    found = compute_metrics(make_walker((2,)))["moments"]
    assert found["legs"] == {
        "right": {"measured": 301, "derived": 0, "prior": 0, "absent": 0},
        "left": {"measured": 241, "derived": 60, "prior": 0, "absent": 0},
    }
    assert found["coordinates"]["arm_flex_l"]["measured"] == 301
    assert found["verdict"] == (
        "Leg moments: right measured in 301 of 301 frames; left measured in 241 and derived from the motion in 60."
    )
    assert found["reasons"] == [make_walker((2,)).messages[-1].text]
    prior = compute_metrics(make_walker((2,), code=PRIOR))["moments"]
    assert prior["legs"]["left"] == {"measured": 241, "derived": 0, "prior": 60, "absent": 0}
    assert prior["verdict"].endswith("left measured in 241 and estimated with a prior in 60.")
    every = moment_figures(with_legs(make_walker(), PRIOR))
    assert every["verdict"] == "Leg moments: estimated with a prior in all 301 frames."
    whole = compute_metrics(make_walker())["moments"]
    assert whole["verdict"] == "Leg moments: measured in all 301 frames." and whole["reasons"] == []


def with_legs(walker: Estimate, code: int) -> Estimate:
    """All moments of both legs come from there."""
    data = walker.data.copy(deep=True)
    data["moment_source"][:, 1:3] = code
    return replace(walker, data=data)


def test_legs_are_said_by_joint_where_these_differ() -> None:
    """Of a seated person with both feet on plates only the hips are absent, and 0.1 said that of all the legs."""
    walker = make_walker()
    renamed = {"knee_angle_r": "subtalar_angle_r", "knee_angle_l": "hip_flexion_l"}
    data = walker.data.copy(deep=True)
    data["moments"][:, 2] = np.nan
    data["moments"][:20, 1] = np.nan
    names = [renamed.get(name, name) for name in walker.coordinate_names]
    found = compute_metrics(replace(walker, data=data.assign_coords(coordinate=names)))["moments"]
    assert found["verdict"] == "Leg moments: right measured in 281 of 301 frames and absent in 20; left absent in 301."
    both = data.assign_coords(coordinate=names).sel(coordinate=[names[1], names[1], names[2]])
    both = both.assign_coords(
        coordinate=["ankle_angle_l", "subtalar_angle_l", "hip_flexion_l"],
        coordinate_segment=("coordinate", ["foot_l", "foot_l", "shank_l"]),
    )
    both["moments"][:30, 0] = np.nan  # the joint is not known where one of its coordinates is not
    found = moment_figures(replace(walker, data=both))
    assert found["verdict"] == (
        "Leg moments: left: ankle measured in 271 of 301 frames and absent in 30, hip absent in 301."
    )
    assert found["coordinates"]["subtalar_angle_l"]["measured"] == 281 and found["legs"]["left"]["absent"] == 301


def test_reasons_are_the_grounds_and_of_lost_frames_whatever_other_messages_say() -> None:
    """0.1 sought words: a column not used was a reason, plates that are NaN were none."""
    walker = make_walker((2,))
    other = "columns not used: emg_1."
    said = replace(walker, messages=[*walker.messages, note("recording", other)])
    assert other not in compute_metrics(said)["moments"]["reasons"]
    assert compute_metrics(replace(said, config={}))["moments"]["reasons"] == []
    plates = replace(said, config={"ground": {"reasons": ["the plates are silent from 1.70 to 2.30 s."]}})
    assert compute_metrics(plates)["moments"]["reasons"] == ["The plates are silent from 1.70 to 2.30 s."]
    held = plates.data.assign(tracking=("time", np.where(np.arange(301) < 10, 2, 0)))
    reasons = compute_metrics(without_lost(replace(plates, data=held)))["moments"]["reasons"]
    assert len(reasons) == 2 and reasons[1].startswith("The person was lost: 10 of 301 frames")


def test_legs_are_found_without_feet_too() -> None:
    data = make_walker().data
    assert legs_of(data) == ["", "right", "left", "", ""]
    assert legs_of(data.drop_dims("foot")) == ["", "right", "left", "", ""]


def test_what_has_no_codes_is_measured_and_what_is_nan_is_absent(estimate: Estimate) -> None:
    assert "moment_source" not in estimate.data and not moment_sources(estimate.data).any()
    assert compute_metrics(estimate)["moments"]["verdict"] == "Moments: measured in all 1201 frames."
    data = estimate.data.copy(deep=True)
    data["moments"][5, 2] = np.nan
    assert moment_sources(data)[5, 2] == ABSENT and moment_sources(data).sum() == ABSENT


@pytest.fixture(scope="module", params=[DERIVED, PRIOR, ABSENT], ids=["derived", "prior", "absent"])
def saved(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[Estimate, Path]:
    walker = make_walker((2,), code=request.param)
    return walker, Result(walker).save(tmp_path_factory.mktemp("walker") / "out")


def test_every_table_has_its_flags(saved: tuple[Estimate, Path]) -> None:
    walker, folder = saved
    code = walker.data["moment_source"].values.max()
    moments, sources = read_table(folder / "moments.sto"), read_table(folder / "moments_source.sto")
    assert list(moments.names) == list(sources.names)
    np.testing.assert_array_equal(sources.values, walker.data["moment_source"].values)
    np.testing.assert_array_equal(np.isnan(moments.values), sources.values == ABSENT)
    text = (folder / "moments_source.sto").read_text().split("endheader")[0]
    assert all(word in text for word in ("1 derived", "2 prior", "3 absent"))
    powers = read_table(folder / "powers.sto")
    np.testing.assert_array_equal(np.isnan(powers.values), sources.values == ABSENT)
    deviations = read_table(folder / "uncertainty.sto")
    knee = deviations.values[:, list(deviations.names).index("knee_angle_l_moment")]
    np.testing.assert_array_equal(np.isnan(knee), sources.values[:, 2] == ABSENT)
    joints, feet = read_table(folder / "joint_reactions_source.sto"), read_table(folder / "feet_source.sto")
    columns = dict(zip(joints.names, joints.values.T, strict=True))
    off_plate = slice(170, 230)
    assert (columns["shank_l_on_shank_l_in_ground"][off_plate] == code).all()
    assert not columns["shank_r_on_shank_r_in_ground"].any()
    assert list(feet.names) == ["ground_force_r", "ground_force_l"] and (feet.values[off_plate, 1] == code).all()
    force = read_table(folder / "feet.sto")
    lacking = np.isnan(force.values[:, [str(n).startswith("ground_force_l_") for n in force.names]]).all(axis=1)
    np.testing.assert_array_equal(lacking, feet.values[:, 1] == ABSENT)


def test_netcdf_flags_follow_cf(saved: tuple[Estimate, Path]) -> None:
    walker, folder = saved
    with xr.open_dataset(folder / "estimate.nc") as stored:
        for name in ("moment_source", "joint_source", "foot_source"):
            assert list(stored[name].attrs["flag_values"]) == [0, 1, 2, 3]
            assert stored[name].attrs["flag_meanings"] == "measured derived prior absent"
            np.testing.assert_array_equal(stored[name].values, walker.data[name].values)
        assert stored["foot_contact"].attrs["flag_meanings"] == "none plate unmeasured shared_plate"
        assert stored["moments"].attrs["ancillary_variables"] == "moment_source"
        assert stored["joint_loads"].attrs["ancillary_variables"] == "joint_source"
        assert stored["foot_wrench"].attrs["ancillary_variables"] == "foot_source"


def test_a_cycle_that_is_not_measured_throughout_is_left_out_of_the_mean(tmp_path: Path) -> None:
    walker = make_walker((2,))
    time, data = walker.time, walker.data
    cycles = [Repetition("gait", "left", a, a + 99, float(time[a]), float(time[a + 99])) for a in (70, 170)]
    own = signals(
        walker.coordinate_names,
        walker.is_rotation(),
        data["coordinates"].values,
        measured_moments(data),
    )
    curves = {c.quantity: c for c in mean_curves(time, cycles, {"EKF": own}, MASS_KG)}
    knee = curves["knee_angle_l/moment"]
    assert (knee.n == 1).all() and knee.of == 2 and knee.times == "1 of 2 repetitions"
    assert knee.mean.max() == pytest.approx(0.1 * PEAK_N, rel=0.01)
    assert (curves["knee_angle_l"].n == 2).all() and (curves["arm_flex_l/moment"].n == 2).all()
    write_curves(tmp_path / "r.csv", curve_points("walk", [knee]))
    with (tmp_path / "r.csv").open() as file:
        row = next(csv.DictReader(file))
    assert (row["n"], row["repetitions"]) == ("1", "2")


def test_impulse_is_the_stances() -> None:
    """Twice the load on the right: its index is that of the stances, whatever their number."""
    walker = make_walker((2,))
    data = walker.data.copy(deep=True)
    data["foot_wrench"].loc[{"foot": "right"}] *= 2.0
    found = compute_metrics(replace(walker, data=data))["asymmetry"]["feet"]
    assert found["impulse"] == pytest.approx(200.0 / 3.0, abs=0.01)
    assert found["peak_vertical_force"] == pytest.approx(200.0 / 3.0, abs=0.01)
    stance = data["foot_wrench"].values[20:80, 0, 1]
    assert np.trapezoid(stance, walker.time[20:80]) == pytest.approx(2.0 * PEAK_N * STANCE_S * 2.0 / np.pi, rel=0.01)


def test_nothing_left_at_the_root_is_said_by_the_numbers_only() -> None:
    walker = make_walker((2,))
    feet = compute_metrics(walker)["feet"]
    assert feet["verdict"].startswith("No residual is left at the root in the 235 of 301 frames in which every contact")
    data = walker.data.copy(deep=True)
    data["wrench_remainder"][50, 1] = 718.0
    data["wrench_remainder"][[0, -1], 1] = 900.0  # accelerations are a guess there
    contradicted = compute_metrics(replace(walker, data=data))["feet"]
    assert contradicted["left_at_root"]["grounded"]["force_n"] == pytest.approx(718.0)
    weight = GRAVITY_M_S2 * walker.mass_kg
    landing = walker.data.copy(deep=True)
    for at in (50, 55):  # a landing of three times the weight, and a moment of once the weight
        landing["wrench_remainder"][at, 1] = 0.3 * weight
    landing["foot_wrench"][50, :, :3] = 0.0
    landing["foot_wrench"][50, 0, 1] = 3.0 * weight
    landing["foot_wrench"][55, :, :3] = 0.0
    for share in (0.3, 0.1):
        left = compute_metrics(replace(walker, data=landing))["feet"]["left_at_root"]
        assert left["grounded"]["share"] == pytest.approx(share)
        landing["wrench_remainder"][55, 1] = 0.0
    assert "Nothing is left" not in contradicted["verdict"]
    assert "Up to 718 N and 0 N m of residual are left at the root" in contradicted["verdict"]
    seated = walker.data.copy(deep=True)  # both feet measured, and yet not all that bears the person
    seated["moment_source"][:100, 0] = ABSENT
    assert "in the 138 of 301 frames" in compute_metrics(replace(walker, data=seated))["feet"]["verdict"]
    data["foot_contact"][:] = 0  # both feet "in the air" for three seconds
    flying = compute_metrics(replace(walker, data=data))["feet"]["verdict"]
    assert (
        "No residual is left" not in flying
        and "of residual are left in flight (" in flying
        and "or a contact that is not measured" in flying
    )
    data["foot_contact"][:] = UNMEASURED
    unknown = compute_metrics(replace(walker, data=data))["feet"]
    assert unknown["left_at_root"] == {"grounded": None, "flight": None}
    assert "Nothing is left" not in unknown["verdict"]


def test_the_console_says_first_what_is_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    text = io.StringIO()
    monkeypatch.setattr(summary, "out", lambda: Console(file=text, width=200))
    summary.print_summary(Result(make_walker((2,))), Path("out"))
    first, second = text.getvalue().splitlines()[:2]
    assert first.startswith("Leg moments: right measured in 301 of 301 frames")
    assert "off the plates from 1.70 to 2.30 s" in second


def test_without_plates_nothing_is_said_to_be_measured() -> None:
    walker = make_walker()
    data = walker.data.copy(deep=True)
    data["moment_source"][24:] = DERIVED
    bare = replace(walker, data=data, recording=replace(walker.recording, plates=()))
    verdict = compute_metrics(bare)["moments"]["verdict"]
    assert "known (in the air) in 24 of 301 frames" in verdict and "measured" not in verdict


def test_a_note_that_stands_above_is_not_said_again(monkeypatch: pytest.MonkeyPatch) -> None:
    text, zero = io.StringIO(), note("zero", "plate 2 reads -7.86 N where nobody stands on it: it is taken off.")
    walker = replace(make_walker(), messages=[zero])
    monkeypatch.setattr(summary, "out", lambda: Console(file=text, width=1000))
    summary.print_summary(Result(walker), Path("out"), [zero])
    assert "plate 2 reads" not in text.getvalue()
    summary.print_summary(Result(walker), Path("out"))
    assert text.getvalue().count("plate 2 reads") == 1


def test_a_verdict_says_in_a_clause_what_it_found_where_the_sentences_stand_above(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """It said only what to do about it."""
    walker, text = make_walker((2,)), io.StringIO()
    lost = [
        warning("plates", f"plate {k} carries up to 266 N where no foot stands, from 0.34 to 0.37 s: it is left out.")
        for k in (2, 4)
    ]
    monkeypatch.setattr(summary, "out", lambda: Console(file=text, width=1000))
    known = {"ground": {"reasons": [message.text for message in lost]}}
    summary.print_summary(Result(replace(walker, messages=lost, config=walker.config | known)), Path("out"))
    clause = "Plate 2 carries up to 266 N where no foot stands, from 0.34 to 0.37 s, and 1 more (above)."
    assert f"  Force plates: {clause}" in text.getvalue().splitlines()
    assert text.getvalue().count("it is left out") == 2


def test_the_console_says_every_warning_once_under_the_verdict_and_the_mass_first(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    walker, text = make_walker(), io.StringIO()
    light = warning("weight", "the plates carry 70.0 kg on average where the person weighs 40.0 kg.")
    doubted = replace(walker, messages=[warning("recording", "something else."), light, note("recording", "A note.")])
    monkeypatch.setattr(summary, "out", lambda: Console(file=text, width=1000))
    summary.print_summary(Result(doubted), Path("out"))
    (verdict,) = (k for k, line in enumerate(text.getvalue().splitlines()) if line.startswith("Verdict:"))
    lines = text.getvalue().splitlines()[verdict + 1 :]
    assert lines[0] == f"  Mass: T{light.text[1:]}" and lines[1].startswith("  Mass, what to do: ")
    assert lines[2] == "  Recording: Something else." and lines[3].startswith("  Recording, what to do: ")
    assert text.getvalue().casefold().count("the plates carry") == 1
    data = walker.data.assign(moments=walker.data["moments"].where(walker.data["coordinate"] != "knee_angle_r"))
    text.seek(0)
    known = {"ground": {"reasons": [light.text]}}  # said first, as a reason, and then in a clause
    summary.print_summary(Result(replace(doubted, data=data, config=doubted.config | known)), Path("out"))
    clause = "  Mass: The plates carry 70.0 kg on average where the person weighs 40.0 kg (above)."
    assert text.getvalue()[: text.tell()].casefold().count("the plates carry") == 2
    assert clause in text.getvalue()[: text.tell()].splitlines()
    (first, *others) = insights(doubted, compute_metrics(doubted))
    assert (first.level, first.title) == ("warning", "Mass") and "70.0 kg" in first.text
    assert not any("70.0 kg" in insight.text for insight in others)
    assert in_short([first, *others]).split(": ")[1].startswith("mass")


def test_a_few_refused_frames_rest_on_the_plates_beside_them() -> None:
    """For 50 ms at most, and not where no others are beside them."""
    for first, end, stay in ((150, 154, False), (150, 156, True), (0, 2, True), (299, 301, True)):
        verdict = np.zeros((301, 2), dtype=np.uint8)
        verdict[first:end, -1] = REFUSED
        data = xr.Dataset(
            {"verdict": (("time", "sensor"), verdict), "foot_contact": (("time", "foot"), verdict)},
            coords={"time": 0.01 * np.arange(301)},
        )
        assert refused_for_long(data).any() == stay
        assert not refused_for_long(data)[verdict[:, -1] != REFUSED].any()
