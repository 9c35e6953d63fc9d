"""Squats and gait cycles found in movements whose repetitions are known, and on real trials beside their plates."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy

import dynakin
from dynakin.arrays import peaks
from dynakin.recordings.frame import find_ground_frame
from dynakin.results.estimate import Estimate
from dynakin.results.measures.repetitions import (
    BodyPaths,
    body_paths,
    feet_pass,
    find_repetitions,
    gait_cycles,
    initial_contacts,
    repetitions_of,
    squats,
)

TIME = np.arange(0.0, 20.0, 0.01)
STEP_S = 1.1


def height(starts: dict[float, float], standing: float = 0.9, length: float = 2.0) -> np.ndarray:
    """Height with a cosine dip of some depth (m) from each start (s) on."""
    found = np.full(len(TIME), standing)
    for start, depth in starts.items():
        inside = (start <= TIME) & (start + length >= TIME)
        found[inside] -= depth * 0.5 * (1.0 - np.cos(2.0 * np.pi * (TIME[inside] - start) / length))
    return found + 0.002 * np.sin(2.0 * np.pi * 0.7 * TIME)  # sway


def walking(time: np.ndarray) -> BodyPaths:
    """A pelvis at 1.2 m/s between feet that are foremost at 0.3 + k 1.1 s (right) and half a step later (left)."""
    pelvis = np.zeros((len(time), 3))
    pelvis[:, 0], pelvis[:, 1] = 1.2 * time, 0.95 + 0.02 * np.cos(4.0 * np.pi * time / STEP_S)
    heels = {}
    for side, phase in (("right", 0.3), ("left", 0.3 + 0.5 * STEP_S)):
        heels[side] = np.zeros((len(time), 3))
        heels[side][:, 0] = pelvis[:, 0] + 0.35 * np.cos(2.0 * np.pi * (time - phase) / STEP_S)
    return BodyPaths(time, pelvis, heels)


def test_each_squat_is_found_whole_deep_or_shallow() -> None:
    starts = {2.0: 0.35, 6.0: 0.12, 9.0: 0.3, 14.0: 0.2}
    found = squats(TIME, height(starts))
    assert len(found) == len(starts)
    for repetition, (start, depth) in zip(found, starts.items(), strict=True):
        assert (repetition.movement, repetition.side) == ("squat", "both")
        assert repetition.lowest_s == pytest.approx(start + 1.0, abs=0.1)
        assert start <= repetition.start_s < start + 0.6
        assert start + 1.4 < repetition.end_s <= start + 2.0
        assert repetition.depth_m == pytest.approx(depth, abs=0.02)
        assert repetition.lowest is not None and repetition.first < repetition.lowest < repetition.last
        assert TIME[repetition.first] == repetition.start_s


def test_a_squat_that_the_recording_cuts_is_left_out() -> None:
    cut = (TIME >= 2.8) & (TIME <= 10.8)  # begins near the bottom of the first, ends near that of the last
    found = squats(TIME[cut], height({2.0: 0.3, 6.0: 0.3, 10.0: 0.3})[cut])
    assert [round(r.lowest_s or 0.0) for r in found] == [7]


def test_standing_or_not_knowing_the_height_is_no_squat() -> None:
    assert squats(TIME, height({})) == []
    assert squats(TIME, np.full(len(TIME), np.nan)) == []
    lost = height({2.0: 0.3, 6.0: 0.3})
    lost[(TIME > 2.5) & (TIME < 3.6)] = np.nan  # too long a gap to be filled
    assert [round(r.lowest_s or 0.0) for r in squats(TIME, lost)] == [7]


def test_gait_cycles_go_from_each_foots_contact_to_its_next() -> None:
    time = TIME[TIME < 4.0]
    paths = walking(time)
    found = gait_cycles(paths)
    right = [r for r in found if r.side == "right"]
    assert [r.start_s for r in right] == pytest.approx([0.3, 1.4, 2.5], abs=0.011)
    assert all(r.end_s - r.start_s == pytest.approx(STEP_S, abs=0.011) for r in found)
    assert [r.start_s for r in found if r.side == "left"] == pytest.approx([0.85, 1.95], abs=0.011)
    assert [r.first for r in found] == sorted(r.first for r in found)


def test_a_foot_on_its_way_where_the_recording_begins_or_ends_makes_no_contact() -> None:
    ahead = 0.35 * np.cos(2.0 * np.pi * (TIME - 0.3) / STEP_S)
    inside = (TIME >= 0.3 - 1e-9) & (TIME <= 2.5 + 1e-9)  # begins and ends where the foot is foremost
    (contacts,) = initial_contacts(TIME[inside], ahead[inside])
    assert [TIME[inside][k] for k in contacts] == pytest.approx([1.4], abs=0.011)
    later = TIME >= 0.2  # the swing is cut, its contact is not
    assert TIME[later][initial_contacts(TIME[later], ahead[later])[0][0]] == pytest.approx(0.3, abs=0.021)


def test_no_gait_cycle_spans_a_gap() -> None:
    time = TIME[TIME < 6.0]
    paths = walking(time)
    paths.heels["right"][(time > 2.8) & (time < 3.2)] = np.nan
    right = [r.start_s for r in gait_cycles(paths) if r.side == "right"]
    assert right == pytest.approx([0.3, 1.4, 3.6, 4.7], abs=0.011)  # not the one from 2.5 to 3.6 s


def test_the_kind_of_movement_is_told_from_the_feet() -> None:
    paths = walking(TIME)
    assert feet_pass(paths) and find_repetitions(paths).movement == "gait"
    treadmill = replace(
        paths, pelvis=paths.pelvis * [0, 1, 1], heels={s: p - paths.pelvis * [1, 0, 0] for s, p in paths.heels.items()}
    )
    assert len(find_repetitions(treadmill).items) == len(find_repetitions(paths).items)
    together = replace(paths, heels={side: np.zeros((len(TIME), 3)) for side in paths.heels})
    assert find_repetitions(together).movement == "squat"


def test_repetitions_outside_the_window_do_not_count_and_the_note_says_what_was_found() -> None:
    pelvis = np.zeros((len(TIME), 3))
    pelvis[:, 1] = height({1.0: 0.3, 6.0: 0.3, 11.0: 0.3})
    paths = BodyPaths(TIME, pelvis, {})
    found = find_repetitions(paths, window=TIME > 2.0)
    assert [round(r.lowest_s or 0.0) for r in found.items] == [7, 12]
    assert found.note.startswith("2 squats after the adaptation: 6.")
    nothing = find_repetitions(BodyPaths(TIME, pelvis * np.nan, {}))
    assert nothing.items == () and nothing.note == "No squat was found: the recording has no pelvis markers."


def test_uneven_times_are_said_and_stop_nothing() -> None:
    time = np.delete(TIME, slice(100, 400))
    pelvis = np.ones((len(time), 3))
    found = find_repetitions(BodyPaths(time, pelvis, {}))
    assert found.items == () and "evenly spaced" in found.note


def test_an_estimates_repetitions_lie_after_its_adaptation(estimate: Estimate) -> None:
    found = repetitions_of(estimate).items  # squats of 3 s from 1.5 s on
    assert [r.lowest_s for r in found] == pytest.approx([6.0, 9.0], abs=0.1)


def test_squats1_has_five_squats(data_dir: Path) -> None:
    folder = data_dir / "opencap_subject4"
    recording = dynakin.read(folder / "squats1.trc")
    found = find_repetitions(body_paths(recording, find_ground_frame(recording)))
    assert found.movement == "squat" and len(found.items) == 5
    assert all(0.25 < (repetition.depth_m or 0.0) < 0.45 for repetition in found.items)


def test_contacts_of_a_real_walk_agree_with_the_plates(data_dir: Path) -> None:
    recording = dynakin.read(data_dir / "plugin_gait" / "GaitNormal_1.c3d")
    ground = find_ground_frame(recording)
    paths = body_paths(recording, ground)
    found = find_repetitions(paths)
    assert found.movement == "gait" and [r.side for r in found.items] == ["right", "left"]
    assert all(1.1 < r.end_s - r.start_s < 1.3 for r in found.items)
    contacts = [
        recording.time[k]
        for heel in paths.heels.values()
        for stretch in initial_contacts(paths.time, heel[:, 0] - paths.pelvis[:, 0])
        for k in stretch
    ]
    for plate in recording.plates:
        loaded = ground.vectors_to_ground(plate.force)[:, 1] > 20.0
        onset = recording.time[int(np.flatnonzero(loaded)[0])]
        assert min(abs(onset - contact) for contact in contacts) <= 0.06, plate.name


@pytest.mark.parametrize("digits", [0, 1, 8])  # flat tops; as high as others; all different
def test_peaks_are_scipys(digits: int) -> None:
    rng = np.random.default_rng(digits)
    for _ in range(100):
        path = np.round(np.cumsum(rng.normal(size=rng.integers(3, 200))), digits)
        expected, _ = scipy.signal.find_peaks(path, prominence=1.0)
        assert peaks(path, 1.0) == expected.tolist()
