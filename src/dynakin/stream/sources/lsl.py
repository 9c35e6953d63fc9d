"""`lsl:NAME`: streams of the Lab Streaming Layer, described by labels and units.

Two kinds of streams are understood. Markers: channels in threes, labelled NAME_X, NAME_Y, NAME_Z (or NAME.X, NAMEX), in
the unit that the description gives (m, mm, cm; metres where it gives none). Plates: channels labelled PLATE_FX ... FZ,
PLATE_MX ... MZ, N and N m (N mm where the unit says so): the ground's push on the person in the laboratory frame,
moments about its origin.
"""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pylsl

from dynakin.arrays import Array
from dynakin.errors import ConfigError, StreamError
from dynakin.stream.sources.packets import MarkerPacket, Packet, PlatePacket, StreamInfo, Streams
from dynakin.units import COMPONENTS, force_factor, length_factor, moment_factor

_AXIS = re.compile(r"^(?P<name>.+?)[ _.:\-]?(?P<axis>[xyz])$", re.IGNORECASE)
_LOAD = re.compile(r"^(?P<name>.+?)[ _.:\-]?(?P<axis>[fm][xyz])$", re.IGNORECASE)
_CORRECT_S = 5.0  # how often the offset of the sender's clock is asked for


class LslSource:
    """One stream by its name; its stamps are carried to this machine's clock by LSL's own time correction.

    Args:
        name: of the stream.
        own_clock: the sender stamps by a clock that LSL knows nothing of; its offset is found from arrivals.
    """

    def __init__(self, name: str, *, own_clock: bool = False) -> None:
        self.name = name
        self._clock = f"lsl:{name}" if own_clock else "lsl"
        self._inlet: Any = None
        self._order: list[Array] = []
        self._factors: Array = np.ones(0)
        self._plates = False

    def open(self, timeout_s: float) -> Streams:
        """Look for the stream.

        Raises:
            StreamError: no such stream in time; those that were seen are listed.
            ConfigError: its labels are neither markers' nor plates'.
        """
        self.close()
        found = pylsl.resolve_byprop("name", self.name, timeout=timeout_s)
        if not found:
            seen = ", ".join(sorted({info.name() for info in pylsl.resolve_streams(0.5)})) or "none"
            raise StreamError(f"lsl:{self.name}: no such stream within {timeout_s:g} s; seen: {seen}")
        inlet = pylsl.StreamInlet(found[0], max_buflen=10, recover=False)
        self._correction = inlet.time_correction(5.0)
        self._corrected = pylsl.local_clock()
        self._inlet = inlet
        info = inlet.info(5.0)
        labels, units = _channels(info)
        rate = info.nominal_srate()
        if not rate > 0.0:
            raise ConfigError(f"lsl:{self.name}: an irregular stream, expected one with a nominal rate")
        loads = _grouped(labels, _LOAD, COMPONENTS)
        if loads:
            names, columns, self._plates = tuple(loads), [loads[name] for name in loads], True
        else:
            points = _grouped(labels, _AXIS, ("x", "y", "z"))
            names, columns, self._plates = tuple(points), [points[name] for name in points], False
        if not names:
            raise ConfigError(
                f"lsl:{self.name}: labels {', '.join(labels[:8])} ..., expected NAME_X, NAME_Y, NAME_Z of markers or "
                "PLATE_FX ... PLATE_MZ of plates"
            )
        used = {k for column in columns for k in column}
        self._order = [np.array(column) for column in columns]
        self._factors = np.array(
            [_factor(units[k], labels[k], self._plates, self.name) if k in used else 1.0 for k in range(len(labels))]
        )
        info = StreamInfo(names, rate, self._clock, ordered=True)
        notes = (f"lsl:{self.name}: the sender's clock is {self._correction:+z.4f} s away.",)
        return Streams(None, info, notes) if self._plates else Streams(info, None, notes)

    def read(self, timeout_s: float) -> list[Packet] | None:
        """What came.

        Raises:
            StreamError: the sender is gone.
        """
        try:
            first, stamp = self._inlet.pull_sample(timeout=timeout_s)
            if first is None:
                return []
            rows, stamps = self._inlet.pull_chunk(timeout=0.0, max_samples=512)
            if pylsl.local_clock() - self._corrected > _CORRECT_S:
                self._correction, self._corrected = self._inlet.time_correction(1.0), pylsl.local_clock()
        except (pylsl.util.LostError, pylsl.util.TimeoutError, RuntimeError) as error:
            raise StreamError(f"lsl:{self.name}: {error or 'the sender is gone'}") from None
        values = np.array([first, *rows], dtype=float) * self._factors
        time = np.array([stamp, *stamps]) + self._correction
        grouped = np.stack([values[:, columns] for columns in self._order], axis=1)  # (K, names, 3 or 6)
        if self._plates:
            return [PlatePacket(time, grouped)]
        return [MarkerPacket(float(t), frame) for t, frame in zip(time, grouped, strict=True)]

    def close(self) -> None:
        """Let go of the stream."""
        if self._inlet is not None:
            self._inlet.close_stream()
            self._inlet = None


def lsl_source(address: str, options: dict[str, str]) -> LslSource:
    """`lsl:NAME`, or `lsl:NAME,clock=own`.

    Raises:
        ConfigError: no name, or another option.
    """
    if not address or options.get("clock", "own") != "own" or set(options) - {"clock"}:
        raise ConfigError(f"lsl:{address}: expected lsl:NAME, the stream's name, or lsl:NAME,clock=own")
    return LslSource(address, own_clock="clock" in options)


def _channels(info: Any) -> tuple[list[str], list[str]]:
    labels, units = [], []
    channel = info.desc().child("channels").child("channel")
    for _ in range(info.channel_count()):
        labels.append(channel.child_value("label"))
        units.append(channel.child_value("unit"))
        channel = channel.next_sibling("channel")
    return labels, units


def _grouped(labels: list[str], pattern: re.Pattern[str], axes: tuple[str, ...]) -> dict[str, list[int]]:
    """Name -> columns in the order of the axes, of names that have them all."""
    found: dict[str, dict[str, int]] = {}
    for column, label in enumerate(labels):
        match = pattern.match(label)
        if match:
            found.setdefault(match["name"], {})[match["axis"].lower()] = column
    return {name: [got[a] for a in axes] for name, got in found.items() if set(got) == set(axes)}


def _factor(unit: str, label: str, plates: bool, where: str) -> float:
    """SI units per unit; metres, newtons and newton metres where none is given."""
    if not unit.strip():
        return 1.0
    if not plates:
        found = length_factor(unit)
    else:
        found = force_factor(unit) if _LOAD.match(label)["axis"][0] in "fF" else moment_factor(unit)  # type: ignore[index]
    if found is None:
        raise ConfigError(
            f"lsl:{where}: channel {label} has unit {unit!r}, expected one of {'force' if plates else 'length'}"
        )
    return found
