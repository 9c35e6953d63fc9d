"""Records what comes, as it comes; turned into the usual output folder afterwards."""

from __future__ import annotations

import os
import queue
import subprocess
import sys
import threading
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from dynakin.errors import ConfigError, OutputError, RecordingError
from dynakin.messages import note, warning
from dynakin.pipeline.result import Result
from dynakin.pipeline.stages import run_case
from dynakin.recordings.formats.trajectories import clean_markers
from dynakin.recordings.limits import FASTEST_HZ, SLOWEST_HZ
from dynakin.recordings.plates.dead import without_dead_channels
from dynakin.recordings.plates.stuck import frozen_in_words
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
_NAMED = 5  # holes whose times are said
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


class Hole(NamedTuple):
    """The times of what is whole before and after something damaged, s."""

    after_s: float
    before_s: float


class Recorded(NamedTuple):
    """A recorded session.

    Attributes:
        samples: fused as they were live. begun: what it began with: "settings", "subject" and "delay_s" (the last two
            are not in old recordings). holes: where the file is damaged. frozen: plates that stood still, from when
            and until when.
    """

    samples: list[Fused]
    markers: StreamInfo
    plates: StreamInfo | None
    begun: dict[str, Any]
    holes: list[Hole]
    frozen: list[tuple[str, float, float]]


def read_recorded(folder: str | Path) -> Recorded:
    """A recorded session.

    Raises:
        RecordingError: nothing was recorded there.
    """
    path = Path(folder) / FILE
    fusion: Fusion | None = None
    begun: dict[str, Any] = {}
    found: list[Fused] = []
    holes: list[Hole] = []
    damaged, last_s = False, -np.inf
    for record in read_records(path):
        if record is None:
            damaged = True
        elif isinstance(record, MarkerPacket | PlatePacket):
            if damaged:
                holes.append(Hole(last_s, float(np.min(record.time_s))))
            damaged, last_s = False, float(np.max(record.time_s))
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
    if damaged:
        holes.append(Hole(last_s, np.inf))
    found += fusion.poll(np.inf)
    frozen = [(*plate, until) for plate, until in zip(fusion.frozen_plates, fusion.frozen_until, strict=True)]
    return Recorded(found, fusion.markers, fusion.plates, begun, holes, frozen)


def recorded(folder: str | Path) -> Recording:
    """A recorded session as a recording, laboratory frame; frames that a damaged file has lost are missing.

    Raises:
        RecordingError: nothing was recorded there.
    """
    return _recording(read_recorded(folder), folder)


def finish(folder: str | Path, output: str | Path, given: Mapping[str, Any] | None = None) -> Result:
    """Turn a recorded session into the usual output folder, as `dynakin run` makes it of a recording; late stages that
    failed are in its ``failures``.

    Args:
        given: settings in the place of those of the session.

    Raises:
        RecordingError: nothing was recorded there. ConfigError: a file that the session was told of is there no more.
            Others: as `dynakin run`.
    """
    check_output_writable(Path(output))
    found = read_recorded(folder)
    for key, told in found.begun["settings"].items():
        file = Path(told) if isinstance(told, str) and key not in (given or {}) else Path()
        if file.is_absolute() and not file.exists():
            raise ConfigError(f"{folder}: the session's {key}, {told}, is there no more, expected it, or --{key} FILE")
    settings = found.begun["settings"] | (given or {}) | {"trial": Path(folder), "output": Path(output)}
    case = case_of(Settings.of(settings, "live"), recording=_recording(found, folder))
    result = run_case(case, keep=None)  # live has no option to keep it
    result.save(output, check=False)
    return result


def _recording(found: Recorded, folder: str | Path) -> Recording:
    names = found.plates.names if found.plates else ()
    subject = found.begun.get("subject")
    made = recording_of(found.samples, found.markers.names, names, Path(folder).name, subject)
    if not found.holes:
        return _as_read(made, found, folder)
    filled = _with_lost_frames(made, 1.0 / found.markers.rate_hz, found.holes)
    lost, count = filled.n_frames - made.n_frames, len(found.holes)
    when = ", ".join(_when(hole) for hole in found.holes[:_NAMED])
    when += f" and {count - _NAMED} more" * (count > _NAMED)
    text = (
        f"the recording {Path(folder) / FILE} is damaged in {count} place{'s' * (count > 1)} ({when}): what was "
        f"recorded there cannot be read; frames of markers that are missing for it: {lost}."
    )
    said = warning("recording", text) if lost else note("recording", text)
    return _as_read(replace(filled, notes=(*filled.notes, said)), found, folder)


def _as_read(recording: Recording, found: Recorded, folder: str | Path) -> Recording:
    """Without what is no measurement, as a file is read."""
    markers, notes = clean_markers(recording.marker_names, recording.markers, recording.time, Path(folder) / FILE)
    for name in dict.fromkeys(name for name, _, _ in found.frozen):
        lost = np.zeros(recording.n_frames, dtype=bool)
        for which, since_s, until_s in found.frozen:
            first, end = np.searchsorted(recording.time, since_s), np.searchsorted(recording.time, until_s, "right")
            lost[first : max(end, first + 1)] |= which == name
        notes += frozen_in_words(name, recording.time, lost, "Look whether its amplifier or its connection hung")
    return without_dead_channels(replace(recording, markers=markers, notes=(*recording.notes, *notes)))


def _when(hole: Hole) -> str:
    if not np.isfinite(hole.after_s):
        return f"before {hole.before_s:.2f} s"
    return f"after {hole.after_s:.2f} s" if hole.before_s == np.inf else f"{hole.after_s:.2f} to {hole.before_s:.2f} s"


def _with_lost_frames(recording: Recording, period_s: float, holes: Sequence[Hole]) -> Recording:
    """With a frame of nothing at each time that the markers' rate asks for within a hole."""
    time, lost = recording.time, list[float]()
    for hole in holes:
        for k in np.flatnonzero(np.diff(time) > 1.5 * period_s):
            if time[k] < hole.before_s and time[k + 1] > hole.after_s:
                count = round((time[k + 1] - time[k]) / period_s)
                lost += np.linspace(time[k], time[k + 1], count + 1)[1:-1].tolist()
    there = np.union1d(time, lost)
    at = np.searchsorted(there, time)

    def spread(values: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        wide = np.full((len(there), *values.shape[1:]), np.nan)
        wide[at] = values
        return wide

    plates = tuple(
        replace(
            plate,
            force=spread(plate.force),
            moment=spread(plate.moment),
            cop=spread(plate.cop),
            free_moment=spread(plate.free_moment),
        )
        for plate in recording.plates
    )
    return replace(recording, time=there, markers=spread(recording.markers), plates=plates)


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
