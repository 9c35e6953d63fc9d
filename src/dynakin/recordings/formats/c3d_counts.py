"""Whether the counts in a C3D file's parameters agree with its header and its size.

ezc3d takes the parameters' word over the header's. With a wrong count of points or channels every value after
the first frame is out of place, and a huge one makes it ask for more memory than there is.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from dynakin.errors import RecordingError
from dynakin.recordings.formats.c3d_records import Groups

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
    """What the header block says; ``n_analog`` values a frame, ``data_start`` in bytes."""

    n_points: int
    n_analog: int
    frames: int
    data_start: int
    floating: bool

    @property
    def frame_bytes(self) -> int:
        """Bytes of one frame."""
        return (4 * self.n_points + self.n_analog) * (4 if self.floating else 2)


def check_counts(header: Header, groups: Groups, size: int, path: Path) -> list[str]:
    """Notes on harmless contradictions.

    Raises:
        RecordingError: contradictions that would put values out of place, or promises beyond the file's end.
    """
    for group, names in _SCALARS.items():
        for name in names:
            record = groups.get(group, {}).get(name)
            if record is not None and not math.isfinite(record.first()):
                raise RecordingError(f"{path}: damaged C3D parameters, {group}:{name} holds no number, expected one")
    points = _number(groups, "POINT", "USED", 0)
    if points != header.n_points or points == 0:
        raise RecordingError(
            f"{path}: found {points:g} points in POINT:USED and {header.n_points} in the header, "
            "expected the same number, at least 1"
        )
    floating = _number(groups, "POINT", "SCALE", -1.0) < 0
    if floating != header.floating:
        kinds = {True: "floating-point", False: "integer"}
        raise RecordingError(
            f"{path}: found {kinds[floating]} data by POINT:SCALE and {kinds[header.floating]} data by the header, "
            "expected the same"
        )
    if "SHADOW" not in groups:  # that maker's files leave ANALOG out, and ezc3d knows
        _check_analog(header, groups, path)
    frames = _number(groups, "POINT", "FRAMES", 0)
    needed = header.data_start + frames * header.frame_bytes
    if frames < 0 or needed > size:
        raise RecordingError(
            f"{path}: truncated C3D file, found {size} bytes, expected {needed:.0f} for POINT:FRAMES {frames:g}"
        )
    _check_rotations(groups, size, path)
    notes = []
    if frames and frames != header.frames:
        notes.append(f"The header says {header.frames} frames, POINT:FRAMES {frames:g}: the latter is used.")
    block = _number(groups, "POINT", "DATA_START", 0)
    used = header.data_start // 512 + 1
    if block and block != used:
        notes.append(
            f"The header says that data begin in block {used}, POINT:DATA_START {block:g}: the former is used."
        )
    return notes


def _check_analog(header: Header, groups: Groups, path: Path) -> None:
    """Channels times samples a frame as ezc3d counts them, and a scale and an offset for each channel."""
    channels = _number(groups, "ANALOG", "USED", 0)
    point_rate = _number(groups, "POINT", "RATE", 0)
    ratio = _number(groups, "ANALOG", "RATE", 0) / point_rate if point_rate >= 1 else 1.0
    most = 65535 if header.n_analog else _MOST_SAMPLES
    if not 0 <= ratio <= most:
        raise RecordingError(f"{path}: found {ratio:g} analog samples a frame, expected a number from 0 to {most}")
    # A rate is a 4-byte float: 999.99 / 100 may be meant as 10.
    if header.n_analog not in (channels * math.floor(ratio), channels * round(ratio)):
        raise RecordingError(
            f"{path}: found {channels:g} analog channels of {ratio:g} samples a frame in ANALOG:USED and the rates, "
            f"expected the {header.n_analog} analog values a frame of the header"
        )
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
