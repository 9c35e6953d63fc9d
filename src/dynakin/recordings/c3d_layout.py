"""The few bytes of a C3D file that tell whether it is one, and whether all of it is there.

Checked before ezc3d opens the file, which otherwise reads past the end. Layout: C3D user guide, header
section (512 bytes; words of 2 bytes, numbered from 1) and parameter section.
"""

from __future__ import annotations

import struct
from pathlib import Path

from dynakin.errors import RecordingError
from dynakin.recordings.textfile import require_file

_KEY = 0x50
_BLOCK = 512
_BIG_ENDIAN_PROCESSOR = 86  # 84 Intel, 85 DEC (integers as Intel), 86 MIPS


def check_c3d_file(path: Path) -> None:
    """Raise RecordingError, in one clear sentence, if the file is no C3D or shorter than its header
    promises."""
    require_file(path)
    size = path.stat().st_size
    with path.open("rb") as file:
        head = file.read(_BLOCK)
        if len(head) < 2 or head[1] != _KEY or head[0] == 0:
            found = f"found {head[1]:#04x}" if len(head) > 1 else f"the file has {size} bytes"
            raise RecordingError(f"{path}: is not a C3D file (expected 0x50 as its second byte, {found})")
        file.seek((head[0] - 1) * _BLOCK)
        parameters = file.read(4)
    if len(head) < _BLOCK or len(parameters) < 4:
        raise RecordingError(f"{path}: truncated C3D file, found {size} bytes, the header alone needs {_BLOCK + 4}")
    order = ">" if parameters[3] == _BIG_ENDIAN_PROCESSOR else "<"
    words = struct.unpack(f"{order}12H", head[:24])
    n_points, n_analog, first, last, data_block = words[1], words[2], words[3], words[4], words[8]
    # A negative scale (words 7 and 8) means floating-point data. Its sign bit: last byte in Intel order,
    # first in MIPS, second in DEC.
    sign = {84: head[15], 85: head[13], 86: head[12]}.get(parameters[3], head[15])
    bytes_per_value = 4 if sign & 0x80 else 2
    frames = last - first + 1 if last >= first else 0
    expected = (data_block - 1) * _BLOCK + frames * (4 * n_points + n_analog) * bytes_per_value
    if size < expected:
        raise RecordingError(
            f"{path}: truncated C3D file, found {size} bytes, expected at least {expected} "
            f"for {frames} frames of "
            f"{n_points} points and {n_analog} analog values"
        )
