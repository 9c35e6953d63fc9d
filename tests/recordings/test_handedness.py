"""A recording of which an axis is negated is refused; one that is turned, or a person who lies or turns, is not."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from dynakin.errors import RecordingError
from dynakin.recordings.frame import find_ground_frame
from dynakin.recordings.landmarks import DEFAULT_PAIRS
from dynakin.recordings.orientation import refuse_mirrored
from dynakin.recordings.recording import Recording
from support.made_recordings import standing
from support.real_trials import real_trials

Y_UP = np.array([0.0, 1.0, 0.0])


def negated(recording: Recording, *axes: int) -> Recording:
    """The same with axes of the laboratory negated, plates too; moments turn the other way, as in any mirror."""
    sign = np.ones(3)
    sign[list(axes)] = -1.0
    turn = sign * np.prod(sign)
    plates = tuple(
        replace(
            plate,
            force=plate.force * sign,
            cop=plate.cop * sign,
            moment=plate.moment * turn,
            free_moment=plate.free_moment * turn,
            corners=None if plate.corners is None else plate.corners * sign,
        )
        for plate in recording.plates
    )
    return replace(recording, markers=recording.markers * sign, plates=plates)


def exchanged(recording: Recording) -> Recording:
    """The same with all names of left and right exchanged."""
    names = tuple(
        ("R" if name[0] == "L" else "L" if name[0] == "R" else name[0]) + name[1:] for name in recording.marker_names
    )
    return replace(recording, marker_names=names)


@pytest.mark.parametrize("axes", [(0,), (1,), (2,), (0, 1, 2)])
def test_a_mirror_is_refused_and_says_which_axis(axes: tuple[int, ...]) -> None:
    with pytest.raises(RecordingError, match="seen in a mirror: by the pelvis and the feet") as caught:
        find_ground_frame(negated(standing(), *axes))
    said = str(caught.value)
    assert ("y axis looks negated (or all three are)" in said) == (1 in axes)
    assert ("looks negated (x or z), or all names of left and right exchanged" in said) == (1 not in axes)


def test_exchanged_names_are_refused_with_both_possibilities() -> None:
    with pytest.raises(RecordingError, match="or all names of left and right exchanged"):
        find_ground_frame(exchanged(standing()))


@pytest.mark.parametrize("axes", [(0, 1), (0, 2), (1, 2)])
def test_two_negated_axes_are_a_rotation(axes: tuple[int, ...]) -> None:
    """The person is then found where they were."""
    made = standing()
    turned = negated(made, *axes)
    expected = find_ground_frame(made).points_to_ground(made.markers)
    np.testing.assert_allclose(find_ground_frame(turned).points_to_ground(turned.markers), expected, atol=1e-9)


@settings(max_examples=40, deadline=None)
@given(turn=st.tuples(*[st.floats(-1.0, 1.0)] * 4).filter(lambda q: np.linalg.norm(q) > 0.1))
def test_a_body_in_any_pose_is_no_mirror_and_its_image_is(turn: tuple[float, ...]) -> None:
    """Lying, upside down, walking backwards: what is up in the laboratory does not matter."""
    R = Rotation.from_quat(turn).as_matrix()
    posed = standing()
    posed = replace(posed, markers=posed.markers @ R.T)
    refuse_mirrored(posed, Y_UP, "+Y", DEFAULT_PAIRS)
    with pytest.raises(RecordingError, match="mirror"):
        refuse_mirrored(negated(posed, 2), Y_UP, "+Y", DEFAULT_PAIRS)


def test_without_names_nothing_is_said() -> None:
    recording = negated(standing(), 2)
    names = tuple(f"M{k}" for k in range(len(recording.marker_names)))
    refuse_mirrored(replace(recording, marker_names=names), Y_UP, "+Y", DEFAULT_PAIRS)


def test_real_recordings_are_right_handed_and_their_images_are_not(data_dir: Path) -> None:
    judged = 0
    for recording in real_trials(data_dir):
        find_ground_frame(recording)
        for axis in range(3):
            with pytest.raises(RecordingError, match="mirror"):
                find_ground_frame(negated(recording, axis))
        judged += 1
    assert judged >= 24
