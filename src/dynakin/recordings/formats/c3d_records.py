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
from dynakin.files import require_file
from dynakin.messages import Message, note

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
        length, group = struct.unpack("bb", _take(section, at, 2, start, path, "the next record"))
        if length == 0:
            break
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


# The few bytes of a C3D file that show whether it is one, and whether all of it is there.
#
# Checked before ezc3d opens the file, which otherwise reads past the end of the file or of its own memory.
# Layout: C3D user guide, header section (512 bytes; words of 2 bytes, numbered from 1) and parameter section.
_KEY = 0x50
_BLOCK = 512
_INTEL, _DEC, _SGI = 84, 85, 86  # the last is unknown to ezc3d


def check_c3d_file(path: Path) -> tuple[list[Message], list[Correction]]:
    """Notes on what the file says twice and differently, and what has to be corrected so that ezc3d reads it right.

    Raises:
        RecordingError: in one clear sentence, the file is no C3D, is shorter than it promises, or its header
            or parameters are damaged.
    """
    require_file(path)
    size = path.stat().st_size
    try:
        with path.open("rb") as file:
            head = file.read(_BLOCK)
            if len(head) < 2 or head[1] != _KEY or head[0] == 0:
                found = f"found {head[1]:#04x}" if len(head) > 1 else f"the file has {size} bytes"
                raise RecordingError(f"{path}: is not a C3D file (expected 0x50 as its second byte, {found})")
            start = (head[0] - 1) * _BLOCK
            # The parameters end where the data begin; if those come first, with the file.
            data_start = (int.from_bytes(head[16:18], "little") - 1) * _BLOCK
            file.seek(start)
            section = file.read(data_start - start if data_start > start else size)
    except OSError as error:
        raise RecordingError(f"{path}: cannot be read ({error.strerror})") from error
    if len(head) < _BLOCK or len(section) < 4:
        raise RecordingError(
            f"{path}: truncated C3D file, found {size} bytes, the header alone needs {max(start, _BLOCK) + 4}"
        )
    processor = section[3]
    if processor not in (_INTEL, _DEC):
        sgi = " (SGI, MIPS)" if processor == _SGI else ""
        raise RecordingError(
            f"{path}: found processor type {processor}{sgi} in the C3D parameters, expected {_INTEL} (Intel) or {_DEC} "
            "(DEC): save the file again in Intel's format, with the capture software or Mokka"
        )
    header = _header(head, dec=processor == _DEC)
    expected = header.data_start + header.frames * header.frame_bytes
    if size < expected:
        raise RecordingError(
            f"{path}: truncated C3D file, found {size} bytes, expected at least {expected} "
            f"for {header.frames} frames of {header.n_points} points and {header.n_analog} analog values"
        )
    if header.data_start < _BLOCK:
        raise RecordingError(f"{path}: found data in block {header.data_start // _BLOCK + 1}, expected 2 or later")
    groups, rewritten = read_records(section, start, path, dec=processor == _DEC)
    notes, corrections = check_counts(header, groups, size, path)
    return notes, rewritten + corrections


def _header(head: bytes, *, dec: bool) -> Header:
    words = struct.unpack("<12H", head[:24])
    scale = head[14:16] + head[12:14] if dec else head[12:16]
    n_points, n_analog, first, last, data_block, samples = words[1], words[2], words[3], words[4], words[8], words[9]
    # A negative scale (words 7 and 8) means floating-point data. Its sign bit is in the last byte in Intel
    # order, in the second in DEC's.
    sign = head[13] if dec else head[15]
    return Header(
        n_points=n_points,
        n_analog=n_analog,
        frames=last - first + 1 if last >= first else 0,
        data_start=(data_block - 1) * _BLOCK,
        floating=bool(sign & 0x80),
        samples=samples,
        scale=float(struct.unpack("<f", scale)[0]),
    )


