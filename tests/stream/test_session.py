"""A session from a replayed recording to published estimates."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dynakin.errors import ConfigError, ModelError, StreamError
from dynakin.filter.measurements import Measurements
from dynakin.filter.samples import sample_arrays
from dynakin.recordings.recording import Recording
from dynakin.simulation.trial import simulate_squat
from dynakin.stream import start
from dynakin.stream.fusion import Fusion
from dynakin.stream.monitor import Monitor
from dynakin.stream.plates import LivePlates
from dynakin.stream.session import Live
from dynakin.stream.sinks.base import Callback, LiveFrame, Sink
from dynakin.stream.sinks.recorder import Recorder, recorded
from dynakin.stream.sources.packets import MarkerPacket, Packet, PlatePacket, Seam, Streams
from dynakin.stream.sources.replay import Replay
from dynakin.stream.start import quietest
from support.squat_estimator import estimator


@pytest.fixture(scope="module")
def squat() -> Recording:
    return simulate_squat(seed=1, duration_s=8.0).recording


def run(source: object, **options: object) -> tuple[list[LiveFrame], list[str], Live]:
    frames: list[LiveFrame] = []
    said: list[str] = []
    live = Live(estimator(), [source], [Callback(frames.append)], say=said.append, **options)  # type: ignore[list-item,arg-type]
    live.run()
    return frames, said, live


def test_a_recording_is_not_waited_for_as_a_person_is() -> None:
    """The source says that it is one: 20 s were waited for, and the streams ended before. What is given wins."""
    moves = simulate_squat(seed=1, duration_s=12.0).recording.window(3.0, 10.5)
    frames, said, live = run(Replay(moves, speed=0.0))
    assert (live.standing_s, live.standing_wait_s) == (2.0, 3.0) and "Nobody stood still for 2 s." in said
    assert len(frames) > 300
    with pytest.raises(StreamError, match=r"7\.5 s came, expected 2 s of standing, or 20 s in all.*standing_wait_s"):
        run(Replay(moves, speed=0.0), standing_wait_s=20.0)


def test_a_recording_that_begins_again_loses_nothing(squat: Recording) -> None:
    """At each seam markers fell silent, the motion was lost and found, and 198 packets were lost."""
    short = squat.window(0.0, 2.5)
    frames, said, live = run(Replay(short, speed=2.0, loop=True, duration_s=9.0), standing_wait_s=1.0)
    assert said.count("The recording begins again.") == 2
    assert not [text for text in said if "silent" in text or "lost" in text or "found again" in text]
    assert live.status.lost == live.status.late == 0 and live.status.tracking == "following"
    assert len({round(frame.estimate.time_s // 3.5) for frame in frames}) == 3


class UnseenAgain(Replay):
    """In whose second round no marker is seen for 2 s."""

    def read(self, timeout_s: float) -> Sequence[Packet | Seam] | None:
        packets = super().read(timeout_s)
        return packets and [
            replace(packet, positions=np.full_like(packet.positions, np.nan))
            if isinstance(packet, MarkerPacket) and 5.0 < packet.time_s < 7.0
            else packet
            for packet in packets
        ]


def test_a_loss_right_after_a_seam_is_still_said(squat: Recording) -> None:
    said = run(UnseenAgain(squat.window(0.0, 4.0), speed=0.0, loop=True, duration_s=8.0), standing_wait_s=1.0)[1]
    after = said[said.index("The recording begins again.") :]
    assert any(text.startswith("The motion is lost at 6.0") for text in after)


def test_live_equals_offline_on_the_same_samples(squat: Recording) -> None:
    frames, said, _ = run(Replay(squat, speed=0.0))
    assert "Ready: move." in said and any(text.startswith("Stand still") for text in said)
    first = frames[0].estimate.time_s
    offline = estimator().start(squat.window(first - 2.01 - 1e-6, first - 0.005))
    initial = offline.calibrated
    begin = int(np.searchsorted(squat.time, first - 1e-6))
    assert len(frames) == squat.n_frames - begin  # no frame is lost
    time_, markers = (
        squat.time[begin:],
        initial.ground.points_to_ground(
            np.stack([squat.marker(name)[begin:] for name in initial.recorded_markers], axis=1)
        ),
    )
    wrench = initial.ground.wrench_to_ground(squat.total_wrench())[begin:]
    arrays = offline.run_arrays(Measurements(time_, markers, wrench))
    np.testing.assert_allclose(np.stack([f.state for f in frames]), arrays["state"], atol=1e-9)


def test_moments_of_who_moves_at_the_start_are_right_from_then_on() -> None:
    """The model's posture is that of the first of the frames that it is measured on, half a second before."""
    trial = simulate_squat(seed=1, duration_s=8.0)
    source = Replay(trial.recording.window(4.0, 5.0), speed=0.0)
    static = trial.recording.window(0.0, 2.0)
    frames, said, _ = run(source, static=static, standing_s=0.4, standing_wait_s=0.6)
    assert any(text.startswith("Nobody stood still") for text in said)
    truth = trial.truth.data["moments"].sel(coordinate="knee")
    first = [frame.estimate for frame in frames[:20]]
    true = np.interp([one.time_s for one in first], truth["time"].values, truth.values)
    assert np.abs([one.moments["knee"] for one in first] - true).max() < 2.0  # 8 where the first frames are passed over


