"""Records what comes, as it comes; turned into the usual output folder afterwards."""

from __future__ import annotations

import os
import queue
import subprocess
import sys
import threading
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from dynakin.errors import OutputError, RecordingError
from dynakin.pipeline.result import Result
from dynakin.pipeline.stages import run_case
from dynakin.recordings.limits import FASTEST_HZ, SLOWEST_HZ
from dynakin.recordings.recording import Recording
from dynakin.results.files.folder import check_output_writable
from dynakin.settings.defaults import DELAY_S
from dynakin.settings.settings import Settings
from dynakin.stream.fusion import Fused, Fusion
from dynakin.stream.sinks.append import SYSTEM_ERROR
from dynakin.stream.sinks.base import Sink, Status
from dynakin.stream.sinks.record_format import packet_record, read_records, text_record
from dynakin.stream.sources.packets import MarkerPacket, Packet, PlatePacket, StreamInfo
from dynakin.stream.start import recording_of
from dynakin.validation.case import case_of

FILE = "stream.dkr"
_CLOSE_S = 10.0  # for the last half second to reach the disk


class Recorder(Sink):
    """Writes every packet through a process of its own, which outlives a session that is killed.

    Args:
        folder: new, or empty. settings: keys of the configuration, for `finish`.

    Raises:
        OutputError: the folder holds something, or cannot be made.
    """

    def __init__(self, folder: str | Path, settings: dict[str, Any] | None = None) -> None:
        self.folder, self.settings = Path(folder), dict(settings or {})
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            filled = any(self.folder.iterdir())
        except OSError as error:
            raise OutputError(f"{self.folder}: cannot be written ({error.strerror})") from None
        if filled:
            raise OutputError(f"{self.folder}: is not empty, expected a new folder for a recording")
        self._session: dict[str, Any] = {}
        self.restarts = 0  # of the process, which somebody else ended
        self._failure: str | None = None
        self._queue: queue.SimpleQueue[bytes | None] = queue.SimpleQueue()
        self._process = self._begin()
        self._thread = threading.Thread(target=self._write, daemon=True)
        self._thread.start()

    @property
    def pid(self) -> int:
        """Process that writes."""
        return self._process.pid

    def begins(self, subject: Mapping[str, float], delay_s: float) -> None:
        """Keeps them, so that `finish` fuses as it was live."""
        self._session = {"subject": dict(subject), "delay_s": delay_s}

    def opened(self, markers: StreamInfo, plates: StreamInfo | None) -> None:
        """Writes what is needed to read the rest."""
        streams = {"markers": asdict(markers), "plates": None if plates is None else asdict(plates)}
        self._queue.put(text_record({"streams": streams, "settings": self.settings, **self._session, "version": 1}))

    def packet(self, packet: Packet) -> None:
        """Writes it."""
        self._queue.put(packet_record(packet))

    def said(self, text: str, status: Status) -> None:
        """Writes it."""
        self._queue.put(text_record({"said": text, "phase": status.phase}))

    def failure(self) -> str | None:
        """The file takes no more, as of a full disk."""
        return self._failure

    def close(self) -> None:
        """Everything is on the disk afterwards, or there is a `failure`; may be called twice."""
        if not self._thread.is_alive():
            return
        self._queue.put(None)
        self._thread.join(_CLOSE_S)
        if self._thread.is_alive():
            self._fail(f"still not written {_CLOSE_S:g} s after the end")

    def _begin(self) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-I", str(Path(__file__).with_name("append.py")), str(self.folder / FILE)]
        return subprocess.Popen(command, stdin=subprocess.PIPE, start_new_session=True, bufsize=0)

    def _write(self) -> None:
        while (data := self._queue.get()) is not None:
            while not self._sent(data):
                if (code := self._process.wait()) > 0:
                    self._fail(_why_ended(code))
                    return
                self.restarts += 1  # somebody ended the process: a new one goes on in the same file
                self._process = self._begin()
        assert self._process.stdin is not None
        self._process.stdin.close()
        if (code := self._process.wait()) > 0:
            self._fail(_why_ended(code))

    def _fail(self, reason: str) -> None:
        self._failure = (
            f"Error: the recording has ended: {self.folder / FILE} takes no more ({reason}). What was written before "
            "can be read."
        )

    def _sent(self, data: bytes) -> bool:
        """False where the process has ended."""
        assert self._process.stdin is not None
        try:
            self._send(data)
        except OSError:
            return False
        return True

    def _send(self, data: bytes) -> None:
        assert self._process.stdin is not None
        rest = memoryview(data)
        while rest:
            rest = rest[self._process.stdin.write(rest) :]


