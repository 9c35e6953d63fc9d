"""given a person who is followed, when nothing comes for a while, then the motion is held, sought anew, and found."""

from __future__ import annotations

import dataclasses
import re

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import dynakin
from dynakin.stream.session import Live
from dynakin.stream.sinks.base import Callback, LiveFrame
from dynakin.stream.sources.replay import Replay
from support.gaps import GAPS_S, LATER_S, compared, distance, estimator, figures, follow, person, with_gap, without_gap
from support.gaps import Followed as Run

STOP_S, AFTER_S = 6.0, 2.0
START_S = {"sagittal7": 0.0, "fullbody": 4.0}
"""From when on the person is followed, who then stands, and squats before the gap."""
LENGTH_S = STOP_S + LATER_S + AFTER_S
FIT_M = 0.03  # what the core calls a fit


CASES = [("sagittal7", gap_s) for gap_s in GAPS_S] + [("fullbody", gap_s) for gap_s in (0.5, 10.0, 300.0)]
EACH_NIGHT = [pytest.param("fullbody", gap_s, marks=pytest.mark.nightly) for gap_s in (1.0, 2.0, 5.0, 60.0)]


@pytest.mark.parametrize(("kind", "gap_s"), [*CASES, *EACH_NIGHT])
def test_soon_after_a_gap_all_is_as_it_was_and_no_frame_claims_too_much(kind: str, gap_s: float) -> None:
    """0.1 has 1 to 600,000 m of error after 2 to 300 s, and says "following" 5 cm off for hundreds of frames."""
    found = figures(kind, gap_s, STOP_S, AFTER_S, START_S[kind])
    assert found.words[0] == "found" and set(found.words[1:]) == {"following"}
    assert found.soon < 1.5 and found.later < 1.5
    assert found.following_m < 0.005


@pytest.mark.parametrize(
    ("kind", "gap_s"),
    [("sagittal7", 0.5), ("sagittal7", 60.0), pytest.param("fullbody", 10.0, marks=pytest.mark.nightly)],
)
def test_a_live_session_says_that_the_motion_is_found_again(kind: str, gap_s: float) -> None:
    recording, _ = with_gap(person(kind, LENGTH_S), STOP_S, gap_s)
    frames: list[LiveFrame] = []
    said: list[str] = []
    live = Live(estimator(kind), [Replay(recording, speed=0.0)], [Callback(frames.append)], say=said.append)
    live.run()
    time = np.array([frame.estimate.time_s for frame in frames])
    initial = live.tracker.calibrated
    assert initial is not None and len(time) > 400
    off = [distance(initial, frame.estimate.markers, dict(frame.fused.sample.markers)) for frame in frames]
    run = Run(np.array(off), np.array([frame.status.tracking for frame in frames]))
    whole = np.interp(time, person(kind, LENGTH_S).time, without_gap(kind, LENGTH_S, 0.0).off)
    found = compared(run, Run(np.full(len(time), whole[time < STOP_S][200:].mean()), run.tracking), time, STOP_S)
    assert found.words[0] == "found" and set(found.words[1:]) == {"following"}
    assert found.following_m < 0.005 and found.later < 2.0
    text = next(text for text in said if "found again" in text)
    assert f"{gap_s:.1f} s after it was last followed; the markers used are" in text
    assert re.search(r"\b[01] mm off \(RMS\)", text)


def test_a_recording_whose_time_jumps_is_estimated_with_the_motion_sought_anew() -> None:
    recording, _ = with_gap(person("sagittal7", LENGTH_S), STOP_S, 10.0)
    result = estimator("sagittal7").run(recording, lag_s=np.inf)
    words = [event.message for event in result.events if event.subject == "motion"]
    assert len(words) == 1 and "found again from the markers for 1 frame" in words[0]
    residual = result.data["markers_measured"].values - result.data["markers_estimated"].values
    assert np.nanmax(np.abs(residual[:, :, :2])) < 0.02


def test_a_jump_of_the_posture_within_the_carried_time_leaves_no_segment_behind() -> None:
    """0.1 s, and 2.4 s of movement: 0.1 refused the trunk's markers for seconds, and said that it follows."""
    recording, _ = with_gap(person("fullbody", LENGTH_S), STOP_S, LATER_S)
    time = recording.time - np.where(recording.time < STOP_S - 1e-6, 0.0, LATER_S - 0.1)
    run = follow("fullbody", dataclasses.replace(recording, time=time), START_S["fullbody"])
    following = run.off[run.tracking == "following"]
    assert following.max() < FIT_M and run.off[-150:].max() < 0.002


@pytest.mark.parametrize("turn_deg", [pytest.param(90.0, marks=pytest.mark.nightly), 180.0])
def test_a_person_who_comes_back_facing_elsewhere_is_found(turn_deg: float) -> None:
    recording, _ = with_gap(person("fullbody", LENGTH_S), STOP_S, 10.0)
    up = estimator("fullbody").calibrate(recording.window(0.0, 2.0)).ground.rotation[1]
    R = Rotation.from_rotvec(np.radians(turn_deg) * up).as_matrix()
    after = recording.time > STOP_S
    markers = recording.markers.copy()
    centre = np.nanmean(markers[after][0], axis=0)
    markers[after] = (markers[after] - centre) @ R.T + centre + 2.0 * (np.eye(3)[0] - up * up[0])
    turned = dataclasses.replace(recording, markers=markers, plates=())
    run = follow("fullbody", turned, START_S["fullbody"])
    first = len(run.off) - int(after.sum())
    assert run.tracking[first] == "found" and set(run.tracking[first + 1 :]) == {"following"}
    assert run.off[first:].max() < 0.005


def test_the_seam_of_a_replayed_recording_is_a_gap() -> None:
    source = Replay(person("sagittal7", LENGTH_S).window(1.0, 4.4), speed=0.0, loop=True, duration_s=9.0)
    source.open()
    frames = []
    while (packets := source.read(0.0)) is not None:
        frames += [packet for packet in packets if hasattr(packet, "positions")]
    steps = np.diff([frame.time_s for frame in frames])
    assert (steps > 0.5).sum() == 2 and np.median(steps) == pytest.approx(0.01)
    recording = source.recording
    live = estimator("sagittal7").start(recording)
    words = []
    for frame in frames:
        markers = dict(zip(recording.marker_names, frame.positions, strict=True))
        words.append(live.step(dynakin.Sample(frame.time_s, markers)).report.tracking)
    assert words.count("found") == 2 and set(words) == {"found", "following"}
