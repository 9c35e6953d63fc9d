"""TRC, the text format of OpenSim and Motion Analysis for marker trajectories.

A whole valid file (cells are parted by tabs, a blank cell is a missing value)::

    PathFileType  4           (X/Y/Z)    trial.trc
    DataRate      CameraRate  NumFrames  NumMarkers  Units  OrigDataRate  OrigDataStartFrame  OrigNumFrames
    100           100         2          2           mm     100           1                   2
    Frame#        Time        RKNE                   RANK
                              X1   Y1   Z1           X2   Y2   Z2

    1             0.00        1.0  2.0  3.0          4.0  5.0  6.0
    2             0.01                               4.0  5.0  6.0
"""

from __future__ import annotations

import re
from itertools import pairwise
from pathlib import Path

from dynakin.errors import RecordingError
from dynakin.messages import Message, note
from dynakin.recordings.formats.points import sort_points
from dynakin.recordings.formats.textfile import check_unique, read_lines, split_cells, timed_rows, trial_name
from dynakin.recordings.formats.trajectories import clean_markers, distinct_names, length_unit, timing_notes
from dynakin.recordings.recording import Recording
from dynakin.recordings.resampling import ReadOptions
from dynakin.recordings.times import settled_times

_AXES_ROW = re.compile(r"^[XYZ]_?\d*$", re.IGNORECASE)


def read_trc(path: Path, options: ReadOptions | None = None) -> Recording:
    """Read a TRC file; ``options`` concern plates only, which the format does not have.

    Raises:
        RecordingError: not a TRC, wrong column count (with line, found and expected), time that does not increase.
    """
    path = Path(path)
    lines = _tabbed(read_lines(path))
    top = next((k for k, line in enumerate(lines[:40]) if _is_names_row(line)), None)
    if top is None:
        raise RecordingError(f"{path}: is not a TRC file, found no line that starts with 'Frame#' and 'Time'")
    names = tuple(cell for cell in split_cells(lines[top])[2:] if cell)
    if not names:
        raise RecordingError(f"{path}, line {top + 1}: found no marker names after 'Frame#' and 'Time'")
    header = _header(lines[:top])
    columns = ["Frame#", "Time", *(f"{name} {axis}" for name in names for axis in "xyz")]
    body = [(k + 1, split_cells(lines[k])) for k in range(top + 1, len(lines))]
    while body and all(_AXES_ROW.match(cell) for cell in body[0][1] if cell):  # blank lines, too
        del body[0]
    rate = _number(header.get("datarate"))
    empty = f"has no frames, expected rows of numbers after line {top + 1}"
    table, time, row_notes, time_notes = timed_rows(body, columns, path, empty=empty, time_at=1, rate=rate)
    raw = table[:, 2:].reshape(len(table), len(names), 3)
    found = sort_points(names, raw.transpose(2, 1, 0))
    if not found.names:
        said = f"found {len(names)} points and no marker; expected labelled markers"
        raise RecordingError(f"{path}, line {top + 1}: {said}")
    raw = raw[:, found.markers]
    factor, unit, unit_notes = length_unit(header.get("units", ""), raw)
    time, stamp_notes = settled_times(time, raw, rate)
    time_notes += stamp_notes
    notes = row_notes + _count_notes(header, len(table), len(names)) + time_notes + timing_notes(time, rate)
    names, markers, doubled_notes = distinct_names(found.names, raw * factor)
    check_unique(names, "marker", path)
    markers, marker_notes = clean_markers(names, markers, time, path)
    return Recording(
        name=trial_name(path),
        path=path,
        time=time,
        marker_names=names,
        markers=markers,
        length_unit=unit,
        notes=(*notes, *found.notes, *unit_notes, *doubled_notes, *marker_notes),
    )


def _tabbed(lines: list[str]) -> list[str]:
    """The lines parted by tabs, of a file that a spreadsheet parted by semicolons or commas."""
    for mark in ";,":
        head = next((line for line in lines[:40] if _is_names_row(line.replace(mark, "\t"))), None)
        if head is not None and "\t" not in head:
            return [line.replace(mark, "\t") for line in lines]
    return lines


def _is_names_row(line: str) -> bool:
    cells = split_cells(line)
    return len(cells) > 1 and cells[0].casefold().startswith("frame") and cells[1].casefold().startswith("time")


def _header(lines: list[str]) -> dict[str, str]:
    """Keys of the header (lower case) and the values in the next filled line, cell by cell."""
    filled = [split_cells(line) for line in lines if line.strip()]
    for keys, values in pairwise(filled):
        if any(key.casefold() in ("datarate", "units", "numframes") for key in keys):
            given = [value for value in values if value]  # some programs part them by two tabs
            entries = given if len(given) == len([key for key in keys if key]) else values
            return {key.casefold(): value for key, value in zip(keys, entries, strict=False) if key}
    return {}


def _number(text: str | None) -> float | None:
    try:
        return float(text.replace(",", ".")) if text else None
    except ValueError:
        return None


def _count_notes(header: dict[str, str], frames: int, markers: int) -> list[Message]:
    notes = []
    for key, found, word in (("numframes", frames, "frames"), ("nummarkers", markers, "markers")):
        said = _number(header.get(key))
        if said is not None and said != found:
            notes.append(
                note("recording", f"The header says {said:g} {word}, the file holds {found}: the latter are used.")
            )
    return notes