def test_a_standing_trial_that_nobody_gave_is_not_blamed() -> None:
    trial = simulate_squat(seed=1, duration_s=8.0)
    _, said, _ = run(Replay(trial.recording.window(3.0, 5.0), speed=0.0), standing_s=0.4, standing_wait_s=1.2)
    assert any(text.startswith("Nobody stood still") for text in said)
    assert any("Stand still at the start, or give a standing trial" in text for text in said)
    assert not any("nobody stands still in" in text for text in said)


def test_a_lag_is_shown_as_its_delay(squat: Recording) -> None:
    frames, _, _ = run(Replay(squat, speed=0.0, duration_s=4.0), lag_s=0.2)
    last = frames[-1]
    assert last.smoothed is not None and last.published is last.smoothed
    assert last.status.delay_s == pytest.approx(0.2, abs=1e-6) == last.estimate.time_s - last.smoothed.time_s


def test_a_session_that_looks_ahead_says_what_is_expected(squat: Recording) -> None:
    """Of the sample, not of what is published late; also after a restart, and only where it is asked for."""
    frames, _, live = run(Replay(squat, speed=0.0), ahead_s=0.1)
    first = frames[0].estimate.time_s
    held, expected = [], []
    for k, frame in enumerate(frames[:-10]):
        assert frame.ahead is not None and frame.ahead.time_s == pytest.approx(frame.estimate.time_s + 0.1)
        then = frames[k + 10].estimate
        if then.time_s > first + 1.5:
            held.append(then.wrench["fy"] - frame.estimate.wrench["fy"])
            expected.append(then.wrench["fy"] - frame.ahead.wrench["fy"])
    assert live.fusion.markers.rate_hz == pytest.approx(100.0)
    assert np.std(expected) < 0.6 * np.std(held)
    live.restart()
    assert live.tracker.ahead() is None
    assert all(frame.ahead is None for frame in run(Replay(squat, speed=0.0, duration_s=3.0))[0])
    with pytest.raises(ConfigError, match=r"ahead_s: -0\.1 s, expected 0"):
        Live(estimator(), [], ahead_s=-0.1)


