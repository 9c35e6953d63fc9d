"""MOT and STO, OpenSim's text tables (coordinates, ground forces).

Both generations of headers are read: ``nRows=..``, ``nColumns=..``, ``inDegrees=yes|no`` (any order, other
lines are remarks) and SIMM's older ``name``, ``datacolumns``, ``datarows``, ``range``; each ends with
``endheader``, then one line of column names beginning with ``time``, then the numbers, parted by tabs or
blanks.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dynakin.arrays import Array
from dynakin.errors import RecordingError
from dynakin.messages import Message, note
from dynakin.recordings.formats.textfile import check_unique, read_lines, split_cells, timed_rows

_ENTRY = re.compile(
    r"^\s*(nRows|nColumns|inDegrees|datarows|datacolumns|name|range|version)\s*[=:\s]\s*(.+?)\s*$", re.I
)
_PARTED = re.compile(r'^\s*"?time"?\s*([,;|])', re.I)
_SEPARATORS = {",": "commas", ";": "semicolons", "|": "bars"}
_SYNONYMS = {"datarows": "nrows", "datacolumns": "ncolumns"}


@dataclass(frozen=True, eq=False)
class Table:
    """A table of columns over time, values as the file has them.

    Attributes:
        names: K column names, without time.
        time: (T,) s.
        values: (T, K).
        in_degrees: what the header says of angles; None where it says nothing.
        path: the file.
        notes: what the reader found odd.
    """

    names: tuple[str, ...]
    time: Array
    values: Array
    in_degrees: bool | None
    path: Path
    notes: tuple[Message, ...] = ()

    def column(self, name: str) -> Array:
        """One column (T,) as the file has it; RecordingError lists the columns if it is not there."""
        if name not in self.names:
            raise RecordingError(f"{self.path}: no column {name!r}; it has {', '.join(self.names)}")
        return self.values[:, self.names.index(name)]

    def radians(self, rotations: Iterable[str]) -> Table:
        """The same table with the columns named in ``rotations`` in radians; the others (translations) stay.

        Raises:
            RecordingError: the header does not give ``inDegrees``.
        """
        if self.in_degrees is None:
            raise RecordingError(f"{self.path}: header has no inDegrees line, expected inDegrees=yes or inDegrees=no")
        wanted = set(rotations)
        factor = np.array([np.pi / 180 if self.in_degrees and name in wanted else 1.0 for name in self.names])
        return Table(self.names, self.time, self.values * factor, False, self.path, self.notes)


def read_table(path: str | Path) -> Table:
    """Read a MOT or STO file.

    Raises:
        RecordingError: no column line beginning with time, wrong column count (line, found, expected), a column given
            twice, time that does not increase.
    """
    path = Path(path)
    lines = read_lines(path)
    top = _names_line(lines, path)
    header: dict[str, str] = {}
    for line in lines[:top]:
        if entry := _ENTRY.match(line):
            key = entry[1].casefold()
            header.setdefault(_SYNONYMS.get(key, key), entry[2])
    columns = [name for name in split_cells(lines[top]) if name]
    check_unique(columns, "column", path)

    body = ((k + 1, split_cells(lines[k])) for k in range(top + 1, len(lines)))
    empty = f"has no rows of numbers after line {top + 1}"
    table, time, notes, time_notes = timed_rows(body, columns, path, empty=empty)
    notes = [said.of(path.name) for said in notes + time_notes]
    notes += _count_notes(header, len(table), len(columns), path)
    return Table(tuple(columns[1:]), time, table[:, 1:], _in_degrees(header, path), path, tuple(notes))


def _names_line(lines: list[str], path: Path) -> int:
    end = next((k for k, line in enumerate(lines) if line.strip().casefold() == "endheader"), -1)
    for k in range(end + 1, len(lines)):
        if cells := split_cells(lines[k].rstrip()):
            if cells[0].casefold() == "time":
                return k
            if parted := _PARTED.match(lines[k]):
                raise RecordingError(
                    f"{path}, line {k + 1}: found columns parted by {_SEPARATORS[parted[1]]}, expected tabs or blanks"
                )
            if end >= 0 and any(cells):
                raise RecordingError(f"{path}, line {k + 1}: found column {cells[0]!r} first, expected 'time'")
    raise RecordingError(f"{path}: is not a MOT or STO table, found no line of column names that begins with 'time'")


def _count_notes(header: dict[str, str], rows: int, columns: int, path: Path) -> list[Message]:
    notes = []
    said_rows, said_columns = header.get("nrows", ""), header.get("ncolumns", "")
    if said_columns and _count(said_columns) not in (None, columns):
        notes.append(
            note("recording", f"{path.name}: the header says {said_columns:.20} columns, the file names {columns}.")
        )
    said = _count(said_rows)
    if said is not None and said != rows:
        cut = " (has it been cut off?)" if said > rows else ""
        notes.append(
            note(
                "recording",
                f"{path.name}: the header says {said:.6g} rows, the file holds {rows}{cut}: all of these are used.",
            )
        )
    return notes


def _count(word: str) -> float | None:
    """A whole number, infinite where no file is so long; None for what is none ("²", say)."""
    if not (word.isascii() and word.isdigit()):
        return None
    return int(word) if len(word) < 18 else float("inf")


def _in_degrees(header: dict[str, str], path: Path) -> bool | None:
    word = header.get("indegrees")
    if word is None:
        return None
    if word.casefold() not in ("yes", "no", "true", "false", "1", "0"):
        raise RecordingError(f"{path}: found inDegrees={word}, expected yes or no")
    return word.casefold() in ("yes", "true", "1")
