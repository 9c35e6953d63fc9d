"""Lab Streaming Layer with the real library on both ends."""

from __future__ import annotations

import threading
import time
import uuid
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import dynakin
from dynakin.errors import StreamError
from dynakin.recordings.pushes import UNLOADED_N
from dynakin.recordings.recording import Recording
from dynakin.recordings.resampling import CausalLowPass, latest_before
from dynakin.simulation.trial import simulate_squat
from dynakin.stream.fusion import Fused
from dynakin.stream.session import Live
from dynakin.stream.sinks.base import Callback, LiveFrame, Sink
from dynakin.stream.sources.packets import MarkerPacket, Packet, PlatePacket
from support.stream.offline import offline_states

pylsl = pytest.importorskip("pylsl")
from dynakin.stream.sinks.lsl import LslSink  # noqa: E402
from dynakin.stream.sources.lsl import LslSource  # noqa: E402

OFFSET_S = 4321.0


def outlet(name: str, labels: list[str], units: list[str], rate_hz: float) -> Any:
    info = pylsl.StreamInfo(name, "MoCap", len(labels), rate_hz, "double64", name)
    channels = info.desc().append_child("channels")
    for label, unit in zip(labels, units, strict=True):
        channel = channels.append_child("channel")
        channel.append_child_value("label", label)
        channel.append_child_value("unit", unit)
    return pylsl.StreamOutlet(info)


class Laboratory:
    """Sends a recording: markers in mm, plates at 1000 Hz with a clock of their own and jitter of their stamps."""

    def __init__(self, recording: Recording, name: str, jitter_s: float = 0.0001) -> None:
        self.recording = recording
        labels = [f"{m}_{a}" for m in recording.marker_names for a in "XYZ"]
        self.markers = outlet(f"{name}-markers", labels, ["mm"] * len(labels), recording.rate)
        loads = [f"{p.name}_{c}" for p in recording.plates for c in ("FX", "FY", "FZ", "MX", "MY", "MZ")]
        units = [u for _ in recording.plates for u in ["N"] * 3 + ["N m"] * 3]
        self.plates = outlet(f"{name}-plates", loads, units, 1000.0)
        rows = np.hstack([np.hstack([p.force, p.moment]) for p in recording.plates])
        begin = recording.time[0]
        self.fine = np.arange(round((recording.time[-1] - begin) * 1000) + 1) / 1000
        self.loads = np.stack([np.interp(self.fine, recording.time - begin, c) for c in rows.T], axis=1)
        self.jitter = jitter_s * np.random.default_rng(1).uniform(-1, 1, len(self.fine))
        self.thread = threading.Thread(target=self.run, daemon=True)

    def run(self) -> None:
        begun = pylsl.local_clock() + 0.05
        row = 0
        for k, t in enumerate(self.recording.time - self.recording.time[0]):
            time.sleep(max(0.0, begun + t - pylsl.local_clock()))
            while row < len(self.fine) and self.fine[row] <= t + 1e-9:
                self.plates.push_sample(self.loads[row], begun + self.fine[row] + OFFSET_S + self.jitter[row])
                row += 1
            self.markers.push_sample(1000.0 * self.recording.markers[k].ravel(), begun + t)


class Kept(Sink):
    """Packets as they came, and frames."""

    def __init__(self) -> None:
        self.packets: list[Packet] = []
        self.frames: list[LiveFrame] = []

    def packet(self, packet: Packet) -> None:
        self.packets.append(packet)

    def frame(self, frame: LiveFrame) -> None:
        self.frames.append(frame)


def begin_when_open(live: Live, laboratory: Laboratory, then: Callable[[], None]) -> threading.Thread:
    """Sends once the session listens."""

    def begin() -> None:
        while live._fusion is None:
            time.sleep(0.02)
        laboratory.thread.start()
        then()
        live.stop()

    director = threading.Thread(target=begin, daemon=True)
    director.start()
    return director


def test_markers_and_plates_come_in_and_estimates_go_out() -> None:
    recording = simulate_squat(seed=1, duration_s=5.0).recording
    name = f"test{uuid.uuid4().hex[:8]}"
    laboratory = Laboratory(recording, name)
    subject = dynakin.Subject(mass_kg=70.0, height_m=1.75, sex="male")
    estimator = dynakin.Estimator(dynakin.load_model("sagittal7", subject=subject, markers="opencap"))
    frames: list[LiveFrame] = []
    said: list[str] = []
    received: list[float] = []
    sources = [LslSource(f"{name}-markers"), LslSource(f"{name}-plates", own_clock=True)]
    live = Live(estimator, sources, [LslSink(name), Callback(frames.append)], say=said.append, standing_s=1.5)

    def listen() -> None:
        found = pylsl.resolve_byprop("name", f"{name}-coordinates", timeout=20.0)
        if not found:
            return
        inlet = pylsl.StreamInlet(found[0])
        labels = inlet.info(2.0).desc().child("channels").child("channel").child_value("label")
        assert labels == recorded_names()[0]
        while (sample := inlet.pull_sample(timeout=2.0))[0] is not None:
            received.append(sample[0][3])

    def recorded_names() -> list[str]:
        return list(live.tracker.core_model.coordinate_names)

    director = begin_when_open(live, laboratory, listen)
    live.run()
    director.join(5.0)
    assert live.fusion.clock_offset_s == pytest.approx(-OFFSET_S, abs=0.03)
    assert len(frames) > 200 and len(received) > 50
    sent = {round(float(f.published.coordinates[3]), 9) for f in frames if f.published is not None}
    assert all(round(value, 9) in sent for value in received)
    used = [f for f in frames[50:] if f.status.plates == "used"]
    assert len(used) > 0.8 * len(frames[50:])
    # Positions arrive in metres, whatever the unit on the wire.
    first = frames[0].fused
    assert np.nanmin(np.abs(recording.markers - first.positions).max(axis=(1, 2))) < 1e-9


