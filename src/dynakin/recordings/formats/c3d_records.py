"""Walk of a C3D file's parameter section, before ezc3d sees it.

ezc3d believes every length it meets: a damaged number of dimensions makes it read outside its memory, damaged
dimensions make it read millions of values, a negative description length asks for 4 GB. So each record has to
end where the next begins, inside the section. Layout (C3D user guide, parameter section), each record:
length of the name (negative: locked; 0 ends the section), group number (negative: a group, positive: a
parameter of that group), name, offset to the next record (2 bytes, counted from themselves; 0: the last);
a parameter then has its type, the number of dimensions, the dimensions, the values; both end with a
description, its length first.
"""

from __future__ import annotations

import math
import re
import struct
from dataclasses import dataclass, replace
from pathlib import Path

from dynakin.errors import RecordingError

_TYPES = {-1: 1, 1: 1, 2: 2, 4: 4}  # text, byte, integer, float: bytes per value
_MAX_DIMENSIONS = 7
_MAX_DESCRIPTION = 127  # ezc3d reads the length as a signed byte
_ASKED = re.compile(
    rb"POINT|ANALOG|FORCE_PLATFORM|ROTATION|SHADOW|USED|RATE|RATIO|FRAMES|DATA_START|GEN_SCALE|FORMAT|BITS"
    rb"|(LABELS|DESCRIPTIONS|UNITS|SCALE|OFFSET)[0-9]*|TYPE|ZERO|CORNERS|ORIGIN|CHANNEL|CAL_MATRIX"
)  # what it does not find it adds, empty
_MOST_PADDING = 3  # bytes: some programs begin their records at even or at fourth bytes


@dataclass(frozen=True)
class Record:
    """Type and raw values of one parameter; ``dec`` where its floats are in DEC's order; ``at``: where its values begin
    in the file."""

    kind: int
    raw: bytes
    dec: bool
    at: int

    @property
    def count(self) -> int:
        """Number of values (characters of a text)."""
        return len(self.raw) // _TYPES[self.kind]

    def first(self) -> float:
        """First value as a number, an integer as unsigned (C3D counts up to 65535); NaN where there is none."""
        size = _TYPES[self.kind]
        raw = self.raw[:size]
        if self.kind == -1 or len(raw) < size:
            return math.nan
        if self.kind == 4 and self.dec:  # words swapped, exponent offset by 2
            return float(struct.unpack("<f", raw[2:] + raw[:2])[0]) / 4
        return float(struct.unpack({1: "<B", 2: "<H", 4: "<f"}[self.kind], raw)[0])

    def replaced(self, value: float) -> Correction | None:
        """What to write over the file so that the first value is another; None where it cannot be written."""
        if self.dec or self.count < 1 or self.kind not in (2, 4):
            return None
        return self.at, struct.pack("<f", value) if self.kind == 4 else struct.pack("<H", math.ceil(value))


Correction = tuple[int, bytes]
"""Place in the file, and the bytes that belong there."""
Groups = dict[str, dict[str, Record]]


