"""Estimates on the wire: four streams, each channel with label and unit, values as they were estimated."""

from __future__ import annotations

import threading
import uuid
from typing import Any

import numpy as np
import pytest

import dynakin
from dynakin.simulation.trial import simulate_squat
from dynakin.stream.session import Live
from dynakin.stream.sinks.base import Callback, LiveFrame, Sink, Started
from dynakin.stream.sources.replay import Replay

pylsl = pytest.importorskip("pylsl")
from dynakin.stream.sinks.lsl import LslSink  # noqa: E402

UNITS = {
    "coordinates": {"knee": "rad"},
    "speeds": {"knee": "rad/s"},
    "moments": {"knee": "N m"},
    "parameters": {"length/thigh": "m", "inertia/thigh/mass": "kg", "inertia/thigh/mx": "kg m"},
}


class Begun(Sink):
    def started(self, started: Started) -> None:
        self.last = started


def channels_of(info: Any) -> list[tuple[str, str]]:
    found, channel = [], info.desc().child("channels").child("channel")
    while not channel.empty():
        found.append((channel.child_value("label"), channel.child_value("unit")))
        channel = channel.next_sibling()
    return found


def test_every_channel_has_its_label_unit_and_value() -> None:
    recording = simulate_squat(seed=1, duration_s=5.0).recording
    subject = dynakin.Subject(mass_kg=70.0, height_m=1.75, sex="male")
    estimator = dynakin.Estimator(dynakin.load_model("sagittal7", subject=subject, markers="opencap"))
    begun, frames = Begun(), list[LiveFrame]()
    Live(
        estimator, [Replay(recording, speed=0.0)], [begun, Callback(frames.append)], standing_wait_s=0.5, say=print
    ).run()
    frame, name = frames[-1], f"test{uuid.uuid4().hex[:8]}"
    sink = LslSink(name)
    sink.started(begun.last)
    again = threading.Event()

    def send() -> None:
        while not again.wait(0.05):
            sink.frame(frame)

    sender = threading.Thread(target=send, daemon=True)
    sender.start()
    try:
        for kind, units in UNITS.items():
            inlet = pylsl.StreamInlet(pylsl.resolve_byprop("name", f"{name}-{kind}", timeout=20.0)[0])
            channels = channels_of(inlet.info(5.0))
            values, _ = inlet.pull_sample(timeout=5.0)
            assert units.items() <= dict(channels).items()
            assert all(unit for _, unit in channels)
            labels = [label for label, _ in channels]
            if kind == "parameters":
                expected = [frame.state[begun.last.initial.names.index(label)] for label in labels]
            else:
                assert labels == list(begun.last.model.coordinate_names)
                assert frame.published is not None
                expected = getattr(frame.published, kind)
            np.testing.assert_array_equal(values, expected)
    finally:
        again.set()
        sender.join()
        sink.close()
