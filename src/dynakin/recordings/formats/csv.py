"""dynakin's own simple format: one row of names, then numbers, parted by commas.

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

from pathlib import Path

import numpy as np

from dynakin.errors import RecordingError
from dynakin.recordings.formats.grf_columns import parse_column
from dynakin.recordings.formats.ground_forces import attach_forces
from dynakin.recordings.formats.mot import Table
from dynakin.recordings.formats.textfile import check_time, check_unique, parse_row, read_lines, split_cells, trial_name
from dynakin.recordings.formats.trajectories import clean_markers, timing_notes
from dynakin.recordings.recording import Recording
from dynakin.recordings.resampling import ReadOptions


def read_csv_table(path: Path) -> Table:
    """All columns of such a file, without sorting them into markers and forces."""
    path = Path(path)
    rows: list[list[float]] = []
    numbers: list[int] = []
    names: list[str] = []
    for number, line in enumerate(read_lines(path), start=1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        cells = split_cells(line, ",")
        if not names:
            names = [cell.strip('"') for cell in cells]
            if names[0].casefold() != "time":
                raise RecordingError(f"{path}, line {number}: found column {names[0]!r} first, expected 'time'")
            check_unique(names, "column", path)
        else:
            rows.append(parse_row(cells, names, path, number))
            numbers.append(number)
    if not rows:
        raise RecordingError(f"{path}: has no rows of numbers")
    values = np.array(rows)
    check_time(values[:, 0], numbers, path)
    return Table(tuple(names[1:]), values[:, 0], values[:, 1:], None, path)


def read_csv(path: Path, options: ReadOptions | None = None) -> Recording:
    """Read markers, and plates where there are force columns.

    Raises:
        RecordingError: wrong column count, a column that is neither NAME_x, NAME_y, NAME_z nor a force, time
            that does not increase.
    """
    table = read_csv_table(path)
    forces = [name for name in table.names if parse_column(name)]
    rest = [name for name in table.names if name not in forces]
    names = tuple(dict.fromkeys(name[:-2] for name in rest if name[-2:] in ("_x", "_y", "_z")))
    expected = {f"{name}_{axis}" for name in names for axis in "xyz"}
    for name in sorted(expected ^ set(rest)):
        found = "found" if name in rest else "missing"
        raise RecordingError(f"{path}: {found} column {name!r}, expected NAME_x, NAME_y and NAME_z for each marker")
    raw = np.stack([table.column(f"{name}_{axis}") for name in names for axis in "xyz"], axis=1) if names else None
    shape = (len(table.time), len(names), 3)
    markers, notes = clean_markers(names, np.empty(shape) if raw is None else raw.reshape(shape))
    recording = Recording(
        name=trial_name(table.path),
        path=table.path,
        time=table.time,
        marker_names=names,
        markers=markers,
        notes=tuple(timing_notes(table.time) + notes),
    )
    if not forces:
        return recording
    columns = np.column_stack([table.column(name) for name in forces])
    only = Table(tuple(forces), table.time, columns, None, table.path)
    return attach_forces(recording, only, options or ReadOptions())
