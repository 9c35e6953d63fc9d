"""The few bytes of a C3D file that show whether it is one, and whether all of it is there: header and counts.

Checked before ezc3d opens the file, which otherwise reads past the end of the file or of its own memory.
Layout: C3D user guide, header section (512 bytes; words of 2 bytes, numbered from 1) and parameter section.
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass
from pathlib import Path

from dynakin.errors import RecordingError
from dynakin.files import require_file
from dynakin.messages import Message, note
from dynakin.recordings.formats.c3d_records import DEC, INTEL, SGI, Correction, Groups, read_records

_KEY = 0x50
_BLOCK = 512


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
    if processor not in (INTEL, DEC):
        sgi = " (SGI, MIPS)" if processor == SGI else ""
        raise RecordingError(
            f"{path}: found processor type {processor}{sgi} in the C3D parameters, expected {INTEL} (Intel) or {DEC} "
            "(DEC): save the file again in Intel's format, with the capture software or Mokka"
        )
    header = _header(head, dec=processor == DEC)
    expected = header.data_start + header.frames * header.frame_bytes
    if size < expected:
        raise RecordingError(
            f"{path}: truncated C3D file, found {size} bytes, expected at least {expected} "
            f"for {header.frames} frames of {header.n_points} points and {header.n_analog} analog values"
        )
    if header.data_start < _BLOCK:
        raise RecordingError(f"{path}: found data in block {header.data_start // _BLOCK + 1}, expected 2 or later")
    groups, rewritten = read_records(section, start, path, dec=processor == DEC)
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
