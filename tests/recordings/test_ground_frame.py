"""Up, forward, and the ground frame, in laboratories turned at will."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dynakin.errors import ConfigError, RecordingError
from dynakin.recordings.frame import find_ground_frame
from dynakin.recordings.landmarks import FacingPairs, find_marker
from dynakin.recordings.recording import Recording
from dynakin.recordings.standing import standing_window
from support.made_recordings import plain, standing, without

AXES = {"+Y": np.eye(3), "+Z": np.array([[1.0, 0, 0], [0, 0, -1.0], [0, 1.0, 0]]),
        "+X": np.array([[0, 1.0, 0], [1.0, 0, 0], [0, 0, -1.0]]), "-Y": np.diag([1.0, -1, -1])}  # fmt: skip


def about_y(angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])


@settings(max_examples=40, deadline=None)
@given(
    vertical=st.sampled_from(sorted(AXES)),
    heading=st.floats(-np.pi, np.pi),
    origin=st.tuples(*[st.floats(-3, 3)] * 3),
)
def test_the_laboratory_leaves_the_ground_wrench_unchanged(
    vertical: str, heading: float, origin: tuple[float, ...]
) -> None:
    R_LG = AXES[vertical] @ about_y(heading)
    recording = standing(rotation_LG=R_LG, origin_L=origin)
    frame = find_ground_frame(recording).with_origin(origin)
    assert frame.vertical == vertical
    np.testing.assert_allclose(frame.rotation, R_LG.T, atol=1e-9)
    np.testing.assert_allclose(np.linalg.det(frame.rotation), 1.0)
    still = standing()
    np.testing.assert_allclose(
        frame.wrench_to_ground(recording.total_wrench()), still.total_wrench(), atol=1e-8 * 700 * 10
    )
    np.testing.assert_allclose(frame.points_to_ground(recording.markers), still.markers, atol=1e-9)


def test_there_and_back() -> None:
    frame = find_ground_frame(standing(rotation_LG=AXES["+Z"] @ about_y(0.4))).with_origin((0.3, -0.2, 0.1))
    points, wrench = (
        np.random.default_rng(0).normal(size=(4, 5, 3)),
        np.random.default_rng(1).normal(size=(7, 6)),
    )
    np.testing.assert_allclose(frame.points_to_laboratory(frame.points_to_ground(points)), points, atol=1e-14)
    np.testing.assert_allclose(frame.wrench_to_laboratory(frame.wrench_to_ground(wrench)), wrench, atol=1e-14)
    np.testing.assert_allclose(frame.vectors_to_laboratory(frame.vectors_to_ground(points)), points, atol=1e-14)
    moved = frame.with_origin((1, 0, 0))
    np.testing.assert_allclose(moved.points_to_ground(np.array([1.0, 0, 0])), 0.0)


def test_wrench_moves_with_the_origin_by_hand() -> None:
    frame = find_ground_frame(standing(), vertical="+Y", forward="+X").with_origin((1.0, 0.0, 0.0))
    # 100 N up at x = 3 m: 300 N m about Z at the laboratory's origin, 200 N m about one 1 m ahead
    np.testing.assert_allclose(frame.wrench_to_ground(np.array([0, 100.0, 0, 0, 0, 300.0])), [0, 100, 0, 0, 0, 200])


def test_a_screen_hint_that_is_wrong_is_told_and_not_followed() -> None:
    frame = find_ground_frame(replace(standing(), hints={"Y_SCREEN": "-Z", "X_SCREEN": "-X"}))
    assert frame.vertical == "+Y"
    assert any("Y_SCREEN says -Z" in sentence for sentence in frame.how)


def test_hint_alone_is_followed_and_nothing_at_all_is_an_error() -> None:
    bare = plain(50)
    frame = find_ground_frame(replace(bare, hints={"Y_SCREEN": "+Z"}), forward="+X")
    assert frame.vertical == "+Z"
    with pytest.raises(RecordingError, match="vertical axis not found"):
        find_ground_frame(bare, forward="+X")
    with pytest.raises(RecordingError, match="facing direction not found"):
        find_ground_frame(bare, vertical="+Y")


def test_given_axes_win() -> None:
    frame = find_ground_frame(replace(standing(), plates=()), vertical="z", forward=(1.0, 1.0, 5.0))
    assert frame.vertical == "+Z"
    np.testing.assert_allclose(frame.forward, np.array([1, 1, 0]) / np.sqrt(2))
    assert sum("given" in sentence for sentence in frame.how) == 2
    with pytest.raises(ConfigError, match="expected one of"):
        find_ground_frame(standing(), vertical="up")
    with pytest.raises(ConfigError, match="across vertical"):
        find_ground_frame(standing(), vertical="+Y", forward="-Y")


def test_a_given_vertical_that_body_and_plates_contradict_is_refused() -> None:
    """Where the body alone does, as that of one who lies, it is said and not followed."""
    still = standing()
    assert "not followed" in " ".join(find_ground_frame(replace(still, plates=()), vertical="Z", forward="+X").how)
    with pytest.raises(RecordingError, match=r"vertical is \+Z, but the body above .* force show \+Y; expected \+Y"):
        find_ground_frame(still, vertical="Z", forward="+X")
    assert find_ground_frame(still, vertical="Y", forward="+X").vertical == "+Y"


def lying(*, plates: bool = True, at: tuple[float, float, float] = (1.0, 0.0, 0.0)) -> Recording:
    """The standing person on the back, 8 cm above the same floor, with the feet towards -X: the body is along +X. The
    plates bear all of it from below."""
    still = standing()
    upright = still.markers
    markers = np.stack([upright[..., 1], 0.10 + 0.1 * upright[..., 0], -upright[..., 2]], axis=-1) + np.array(at)
    cop = markers.mean(axis=(0, 1)) * [1.0, 0.0, 1.0]
    borne = tuple(replace(plate, cop=np.tile(cop, (still.n_frames, 1))) for plate in still.plates)
    return replace(still, name="lying", markers=markers, plates=borne if plates else ())


def test_plates_that_bear_a_person_who_lies_show_up() -> None:
    """The body's own axis was taken for up, and right forces were to be given "in the axes of the markers"."""
    found = find_ground_frame(lying(), forward="-X")
    assert found.vertical == "+Y"
    assert "the body above the feet says +X, not +Y; not followed" in " ".join(found.how)