# Whether the counts in a C3D file's parameters agree with its header and its size.
#
# ezc3d takes the parameters' word over the header's. With a wrong count of points or channels every value after
# the first frame is out of place, and a huge one makes it ask for more memory than there is.
# ezc3d takes the first value of these without looking whether there is one
_SCALARS = {
    "POINT": ("USED", "SCALE", "RATE", "FRAMES", "DATA_START"),
    "ANALOG": ("USED", "RATE", "GEN_SCALE"),
    "ROTATION": ("USED", "RATIO", "RATE", "DATA_START"),
}
# More samples a frame than any laboratory takes: where no channel's data bound them, ezc3d fills memory with
# empty samples.
_MOST_SAMPLES = 1000
_BYTES_PER_ROTATION = 17 * 4  # a matrix of 16 and its reliability


@dataclass(frozen=True)
class Header:
    """What the header block says; ``n_analog`` values a frame in ``samples`` samples of each channel, ``data_start`` in
    bytes."""

    n_points: int
    n_analog: int
    frames: int
    data_start: int
    floating: bool
    samples: int
    scale: float

    @property
    def frame_bytes(self) -> int:
        """Bytes of one frame."""
        return (4 * self.n_points + self.n_analog) * (4 if self.floating else 2)

    def fits(self, size: int) -> bool:
        """Whether the data that it promises fill a file of ``size`` bytes, but for its last blocks."""
        return 0 <= size - self.data_start - self.frames * self.frame_bytes <= 2 * _BLOCK


def check_counts(header: Header, groups: Groups, size: int, path: Path) -> tuple[list[Message], list[Correction]]:
    """Notes on contradictions that are harmless, or that the size of the file settles, and corrections for the latter.

    Raises:
        RecordingError: contradictions that would put values out of place, or promises beyond the file's end.
    """
    for group, names in _SCALARS.items():
        for name in names:
            record = groups.get(group, {}).get(name)
            if record is not None and not math.isfinite(record.first()):
                raise RecordingError(f"{path}: damaged C3D parameters, {group}:{name} holds no number, expected one")
    settled = _Settled(groups, trusted=header.fits(size) and not _number(groups, "ROTATION", "USED", 0))
    points = _number(groups, "POINT", "USED", 0)
    if header.n_points == 0 or (points != header.n_points and not settled.by_header("POINT", "USED", header.n_points)):
        raise RecordingError(
            f"{path}: found {points:g} points in POINT:USED and {header.n_points} in the header, "
            "expected the same number, at least 1"
        )
    floating = _number(groups, "POINT", "SCALE", -1.0) < 0
    if floating != header.floating and not settled.by_header("POINT", "SCALE", header.scale):
        kinds = {True: "floating-point", False: "integer"}
        raise RecordingError(
            f"{path}: found {kinds[floating]} data by POINT:SCALE and {kinds[header.floating]} data by the header, "
            "expected the same"
        )
    if "SHADOW" not in groups:  # that maker's files leave ANALOG out, and ezc3d knows
        _check_analog(header, groups, settled, path)
    frames = _number(groups, "POINT", "FRAMES", 0)
    needed = header.data_start + frames * header.frame_bytes
    if (frames < 0 or needed > size) and not settled.by_header("POINT", "FRAMES", header.frames):
        raise RecordingError(
            f"{path}: truncated C3D file, found {size} bytes, expected {needed:.0f} for POINT:FRAMES {frames:g}"
        )
    _check_rotations(groups, size, path)
    notes = settled.notes
    if frames and frames != header.frames and needed <= size:
        notes.append(
            note("recording", f"The header says {header.frames} frames, POINT:FRAMES {frames:g}: the latter is used.")
        )
    block = _number(groups, "POINT", "DATA_START", 0)
    used = header.data_start // 512 + 1
    if block and block != used:
        notes.append(
            note(
                "recording",
                f"The header says that data begin in block {used}, POINT:DATA_START {block:g}: the former is used.",
            )
        )
    return notes, settled.corrections