def read_records(section: bytes, start: int, path: Path, *, dec: bool) -> tuple[Groups, list[Correction]]:
    """Parameters by group and name, upper case, and the section written anew where ezc3d could not read it: names in
    small letters, records with a few bytes of padding behind them, descriptions of 128 characters or more (these are
    cut), a number of frames as a float.

    Args:
        section: bytes from the start of the parameter section to where the data begin.
        start: its place in the file, for messages.
        dec: floats are in DEC's order.

    Raises:
        RecordingError: a record that does not end where the next one begins, or is of no known type.
    """
    names: dict[int, str] = {}
    found: dict[int, dict[str, Record]] = {}
    anew = bytearray(section[:4])
    at = 4
    while True:
        if _take(section, at, 1, start, path, "the next record") == b"\0":  # may be the section's last byte
            break
        length, group = struct.unpack("bb", _take(section, at, 2, start, path, "the next record"))
        name = _take(section, at + 2, abs(length), start, path, "a name").split(b"\0")[0].decode("latin-1").upper()
        what = f"{'group' if group < 0 else 'parameter'} {name!r} at byte {start + at}"
        here = at + 2 + abs(length)
        (offset,) = struct.unpack("<H", _take(section, here, 2, start, path, what))
        following = here + offset if offset else len(section)
        if following > len(section):
            raise RecordingError(
                f"{path}: damaged C3D parameters, found the record after {what} at byte {start + following}, "
                f"expected it before byte {start + len(section)}, the end of the section"
            )
        if group == 0:
            raise RecordingError(f"{path}: damaged C3D parameters, {what} is in group 0, expected 1 to 127")
        inside = section[:following]
        if group < 0:
            names.setdefault(-group, name)
            end, values = here + 2, b""
        else:
            record, end = _parameter(inside, here + 2, start + len(anew) - at, path, what, dec)
            values = section[here + 2 : end]
            counts = name == "FRAMES" and names.get(group, "POINT") == "POINT"  # or of a group that is named later
            if counts and record.kind == 4 and 0.0 <= record.first() < math.inf:  # others are refused with the counts
                record, values = _whole(record)
            found.setdefault(group, {})[name] = record
        length = _take(inside, end, 1, start, path, what)[0]
        description = _take(inside, end + 1, length, start, path, what)[:_MAX_DESCRIPTION]
        content = values + bytes([len(description)]) + description
        end += 1 + length
        anew += (
            section[at : at + 2]
            + _in_capitals(section[at + 2 : here])
            + struct.pack("<H", (2 + len(content)) if offset else 0)
            + content
        )
        if offset == 0:
            break
        if not end <= following <= end + _MOST_PADDING:  # ezc3d refuses that too, but does not say where
            raise RecordingError(
                f"{path}: damaged C3D parameters, {what} ends at byte {start + end}, "
                f"expected byte {start + following}, where the next record begins"
            )
        at = following
    groups: Groups = {}
    for number, name in sorted(names.items()):
        groups.setdefault(name, found.get(number, {}))  # of two groups with one name ezc3d takes the first
    same = section.startswith(anew)
    return groups, [] if same else [(start, bytes(anew.ljust(len(section), b"\0")))]


def _whole(frames: Record) -> tuple[Record, bytes]:
    """A number of frames that is written as a float (the user guide's way beyond 65535) as the integer that ezc3d asks
    for, which takes 65535 as up to the file's end; and as it stands in the file, with its type."""
    raw = struct.pack("<H", round(min(frames.first(), 65535.0)))
    return replace(frames, kind=2, raw=raw), b"\x02\x00" + raw


def _in_capitals(name: bytes) -> bytes:
    """A name that ezc3d asks for as it asks for it; any other as it is, so that most files need no copy."""
    return name.upper() if _ASKED.fullmatch(name.upper()) else name


def _parameter(section: bytes, at: int, start: int, path: Path, what: str, dec: bool) -> tuple[Record, int]:
    """The parameter whose type is at ``at``, and where its description begins."""
    kind, n_dimensions = struct.unpack("bb", _take(section, at, 2, start, path, what))
    if kind not in _TYPES:
        raise RecordingError(f"{path}: damaged C3D parameters, {what} has type {kind}, expected -1, 1, 2 or 4")
    fewest = 1 if kind == -1 else 0  # ezc3d looks for the length of a text in its first dimension
    if not fewest <= n_dimensions <= _MAX_DIMENSIONS:
        raise RecordingError(
            f"{path}: damaged C3D parameters, {what} has {n_dimensions} dimensions, "
            f"expected {fewest} to {_MAX_DIMENSIONS}"
        )
    dimensions = _take(section, at + 2, n_dimensions, start, path, what)
    values = at + 2 + n_dimensions
    raw = _take(section, values, math.prod(dimensions) * _TYPES[kind], start, path, what)
    return Record(kind, raw, dec, start + values), values + len(raw)


def _take(section: bytes, at: int, size: int, start: int, path: Path, what: str) -> bytes:
    if at + size > len(section):
        raise RecordingError(
            f"{path}: damaged C3D parameters, {what} reaches up to byte {start + at + size}, "
            f"expected an end by byte {start + len(section)}"
        )
    return section[at : at + size]


INTEL, DEC, SGI = 84, 85, 86  # the last is unknown to ezc3d