def test_forces_in_other_axes_than_the_markers_do_not_move_the_vertical() -> None:
    """Nor does a hand on a wall with a plate: neither presses at the lowest part, under the middle of the markers."""
    still = standing()
    order = [0, 2, 1]
    swapped = [replace(p, force=p.force[:, order], cop=p.cop[:, order]) for p in still.plates]
    assert find_ground_frame(replace(still, plates=tuple(swapped))).vertical == "+Y"
    wall = replace(still.plates[0], force=np.tile([-400.0, 0.0, 0.0], (still.n_frames, 1)))
    wall = replace(wall, cop=np.tile([0.25, 1.3, 0.0], (still.n_frames, 1)))
    assert find_ground_frame(replace(still, plates=(wall,))).vertical == "+Y"


def test_a_standing_trial_over_the_same_floor_shows_up_for_who_lies() -> None:
    static = standing()
    found = find_ground_frame(lying(plates=False), forward="-X", static=static)
    assert found.vertical == "+Y"
    assert "Vertical +Y: the standing trial" in found.how[0]
    assert find_ground_frame(lying(plates=False), forward="+Y").vertical == "+X"  # nothing says otherwise


def test_who_is_upright_in_other_axes_than_forces_and_standing_trial_does_not_lie() -> None:
    """As told by the floor, which is elsewhere along their axis; a squat was run as one who lies, "plate 1 off its
    place"."""
    static = standing()
    turned = standing(rotation_LG=AXES["+Z"], origin_L=(0.0, 0.6, 0.0))
    assert find_ground_frame(replace(turned, plates=static.plates), static=static).vertical == "+Z"


def test_a_standing_trial_may_lack_markers_or_spell_them_otherwise() -> None:
    """Nothing else of it was asked than the trial's own names, and it was refused."""
    whole = standing()
    few = [k for k, name in enumerate(whole.marker_names) if name != "RASI"]
    names = tuple(f"Somebody:{whole.marker_names[k]}" for k in few)
    static = replace(whole, marker_names=names, markers=whole.markers[:, few])
    pairs = FacingPairs((), (), above=("RASI", "LASI"), below=("RHEE", "LHEE"))
    assert find_ground_frame(lying(plates=False), forward="-X", pairs=pairs, static=static).vertical == "+Y"