def test_a_live_session_with_a_lag_gives_what_a_recording_with_it_gives(squat: Recording) -> None:
    frames, said, live = run(Replay(squat, speed=0.0, duration_s=5.0))
    assert live.tracker.lag == 5 and any("50 ms late" in text for text in said)  # as recommended
    assert frames[4].published is None and frames[5].published is not None
    initial, samples = live.tracker.calibrated, [frame.fused.sample for frame in frames]
    markers, wrench = (np.stack(rows) for rows in zip(*(sample_arrays(one, initial) for one in samples), strict=True))
    time_ = np.array([one.time_s for one in samples])
    arrays = live.tracker.fresh().run_late_arrays(5, Measurements(time_, markers, wrench))
    late = [frame.published for frame in frames[5:] if frame.published is not None]
    np.testing.assert_allclose([one.time_s for one in late], time_[:-5], atol=1e-9)
    np.testing.assert_allclose(np.stack([one.moments for one in late]), arrays["moments"][:-5], atol=1e-8)
    spread = [(k, frame.deviations["moments"]) for k, frame in enumerate(frames) if frame.deviations is not None]
    assert spread  # as the queue allows
    for k, sd in spread:
        np.testing.assert_allclose(sd.values, arrays["moments_sd"][k - 5], rtol=1e-7)
    at_once, said, _ = run(Replay(squat, speed=0.0, duration_s=4.0), lag_s=0.0)
    assert not any("50 ms late" in text for text in said)
    assert all(frame.published is frame.estimate and frame.status.delay_s == 0.0 for frame in at_once)


def test_wrong_labels_list_what_came_and_what_was_expected(squat: Recording) -> None:
    strange = replace(squat, marker_names=tuple(f"ball{k}" for k in range(len(squat.marker_names))))
    with pytest.raises(
        ModelError,
        match=r"0 of the 53 markers of opencap are there, nothing on the pelvis.*; came: ball0, ball1.*L_HJC_reg$",
    ):
        run(Replay(strange, speed=0.0))


def test_half_of_the_markers_gone_for_three_seconds(squat: Recording) -> None:
    markers = squat.markers.copy()
    gone = (squat.time > 3.0) & (squat.time < 6.0)
    markers[np.ix_(gone, range(0, markers.shape[1], 2))] = np.nan
    whole, _, _ = run(Replay(squat, speed=0.0))
    frames, _, _ = run(Replay(replace(squat, markers=markers), speed=0.0))
    assert len(frames) == len(whole) and frames[200].status.missing
    last = np.rad2deg(frames[-1].estimate.coordinates - whole[-1].estimate.coordinates)
    assert np.abs(last).max() < 3.0  # once they are back; in between a segment without markers is only guessed
    assert all(np.isfinite(f.estimate.coordinates).all() for f in frames)


@pytest.mark.parametrize("blank", [np.nan, 0.0])
def test_while_the_motion_is_lost_moments_are_absent(squat: Recording, blank: float) -> None:
    """Zeros in all three places are some systems' word for missing."""
    markers = squat.markers.copy()
    markers[(squat.time > 4.0) & (squat.time < 6.0)] = blank
    frames, said, _ = run(Replay(replace(squat, markers=markers), speed=0.0), lag_s=0.0)
    lost = [frame for frame in frames if frame.status.tracking in ("doubtful", "lost", "restarted")]
    assert len(lost) > 100
    for frame in lost:
        assert np.isnan(frame.estimate.moments).all() and (np.array(frame.estimate.moment_sources) == 3).all()
    sure = [frame for frame in frames if frame.status.tracking == "following"]
    assert len(sure) > 200 and all(np.isfinite(frame.estimate.moments).any() for frame in sure)
    assert re.fullmatch(rf"Of {len(frames)} frames: {len(lost)} with the motion lost\.", said[-1])


class Edited(Replay):
    """A replay whose packets are changed on the way, at the recording's own pace by the times of arrival."""

    def __init__(self, recording: Recording, edit: Callable[[Packet], list[Packet]]) -> None:
        super().__init__(recording, speed=0.0)
        self.edit = edit

    def read(self, timeout_s: float) -> list[Packet] | None:
        packets = super().read(timeout_s)
        if packets is None:
            return None
        arrived = [replace(p, arrived_s=1000.0 + float(np.max(p.time_s)) + 0.001) for p in packets]
        return [one for packet in arrived for one in self.edit(packet)]


def test_silent_plates_are_told_and_the_estimate_goes_on(squat: Recording) -> None:
    def silent(packet: Packet) -> list[Packet]:
        at = float(np.max(packet.time_s))
        return [] if isinstance(packet, PlatePacket) and 4.0 < at < 6.0 else [packet]

    frames, said, _ = run(Edited(squat, silent))
    words = " ".join(said)
    assert "The plates are silent; going on with markers alone." in words and "The plates are back." in words
    by_time = {round(f.estimate.time_s, 2): f.status.plates for f in frames}
    assert (by_time[3.5], by_time[5.0], by_time[7.0]) == ("used", "silent", "used")
    assert frames[-1].estimate.time_s == pytest.approx(squat.time[-1])


