"""The recorder's file: records one after the other, each with its length and checksum.

A record is b"DKR1", its kind (one byte), the payload's length and CRC-32 (unsigned, 4 bytes each, little-endian), then
the payload. Kind J: JSON, in UTF-8. Kind M: a frame of markers, float64: arrival, time, positions (M x 3). Kind F:
samples of plates, float64: arrival, number K, times (K), wrenches (K x P x 6). What a session that was killed cut off
at the end is passed over; where something is damaged is told.
"""

from __future__ import annotations

import json
import struct
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from dynakin.files import read_bytes
from dynakin.stream.sources.packets import MarkerPacket, Packet, PlatePacket

_MAGIC = b"DKR1"
_HEAD = struct.Struct("<4scII")


def text_record(content: dict[str, Any]) -> bytes:
    """A record of kind J."""
    return _record(b"J", json.dumps(content).encode())


def packet_record(packet: Packet) -> bytes:
    """A packet as it came."""
    if isinstance(packet, MarkerPacket):
        return _record(b"M", _bytes([packet.arrived_s, packet.time_s], packet.positions))
    time = np.atleast_1d(packet.time_s)
    return _record(b"F", _bytes([packet.arrived_s, float(len(time))], time, packet.wrenches))


def read_records(path: Path) -> Iterator[dict[str, Any] | Packet | None]:
    """Everything whole in the file, in its order; None where what lies between is damaged.

    Raises:
        RecordingError: the file cannot be read.
    """
    data = read_bytes(path)
    at, end = data.find(_MAGIC), 0  # of the last whole record
    while 0 <= at <= len(data) - _HEAD.size:
        _, kind, length, checksum = _HEAD.unpack_from(data, at)
        payload = data[at + _HEAD.size : at + _HEAD.size + length]
        whole = len(payload) == length and zlib.crc32(payload) == checksum
        if not whole or (content := _content(kind, payload)) is None:
            at = data.find(_MAGIC, at + 1)
            continue
        if at > end:
            yield None
        yield content
        end = at + _HEAD.size + length
        at = data.find(_MAGIC, end)
    rest = data[end:]
    if rest and not _cut_off(rest):
        yield None


def _cut_off(rest: bytes) -> bool:
    """Whether the end of a file is the beginning of one record."""
    if len(rest) < _HEAD.size:
        return rest[: len(_MAGIC)] == _MAGIC[: len(rest)]
    magic, kind, length, _ = _HEAD.unpack_from(rest)
    return bool(magic == _MAGIC and kind in (b"J", b"M", b"F") and len(rest) < _HEAD.size + length)


def _content(kind: bytes, payload: bytes) -> dict[str, Any] | Packet | None:
    """What a whole record holds; None where that is no packet."""
    try:
        if kind == b"J":
            found = json.loads(payload)
            return found if isinstance(found, dict) else None
        numbers = np.frombuffer(payload, dtype="<f8").astype(float)
        if kind == b"M":
            return MarkerPacket(float(numbers[1]), numbers[2:].reshape(-1, 3), float(numbers[0]))
        count = int(numbers[1])
        return PlatePacket(numbers[2 : 2 + count], numbers[2 + count :].reshape(count, -1, 6), float(numbers[0]))
    except (ValueError, LookupError, ArithmeticError, RecursionError):
        return None


def _record(kind: bytes, payload: bytes) -> bytes:
    return _HEAD.pack(_MAGIC, kind, len(payload), zlib.crc32(payload)) + payload


def _bytes(*parts: Any) -> bytes:
    return b"".join(np.ascontiguousarray(part, dtype="<f8").tobytes() for part in parts)
