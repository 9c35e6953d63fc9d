"""What was recorded can be read, whoever was killed."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dynakin.cli.app import main
from dynakin.errors import OutputError, RecordingError
from dynakin.filter.build import estimator_of
from dynakin.recordings.recording import Recording
from dynakin.settings.settings import Settings
from dynakin.simulation.trial import simulate_squat
from dynakin.stream.session import Live
from dynakin.stream.sinks.base import Callback, LiveFrame, Sink
from dynakin.stream.sinks.recorder import FILE, Recorder, finish, recorded
from dynakin.stream.sources.packets import Packet, PlatePacket
from dynakin.stream.sources.replay import Replay
from support.stream.made import MARKERS, PLATES, block, frame

SETTINGS = {"model": "sagittal7", "markers": "opencap", "mass_kg": 70.0, "height_m": 1.75, "sex": "male"}

SESSION = """
import time
from dynakin.simulation import simulate_squat
from dynakin.stream import Callback, Live, LiveFrame, Packet, PlatePacket, Replay, Sink
from dynakin.stream.sinks.recorder import Recorder
from dataclasses import replace
source = Replay(simulate_squat(seed=1, duration_s=8.0).recording, loop=True)
recorder = Recorder({folder!r}, {settings!r})
streams = source.open()
recorder.opened(streams.markers, streams.plates)
print("ready", flush=True)
while True:
    for packet in source.read(0.1):
        recorder.packet(replace(packet, arrived_s=time.monotonic()))
        print(packet.time_s if not hasattr(packet, "wrenches") else "", flush=True)
