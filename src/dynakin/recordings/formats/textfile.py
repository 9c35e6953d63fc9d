"""Lines and numbers of the text formats, with errors that name file and line."""

from __future__ import annotations

import codecs
import csv
import re
from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from dynakin.arrays import Array
from dynakin.errors import RecordingError
from dynakin.files import read_bytes
from dynakin.messages import Message, note
from dynakin.recordings.limits import LONGEST_GAP_S, rate_problem

_CONTROL = re.compile(r"[\x00-\x1f\x7f]+")
# What programs write for a value that is missing
_MISSING = ("", "nan", "-nan", "na", "n/a", "#n/a", "null", "none", "-", "-nan(ind)", "nan(ind)", "-1.#ind", "1.#qnan")
_NO_NUMBER = "-*."  # and any number of these
_ROUGH = 0.1  # part of a step from which rounding of times is undone: `resampling.UNEVEN` would refuse it
_COARSE = 1.05  # the same from which rounding makes two times equal: 100 Hz to 0.01 s has none
_ENOUGH = 10  # times that show a grid
_AGAIN = 3  # longer steps that may come from rounding


_EXPORTS = {
    "format version": "a CSV of Motive",
    "trajectories": "a CSV of Nexus",
    "devices": "a CSV of Nexus",
    "no_of_frames": "a TSV of QTM",
}


def first_cell(path: Path) -> str:
    """Of a text file; "" where it has none."""
    cells = split_cells(read_lines(path)[0])
    return cells[0] if cells else ""


def refuse_export(first: str, path: Path) -> None:
    """Raise RecordingError where a file begins as a camera system's tables do, which no reader takes."""
    if (what := _EXPORTS.get(first.casefold())) is not None:
        raise RecordingError(f"{path}: is {what}, expected the same trial exported as C3D (or TRC)")


def trial_name(path: Path) -> str:
    """What a recording is called: its file's name without ending; a line end in it is a blank."""
    return _CONTROL.sub(" ", path.stem)


def read_lines(path: Path) -> list[str]:
    """All lines without their ends (LF, CRLF or CR), byte order mark removed; UTF-16 where its mark says so, Latin-1
    where it is not UTF-8."""
    raw = read_bytes(path)
    encoding = "utf-16" if raw[:2] in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE) else "utf-8-sig"
    try:
        text = raw.decode(encoding)
    except UnicodeDecodeError:
        text = raw.decode("latin-1")
    if "\0" in text:
        raise RecordingError(f"{path}: is not a text file")
    return text.replace("\r\n", "\n").replace("\r", "\n").split("\n")


def split_cells(line: str, separator: str | None = None) -> list[str]:
    """Cells of a line without blanks and quotes round them: between tabs where it has any (blank cells count), else
    between blanks."""
    if separator is None:
        separator = "\t" if "\t" in line else None
    if separator is None:
        return [cell.strip('"') for cell in line.split()]
    if '"' in line:
        try:
            return [cell.strip() for cell in next(csv.reader([line], delimiter=separator, skipinitialspace=True))]
        except csv.Error:
            pass
    return [cell.strip() for cell in line.split(separator)]


def parse_rows(
    lines: Iterable[tuple[int, Sequence[str]]], names: Sequence[str], path: Path
) -> tuple[Array, list[int], list[Message]]:
    """Numbers (R, K) of rows of cells, the line of each, and notes.

    Decimal commas are read where the file has no decimal points as well.

    Args:
        lines: number and cells of each line; those without any filled cell are passed over.
    """
    rows = [(number, cells) for number, cells in lines if any(cells)]
    notes = []
    if any("," in cell for _, cells in rows for cell in cells) and not any(
        "." in cell for _, cells in rows for cell in cells
    ):
        rows = [(number, [cell.replace(",", ".") for cell in cells]) for number, cells in rows]
        notes.append(note("recording", "Numbers are written with decimal commas."))
    table = np.array([parse_row(cells, names, path, number) for number, cells in rows])
    return table, [number for number, _ in rows], notes