def _why_ended(code: int) -> str:
    return os.strerror(code - SYSTEM_ERROR) if code > SYSTEM_ERROR else "the process that writes ended"


def read_recorded(folder: str | Path) -> tuple[list[Fused], StreamInfo, StreamInfo | None, dict[str, Any]]:
    """Samples of a recorded session, fused as they were live, its streams, and what it began with: "settings",
    "subject" and "delay_s" (the last two are not in old recordings).

    Raises:
        RecordingError: nothing was recorded there.
    """
    path = Path(folder) / FILE
    fusion: Fusion | None = None
    begun: dict[str, Any] = {}
    found: list[Fused] = []
    for record in read_records(path):
        if isinstance(record, MarkerPacket | PlatePacket):
            if fusion is not None:
                fusion.push(record)
                found += fusion.poll(record.arrived_s)
        elif "streams" in record:
            if begun and record["streams"] != begun["streams"]:
                raise RecordingError(f"{path}: holds two sessions with other markers or plates, expected one")
            try:
                fusion = fusion or _fusion(record)
            except (KeyError, TypeError, ValueError, AttributeError, ArithmeticError) as error:
                raise RecordingError(f"{path}: its streams are not described as expected ({error!r})") from None
            begun = begun or record
    if fusion is None:
        raise RecordingError(f"{path}: holds no recorded session")
    return found + fusion.poll(np.inf), fusion.markers, fusion.plates, begun


def recorded(folder: str | Path) -> Recording:
    """A recorded session as a recording, laboratory frame.

    Raises:
        RecordingError: nothing was recorded there.
    """
    found, markers, plates, begun = read_recorded(folder)
    names = plates.names if plates else ()
    return recording_of(found, markers.names, names, Path(folder).name, begun.get("subject"))


def finish(folder: str | Path, output: str | Path) -> Result:
    """Turn a recorded session into the usual output folder, as `dynakin run` makes it of a recording; late stages that
    failed are in its ``failures``.

    Raises:
        RecordingError: nothing was recorded there. Others: as `dynakin run`.
    """
    check_output_writable(Path(output))
    settings = read_recorded(folder)[3]["settings"]
    config = Settings.of(settings | {"trial": Path(folder), "output": Path(output)}, "live")
    result = run_case(case_of(config, recording=recorded(folder)), keep=None)  # live has no option to keep it
    result.save(output, check=False)
    return result


def _fusion(record: Mapping[str, Any]) -> Fusion:
    streams = {kind: info and _info(info) for kind, info in record["streams"].items()}
    if not all(isinstance(record.get(key, {}), dict) for key in ("settings", "subject")):
        raise ValueError("settings and subject, expected tables")
    return Fusion(streams["markers"], streams["plates"], delay_s=float(record.get("delay_s", DELAY_S)))


def _info(stream: dict[str, Any]) -> StreamInfo:
    rate = float(stream["rate_hz"])
    if not SLOWEST_HZ <= rate <= FASTEST_HZ:
        raise ValueError(f"{rate:g} Hz, expected {SLOWEST_HZ:g} to {FASTEST_HZ:g} Hz")
    return StreamInfo(tuple(map(str, stream["names"])), rate, str(stream["clock"]), bool(stream.get("ordered")))
