"""What lies before somebody is seen and after is no part of a recording, and a gap's edge is no end of a stance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dynakin.recordings.recording import Event, Plate, Recording
from dynakin.recordings.standing import marker_velocities

RATE, FRAMES, MARKERS = 100.0, 60, 8
SPEED = np.array([1.2, 0.0, -0.4])


def passing() -> Recording:
    """Eight markers that pass a plate at a steady speed."""
    time = 3.0 + np.arange(FRAMES) / RATE
    places = np.random.default_rng(0).normal(size=(MARKERS, 3))
    push = np.tile([0.0, 600.0, 0.0], (FRAMES, 1))
    plate = Plate("plate 1", push, 0.0 * push, 0.0 * push, 0.0 * push)
    markers = places + (time - time[0])[:, None, None] * SPEED
    return Recording("passing", None, time, tuple("abcdefgh"), markers, (plate,), events=(Event(3.02, "on"),))


def without(recording: Recording, frames: slice, markers: slice = slice(None)) -> Recording:
    found = recording.markers.copy()
    found[frames, markers] = np.nan
    return replace(recording, markers=found)


def test_frames_before_and_after_the_person_are_left_out_with_a_note() -> None:
    whole = without(without(passing(), slice(0, 5)), slice(59, 60))
    part = whole.without_empty_ends()
    assert part.n_frames == 54 and len(part.plates[0].force) == 54
    np.testing.assert_array_equal(part.time, whole.time[5:59])
    np.testing.assert_array_equal(part.markers, whole.markers[5:59])
    assert not part.events  # it lies before
    assert [str(note) for note in part.notes] == [
        "Fewer than a quarter of the markers are seen in the first 5 frames and the last frame: they are left out."
    ]
    assert part.without_empty_ends() is part


def test_what_is_left_lying_or_reflects_is_no_person() -> None:
    assert without(passing(), slice(0, 10), slice(0, 7)).without_empty_ends().n_frames == 50
    assert without(passing(), slice(0, 10), slice(0, 6)).without_empty_ends().n_frames == FRAMES


@pytest.mark.parametrize("frames", [slice(0, 0), slice(20, 40), slice(0, FRAMES)])
def test_gaps_within_and_recordings_of_nobody_stay_as_they_are(frames: slice) -> None:
    recording = without(passing(), frames)
    assert recording.without_empty_ends() is recording


def test_speeds_are_known_up_to_the_edges_of_a_gap() -> None:
    found = marker_velocities(without(passing(), slice(30, 33), slice(0, 1)))
    np.testing.assert_allclose(np.delete(found, [30, 31, 32], axis=0), np.tile(SPEED, (57, MARKERS, 1)), atol=1e-9)
    assert np.isnan(found[30:33, 0]).all() and np.isfinite(found[:, 1:]).all()


def test_a_marker_that_is_seen_once_has_no_speed() -> None:
    recording = without(without(passing(), slice(0, 20), slice(0, 1)), slice(21, FRAMES), slice(0, 1))
    assert np.isnan(marker_velocities(recording)[:, 0]).all()
