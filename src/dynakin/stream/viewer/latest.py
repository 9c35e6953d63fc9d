"""A queue of one: the writer never waits, the reader gets the newest numbers or none."""

from __future__ import annotations

import mmap
import os
import struct
import tempfile
from pathlib import Path

import numpy as np

from dynakin.arrays import Array

_HEAD = struct.Struct("<QQ")


class Latest:
    """Some numbers and a text in a file that two processes map.

    The writer makes the counter odd, writes, and makes it even again; a reader that saw it odd, or changed, looks
    again.

    Args:
        numbers: how many. text: bytes at most. path: of an existing one; None: a new one is made.
    """

    def __init__(self, numbers: int, text: int = 4096, path: str | None = None) -> None:
        self.numbers, self._text = numbers, text
        size = _HEAD.size + text + 8 * numbers
        self._own = path is None
        if path is None:
            handle, path = tempfile.mkstemp(prefix="dynakin-live-")
            os.truncate(handle, size)
        else:
            handle = os.open(path, os.O_RDWR)
        self.path = path
        self._map = mmap.mmap(handle, size)
        os.close(handle)
        self._seen = 0

    def write(self, numbers: Array, text: bytes) -> None:
        """Replace what is there.

        Raises:
            ValueError: the text is longer than there is room; half of one is of no use.
        """
        if len(text) > self._text:
            raise ValueError(f"the text has {len(text)} bytes, expected {self._text} at most")
        count = _HEAD.unpack_from(self._map, 0)[0]
        _HEAD.pack_into(self._map, 0, count + 1, len(text))
        self._map[_HEAD.size : _HEAD.size + len(text)] = text
        start = _HEAD.size + self._text
        self._map[start : start + 8 * self.numbers] = np.ascontiguousarray(numbers, "<f8").tobytes()
        _HEAD.pack_into(self._map, 0, count + 2, len(text))

    def read(self) -> tuple[Array, bytes] | None:
        """What was written since the last read, None where nothing was or it is being written just now."""
        before, length = _HEAD.unpack_from(self._map, 0)
        if before % 2 or before == self._seen:
            return None
        start = _HEAD.size + self._text
        data = self._map[start : start + 8 * self.numbers]
        text = self._map[_HEAD.size : _HEAD.size + min(length, self._text)]
        if _HEAD.unpack_from(self._map, 0)[0] != before:
            return None
        self._seen = before
        return np.frombuffer(data, "<f8").astype(float), text

    def close(self) -> None:
        """The maker also removes the file."""
        self._map.close()
        if self._own:
            Path(self.path).unlink(missing_ok=True)
