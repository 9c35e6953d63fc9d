"""What live takes for no measurement, as frames come, against what a file's reader does with all of them."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import dynakin
from dynakin.recordings.formats.jumps import without_jumps
from dynakin.recordings.recording import Recording
from dynakin.simulation.trial import simulate
from dynakin.stream.markers import LiveMarkers
from dynakin.stream.session import Live
from dynakin.stream.sinks.base import Callback, LiveFrame
from dynakin.stream.sources.replay import Replay

Array = np.ndarray


@cache
def walk() -> Recording:
    return simulate("fullbody", "gait", 2).recording


def live(recording: Recording, markers: Array, frames: Array | None = None) -> tuple[Array, list[str]]:
    """What is left of the frames, or of those that come, as they come, and what is said."""
    watch = LiveMarkers(recording.marker_names, recording.rate)
    frames = np.arange(len(markers)) if frames is None else frames
    left = np.stack([watch.look(float(recording.time[k]), markers[k]) for k in frames])
    return left, [str(message) for message in watch.news()]


def faulty(name: str, begin_s: float = 1.0, end_s: float = 1.2) -> tuple[Array, np.ndarray, int]:
    """A walk's markers to be changed, the frames to change, and the marker's number."""
    recording = walk()
    frames = np.flatnonzero((recording.time >= begin_s) & (recording.time < end_s))
    return recording.markers.copy(), frames, recording.marker_names.index(name)


def test_of_a_good_walk_all_frames_are_what_came() -> None:
    recording = walk()
    watch = LiveMarkers(recording.marker_names, recording.rate)
    for time_s, frame in zip(recording.time, recording.markers, strict=True):
        assert watch.look(float(time_s), frame) is frame
    assert watch.news() == [] and watch.left_out == 0


@pytest.mark.parametrize("name", ["r_toe", "r_knee", "C7"])
def test_a_marker_that_jumps_is_missing_until_it_is_back_as_in_a_file(name: str) -> None:
    markers, frames, m = faulty(name)
    markers[frames, m] += [0.0, 0.03, 0.0]
    left, said = live(walk(), markers)
    offline, _ = without_jumps(walk().marker_names, markers, walk().time, walk().rate)
    np.testing.assert_array_equal(left, offline)
    assert np.isnan(left[frames, m]).all() and np.isnan(left).any(axis=2).sum() == len(frames)
    assert len(said) == 1 and f"{name} jumps off its place" in said[0] and "at 1.00 s" in said[0]


def test_one_that_slips_stays_missing_and_one_found_after_a_gap_does_not() -> None:
    markers, frames, m = faulty("r_toe", 1.0, 99.0)
    markers[frames, m] += [0.0, 0.03, 0.0]
    left, _ = live(walk(), markers)
    assert np.isnan(left[frames, m]).all()
    markers[frames[30:32], m] = np.nan
    left, _ = live(walk(), markers)
    assert np.isnan(left[frames[:32], m]).all() and np.isfinite(left[frames[32:], m]).all()


def test_labels_that_change_places_are_put_right_at_once() -> None:
    markers, frames, a = faulty("r_toe")
    b = walk().marker_names.index("r_5meta")
    markers[frames[:, None], [a, b]] = markers[frames[:, None], [b, a]]
    left, said = live(walk(), markers)
    np.testing.assert_array_equal(left, walk().markers)
    assert len(said) == 1 and "r_toe and r_5meta change places at 1.00 s" in said[0].replace(
        "r_5meta and r_toe", "r_toe and r_5meta"
    )


@pytest.mark.parametrize("changes_back", [True, False])
@pytest.mark.parametrize("what", ["both hidden", "one hidden", "time gap", "one frame lost"])
def test_labels_that_may_change_back_unseen_are_told_by_the_markers_near(what: str, changes_back: bool) -> None:
    recording = walk()
    markers, frames, a = faulty("r_toe", 1.0, 1.2 if changes_back else 99.0)
    b = recording.marker_names.index("r_5meta")
    markers[frames[:, None], [a, b]] = markers[frames[:, None], [b, a]]
    unseen = np.flatnonzero((recording.time >= 1.15) & (recording.time < 1.25))
    if what == "one frame lost":
        unseen = unseen[unseen == np.searchsorted(recording.time, 1.2 - 1e-9)]
    if "hidden" in what:
        markers[unseen[:, None], [a, b] if what == "both hidden" else [a]] = np.nan
        left, said = live(recording, markers)
        kept = np.isfinite(left).all(axis=2)
        assert kept[np.setdiff1d(np.arange(len(kept)), unseen)].all()
        np.testing.assert_array_equal(left[kept], recording.markers[kept])
    else:
        rest = np.delete(np.arange(len(markers)), unseen)
        left, said = live(recording, markers, rest)
        np.testing.assert_array_equal(left, recording.markers[rest])
    assert len(said) == 1 and "change places at 1.00 s" in said[0]


def test_labels_of_which_nobody_can_tell_whether_they_changed_back_are_taken_as_they_come_and_named() -> None:
    recording = walk()
    markers, frames, a = faulty("r_toe")
    b = recording.marker_names.index("r_5meta")
    markers[frames[:, None], [a, b]] = markers[frames[:, None], [b, a]]
    after = np.arange(frames[-1] + 1, len(markers))
    others = np.delete(np.arange(markers.shape[1]), [a, b])
    markers[after[:5]] = np.nan
    markers[after[5]] += np.nan
    markers[after[5], [a, b]] = recording.markers[after[5], [a, b]]  # nothing near is seen yet
    markers[after[6], others] *= 1.5
    left, said = live(recording, markers)
    assert np.isnan(left[after[5], [a, b]]).all()
    np.testing.assert_array_equal(left[after[7:]][:, [a, b]], recording.markers[after[7:]][:, [a, b]])
    assert any("r_5meta still are exchanged cannot be told" in text or "r_toe still are" in text for text in said)


def test_two_markers_near_which_none_ever_was_are_taken_as_they_come_after_a_gap() -> None:
    recording = walk()
    a, b = map(recording.marker_names.index, ("r_toe", "r_5meta"))
    frames = np.flatnonzero((recording.time >= 1.0) & (recording.time < 1.2))
    came = recording.markers[:, [a, b]].copy()
    came[frames] = came[frames][:, ::-1]
    came[frames[-1] : frames[-1] + 3] = np.nan
    watch = LiveMarkers(("a", "b"), recording.rate)
    watch.look(float(recording.time[frames[0] - 1]), came[frames[0] - 1])
    watch._order[:] = [1, 0]  # nothing beside them shows a leap
    after = np.arange(frames[0], len(came))
    left = np.stack([watch.look(float(recording.time[k]), came[k]) for k in after])
    np.testing.assert_array_equal(left[25:], recording.markers[after[25:]][:, [a, b]])
    assert any("cannot be told" in str(message) for message in watch.news())


@pytest.mark.parametrize("names", [("r_knee",), ("r_calc", "r_toe")])
def test_a_marker_that_is_held_is_missing_within_four_frames(names: tuple[str, ...]) -> None:
    for name in names:
        markers, frames, _ = faulty(name)
    which = [walk().marker_names.index(name) for name in names]
    markers[frames[:, None], which] = markers[frames[0], which]
    left, said = live(walk(), markers)
    assert np.isnan(left[frames[4:]][:, which]).all()
    assert np.isfinite(left[: frames[0] + 1]).all() and np.isfinite(left[frames[-1] + 1 :]).all()
    assert {name for name in names for text in said if text.startswith(f"Warning: {name} stays")} == set(names)


@pytest.mark.parametrize("digits", [3, 4, 5])
def test_markers_at_rest_are_measured_however_coarse_the_digits(digits: int) -> None:
    _, said = live(walk(), walk().markers.round(digits))
    assert not any("stays where" in text or "repeat" in text for text in said)


def test_frames_that_repeat_while_the_person_moves_are_missing() -> None:
    markers, frames, _ = faulty("r_toe", 1.0, 1.1)
    markers[frames] = markers[frames[0] - 1]
    left, said = live(walk(), markers)
    assert np.isnan(left[frames]).all() and np.isfinite(np.delete(left, frames, axis=0)).all()
    assert len(said) == 1 and "frames repeat" in said[0]


def test_slow_cameras_tell_no_jump_from_a_fast_limb() -> None:
    recording = walk()
    markers, frames, m = faulty("r_toe")
    markers[frames, m] += [0.0, 0.03, 0.0]
    watch = LiveMarkers(recording.marker_names, 50.0)
    every = [watch.look(float(t), frame) for t, frame in zip(recording.time[::2], markers[::2], strict=True)]
    assert np.isfinite(np.stack(every)).all()


def session(recording: Recording) -> tuple[list[LiveFrame], list[str]]:
    """Its frames, and what is said."""
    seen: list[LiveFrame] = []
    said: list[str] = []
    model = dynakin.load_model("fullbody", dynakin.Subject(mass_kg=75.0, height_m=1.75))
    Live(
        dynakin.Estimator(model), [Replay(recording, speed=0.0)], [Callback(seen.append)], lag_s=0.0, standing_s=0.4,
        standing_wait_s=0.6, say=said.append,
    ).run()  # fmt: skip
    return seen, said


def test_a_session_takes_nothing_of_a_marker_off_its_place_and_says_so_once() -> None:
    markers, frames, m = faulty("r_toe", 1.6, 1.8)
    markers[frames, m] += [0.0, 0.03, 0.0]
    seen, said = session(replace(walk(), markers=markers))
    off = [frame for frame in seen if 1.6 <= frame.estimate.time_s < 1.8]
    assert len(off) == len(frames) and all(np.isnan(frame.fused.positions[m]).all() for frame in off)
    assert all("r_toe" in frame.status.missing for frame in off)
    assert sum("r_toe jumps off its place" in text for text in said) == 1


def test_nobody_in_sight_is_no_seat() -> None:
    markers, frames, _ = faulty("r_toe", 1.6, 2.0)
    markers[frames] = np.nan
    _, said = session(replace(walk(), markers=markers))
    assert any("motion is lost" in text for text in said)
    assert not any("no plate measures" in text for text in said)


@pytest.mark.parametrize(("sign", "used"), [(1.0, True), (-1.0, False)])
def test_plates_on_which_nobody_stood_are_checked_once_somebody_does(sign: float, used: bool) -> None:
    recording = simulate("fullbody", "squat", 1, 6.0).recording
    gain = np.where(recording.time < 1.5, 0.0, sign)[:, None]
    plates = tuple(
        replace(plate, force=gain * plate.force, moment=gain * plate.moment, free_moment=gain * plate.free_moment)
        for plate in recording.plates
    )
    seen, said = session(replace(recording, plates=plates))
    assert any("they are not checked" in text for text in said)
    assert used is not any("The plates are not used any more" in text for text in said)
    assert (seen[-1].status.plates == "used") is used