"""


@pytest.fixture(scope="module")
def squat() -> Recording:
    return simulate_squat(seed=1, duration_s=5.0).recording


def record(recording: Recording, folder: Path) -> None:
    source, recorder = Replay(recording, speed=0.0), Recorder(folder, SETTINGS)
    streams = source.open()
    assert streams.markers is not None
    recorder.opened(streams.markers, streams.plates)
    while (packets := source.read(0.0)) is not None:
        for packet in packets:
            kind: Any = type(packet)
            recorder.packet(kind(packet.time_s, list(vars(packet).values())[1], float(np.max(packet.time_s))))
    recorder.close()


def test_what_was_recorded_is_what_came(squat: Recording, tmp_path: Path) -> None:
    record(squat, tmp_path / "r")
    found = recorded(tmp_path / "r")
    np.testing.assert_array_equal(found.markers, squat.markers)
    np.testing.assert_array_equal(found.total_wrench(), squat.total_wrench())
    np.testing.assert_array_equal(found.time, squat.time)


def test_a_recorded_session_becomes_the_usual_output(squat: Recording, tmp_path: Path) -> None:
    record(squat, tmp_path / "r")
    result = finish(tmp_path / "r", tmp_path / "out")
    assert len(result.estimate.time) == squat.n_frames and result.failures.found == []
    assert result.comparison is not None and len(result.comparison.methods) == 3  # as `dynakin run` gives it
    config = tomllib.loads((tmp_path / "out" / "config.toml").read_text())
    assert (config["trial"], config["preset"]) == ("r", "default")
    assert {"coordinates.mot", "estimate.nc", "report.html"} <= {path.name for path in (tmp_path / "out").iterdir()}


def test_a_session_killed_while_recording_loses_nothing_but_the_last_moment(tmp_path: Path) -> None:
    folder = tmp_path / "r"
    code = SESSION.format(folder=str(folder), settings=SETTINGS)
    session = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    assert session.stdout is not None
    times = []
    for line in session.stdout:
        if line.strip() not in ("", "ready"):
            times.append(float(line))
        if times and times[-1] > 2.0:
            break
    os.kill(session.pid, signal.SIGKILL)
    session.wait()
    session.stdout.close()
    deadline = time.monotonic() + 10.0
    found = recorded(folder)
    while found.time[-1] < times[-1] - 0.1 and time.monotonic() < deadline:  # the writer is still at it
        time.sleep(0.1)
        found = recorded(folder)
    assert found.time[-1] >= times[-1] - 0.1 and found.n_frames >= len(times) - 10
    estimate = finish(folder, tmp_path / "out").estimate
    assert len(estimate.time) == found.n_frames and (tmp_path / "out" / "coordinates.mot").exists()


def test_a_writer_killed_goes_on_in_the_same_file(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "r")
    recorder.opened(MARKERS, PLATES)
    for k in range(100):
        recorder.packet(block(k / 100))
        recorder.packet(frame(k / 100))
        if k == 50:
            time.sleep(0.8)
            os.kill(recorder.pid, signal.SIGKILL)
            time.sleep(0.1)
    recorder.close()
    found = recorded_times(tmp_path / "r")
    assert recorder.restarts == 1 and found[0] == 0.0 and found[-1] == pytest.approx(0.99)
    assert len(found) >= 95


def recorded_times(folder: Path) -> list[float]:
    from dynakin.stream.sinks.record_format import read_records

    return [r.time_s for r in read_records(folder / FILE) if hasattr(r, "positions")]


def test_a_file_cut_anywhere_is_read_up_to_there(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "r")
    recorder.opened(MARKERS, None)
    for k in range(20):
        recorder.packet(frame(k / 100))
    recorder.close()
    whole = (tmp_path / "r" / FILE).read_bytes()
    for end in range(len(whole) - 100, len(whole)):
        (tmp_path / "r" / FILE).write_bytes(whole[:end])
        assert len(recorded_times(tmp_path / "r")) >= 18
    damaged = bytearray(whole)
    damaged[len(whole) // 2] ^= 255
    (tmp_path / "r" / FILE).write_bytes(damaged)
    assert len(recorded_times(tmp_path / "r")) == 19


def test_a_disk_that_is_full_ends_the_recording_at_once_and_says_so(tmp_path: Path) -> None:
    """/dev/full takes no byte; the file is there already, as a link to it."""
    recorder = Recorder(tmp_path / "r")
    os.kill(recorder.pid, signal.SIGKILL)  # before it has opened its file for good
    (tmp_path / "r" / FILE).unlink(missing_ok=True)
    (tmp_path / "r" / FILE).symlink_to("/dev/full")
    deadline = time.monotonic() + 20.0
    while recorder.failure() is None and time.monotonic() < deadline:
        recorder.packet(frame(0.0))
        time.sleep(0.01)
    failure = recorder.failure()
    assert failure is not None and "No space left on device" in failure and FILE in failure
    assert recorder.restarts == 1  # the one that was killed
    recorder.close()


def test_only_an_error_of_the_system_is_named_by_its_number(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A writer that Python ends has 1, which is the system's number of `Operation not permitted`."""
    popen = subprocess.Popen

    def broken(command: list[str], **options: object) -> subprocess.Popen[bytes]:
        return popen([command[0], "-c", "raise ValueError"], **options)  # type: ignore[call-overload,no-any-return]

    monkeypatch.setattr(subprocess, "Popen", broken)
    recorder = Recorder(tmp_path / "r")
    recorder.close()
    failure = recorder.failure()
    assert failure is not None and "takes no more (the process that writes ended)" in failure


def test_a_session_whose_recorder_fails_goes_on_and_is_no_success(squat: Recording) -> None:
    class Full(Sink):
        frames, closed = 0, 0

        def frame(self, frame: LiveFrame) -> None:
            self.frames += 1

        def failure(self) -> str | None:
            return "the disk is full" if self.frames >= 20 else None

        def close(self) -> None:
            self.closed += 1

    full, frames, said = Full(), list[LiveFrame](), list[str]()
    live = Live(
        estimator_of(Settings.of(SETTINGS, "live", ("model",))),
        [Replay(squat, speed=4.0)],
        [full, Callback(frames.append)],
        say=said.append,
    )
    live.run()
    assert said.count("the disk is full") == 1 and live.failures == ["the disk is full"]
    assert full.closed == 1 and len(frames) > full.frames >= 20


