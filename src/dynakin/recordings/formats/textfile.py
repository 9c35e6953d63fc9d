"""Lines and numbers of the text formats, with errors that name file and line."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from dynakin.errors import RecordingError
from dynakin.files import read_bytes
from dynakin.recordings.limits import LONGEST_GAP_S, rate_problem
from dynakin.recordings.recording import Array

_CONTROL = re.compile(r"[\x00-\x1f\x7f]+")


def trial_name(path: Path) -> str:
    """What a recording is called: its file's name without ending; a line end in it is a blank."""
    return _CONTROL.sub(" ", path.stem)


def read_lines(path: Path) -> list[str]:
    """All lines without their ends (LF, CRLF or CR), byte order mark removed; Latin-1 where it is not
    UTF-8."""
    raw = read_bytes(path)
    if b"\0" in raw:
        raise RecordingError(f"{path}: is not a text file")
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = raw.decode("latin-1")
    return text.replace("\r\n", "\n").replace("\r", "\n").split("\n")


def split_cells(line: str, separator: str | None = None) -> list[str]:
    """Cells of a line: between tabs where it has any (blank cells count), else between blanks."""
    if separator is not None:
        return [cell.strip() for cell in line.split(separator)]
    return [cell.strip() for cell in line.split("\t")] if "\t" in line else line.split()


def parse_row(cells: Sequence[str], names: Sequence[str], path: Path, line: int) -> list[float]:
    """Numbers of one row, a blank cell is NaN; trailing blank cells beyond the last column are dropped.

    Raises:
        RecordingError: the number of columns is not that of ``names``, or a cell is no number.
    """
    found = len(cells)
    while found > len(names) and not cells[found - 1]:
        found -= 1
    if found != len(names):
        raise RecordingError(f"{path}, line {line}: found {found} columns, expected {len(names)}")
    row = []
    for cell, name in zip(cells, names, strict=False):
        try:
            value = float(cell) if cell else np.nan
            if np.isinf(value):
                raise ValueError
            row.append(value)
        except ValueError:
            hint = "; decimals are written with a point" if "," in cell else ""
            raise RecordingError(
                f"{path}, line {line}: found {cell!r} in column {name!r}, expected a number{hint}"
            ) from None
    return row


def check_time(time: Array, lines: Sequence[int], path: Path) -> None:
    """Raise RecordingError at the first time that is missing, not later than the one before, or an hour after it, and
    where the rate is none of a measurement."""
    for k in np.flatnonzero(~np.isfinite(time))[:1]:
        raise RecordingError(f"{path}, line {lines[k]}: no time given, expected a number")
    for k in np.flatnonzero(np.diff(time) <= 0)[:1]:
        raise RecordingError(
            f"{path}, line {lines[k + 1]}: time {time[k + 1]:g} s does not come after {time[k]:g} s, "
            "expected a strictly increasing time"
        )
    if problem := rate_problem(time):
        raise RecordingError(f"{path}: {problem}")
    for k in np.flatnonzero(np.diff(time) > LONGEST_GAP_S)[:1]:
        raise RecordingError(
            f"{path}, line {lines[k + 1]}: time {time[k + 1]:g} s comes after {time[k]:g} s, expected gaps of at most "
            f"{LONGEST_GAP_S:g} s"
        )


def check_unique(names: Sequence[str], what: str, path: Path) -> None:
    """Raise RecordingError where a name appears more than once, or would break the lines of a file."""
    for name in names:
        if _CONTROL.search(name):
            raise RecordingError(f"{path}: found {what} {name!r}, expected a name without control characters")
    twice = [name for name, count in Counter(names).items() if count > 1]
    if twice:
        raise RecordingError(f"{path}: {what} {', '.join(map(repr, twice))} appears more than once")
