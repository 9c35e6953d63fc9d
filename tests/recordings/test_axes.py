"""The usual axes of laboratories, any heading: up and forward are found on copies of the real recordings that are
turned to each of them."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np

from dynakin.recordings.frame import find_ground_frame
from dynakin.recordings.recording import Recording
from support.real_trials import real_trials

AXES = {f"{sign}{name}": s * np.eye(3)[k] for k, name in enumerate("XYZ") for sign, s in (("+", 1.0), ("-", -1.0))}


def turned(recording: Recording, R: np.ndarray) -> Recording:
    """The same in a laboratory whose axes are turned; what the file says of its screen would be wrong then."""
    plates = tuple(
        replace(
            plate,
            force=plate.force @ R.T,
            moment=plate.moment @ R.T,
            cop=plate.cop @ R.T,
            free_moment=plate.free_moment @ R.T,
            corners=None if plate.corners is None else plate.corners @ R.T,
        )
        for plate in recording.plates
    )
    return replace(recording, markers=recording.markers @ R.T, plates=plates, hints={})


def test_up_and_forward_turn_with_the_laboratory(data_dir: Path) -> None:
    """Each of the six verticals by four headings, spread over the recordings: every one has each vertical once."""
    judged = 0
    for number, recording in enumerate(real_trials(data_dir)):
        whole = recording if recording.n_frames < 400 else recording.window(recording.time[0], recording.time[399])
        own = find_ground_frame(whole)
        up = AXES[own.vertical]
        level = np.roll(np.abs(up), 1)
        for which, (vertical, target) in enumerate(AXES.items()):
            headings = [axis for axis in AXES.values() if not axis @ target]
            heading = headings[(number + which) % 4]
            own_axes, axes = (np.column_stack([a, b, np.cross(a, b)]) for a, b in ((level, up), (heading, target)))
            R = axes @ own_axes.T
            found = find_ground_frame(turned(whole, R))
            assert found.vertical == vertical, recording.name
            np.testing.assert_allclose(found.forward, R @ own.forward, atol=1e-9)
            judged += 1
    assert judged >= 24 * 6


def test_plates_keep_to_a_file_whose_axes_are_turned(data_dir: Path) -> None:
    recording = next(r for r in real_trials(data_dir) if r.name == "S1_StandingRef")
    own = find_ground_frame(recording)
    for up, heading in product(AXES.values(), repeat=2):
        if up @ heading:
            continue
        R = np.column_stack([heading, np.cross(up, heading), up])
        copy = turned(recording, R)
        ground = find_ground_frame(copy)
        np.testing.assert_allclose(
            ground.wrench_to_ground(copy.total_wrench())[:, [1, 4]],
            own.wrench_to_ground(recording.total_wrench())[:, [1, 4]],
            atol=1e-6,
        )