def test_live_equals_offline_on_the_same_samples(data_dir: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    trial = data_dir / "opencap_subject4"
    recording = dynakin.read(trial / "squats1.trc", trial / "squats1_grf.mot").window(0.0, 6.5)
    name = f"test{uuid.uuid4().hex[:8]}"
    laboratory = Laboratory(recording, name, jitter_s=0.0003)
    subject = dynakin.Subject(mass_kg=60.05, height_m=1.70)
    estimator = dynakin.Estimator(dynakin.load_model("sagittal7", subject=subject, markers="opencap"))
    kept = Kept()
    sources = [LslSource(f"{name}-markers"), LslSource(f"{name}-plates", own_clock=True)]
    live = Live(
        estimator,
        sources,
        [kept],
        say=lambda text: None,
        standing_s=1.5,
        standing_wait_s=1.6,
        delay_s=5.0,
        max_late_s=60.0,
    )

    def wait() -> None:
        laboratory.thread.join(60.0)
        time.sleep(0.5)

    begin_when_open(live, laboratory, wait)
    stepped: list[Fused] = []
    sampled = live._sample

    def sample(fused: Fused) -> dynakin.Sample:
        stepped.append(fused)
        return sampled(fused)

    monkeypatch.setattr(live, "_sample", sample)
    live.run()
    # What arrived is what was sent.
    markers = [packet for packet in kept.packets if isinstance(packet, MarkerPacket)]
    blocks = [packet for packet in kept.packets if isinstance(packet, PlatePacket)]
    loads = np.concatenate([block.wrenches for block in blocks])
    np.testing.assert_allclose(np.stack([one.positions for one in markers]), recording.markers, atol=1e-12)
    np.testing.assert_array_equal(loads.reshape(len(loads), -1), laboratory.loads)
    # Offline: the whole stream through the same low-pass, the latest sample before each frame, empty plates at zero.
    filtered = (
        CausalLowPass(1000.0, 0.4 * recording.rate).push(loads.reshape(len(loads), -1)).reshape(len(loads), -1, 6)
    )
    filtered[np.linalg.norm(filtered[:, :, :3], axis=2) < UNLOADED_N] = 0.0
    stamps = np.concatenate([block.time_s for block in blocks]) + live.fusion.clock_offset_s
    frames = kept.frames
    times = np.array([f.estimate.time_s for f in frames])
    wrench = np.full((len(frames), 6), np.nan)
    earlier = 0
    for k, row in enumerate(latest_before(stamps, times, 0.001)):
        had = frames[k].fused.wrenches
        if had is not None:  # a busy machine may leave some out; jitter may hide the very latest
            back = int(not np.allclose(had, filtered[row], atol=1e-9))
            np.testing.assert_allclose(had, filtered[row - back], atol=1e-9)
            wrench[k] = filtered[row - back].sum(axis=0)
            earlier += back
    assert len(frames) > 400 and np.isnan(wrench).mean() < 0.2 and earlier < 0.2 * len(frames)
    # Nobody stands here: the frames of which the model was measured came first.
    before = stepped[: -len(frames)]
    assert len(before) in (50, 51) and before[-1].sample.time_s < times[0]
    own = np.stack([one.positions for one in markers])[len(markers) - len(stepped) :]
    np.testing.assert_array_equal(np.stack([one.positions for one in stepped]), own)
    assert all(one.wrenches is not None for one in before)
    wrench = np.concatenate([[one.wrenches.sum(axis=0) for one in before if one.wrenches is not None], wrench])
    times = np.concatenate([[one.sample.time_s for one in before], times])
    states = offline_states(live, times, recording.marker_names, own, wrench)
    np.testing.assert_allclose(np.stack([f.state for f in frames]), states[len(before) :], atol=1e-9)


def test_a_stream_that_is_not_there_is_named() -> None:
    with pytest.raises(StreamError, match=r"no such stream within 0\.3 s"):
        LslSource("nobody-sends-this").open(0.3)
