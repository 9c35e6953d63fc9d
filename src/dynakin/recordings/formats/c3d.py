"""C3D, the binary format of most motion-capture systems, read through ezc3d."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from dynakin.arrays import Array
from dynakin.errors import RecordingError
from dynakin.messages import Message, note
from dynakin.recordings.formats.c3d_beside import first_frame, read_analog, read_events, read_subject
from dynakin.recordings.formats.c3d_channels import analog_values
from dynakin.recordings.formats.c3d_checks import check_c3d_file
from dynakin.recordings.formats.c3d_parameters import Parameters
from dynakin.recordings.formats.c3d_plates import read_plates
from dynakin.recordings.formats.c3d_records import Correction
from dynakin.recordings.formats.points import Points, sort_points
from dynakin.recordings.formats.textfile import check_unique, trial_name
from dynakin.recordings.formats.trajectories import clean_markers, distinct_names, length_unit
from dynakin.recordings.limits import FASTEST_HZ, SLOWEST_HZ
from dynakin.recordings.recording import Recording
from dynakin.recordings.resampling import ReadOptions

_Read = TypeVar("_Read")
_COMPUTED = ("ANGLES", "FORCES", "MOMENTS", "POWERS", "SCALARS", "REACTIONS")
"""POINT parameters that list what a model computed; others may be named by POINT:TYPE_GROUPS."""


def read_c3d(path: Path, options: ReadOptions | None = None) -> Recording:
    """Read markers, force plates (types 1 to 7), events, analog channels and what is said of the person.

    Time begins at 0 at the first frame of the file; a note gives that frame's number in the capture. Points that no
    camera saw (negative residual, or exactly 0, 0, 0) are NaN; unlabelled points (``*12``) and what a model computed
    (angles, moments, axes, ...) are left out, and so is a plate that cannot be read; the notes say so.

    Raises:
        RecordingError: no such file, not a C3D, truncated or damaged, no points.
    """
    return _opened(Path(path), lambda data, notes: _recording(data, Path(path), options or ReadOptions(), notes))


def read_c3d_results(path: Path) -> dict[str, Array]:
    """What the file's own model computed (angles, moments, powers, ...): label -> (T, 3) in the file's units, NaN where
    there is no result; at the times of the recording.

    Raises:
        RecordingError: as `read_c3d`.
    """

    def results(data: Any, _: list[Message]) -> dict[str, Array]:
        points, sorted_points = _points(data, Parameters(data["parameters"]))
        values = points.transpose(1, 2, 0)  # (N, T, 3)
        values = np.where((values == 0.0).all(axis=2, keepdims=True), np.nan, values)
        return {sorted_points.labels[k]: values[k] for k in sorted_points.outputs}

    return _opened(Path(path), results)


def _opened(path: Path, use: Callable[[Any, list[Message]], _Read]) -> _Read:
    import ezc3d

    layout_notes, corrections = check_c3d_file(path)
    try:
        data: Any = _corrected(path, corrections) if corrections else ezc3d.c3d(str(path))
    except Exception as error:  # ezc3d raises anything its C++ throws
        raise RecordingError(f"{path}: cannot be read as C3D ({' '.join(str(error).split())})") from error
    try:
        return use(data, layout_notes)
    except RecordingError:
        raise
    except (ArithmeticError, LookupError, MemoryError, TypeError, ValueError) as error:
        # What the checks let through: numbers in the parameters that no calculation can use.
        found = " ".join(f"{type(error).__name__}: {error}".split())
        raise RecordingError(f"{path}: the C3D's parameters contradict each other ({found})") from error


def _corrected(path: Path, corrections: list[Correction]) -> Any:
    """What ezc3d reads from a copy in which these bytes are put right."""
    import ezc3d

    content = bytearray(path.read_bytes())
    for at, new in corrections:
        content[at : at + len(new)] = new
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "corrected.c3d"
        copy.write_bytes(content)
        return ezc3d.c3d(str(copy))


def _recording(data: Any, path: Path, options: ReadOptions, notes: list[Message]) -> Recording:
    parameters = Parameters(data["parameters"])
    rate = parameters.number("POINT", "RATE") or float(data["header"]["points"]["frame_rate"])
    if not SLOWEST_HZ <= rate <= FASTEST_HZ:
        raise RecordingError(f"{path}: found point rate {rate:g} Hz, expected {SLOWEST_HZ:g} to {FASTEST_HZ:g} Hz")
    points, found = _points(data, parameters)
    frames = points.shape[2]
    if frames and not found.names and found.unlabelled:
        raise RecordingError(
            f"{path}: {found.unlabelled} unlabelled points and no marker; expected points labelled in the capture "
            "software, and exported again"
        )
    if frames == 0 or not found.names:
        raise RecordingError(f"{path}: found {frames} frames of {len(found.names)} labelled markers, expected some")
    raw = points[:, found.markers].transpose(2, 1, 0)  # (T, M, 3)
    factor, unit, unit_notes = length_unit(parameters.text("POINT", "UNITS"), raw)
    names, markers, doubled_notes = distinct_names(found.names, raw * factor)
    check_unique(names, "marker", path)
    markers, missing_notes = clean_markers(names, markers, np.arange(frames) / rate, path)
    first = first_frame(parameters, int(data["header"]["points"]["first_frame"]), path)
    start_notes = []
    if first:
        start_notes.append(
            note("routine", f"Time 0 is frame {first + 1} of the capture ({first / rate:.4g} s after its start).")
        )

    time = np.arange(frames) / rate
    analog = analog_values(data, parameters)
    plates, plate_notes = read_plates(parameters, analog, time, markers, factor, options)
    events, event_notes = read_events(parameters, first / rate, time)
    said = [*notes, *found.notes, *start_notes, *unit_notes, *doubled_notes, *missing_notes, *plate_notes, *event_notes]
    return Recording(
        name=trial_name(path),
        path=path,
        time=time,
        marker_names=names,
        markers=markers,
        plates=plates,
        length_unit=unit,
        notes=tuple(said),
        subject=read_subject(parameters),
        hints={key: word for key in ("X_SCREEN", "Y_SCREEN") if (word := parameters.text("POINT", key))},
        events=events,
        analog=read_analog(parameters, analog, time),
    )


def _points(data: Any, parameters: Parameters) -> tuple[Array, Points]:
    """All points (3, N, T) in the file's unit, NaN where no camera saw them, and which are markers."""
    points = np.asarray(data["data"]["points"], dtype=float)[:3].copy()
    residual = np.asarray(data["data"]["meta_points"]["residuals"], dtype=float)[0]  # (N, T)
    points[:, residual < 0] = np.nan
    labels = parameters.texts("POINT", "LABELS")[: points.shape[1]]
    labels += [""] * (points.shape[1] - len(labels))
    return points, sort_points(labels, points, _computed(parameters))


def _computed(parameters: Parameters) -> set[str]:
    """Labels that the file lists as a model's outputs."""
    groups = [word.upper() for word in parameters.texts("POINT", "TYPE_GROUPS")[::2]]
    keys = {*_COMPUTED, *groups} - {"MODELED_MARKERS", "MODELLED_MARKERS", "MARKERS", "LABELS"}
    return {text for key in keys for text in parameters.texts("POINT", key) if text}
