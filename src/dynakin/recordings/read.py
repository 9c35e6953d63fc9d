"""``read``: any recording, by the extension of its file."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from os import PathLike
from pathlib import Path

import numpy as np

from dynakin.errors import RecordingError
from dynakin.files import require_file
from dynakin.messages import Message, warning
from dynakin.recordings.formats.c3d import read_c3d
from dynakin.recordings.formats.csv import read_csv, read_csv_table
from dynakin.recordings.formats.grf_columns import parse_column
from dynakin.recordings.formats.ground_forces import attach_forces
from dynakin.recordings.formats.mot import Table, read_table
from dynakin.recordings.formats.textfile import first_cell, refuse_export
from dynakin.recordings.formats.trc import read_trc
from dynakin.recordings.plates.dead import without_dead_channels
from dynakin.recordings.plates.pressure import main_axis
from dynakin.recordings.plates.stuck import without_doubles
from dynakin.recordings.pushes import JUDGED_N
from dynakin.recordings.recording import Recording
from dynakin.recordings.resampling import ReadOptions

Reader = Callable[[Path, ReadOptions], Recording]
ForceReader = Callable[[Path], Table]

READERS: dict[str, Reader] = {".trc": read_trc, ".c3d": read_c3d, ".csv": read_csv}
"""Readers of markers by extension (lower case, with its dot); a plug-in adds its own with
``register_reader``."""

FORCE_READERS: dict[str, ForceReader] = {".mot": read_table, ".sto": read_table, ".csv": read_csv_table}
"""Readers of ground-force tables by extension."""


def extensions(readers: Iterable[str] = READERS) -> str:
    """The extensions in words, for help and errors: ".c3d, .csv or .trc"."""
    *most, last = sorted(readers)
    return f"{', '.join(most)} or {last}" if most else last


_TABLES = (".tsv", ".txt")  # of camera systems, whose first cell says whose
_ENOUGH = 5  # markers that show how large a person is
_SPAN_M = (0.02, 50.0)


def register_reader(extension: str, reader: Reader) -> None:
    """Have ``read`` use ``reader`` for files that end in ``extension`` (".xyz")."""
    READERS[extension.casefold()] = reader


def read(
    path: str | Path,
    forces: str | Path | None = None,
    *,
    plate_filter_hz: float | None = None,
    force_threshold_n: float | None = None,
    causal: bool = False,
) -> Recording:
    """Read a trial: markers, and plates from the same file or from a ground-force table.

    Args:
        path: of one of `READERS`' kinds.
        forces: of one of `FORCE_READERS`' kinds, ground forces in the laboratory frame of the markers.
        plate_filter_hz, force_threshold_n, causal: see ``ReadOptions``.

    Raises:
        RecordingError: a file that is not there, of an unknown kind, damaged, or forces that do not fit the
            markers.
    """
    if not isinstance(path, str | PathLike) or not isinstance(forces, str | PathLike | None):
        raise RecordingError(f"read: found {path!r}, forces {forces!r}, expected names of files")
    options = ReadOptions(plate_filter_hz, force_threshold_n, causal)
    path = Path(path)
    reader = READERS.get(path.suffix.casefold())
    require_file(path)
    if reader is None:
        if path.suffix.casefold() in _TABLES:
            refuse_export(first_cell(path), path)
        hint = "; a table of ground forces goes with a recording" if path.suffix.casefold() in FORCE_READERS else ""
        raise RecordingError(
            f"{path}: found extension {path.suffix!r}, expected a recording as {extensions(READERS)}{hint}"
        )
    recording = marked = reader(path, options)
    _check_unit(recording, path)
    table = None if forces is None else read_forces(Path(forces))
    if table is not None:
        recording = attach_forces(marked, table, options)
    if plate_filter_hz is not None and not causal and recording.plates:  # what looks back delays, too, which is said
        unfiltered = replace(options, plate_filter_hz=None)
        raw = reader(path, unfiltered) if table is None else attach_forces(marked, table, unfiltered)
        if (cut := cuts_into_loads(without_dead_channels(raw), recording, plate_filter_hz)) is not None:
            recording = replace(recording, notes=(*recording.notes, cut))
    asked = {
        "forces": None if forces is None else str(Path(forces).absolute()),
        "plate_filter_hz": plate_filter_hz,
        "force_threshold_n": force_threshold_n,
    }
    known = {key: value for key, value in asked.items() if value is not None}
    return without_dead_channels(without_doubles(replace(recording, read_with=known) if known else recording))


def _check_unit(recording: Recording, path: Path) -> None:
    """A person's markers cannot be taken for one a thousand times as large, or as small."""
    markers = recording.markers
    if markers.shape[1] < _ENOUGH:
        return
    low, high = (
        np.where(np.isnan(markers), np.inf, markers).min(1),
        np.where(np.isnan(markers), -np.inf, markers).max(1),
    )
    span = np.linalg.norm(high - low, axis=1)[np.isfinite(low).all(axis=1)]
    span_m = float(np.median(span)) if len(span) else 1.0
    if not _SPAN_M[0] <= span_m <= _SPAN_M[1]:
        raise RecordingError(
            f"{path}: its markers span {span_m:.3g} m in a frame, expected 0.2 to 10 m of a person: the file's length "
            "unit is wrong"
        )


def read_forces(path: Path) -> Table:
    """A table of ground forces at its own times.

    Raises:
        RecordingError: a file that is not there, of an unknown kind, or damaged.
    """
    require_file(path)
    force_reader = FORCE_READERS.get(path.suffix.casefold())
    if force_reader is None:
        known = extensions(FORCE_READERS)
        raise RecordingError(f"{path}: found extension {path.suffix!r}, expected ground forces as {known}")
    table = force_reader(path)
    return _only_forces(table) if path.suffix.casefold() == ".csv" else table


def _only_forces(table: Table) -> Table:
    """A csv may hold markers and forces: these are not columns "not used"."""
    spots = [k for k, name in enumerate(table.names) if parse_column(name)]
    return replace(table, names=tuple(table.names[k] for k in spots), values=table.values[:, spots])


TAKEN_AWAY = 0.06
"""Part of a plate's mean load, RMS, by which a filter may change it. At 6 Hz it is 1 to 5 % of walks and squats, at 3
Hz 6 to 14 % of walks, whose moments are then up to 27 N m off; impacts of a drop jump lose 10 % even at 10 Hz."""
_LEAST = 10  # loaded frames


def cuts_into_loads(raw: Recording, filtered: Recording, cutoff_hz: float) -> Message | None:
    """A warning where plates that were low-passed differ from what they were by more than noise."""
    worst, name = 0.0, ""
    for before, after in zip(raw.plates, filtered.plates, strict=True):
        push = np.abs(before.force[:, main_axis([before])])
        loaded = (push > JUDGED_N) & np.isfinite(after.force).all(axis=1)
        if np.count_nonzero(loaded) < _LEAST:
            continue
        change = np.linalg.norm(after.force[loaded] - before.force[loaded], axis=1)
        part = float(np.sqrt(np.mean(change**2)) / push[loaded].mean())
        if part > worst:
            worst, name = part, before.name
    if worst <= TAKEN_AWAY:
        return None
    return warning(
        "plates",
        f"the low-pass at {cutoff_hz:g} Hz (plate_filter_hz) takes {100.0 * worst:.0f} % of {name}'s load away or "
        f"smears it (RMS, expected at most {100.0 * TAKEN_AWAY:.0f} %): moments are off by more than their standard "
        "deviations. Leave it out, or give a higher frequency.",
    )
