"""A sink of live estimates for figures.py (``--publish figures:FILE``): each number of a published frame is a column.

Nothing of dynakin is imported and no attribute but the frame's parts is named, so that names may change.
"""

from __future__ import annotations

import csv
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

PUBLISHED = ("estimate", "smoothed", "state")  # parts of a live frame


class Sink:
    """Writes every number of each published frame: a row a frame, in all digits."""

    def __init__(self, address: str, options: dict[str, str]) -> None:
        self._path = Path(address)
        self._rows: list[dict[str, float]] = []

    def frame(self, frame: Any) -> None:
        """A step was done."""
        self._rows.append({n: v for part in PUBLISHED for n, v in _numbers(getattr(frame, part, None), part, 2)})

    def close(self) -> None:
        """Write the file; a frame without a column has a blank cell there."""
        with self._path.open("w", encoding="utf-8", newline="") as file:
            writer = csv.DictWriter(file, list(dict.fromkeys(name for row in self._rows for name in row)))
            writer.writeheader()
            writer.writerows(self._rows)

    def asked(self) -> list[str]:
        """No wishes."""
        return []

    def __getattr__(self, name: str) -> Any:
        return lambda *_: None  # anything else that a session says


def _numbers(value: Any, key: str, depth: int) -> Iterator[tuple[str, float]]:
    """The numbers of an object's public attributes, and of theirs to a depth."""
    if isinstance(value, (int, float)) or (isinstance(value, np.ndarray) and value.dtype.kind in "biuf"):
        yield from ((f"{key}[{k}]", number) for k, number in enumerate(np.asarray(value, dtype=float).ravel().tolist()))
    elif depth:
        for name in dir(value):
            if not name.startswith("_"):
                yield from _numbers(getattr(value, name), f"{key}.{name}", depth - 1)
