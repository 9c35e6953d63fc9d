"""A queue of one: the writer never waits, the reader gets the newest numbers or none."""

from __future__ import annotations

import mmap
import os
import tempfile
from pathlib import Path

import numpy as np

from dynakin.arrays import Array

_HEAD_BYTES = 16  # the counter and the text's length


class Latest:
    """Some numbers and a text in a file that two processes map.

    The writer makes the counter odd, writes, and makes it even again; a reader that saw it odd, or changed, looks
    again. Counter and length are whole 8-byte stores: a struct's ``pack_into`` first puts 0 there, which is even.

    Args:
        numbers: how many. text: bytes at most. path: of an existing one; None: a new one is made.
    """

    def __init__(self, numbers: int, text: int = 4096, path: str | None = None) -> None:
        self.numbers, self._text = numbers, text
        size = _HEAD_BYTES + text + 8 * numbers
        self._own = path is None
        if path is None:
            handle, path = tempfile.mkstemp(prefix="dynakin-live-")
            os.truncate(handle, size)
        else:
            handle = os.open(path, os.O_RDWR)
        self.path = path
        self._map = mmap.mmap(handle, size)
        os.close(handle)
        self._head = memoryview(self._map)[:_HEAD_BYTES].cast("Q")
        self._seen = 0  # as long as nothing was written

    def write(self, numbers: Array, text: bytes) -> None:
        """Replace what is there.

        Raises:
            ValueError: the text is longer than there is room; half of one is of no use.
        """
        if len(text) > self._text:
            raise ValueError(f"the text has {len(text)} bytes, expected {self._text} at most")
        head, start = self._head, _HEAD_BYTES + self._text
        count = head[0]
        head[0] = count + 1
        head[1] = len(text)
        self._map[_HEAD_BYTES : _HEAD_BYTES + len(text)] = text
        self._map[start : start + 8 * self.numbers] = np.ascontiguousarray(numbers, "<f8").tobytes()
        head[0] = count + 2

    def read(self) -> tuple[Array, bytes] | None:
        """What was written since the last read, None where nothing was or it is being written just now."""
        head, start = self._head, _HEAD_BYTES + self._text
        before, length = head
        if before % 2 or before == self._seen:
            return None
        data = self._map[start : start + 8 * self.numbers]
        text = self._map[_HEAD_BYTES : _HEAD_BYTES + min(length, self._text)]
        if head[0] != before:
            return None
        self._seen = before
        return np.frombuffer(data, "<f8").astype(float), text

    def close(self) -> None:
        """The maker also removes the file."""
        self._head.release()
        self._map.close()
        if self._own:
            Path(self.path).unlink(missing_ok=True)
