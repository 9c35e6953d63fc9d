"""Plates that are a few milliseconds out of step, by the motion of the whole body."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import dynakin
from dynakin.filter.ground.delay import Delay, brought_into_step
from dynakin.filter.ground.fine_delay import MODEL_S, PRIOR_S, clock_delay
from dynakin.filter.ground.needed import Needed
from dynakin.filter.prepared import Prepared
from dynakin.filter.samples import marker_paths, total_wrench
from dynakin.messages import about
from dynakin.recordings.recording import Recording
from support.plates import estimated, person, prepared, trial


def delay_of(recording: Recording, ready: Prepared) -> Delay | None:
    markers, wrench = marker_paths(recording, ready.calibrated), total_wrench(recording, ready.calibrated)
    known = np.isfinite(ready.measured.wrench).all(axis=1, keepdims=True)
    return clock_delay(Needed(ready.calibrated, recording.time, markers), np.where(known, wrench, np.nan))


@pytest.mark.parametrize("moved_s", [-0.01, -0.004, 0.0, 0.006, 0.012])
def test_a_few_milliseconds_are_found_in_a_walk(moved_s: float) -> None:
    """Within its deviation, and drawn towards none by as much as that asks for."""
    ready = prepared("gait")
    found = delay_of(brought_into_step(trial("gait"), Delay(-moved_s, 0.0)), ready)
    assert found is not None and MODEL_S < found.sd_s < 0.0035
    assert found.delay_s == pytest.approx(moved_s * (1.0 - (found.sd_s / PRIOR_S) ** 2), abs=0.0015)


def test_who_stands_shows_no_delay() -> None:
    recording = trial("squat").window(0.0, 1.2)
    ready = person().prepare(recording)
    found = delay_of(brought_into_step(recording, Delay(-0.01, 0.0)), ready)
    assert found is not None and abs(found.delay_s) < 0.002 and found.sd_s > 0.8 * PRIOR_S


def test_nothing_is_said_where_forces_are_missing_or_frames_are_few() -> None:
    ready, recording = prepared("gait"), trial("gait")
    markers, wrench = marker_paths(recording, ready.calibrated), total_wrench(recording, ready.calibrated)
    held = replace(ready.calibrated, contacts={"seat": "pelvis"})
    assert clock_delay(Needed(held, recording.time, markers), wrench) is None
    assert clock_delay(Needed(ready.calibrated, recording.time, markers), np.full_like(wrench, np.nan)) is None
    seldom = slice(None, None, 5)
    assert clock_delay(Needed(ready.calibrated, recording.time[seldom], markers[seldom]), wrench[seldom]) is None


def test_frames_that_show_too_little_are_left_out_and_the_rest_is_asked() -> None:
    ready, recording = prepared("gait"), trial("gait")
    late = brought_into_step(recording, Delay(-0.01, 0.0))
    gaps = late.markers.copy()
    known = np.flatnonzero(np.isfinite(ready.measured.wrench).all(axis=1))
    gaps[known[len(known) // 8], 2:] = np.nan
    whole, with_gaps = delay_of(late, ready), delay_of(replace(late, markers=gaps), ready)
    assert whole is not None and with_gaps is not None
    assert with_gaps.delay_s == pytest.approx(whole.delay_s, abs=0.002)


def test_a_run_brings_plates_into_step_and_says_so_where_it_is_not_by_chance() -> None:
    """A frame late: moments are those of plates in step."""
    late = brought_into_step(trial("gait"), Delay(-0.01, 0.0))
    right, found = estimated("gait"), person().run(late)
    assert found.config["ground"]["plates_behind_s"] == pytest.approx(0.01, abs=0.002)
    assert right.config["ground"]["plates_behind_s"] == 0.0
    assert about(found.messages, "in step") and not about(right.messages, "in step")
    legs = [name for name in right.data["coordinate"].values if name.startswith(("hip_flexion", "knee", "ankle"))]
    a, b = (each.data["moments"].sel(coordinate=legs).values for each in (right, found))
    assert np.sqrt(np.nanmean((a - b) ** 2)) < 1.5
    assert "plates/delay" not in found.data["element"].values


def test_a_real_walk_is_found_to_be_moved_as_far_as_it_was(data_dir: Path) -> None:
    folder = data_dir / "opencap_subject4"
    walk = dynakin.read(folder / "walking1.trc", folder / "walking1_grf.mot")
    ready = person().prepare(walk)
    found = [delay_of(brought_into_step(walk, Delay(-moved, 0.0)), ready) for moved in (0.0, 0.008)]
    assert found[0] is not None and found[1] is not None
    assert found[1].delay_s - found[0].delay_s == pytest.approx(0.008, abs=0.0015)


def drifting(recording: Recording, drift: float) -> Recording:
    """Its plates' clock is faster by that part, and right in the middle."""
    return brought_into_step(recording, Delay(0.0, 0.0, -drift))


@pytest.mark.parametrize("drift", [0.03, -0.03])
def test_a_clock_that_is_faster_or_slower_is_found_and_plates_are_brought_into_step(drift: float) -> None:
    """Known to half a percent by the 1.2 s in which its three plates carry the person."""
    whole = trial("gait")
    before, ready = prepared("gait"), person().prepare(drifting(whole, drift))
    assert not about(before.messages, "rate")
    (said,) = about(ready.messages, "rate")
    assert said.level == "warning" and ("faster" if drift > 0.0 else "slower") in said.text
    assert float(said.text.split("clock is ")[1].split()[0]) == pytest.approx(100.0 * abs(drift), abs=0.4)
    assert abs(ready.ground.behind_s) < 0.006
    both = np.isfinite(ready.measured.wrench).all(axis=1) & np.isfinite(before.measured.wrench).all(axis=1)
    assert both.sum() > 0.8 * np.isfinite(before.measured.wrench).all(axis=1).sum()
    assert np.abs(ready.measured.wrench[both] - before.measured.wrench[both])[:, :3].mean() < 3.0