def test_plates_without_numbers_while_empty_show_up_as_well() -> None:
    recording = lying()
    gone = np.full((recording.n_frames, 3), np.nan)
    empty = replace(recording.plates[0], name="empty", force=gone, moment=gone, cop=gone)
    assert find_ground_frame(replace(recording, plates=(*recording.plates, empty)), forward="-X").vertical == "+Y"


def test_a_standing_trial_in_other_axes_leaves_an_upright_person_upright() -> None:
    """Where its floor shows nothing, the vertical is asked for."""
    other = standing(rotation_LG=AXES["+Z"], origin_L=(0.0, 0.0, 0.02))
    upright = replace(standing(origin_L=(0.0, 0.0, 0.9)), plates=())
    assert find_ground_frame(upright, static=other).vertical == "+Y"
    on_a_bed = lying(plates=False, at=(1.0, 0.8, 0.0))
    with pytest.raises(RecordingError, match=r"shows \+X .* standing \+Y: .*--vertical"):
        find_ground_frame(on_a_bed, forward="-X", static=standing())
    assert find_ground_frame(on_a_bed, vertical="+Y", forward="-X", static=standing()).vertical == "+Y"


def test_forward_without_feet_from_pelvis_and_without_both_from_walking() -> None:
    still = standing()
    pelvis_only = without(still, "LHEE", "RHEE", "LTOE", "RTOE")
    frame = find_ground_frame(pelvis_only)
    np.testing.assert_allclose(frame.forward, [1, 0, 0], atol=1e-12)
    assert any("from the back of the pelvis" in sentence for sentence in frame.how)
    blind = without(pelvis_only, "LPSI", "RPSI")
    way = 1.5 * still.time[:, None, None] * np.array([0.6, 0, 0.8])
    frame = find_ground_frame(replace(blind, markers=blind.markers + way), vertical="+Y")
    np.testing.assert_allclose(frame.forward, [0.6, 0, 0.8], atol=1e-9)


def test_swapped_heel_and_toe_are_told() -> None:
    still = standing()
    names = tuple(
        {"LHEE": "LTOE", "LTOE": "LHEE", "RHEE": "RTOE", "RTOE": "RHEE"}.get(n, n) for n in still.marker_names
    )
    frame = find_ground_frame(replace(still, marker_names=names))
    np.testing.assert_allclose(frame.forward, [-1, 0, 0], atol=1e-9)
    assert any("DISAGREES" in sentence and "180 deg" in sentence for sentence in frame.how)


def test_markers_by_prefix_case_and_dots_and_pairs_of_a_marker_set() -> None:
    still = standing()
    renamed = replace(still, marker_names=tuple("S1:" + n[0] + "." + n[1:].lower() for n in still.marker_names))
    assert find_marker(renamed, "LHEE") == "S1:L.hee"
    assert find_marker(renamed, "XHEE") is None
    np.testing.assert_allclose(find_ground_frame(renamed).forward, [1, 0, 0], atol=1e-9)
    own = replace(still, marker_names=tuple("m" + n for n in still.marker_names))
    pairs = FacingPairs(heel_toe=(("mLHEE", "mLTOE"), ("mRHEE", "mRTOE")), pelvis=())
    np.testing.assert_allclose(find_ground_frame(own, pairs=pairs).forward, [1, 0, 0], atol=1e-9)


def test_missing_first_second_does_not_hinder() -> None:
    still = standing(n_frames=300)
    markers = still.markers.copy()
    markers[:150] = np.nan
    np.testing.assert_allclose(find_ground_frame(replace(still, markers=markers)).forward, [1, 0, 0], atol=1e-9)


def test_standing_window() -> None:
    still = standing(n_frames=300)
    assert standing_window(still) == slice(0, 300)
    moving = still.markers.copy()
    moving[:100, :, 1] += 0.3 * np.sin(2 * np.pi * np.arange(100) / 50)[:, None]
    window = standing_window(replace(still, markers=moving))
    assert window is not None
    assert 98 <= window.start <= 106
    assert window.stop == 300
    walking = still.markers + 1.2 * still.time[:, None, None] * np.array([1.0, 0, 0])
    assert standing_window(replace(still, markers=walking)) is None
    assert standing_window(standing(n_frames=20)) is None  # too short to tell
    noisy = still.markers + np.random.default_rng(0).normal(scale=5e-4, size=still.markers.shape)
    assert standing_window(replace(still, markers=noisy)) is not None