def test_late_packets_and_steps_of_zero_or_backwards_leave_the_estimate_as_it_is(squat: Recording) -> None:
    past: list[Packet] = []

    def disturb(packet: Packet) -> list[Packet]:
        if not isinstance(packet, MarkerPacket):
            return [packet]
        past.append(packet)
        at = packet.time_s
        found: list[Packet] = [packet]
        if round(at, 2) == 5.5:  # 500 at once, all long past
            found += [replace(one, arrived_s=packet.arrived_s) for one in past[:500]]
        if round(100 * at) % 50 == 20:
            found += [packet, replace(packet, time_s=at - 0.02), replace(packet, time_s=float("nan"))]
        return found

    whole, _, _ = run(Replay(squat, speed=0.0))
    frames, _, live = run(Edited(squat, disturb))
    assert live.fusion.marker_counts.late >= 500 and live.fusion.marker_counts.duplicate >= 10
    np.testing.assert_array_equal([f.estimate.time_s for f in frames], [f.estimate.time_s for f in whole])
    np.testing.assert_array_equal(frames[-1].state, whole[-1].state)


def test_a_computer_that_is_too_slow_leaves_frames_out_and_says_so(squat: Recording) -> None:
    frames: list[LiveFrame] = []
    said: list[str] = []

    def slow(frame: LiveFrame) -> None:
        frames.append(frame)
        time.sleep(0.02)

    source = Replay(squat.window(0.0, 6.0), speed=2.0)
    live = Live(estimator(), [source], [Callback(slow)], say=said.append, standing_s=1.0, max_late_s=0.1)
    live.run()
    assert frames[-1].status.left_out > 20 and any("too slow" in text for text in said)
    steps = np.diff([f.estimate.time_s for f in frames])
    assert steps.max() < 0.07 and np.isfinite(frames[-1].estimate.coordinates).all()


class Breaking:
    """A replay whose connection breaks once, for half a second, and that then begins at time 0 again."""

    def __init__(self, recording: Recording, at_s: float) -> None:
        self.replay, self.at_s, self.broken = Replay(recording, speed=1.0), at_s, 0.0

    def open(self, timeout_s: float) -> Streams:
        if self.broken and time.monotonic() - self.broken < 0.6:
            raise StreamError("nobody answers")
        return self.replay.open(timeout_s)

    def read(self, timeout_s: float) -> list[Packet] | None:
        packets = self.replay.read(timeout_s)
        if not self.broken and packets and float(np.max(packets[-1].time_s)) > self.at_s:
            self.broken = time.monotonic()
            raise StreamError("connection reset")
        return packets

    def close(self) -> None:
        self.replay.close()


def test_a_source_that_is_killed_and_comes_back(squat: Recording) -> None:
    frames, said, live = run(Breaking(squat.window(0.0, 4.0), at_s=3.0))
    words = " ".join(said)
    assert "is lost (connection reset)" in words and "The source is back." in words and "set back" in words
    times = np.array([f.estimate.time_s for f in frames])
    assert (np.diff(times) > 0).all() and times[-1] > 6.0 and live.fusion.clock_restarts == 1
    assert frames[-1].status.tracking in ("following", "found", "restarted")


def test_restart_and_recalibrate_without_stopping(squat: Recording) -> None:
    frames: list[LiveFrame] = []
    said: list[str] = []
    live = Live(estimator(), [Replay(squat, speed=0.0)], [], say=said.append, standing_wait_s=2.0)

    def on_frame(frame: LiveFrame) -> None:
        frames.append(frame)
        if len(frames) == 100:
            live.restart()
        if len(frames) == 200:
            live.recalibrate()

    live.sinks.append(Callback(on_frame))
    live.run()
    assert "The estimate starts again." in said
    assert said.count("Ready: move.") == 2 and len(frames) > 300


