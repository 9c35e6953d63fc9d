"""dynakin's own simple format: one row of names, then numbers, parted by commas, semicolons or tabs.

``time`` in s, ``NAME_x, NAME_y, NAME_z`` in m for each marker, and, where there are plates, force columns in
any of OpenSim's spellings (``FP1_vx`` ... N, ``FP1_px`` ... m, ``FP1_mx`` ... N m, ground-on-person) in the
same frame. A blank
cell is a missing value, a line that begins with ``#`` a remark::

    # standing, take 2
    time,RKNE_x,RKNE_y,RKNE_z,FP1_vx,FP1_vy,FP1_vz,FP1_px,FP1_py,FP1_pz,FP1_mx,FP1_my,FP1_mz
    0.00,0.101,0.480,0.093,1.2,801.5,-3.0,0.05,0,0.1,0,0.4,0
    0.01,,,,1.1,801.9,-3.1,0.05,0,0.1,0,0.4,0
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np

from dynakin.arrays import Array
from dynakin.errors import RecordingError
from dynakin.messages import Message
from dynakin.recordings.formats.grf_columns import parse_column
from dynakin.recordings.formats.ground_forces import attach_forces
from dynakin.recordings.formats.mot import Table
from dynakin.recordings.formats.points import sort_points
from dynakin.recordings.formats.textfile import (
    check_unique,
    read_lines,
    refuse_export,
    split_cells,
    timed_rows,
    trial_name,
)
from dynakin.recordings.formats.trajectories import clean_markers, length_unit, timing_notes
from dynakin.recordings.recording import Recording
from dynakin.recordings.resampling import ReadOptions
from dynakin.recordings.times import settled_times

_TIME = re.compile(r"^time\W*(s|sec|seconds)?\W*$", re.IGNORECASE)
_COORDINATE = re.compile(r"^(.+?)[_.: -]([xyz])$", re.IGNORECASE)
_EXPECTED = "expected NAME_x, NAME_y and NAME_z for each marker"
_PERSON = 5  # markers that show how large a person is


def read_csv_table(path: Path) -> Table:
    """All columns of such a file, without sorting them into markers and forces."""
    path = Path(path)
    filled = [
        (number, line)
        for number, line in enumerate(read_lines(path), start=1)
        if line.strip(" \t,;") and not line.lstrip(' "').startswith("#")
    ]
    if not filled:
        raise RecordingError(f"{path}: has no rows of numbers")
    first, head = filled[0]
    separator = next((mark for mark in ";\t" if mark in head), ",")
    names = split_cells(head, separator)
    while len(names) > 1 and not names[-1]:
        del names[-1]
    refuse_export(names[0], path)
    if not _TIME.match(names[0]):
        raise RecordingError(
            f"{path}, line {first}: found column {names[0]!r} first, expected 'time', then NAME_x, NAME_y, NAME_z"
        )
    check_unique(names, "column", path)
    body = ((number, split_cells(line, separator)) for number, line in filled[1:])
    values, time, notes, time_notes = timed_rows(body, names, path, empty="has no rows of numbers")
    return Table(tuple(names[1:]), time, values[:, 1:], None, path, tuple(notes + time_notes))


def read_csv(path: Path, options: ReadOptions | None = None) -> Recording:
    """Read markers, and plates where there are force columns.

    Raises:
        RecordingError: wrong column count, a column that is neither NAME_x, NAME_y, NAME_z nor a force, time
            that does not increase.
    """
    table = read_csv_table(path)
    forces = [name for name in table.names if parse_column(name)]
    rest = [name for name in table.names if name not in forces]
    names, raw = _markers(table, rest)
    found = sort_points(names, raw.transpose(2, 1, 0))
    names, raw = found.names, raw[:, found.markers]
    time, stamp_notes = settled_times(table.time, raw)
    table = replace(table, time=time, notes=(*table.notes, *stamp_notes))
    factor, unit, unit_notes = (1.0, "m", []) if forces else _unit(raw)
    markers, notes = clean_markers(names, raw * factor, table.time, table.path)
    recording = Recording(
        name=trial_name(table.path),
        path=table.path,
        time=table.time,
        marker_names=names,
        markers=markers,
        length_unit=unit,
        notes=(*table.notes, *found.notes, *timing_notes(table.time), *unit_notes, *notes),
    )
    if not forces:
        return recording
    columns = np.column_stack([table.column(name) for name in forces])
    only = Table(tuple(forces), table.time, columns, None, table.path)
    return attach_forces(recording, only, options or ReadOptions())


def _markers(table: Table, columns: list[str]) -> tuple[tuple[str, ...], Array]:
    """Names, and places (T, M, 3) in the file's unit, of the markers whose coordinates these columns are."""
    spots: dict[str, dict[str, str]] = {}
    for column in columns:
        parts = _COORDINATE.match(column)
        if parts is None:
            raise RecordingError(f"{table.path}: found column {column!r}, {_EXPECTED}")
        axes = spots.setdefault(parts[1].strip(), {})
        if parts[2].lower() in axes:
            raise RecordingError(f"{table.path}: found columns {axes[parts[2].lower()]!r} and {column!r}, {_EXPECTED}")
        axes[parts[2].lower()] = column
    for name, axes in spots.items():
        for axis in set("xyz") - set(axes):
            raise RecordingError(f"{table.path}: missing column {f'{name}_{axis}'!r}, {_EXPECTED}")
    raw = [table.column(axes[axis]) for axes in spots.values() for axis in "xyz"]
    shape = (len(table.time), len(spots), 3)
    return tuple(spots), np.stack(raw, axis=1).reshape(shape) if raw else np.empty(shape)


def _unit(raw: Array) -> tuple[float, Literal["mm", "m"], list[Message]]:
    """The format is in m; what cannot be a person in m is in the unit in which it can."""
    factor, unit, notes = length_unit("", raw)
    return (factor, unit, notes) if raw.shape[1] >= _PERSON and factor != 1.0 else (1.0, "m", [])
