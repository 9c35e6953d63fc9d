"""The few bytes of a C3D file that tell whether it is one, and whether all of it is there.

Checked before ezc3d opens the file, which otherwise reads past the end of the file or of its own memory.
Layout: C3D user guide, header section (512 bytes; words of 2 bytes, numbered from 1) and parameter section.
"""

from __future__ import annotations

import struct
from pathlib import Path

from dynakin.errors import RecordingError
from dynakin.files import require_file
from dynakin.recordings.formats.c3d_counts import Header, check_counts
from dynakin.recordings.formats.c3d_records import read_records

_KEY = 0x50
_BLOCK = 512
_INTEL, _DEC = 84, 85  # 86, MIPS, is unknown to ezc3d


def check_c3d_file(path: Path) -> list[str]:
    """Notes on what the file says twice and differently.

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
        raise RecordingError(
            f"{path}: found processor type {processor} in the C3D parameters, expected {_INTEL} (Intel) or {_DEC} (DEC)"
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
    return check_counts(header, read_records(section, start, path, dec=processor == _DEC), size, path)


def _header(head: bytes, *, dec: bool) -> Header:
    words = struct.unpack("<12H", head[:24])
    n_points, n_analog, first, last, data_block = words[1], words[2], words[3], words[4], words[8]
    # A negative scale (words 7 and 8) means floating-point data. Its sign bit is in the last byte in Intel
    # order, in the second in DEC's.
    sign = head[13] if dec else head[15]
    return Header(
        n_points=n_points,
        n_analog=n_analog,
        frames=last - first + 1 if last >= first else 0,
        data_start=(data_block - 1) * _BLOCK,
        floating=bool(sign & 0x80),
    )
