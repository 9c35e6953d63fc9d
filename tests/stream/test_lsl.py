"""Lab Streaming Layer with the real library on both ends."""

from __future__ import annotations

import threading
import time
import uuid
from typing import Any

import numpy as np
import pytest

import dynakin
from dynakin.errors import StreamError
from dynakin.recordings import Recording
from dynakin.simulation import simulate_squat
from dynakin.stream import Callback, Live, LiveFrame

pylsl = pytest.importorskip("pylsl")
from dynakin.stream.lsl_sink import LslSink  # noqa: E402
from dynakin.stream.lsl_source import LslSource  # noqa: E402

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
    """Sends a recording: markers in mm, plates at 1000 Hz with a clock of their own and jitter."""

    def __init__(self, recording: Recording, name: str) -> None:
        self.recording = recording
        labels = [f"{m}_{a}" for m in recording.marker_names for a in "XYZ"]
        self.markers = outlet(f"{name}-markers", labels, ["mm"] * len(labels), 100.0)
        loads = [f"{p.name}_{c}" for p in recording.plates for c in ("FX", "FY", "FZ", "MX", "MY", "MZ")]
        units = [u for _ in recording.plates for u in ["N"] * 3 + ["N m"] * 3]
        self.plates = outlet(f"{name}-plates", loads, units, 1000.0)
        self.thread = threading.Thread(target=self.run, daemon=True)

    def run(self) -> None:
        rng = np.random.default_rng(1)
        rec = self.recording
        wrench = np.hstack([np.hstack([p.force, p.moment]) for p in rec.plates])
        fine = np.arange(round(rec.time[-1] * 1000)) / 1000
        wrench = np.stack([np.interp(fine, rec.time, column) for column in wrench.T], axis=1)
        begun = pylsl.local_clock() + 0.05
        row = 0
        for k, t in enumerate(rec.time):
            time.sleep(max(0.0, begun + t - pylsl.local_clock()))
            while row < len(fine) and fine[row] <= t:
                jitter = 0.0001 * rng.uniform(-1, 1)
                self.plates.push_sample(wrench[row], begun + fine[row] + OFFSET_S + jitter)
                row += 1
            self.markers.push_sample(1000.0 * rec.markers[k].ravel(), begun + t)


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
        return list(estimator.core_model.coordinate_names)

    def begin() -> None:
        while live._fusion is None:
            time.sleep(0.02)
        laboratory.thread.start()
        listen()
        live.stop()

    director = threading.Thread(target=begin, daemon=True)
    director.start()
    live.run()
    director.join(5.0)
    assert live.fusion.clock_offset_s == pytest.approx(-OFFSET_S, abs=0.03)
    assert len(frames) > 200 and len(received) > 50
    sent = {round(float(f.estimate.coordinates[3]), 9) for f in frames}
    assert all(round(value, 9) in sent for value in received)
    used = [f for f in frames[50:] if f.status.plates == "used"]
    assert len(used) > 0.8 * len(frames[50:])
    # Positions arrive in metres, whatever the unit on the wire.
    first = frames[0].fused
    assert np.nanmin(np.abs(recording.markers - first.positions).max(axis=(1, 2))) < 1e-9


def test_a_stream_that_is_not_there_is_named() -> None:
    with pytest.raises(StreamError, match=r"no such stream within 0\.3 s"):
        LslSource("nobody-sends-this").open(0.3)
