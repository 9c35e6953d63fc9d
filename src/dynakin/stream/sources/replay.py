"""`replay:FILE` and `simulate:MOTION`: a recording or a simulated person as if measured now, at its pace or faster."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from dynakin.arrays import Array
from dynakin.errors import ConfigError
from dynakin.recordings.formats.ground_forces import plates_from_table
from dynakin.recordings.read import read, read_forces
from dynakin.recordings.recording import Recording
from dynakin.recordings.times import step_of
from dynakin.stream.sources.packets import MarkerPacket, Packet, PlatePacket, Seam, StreamInfo, Streams

_SEAM_S = 1.0  # nobody is seen between the last frame and the first: a gap, as it would be where somebody comes back


class Replay:
    """Plays markers, and plates at their own rate where they come from a force file.

    Args:
        recording: a file, or a recording in memory.
        forces: a force file (.mot, .sto, .csv), whose rows are played as they are.
        speed: 1 is the recording's own pace; 0: as fast as it is read.
        loop: begin again at the end, after a gap of 1 s, which a `Seam` tells of; time goes on.
        duration_s: stop after so much of the recording's time; None: at its end.
    """

    def __init__(
        self,
        recording: str | Path | Recording,
        forces: str | Path | None = None,
        *,
        speed: float = 1.0,
        loop: bool = False,
        duration_s: float | None = None,
    ) -> None:
        if not speed >= 0.0:
            raise ConfigError(f"replay: speed is {speed}, expected 0 (as fast as it is read) or more")
        self.recording = recording if isinstance(recording, Recording) else read(recording, causal=True)
        self.speed, self.loop, self.duration_s = speed, loop, duration_s
        plates = self.recording.plates
        self._plate_time = self.recording.time
        if forces is not None:
            table = read_forces(Path(forces))
            plates, _ = plates_from_table(table)
            self._plate_time = table.time
        self._plate_names = tuple(plate.name for plate in plates)
        parts = [plate.wrench for plate in plates]
        self._wrenches: Array = np.stack(parts, axis=1) if parts else np.zeros((len(self._plate_time), 0, 6))
        self._begun_s: float | None = None
        self._frame = self._row = self._round = 0

    def open(self, timeout_s: float = 0.0) -> Streams:
        """The recording's markers and plates, on one clock; begins to play."""
        del timeout_s
        self._begun_s, self._frame, self._row, self._round = None, 0, 0, 0
        clock, recording = "replay", self.recording
        plates = None
        if self._plate_names:
            rate = 1.0 / step_of(self._plate_time)
            plates = StreamInfo(self._plate_names, rate, clock, ordered=True)
        return Streams(
            StreamInfo(recording.marker_names, recording.rate, clock, ordered=True),
            plates,
            tuple(map(str, recording.notes)),
            recording.subject,
            paced=self.speed > 0.0,
            length_s=float(recording.time[-1] - recording.time[0]),
        )

    def read(self, timeout_s: float) -> Sequence[Packet | Seam] | None:
        """The frames that are due."""
        own = self.recording.time
        if self._begun_s is None:
            self._begun_s = time.monotonic()
        at_seam = self._frame >= len(own)
        if at_seam:
            if not self.loop:
                return None
            self._frame, self._row, self._round = 0, 0, self._round + 1
        shift = self._round * (own[-1] - own[0] + _SEAM_S)
        played = own[self._frame] - own[0] + shift
        if self.duration_s is not None and played > self.duration_s:
            return None
        if at_seam:
            return [Seam(float(own[0] + shift))]
        if self.speed > 0.0:
            wait = self._begun_s + played / self.speed - time.monotonic()
            if wait > timeout_s:
                time.sleep(timeout_s)
                return []
            if wait > 0.0:
                time.sleep(wait)
        packets: list[Packet] = []
        now = own[self._frame]
        rows = int(np.searchsorted(self._plate_time, now + 1e-9, side="right"))
        if self._plate_names and rows > self._row:
            chosen = slice(self._row, rows)
            packets.append(PlatePacket(self._plate_time[chosen] + shift, self._wrenches[chosen]))
            self._row = rows
        packets.append(MarkerPacket(float(now + shift), self.recording.markers[self._frame]))
        self._frame += 1
        return packets

    def close(self) -> None:
        """Nothing is held."""


def replay_source(address: str, options: dict[str, str]) -> Replay:
    """`replay:FILE[,speed=2][,loop]`, with the forces of `--forces FILE` as option "forces".

    Raises:
        ConfigError: an unknown option, or a value that is no number.
    """
    known = ("speed", "loop", "duration", "forces")
    for key in options:
        if key not in known:
            raise ConfigError(f"replay: unknown option {key!r}, expected some of {', '.join(known)}")
    try:
        speed = float(options.get("speed", "1"))
        duration = float(options["duration"]) if "duration" in options else None
    except ValueError:
        raise ConfigError(f"replay: found {options}, expected numbers for speed and duration") from None
    loop = _is_set(options, "loop")
    return Replay(address, options.get("forces"), speed=speed, loop=loop, duration_s=duration)


def _is_set(options: dict[str, str], key: str) -> bool:
    """Whether an option is given that is a word alone, or is given as "yes"."""
    words = {"yes": True, "1": True, "true": True, "no": False, "0": False, "false": False}
    given = options.get(key, "no")
    if given not in words:
        raise ConfigError(f"{key} is {given!r}, expected {key} alone, or {key}=yes or {key}=no")
    return words[given]


_DURATION_S = 20.0


def simulate_source(address: str, options: dict[str, str]) -> Replay:
    """`simulate:squat[,seed=1][,model=fullbody][,speed=1][,loop]`: the simulator's trial, replayed.

    Raises:
        ConfigError: an unknown option, motion or model, or a value that is no number.
    """
    from dynakin.simulation.trial import simulate

    known = ("seed", "model", "speed", "loop", "duration")
    for key in options:
        if key not in known:
            raise ConfigError(f"simulate: unknown option {key!r}, expected some of {', '.join(known)}")
    try:
        seed, speed = int(options.get("seed", "1")), float(options.get("speed", "1"))
        duration = float(options["duration"]) if "duration" in options else None
    except ValueError:
        raise ConfigError(f"simulate: found {options}, expected numbers for seed, speed and duration") from None
    loop, motion = _is_set(options, "loop"), address or "squat"
    length = duration if duration is not None else None if motion == "gait" else _DURATION_S
    trial = simulate(options.get("model", "fullbody"), motion, seed, length)
    return Replay(trial.recording, speed=speed, loop=loop)
