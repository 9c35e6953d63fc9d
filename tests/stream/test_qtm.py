"""Qualisys' real-time protocol: the real client against a server that speaks it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest

import dynakin
from dynakin.errors import ConfigError, StreamError
from dynakin.recordings.recording import Recording
from dynakin.recordings.resampling import resample
from dynakin.simulation.trial import simulate_squat
from dynakin.stream.session import Live
from dynakin.stream.sinks.base import Callback, LiveFrame
from dynakin.stream.sources.packets import MarkerPacket, Packet, PlatePacket
from dynakin.stream.sources.plugins import SOURCES, plugin
from support.stream.offline import offline_states
from support.stream.qtm_server import QtmServer

pytest.importorskip("qtm_rt")
from dynakin.stream.sources.qtm import QtmSource
from dynakin.stream.sources.qtm_parameters import parse_parameters


@pytest.fixture(scope="module")
def squat() -> Recording:
    return simulate_squat(seed=1, duration_s=5.0).recording


@contextmanager
def serving(recording: Recording, **options: Any) -> Iterator[QtmServer]:
    server = QtmServer(recording, **options)
    try:
        yield server
    finally:
        server.close()


def received(server: QtmServer, **options: Any) -> list[Packet]:
    """All packets of one connection."""
    source = QtmSource("127.0.0.1", port=server.port, **options)
    source.open(20.0)
    found: list[Packet] = []
    frames = 0
    while frames < server.recording.n_frames:
        packets = source.read(1.0)
        assert packets
        found += packets
        frames = sum(isinstance(packet, MarkerPacket) for packet in found)
    source.close()
    return found


def session(server: QtmServer, until: float) -> tuple[list[LiveFrame], list[str], Live]:
    subject = dynakin.Subject(mass_kg=70.0, height_m=1.75, sex="male")
    estimator = dynakin.Estimator(dynakin.load_model("sagittal7", subject=subject, markers="opencap"))
    frames: list[LiveFrame] = []
    said: list[str] = []

    def on_frame(frame: LiveFrame) -> None:
        frames.append(frame)
        if frame.estimate.time_s >= until - 1e-6:
            live.stop()

    source = plugin(SOURCES, f"qtm:127.0.0.1,port={server.port}")
    # Nobody is late here: a long wait keeps a busy machine from changing the samples.
    live = Live(
        estimator, [source], [Callback(on_frame)], say=said.append, standing_wait_s=2.0, delay_s=5.0, max_late_s=60.0
    )
    live.run()
    return frames, said, live


@pytest.mark.parametrize("frame", ["plate", "lab"])
def test_markers_and_forces_arrive_as_they_were(squat: Recording, frame: str) -> None:
    hidden = squat.markers.copy()
    hidden[10:20, 3] = np.nan
    recording = Recording("squat", None, squat.time, squat.marker_names, hidden, squat.plates)
    with serving(recording, speed=50.0, frame=frame) as server:
        packets = received(server, frame=frame)
    frames = [packet for packet in packets if isinstance(packet, MarkerPacket)]
    np.testing.assert_allclose([one.time_s for one in frames], squat.time - squat.time[0], atol=1e-6)
    np.testing.assert_array_equal(np.stack([one.positions for one in frames]), server.sent)
    assert np.isnan(frames[15].positions[3]).all()
    blocks = [packet for packet in packets if isinstance(packet, PlatePacket)]
    np.testing.assert_allclose(np.concatenate([one.time_s for one in blocks]), server.plate_time, atol=1e-9)
    np.testing.assert_allclose(np.concatenate([one.wrenches for one in blocks]), server.wrenches, atol=2e-3)


def test_live_equals_offline_on_the_same_samples(squat: Recording) -> None:
    with serving(squat) as server:
        frames, said, live = session(server, squat.time[-1] - squat.time[0])
    assert "version 1.18" in server.commands and "streamframes allframes 3d force" in server.commands
    assert "Ready: move." in said and live.fusion.marker_counts.lost == 0
    begin = squat.n_frames - len(frames)
    assert begin < 205 and all(f.status.plates == "used" for f in frames)
    # float32 on the wire: the plates' loads are rounded, about 1e-7 of a newton metre's size.
    total = resample(server.wrenches.sum(axis=1), server.plate_time, squat.time, causal=True)
    states = offline_states(live, squat.time[begin:], squat.marker_names, server.sent[begin:], total[begin:])
    np.testing.assert_allclose(np.stack([f.state for f in frames]), states, rtol=1e-4, atol=1e-4)


def test_a_measurement_that_stops_and_comes_back(squat: Recording) -> None:
    with serving(squat, hang_up=300) as server:
        frames, said, live = session(server, 6.0)
    words = " ".join(said)
    assert "QTM closed the connection" in words and "The source is back." in words
    times = np.array([f.estimate.time_s for f in frames])
    assert (np.diff(times) > 0).all() and live.fusion.clock_restarts == 1


def test_plates_that_count_from_another_moment_have_a_clock_of_their_own(squat: Recording) -> None:
    with serving(squat, plate_start=50_000, speed=10.0) as server:
        source = QtmSource("127.0.0.1", port=server.port)
        streams = source.open(20.0)
        source.close()
    assert streams.markers is not None and streams.plates is not None
    assert streams.plates.clock != streams.markers.clock
    assert streams.markers.rate_hz == pytest.approx(100.0) and streams.plates.names == ("AMTI 1", "AMTI 2")
    assert any("another moment" in note for note in map(str, streams.notes))


def test_nobody_answers() -> None:
    with pytest.raises(StreamError, match=r"no QTM answers at port 9 within 0\.3 s"):
        QtmSource("127.0.0.1", port=9).open(0.3)


def test_qtm_without_a_measurement_is_told_so(squat: Recording) -> None:
    with serving(squat, measuring=False) as server, pytest.raises(StreamError, match="no frames come within 1 s"):
        QtmSource("127.0.0.1", port=server.port).open(1.0)


def test_plates_in_an_unknown_unit_are_refused() -> None:
    text = "<P><The_3D><Label><Name>C7</Name></Label></The_3D><Force><Unit_Length>ell</Unit_Length><Plate/></Force></P>"
    with pytest.raises(StreamError, match="unknown unit 'ell', expected mm, cm or m"):
        parse_parameters(text, "qtm:here")


@pytest.mark.parametrize("text", ["qtm:", "qtm:host,forces=floor", "qtm:host,port=x", "qtm:host,rate=3"])
def test_wrong_options(text: str) -> None:
    with pytest.raises(ConfigError, match="expected qtm:HOST"):
        plugin(SOURCES, text)