def with_a_clock_of_its_own(recording: Recording, which: int, late_s: float) -> Recording:
    """One plate later than the others; where it is not known by then it is as it was."""
    late = brought_into_step(recording, Delay(-late_s, 0.0)).plates[which]
    whole = recording.plates[which]
    pairs = {name: (getattr(late, name), getattr(whole, name)) for name in ("force", "moment", "cop", "free_moment")}
    own = replace(whole, **{name: np.where(np.isfinite(a), a, b) for name, (a, b) in pairs.items()})
    return recording.with_plates(tuple(own if k == which else plate for k, plate in enumerate(recording.plates)))


def test_one_plate_with_a_clock_of_its_own_is_named_and_brought_into_step() -> None:
    """20 ms late: the mean delay put the others out of step, or looked like a drift."""
    whole = trial("gait")
    before, late = prepared("gait"), with_a_clock_of_its_own(whole, 1, 0.02)
    ready = person().prepare(late)
    (said,) = about(ready.messages, "in step")
    assert said.level == "warning" and "plate 2 is" in said.text and said.text.count("the others") == 1
    assert float(said.text.split("plate 2 is ")[1].split()[0]) == pytest.approx(20.0, abs=3.0)
    assert not about(ready.messages, "rate") and abs(ready.ground.behind_s) < 0.004
    both = np.isfinite(ready.measured.wrench).all(axis=1) & np.isfinite(before.measured.wrench).all(axis=1)
    assert both.sum() > 0.8 * np.isfinite(before.measured.wrench).all(axis=1).sum()
    assert np.abs(ready.measured.wrench[both] - before.measured.wrench[both])[:, :3].mean() < 3.0


def test_a_real_plate_with_a_clock_of_its_own_is_named(data_dir: Path) -> None:
    folder = data_dir / "opencap_subject4"
    walk = dynakin.read(folder / "walking1.trc", folder / "walking1_grf.mot")
    (note,) = about(person().prepare(walk).messages, "in step")
    (said,) = about(person().prepare(with_a_clock_of_its_own(walk, 0, 0.02)).messages, "in step")
    assert note.level == "note" and said.level == "warning"
    assert "have not one clock" in said.text and "have not one clock" not in note.text


def test_a_real_squat_shows_a_clock_that_drifts_and_none_that_does_not(data_dir: Path) -> None:
    folder = data_dir / "opencap_subject4"
    squats = dynakin.read(folder / "squats1.trc", folder / "squats1_grf.mot")
    assert not about(person().prepare(squats).messages, "rate")
    (said,) = about(person().prepare(drifting(squats, 0.005)).messages, "rate")
    assert float(said.text.split("clock is ")[1].split()[0]) == pytest.approx(0.5, abs=0.15)


def test_no_drift_is_asked_for_where_a_load_that_moves_looks_like_one() -> None:
    ready, recording = prepared("gait"), drifting(trial("gait"), 0.03)
    markers, wrench = marker_paths(recording, ready.calibrated), total_wrench(recording, ready.calibrated)
    known = np.where(np.isfinite(ready.measured.wrench).all(axis=1, keepdims=True), wrench, np.nan)
    asked, not_asked = (
        clock_delay(Needed(ready.calibrated, recording.time, markers), known, drifts) for drifts in (True, False)
    )
    assert asked is not None and not_asked is not None and asked.drift > 0.02 and not_asked.drift == 0.0


def test_who_lands_shows_no_few_milliseconds() -> None:
    """Flesh follows later than bones."""
    ready, recording = prepared("gait"), trial("gait")
    markers, wrench = marker_paths(recording, ready.calibrated), total_wrench(recording, ready.calibrated)
    wrench = np.where(np.isfinite(ready.measured.wrench).all(axis=1, keepdims=True), wrench, np.nan)
    known = np.flatnonzero(np.isfinite(wrench[:, 1]))
    wrench[known[-1], 1] = 2.5 * 70.0 * 9.81
    assert clock_delay(Needed(ready.calibrated, recording.time, markers), wrench) is None


def test_short_gaps_hide_no_delay() -> None:
    """Three frames without markers, blank or not in the file at all."""
    ready, recording = prepared("gait"), brought_into_step(trial("gait"), Delay(-0.01, 0.0))
    whole = delay_of(recording, ready)
    assert whole is not None
    markers, wrench = marker_paths(recording, ready.calibrated), total_wrench(recording, ready.calibrated)
    wrench = np.where(np.isfinite(ready.measured.wrench).all(axis=1, keepdims=True), wrench, np.nan)
    gap = np.isin(np.arange(recording.n_frames) % 60, [40, 41, 42])
    blank = np.where(gap[:, None, None], np.nan, markers), np.where(gap[:, None], np.nan, wrench)
    found = clock_delay(Needed(ready.calibrated, recording.time, blank[0]), blank[1])
    lacking = clock_delay(Needed(ready.calibrated, recording.time[~gap], markers[~gap]), wrench[~gap])
    assert found is not None and lacking is not None
    assert found.delay_s == pytest.approx(whole.delay_s, abs=0.0005)
    assert lacking[:4] == pytest.approx(found[:4], abs=1e-6)