def parse_row(cells: Sequence[str], names: Sequence[str], path: Path, line: int) -> list[float]:
    """Numbers of one row, a blank cell is NaN; blank cells beyond the last column are dropped, and every second one in
    a row that is parted by doubled tabs.

    Raises:
        RecordingError: the number of columns is not that of ``names``, or a cell is no number.
    """
    found = len(cells)
    while found > len(names) and not cells[found - 1]:
        found -= 1
    if found > len(names) and len(cells[:found:2]) == len(names) and not any(cells[1::2]):
        cells, found = cells[:found:2], len(names)
    if found != len(names):
        raise RecordingError(f"{path}, line {line}: found {found} columns, expected {len(names)}")
    try:
        row = [float(cell) for cell in cells[:found]]  # nearly every row
    except ValueError:
        row = [np.inf]
    if np.inf not in row and -np.inf not in row:
        return row
    row = []
    for cell, name in zip(cells, names, strict=False):
        try:
            value = np.nan if cell.casefold() in _MISSING or not cell.strip(_NO_NUMBER) else float(cell)
            if np.isinf(value):
                raise ValueError
            row.append(value)
        except ValueError:
            hint = "; decimals are written with a point" if "," in cell else ""
            raise RecordingError(
                f"{path}, line {line}: found {cell!r} in column {name!r}, expected a number{hint}"
            ) from None
    return row


def timed_rows(
    lines: Iterable[tuple[int, Sequence[str]]],
    names: Sequence[str],
    path: Path,
    *,
    empty: str,
    time_at: int = 0,
    rate: float | None = None,
) -> tuple[Array, Array, list[Message], list[Message]]:
    """Numbers (R, K) and times (R,) s of a table, notes on its rows and on its times.

    Args:
        lines, names: as of `parse_rows`. empty: what is said of a file without rows. time_at: the column of the time.
        rate: Hz, by the header.

    Raises:
        RecordingError: no rows, or as `parse_rows` and `check_time`.
    """
    values, numbers, notes = parse_rows(lines, names, path)
    if not len(values):
        raise RecordingError(f"{path}: {empty}")
    time, time_notes = even_times(values[:, time_at], rate)
    check_time(time, numbers, path)
    return values, time, notes, time_notes


def even_times(time: Array, rate_in_header: float | None = None) -> tuple[Array, list[Message]]:
    """Times (T,) s that the file rounds to more than a tenth of a step, put back on the even grid that they come from,
    and a note; all others as they are.

    The grid is one from which every time of the file follows by rounding; its rate is that of the header, a whole
    number of Hz, or the mean, the first that does.
    """
    if len(time) < _ENOUGH or not np.isfinite(time).all():
        return time, []
    rounded_to = next((10.0**-d for d in range(7) if np.abs(time - np.round(time, d)).max() < 1e-9), None)
    k = np.arange(len(time))
    centred = k - k.mean()
    slope = float(centred @ time / (centred @ centred))  # s a frame, by least squares
    if rounded_to is None or slope <= 0.0 or rounded_to <= _ROUGH * slope or (np.diff(time) < 0).any():
        return time, []
    if _lacks_rows(np.diff(time)):
        return time, []
    said = 1.0 / rate_in_header if rate_in_header and 0.8 < rate_in_header * slope < 1.2 else slope
    if rounded_to < _COARSE * said and (np.diff(time) == 0).any():  # a row twice: rounding makes no two times equal
        return time, []
    for rate in (rate_in_header, float(np.rint(1.0 / slope)), 1.0 / slope):
        if rate is None or not rate > 0.0 or np.abs(np.diff(time) - 1.0 / rate).max() >= (1.0 - 1e-6) * rounded_to:
            continue
        low, high = (time - k / rate).max() - 0.55 * rounded_to, (time - k / rate).min() + 0.55 * rounded_to
        if low <= high:
            even = np.clip(time[0], low, high) + k / rate
            if np.abs(even - time).max() < 1e-6 / rate:
                return time, []
            text = f"Times are rounded to {rounded_to:g} s in the file: taken as an even {rate:.6g} Hz."
            return even, [note("recording", text)]
    return time, []


def _lacks_rows(steps: Array) -> bool:
    """Whether some steps are whole multiples of all others, too seldom for it to come from rounding, which would do so
    again and again."""
    step = float(np.median(steps))
    longer = np.count_nonzero(steps > 1.5 * step)
    whole = np.abs(steps - step * np.rint(steps / step if step > 0.0 else steps)).max() < 1e-6 * step
    return bool(0 < longer < _AGAIN and whole and steps.min() > 0.5 * step)


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