class Buttons(Sink):
    """Somebody who presses a button at each of some frames."""

    def __init__(self, presses: dict[int, str]) -> None:
        self.presses, self.frames, self.waiting = presses, 0, list[str]()

    def frame(self, frame: LiveFrame) -> None:
        self.frames += 1
        if self.frames in self.presses:
            self.waiting.append(self.presses[self.frames])

    def asked(self) -> list[str]:
        found, self.waiting = self.waiting, []
        return found


def test_buttons_record_restart_and_recalibrate(squat: Recording, tmp_path: Path) -> None:
    said: list[str] = []
    buttons = Buttons({50: "record", 150: "restart", 250: "record", 300: "recalibrate"})
    settings = {"model": "sagittal7", "markers": "opencap", "mass_kg": 70.0}
    live = Live(
        estimator(),
        [Edited(squat, lambda packet: [packet])],
        [buttons],
        say=said.append,
        standing_wait_s=2.0,
        record=lambda: Recorder(tmp_path / "r", settings),
    )
    live.run()
    ends = [said.index(text) for text in ("Recording.", "The estimate starts again.", "The recording has ended.")]
    assert ends == sorted(ends) and said.count("Ready: move.") == 2
    assert 1.5 < np.ptp(recorded(tmp_path / "r").time) < 2.6  # what came between the two presses


def test_constants_go_on_from_an_earlier_session(squat: Recording) -> None:
    frames, _, live = run(Replay(squat, speed=0.0, duration_s=4.0))
    initial = live.tracker.calibrated
    known = {name: (float(frames[-1].state[k]), 0.001) for k, name in enumerate(initial.names)}
    again, said, other = run(Replay(squat, speed=0.0, duration_s=4.0), known=known)
    assert any("go on from" in text for text in said)
    k = initial.names.index(next(name for name in initial.names if name.startswith("length/")))
    assert other.tracker.calibrated.x0[k] == pytest.approx(frames[-1].state[k])
    assert len(again) == len(frames)


def test_silent_markers_are_told_with_what_happens_then(squat: Recording) -> None:
    def no_markers(packet: Packet) -> list[Packet]:
        return [] if isinstance(packet, MarkerPacket) and 4.0 < packet.time_s < 5.0 else [packet]

    _, said, _ = run(Edited(squat, no_markers))
    assert "The markers are silent; the motion is held until they are back." in said
    assert "The markers are back." in said
    _, said, live = run(Replay(squat.window(0.0, 3.0), speed=0.0))
    for holds, what in ((True, "the motion is held until they are back"), (False, "the estimate waits for them")):
        fusion = Fusion(live.fusion.markers, None)
        monitor = Monitor(live.tracker.calibrated, 100.0, LivePlates(live.estimator, fusion, said.append), holds)
        monitor.last = replace(monitor.last, tracking="following")
        found = monitor.changes(fusion, 1e9)
        assert found == [f"The markers are silent; {what}."]
        assert monitor.last.tracking == ("lost" if holds else "following")


def test_a_movement_weighs_a_person_only_where_it_is_long_and_steady(monkeypatch: pytest.MonkeyPatch) -> None:
    """As `find_mass` has it of files; a step off the plates went into the mass, by half of it, before."""
    squats = replace(simulate_squat(seed=1, duration_s=12.0).recording.window(3.0, 12.0), subject={})
    monkeypatch.setattr(start, "standing_window", lambda recording: None)  # between the squats they do stand
    found = quietest(squats)
    assert found[0].subject["mass_kg"] == pytest.approx(70.0, abs=2.0) and "mean load" in found[2].text
    beside = np.where(squats.time < 7.0, 1.0, 0.3)[:, None]
    uneven = squats.with_plates(
        tuple(replace(p, force=p.force * beside, moment=p.moment * beside) for p in squats.plates)
    )
    for trial, why in (
        (uneven, "of its mean, which is no weight"),
        (squats.window(3.0, 7.0), "too short to weigh"),
    ):
        present, _, said = quietest(trial)
        assert "mass_kg" not in present.subject and why in said.text and "mean load" not in said.text