def test_a_folder_that_holds_something_is_refused(tmp_path: Path) -> None:
    (tmp_path / "x").write_text("mine")
    with pytest.raises(OutputError, match="is not empty"):
        Recorder(tmp_path)
    with pytest.raises(RecordingError, match="cannot be read"):
        recorded(tmp_path / "nothing")


def test_a_recording_keeps_the_delay_and_the_person(tmp_path: Path) -> None:
    """A block of the plates that came 0.2 s late: with a delay of 0.5 s it was waited for, also afterwards."""
    source = Replay(simulate_squat(seed=1, duration_s=5.0).recording, speed=0.0)
    streams = source.open()
    assert streams.markers is not None and streams.plates is not None
    unordered = replace(streams.plates, ordered=False)

    def written(folder: Path, delay_s: float | None) -> Recording:
        recorder = Recorder(folder, SETTINGS)
        if delay_s is not None:
            recorder.begins({"mass_kg": 61.5, "height_m": 1.66}, delay_s)
        recorder.opened(replace(streams.markers, ordered=False), unordered)  # type: ignore[type-var]
        source.open()
        late: list[Packet] = []
        while (packets := source.read(0.0)) is not None:
            for packet in packets:
                at = float(np.max(packet.time_s))
                if isinstance(packet, PlatePacket) and 1.0 < at < 1.1:
                    late.append(replace(packet, arrived_s=at + 0.2))
                    continue
                while late and late[0].arrived_s <= at:
                    recorder.packet(late.pop(0))
                recorder.packet(replace(packet, arrived_s=at))
        recorder.close()
        return recorded(folder)

    waited, not_waited = written(tmp_path / "a", 0.5), written(tmp_path / "b", None)
    assert waited.subject == {"mass_kg": 61.5, "height_m": 1.66} and not_waited.subject == {}
    np.testing.assert_array_equal(waited.total_wrench(), source.recording.total_wrench())
    assert not np.array_equal(not_waited.total_wrench(), source.recording.total_wrench(), equal_nan=True)


@pytest.mark.parametrize("magic", [False, True])
def test_what_is_damaged_in_a_recording_is_missing_and_said(magic: bool, squat: Recording, tmp_path: Path) -> None:
    record(squat, tmp_path / "r")
    whole = (tmp_path / "r" / FILE).read_bytes()
    assert recorded(tmp_path / "r").notes == ()
    damaged = bytearray(whole)
    at = whole.index(b"DKR1M", len(whole) // 2)
    damaged[at if magic else at + 100] ^= 255
    (tmp_path / "r" / FILE).write_bytes(damaged)
    found = recorded(tmp_path / "r")
    (lost,) = np.flatnonzero(np.isnan(found.markers).all(axis=(1, 2)))
    np.testing.assert_allclose(found.time, squat.time, atol=1e-9)
    kept = np.delete(np.arange(squat.n_frames), lost)
    np.testing.assert_array_equal(found.markers[kept], squat.markers[kept])
    assert np.isnan(found.plates[0].force[lost]).all()
    (said,) = (note for note in found.notes if "damaged" in note.text)
    assert said.level == "warning" and said.text.endswith("for it: 1.")
    assert said.text.startswith(f"the recording {tmp_path / 'r' / FILE} is damaged in 1 place (")
    estimate = finish(tmp_path / "r", tmp_path / "out", {"mass_kg": 69.0}).estimate
    assert said in estimate.messages and estimate.config["mass_kg"] == 69.0

    (tmp_path / "r" / FILE).write_bytes(whole[: at + 50])  # a session that was killed loses its last moment
    assert recorded(tmp_path / "r").notes == ()


def test_options_that_change_nothing_are_refused_beside_finish(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for options, said in (
        (["--finish", "r", "-o", "out", "--lag", "0"], "--lag changes nothing with --finish"),
        (["--finish", "r", "-o", "out", "--port", "0"], "--port changes nothing with --finish"),
        (["--source", "simulate:squat", "-o", "out"], "-o out goes with --finish"),
    ):
        assert main(["live", *options]) == 2
        assert said in capsys.readouterr().err