class _Settled:
    """Parameters that contradict a header which fits the file's size (``trusted``) are corrected."""

    def __init__(self, groups: Groups, *, trusted: bool) -> None:
        self._groups, self._trusted = groups, trusted
        self.notes: list[Message] = []
        self.corrections: list[Correction] = []

    def by_header(self, group: str, name: str, value: float) -> bool:
        """Whether the header's value could be put in the parameter's place."""
        record = self._groups.get(group, {}).get(name)
        correction = record.replaced(value) if record is not None and self._trusted else None
        if record is None or correction is None:
            return False
        self.corrections.append(correction)
        here, there = f"{record.first():g}", f"{round(value, 2):g}"
        self.notes.append(
            note(
                "recording", f"{group}:{name} says {here}, the header and the file's size {there}: the latter is used."
            )
        )
        return True


def _check_analog(header: Header, groups: Groups, settled: _Settled, path: Path) -> None:
    """Channels times samples a frame as ezc3d counts them, and a scale and an offset for each channel."""
    channels = _number(groups, "ANALOG", "USED", 0)
    point_rate = _number(groups, "POINT", "RATE", 0)
    ratio = _number(groups, "ANALOG", "RATE", 0) / point_rate if point_rate >= 1 else 1.0
    most = 65535 if header.n_analog else _MOST_SAMPLES
    in_header, odd = divmod(header.n_analog, max(header.samples, 1))
    # ezc3d cuts the ratio to a whole number, and a rate is a 4-byte float: 999.99 / 100 may be meant as 10.
    if not 0 <= ratio <= most or header.n_analog != channels * math.floor(ratio):
        samples = max(header.samples, 1)
        rate = (samples + 1e-5) * point_rate  # which ezc3d does not cut to one less
        sensible = point_rate >= 1 and not odd and samples <= _MOST_SAMPLES
        if not (
            sensible
            and (channels == in_header or settled.by_header("ANALOG", "USED", in_header))
            and (header.n_analog == 0 or math.floor(ratio) == samples or settled.by_header("ANALOG", "RATE", rate))
        ):
            if not 0 <= ratio <= most:
                raise RecordingError(
                    f"{path}: found {ratio:g} analog samples a frame, expected a number from 0 to {most}"
                )
            raise RecordingError(
                f"{path}: found {channels:g} analog channels of {ratio:g} samples a frame in ANALOG:USED and the "
                f"rates, expected the {header.n_analog} analog values a frame of the header"
            )
        channels = in_header
    for name in ("SCALE", "OFFSET") if header.n_analog else ():
        parts = [groups.get("ANALOG", {}).get(name + suffix) for suffix in ("", *map(str, range(2, 100)))]
        count = sum(part.count for part in parts if part is not None)
        if count < channels:
            raise RecordingError(
                f"{path}: found {count} values in ANALOG:{name}, expected one for {channels:g} channels"
            )


def _check_rotations(groups: Groups, size: int, path: Path) -> None:
    """One frame of rotations has to fit into the file (they are not used, but ezc3d reads them)."""
    if "ROTATION" not in groups:
        return
    rate = max(_number(groups, "POINT", "RATE", 0), 1.0)
    ratio = _number(groups, "ROTATION", "RATIO", _number(groups, "ROTATION", "RATE", 0) / rate)
    used = _number(groups, "ROTATION", "USED", 0)
    if not 0 <= ratio <= _MOST_SAMPLES or used * max(ratio, 1.0) * _BYTES_PER_ROTATION > size:
        raise RecordingError(
            f"{path}: found {used:g} rotations of {ratio:g} samples a frame, "
            f"expected at most {_MOST_SAMPLES} samples that fit into {size} bytes"
        )


def _number(groups: Groups, group: str, name: str, default: float) -> float:
    record = groups.get(group, {}).get(name)
    return default if record is None else record.first()
