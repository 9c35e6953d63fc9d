"""C3D, the binary format of most motion-capture systems, read through ezc3d."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, Literal

import ezc3d
import numpy as np

from dynakin.errors import RecordingError
from dynakin.recordings.formats.c3d_parameters import Parameters
from dynakin.recordings.formats.c3d_plates import read_plates
from dynakin.recordings.formats.c3d_records import check_c3d_file
from dynakin.recordings.formats.textfile import check_unique, trial_name
from dynakin.recordings.formats.trajectories import clean_markers
from dynakin.recordings.limits import FASTEST_HZ, SLOWEST_HZ
from dynakin.recordings.recording import Recording
from dynakin.recordings.resampling import ReadOptions
from dynakin.units import length_factor

_UNLABELLED = re.compile(r"^\*\d+$|^(unlabell?ed|uname)\W*\d*$", re.IGNORECASE)
# POINT parameters that list what a model computed
_COMPUTED = ("ANGLES", "FORCES", "MOMENTS", "POWERS", "SCALARS", "REACTIONS")


def read_c3d(path: Path, options: ReadOptions | None = None) -> Recording:
    """Read markers and force plates (types 1 to 4) of a C3D file.

    Time begins at 0 at the first frame of the file; a note gives that frame's number in the capture. Points
    that no camera saw (negative residual, or exactly 0, 0, 0) are NaN; unlabelled points (``*12``) and what a
    model computed (angles, moments, ...) are left out, and the notes say so.

    Raises:
        RecordingError: no such file, not a C3D, truncated or damaged, no or unknown length unit, no points, a plate
            type other than 1 to 4.
    """
    path = Path(path)
    layout_notes = check_c3d_file(path)
    try:
        data: Any = ezc3d.c3d(str(path))
    except Exception as error:  # ezc3d raises anything its C++ throws
        raise RecordingError(f"{path}: cannot be read as C3D ({' '.join(str(error).split())})") from error
    try:
        return _recording(data, path, options or ReadOptions(), layout_notes)
    except RecordingError:
        raise
    except (ArithmeticError, LookupError, MemoryError, TypeError, ValueError) as error:
        # What the checks let through: numbers in the parameters that no calculation can use.
        found = " ".join(f"{type(error).__name__}: {error}".split())
        raise RecordingError(f"{path}: the C3D's parameters contradict each other ({found})") from error


def _recording(data: Any, path: Path, options: ReadOptions, notes: list[str]) -> Recording:
    parameters = Parameters(data["parameters"])
    rate = parameters.number("POINT", "RATE") or float(data["header"]["points"]["frame_rate"])
    if not SLOWEST_HZ <= rate <= FASTEST_HZ:
        raise RecordingError(f"{path}: found point rate {rate:g} Hz, expected {SLOWEST_HZ:g} to {FASTEST_HZ:g} Hz")
    factor, unit = _unit(parameters, path)

    points = np.asarray(data["data"]["points"], dtype=float)[:3]  # (3, N, T)
    residual = np.asarray(data["data"]["meta_points"]["residuals"], dtype=float)[0]  # (N, T)
    points[:, residual < 0] = np.nan
    keep, names, point_notes = _markers(parameters, points.shape[1], path)
    frames = points.shape[2]
    if frames == 0 or not names:
        raise RecordingError(f"{path}: found {frames} frames of {len(names)} labelled markers, expected some")
    markers, marker_notes = clean_markers(names, np.moveaxis(points[:, keep], 0, -1).swapaxes(0, 1) * factor)
    first = int(data["header"]["points"]["first_frame"])
    if first:
        point_notes.append(f"Time 0 is frame {first + 1} of the capture ({first / rate:.4g} s after its start).")

    analog = np.asarray(data["data"]["analogs"], dtype=float)[0]  # (channels, samples)
    time = np.arange(frames) / rate
    plates, plate_notes = read_plates(parameters, analog, time, markers, unit, path, options)
    return Recording(
        name=trial_name(path),
        path=path,
        time=time,
        marker_names=names,
        markers=markers,
        plates=plates,
        length_unit=unit,
        notes=tuple(notes + point_notes + marker_notes + plate_notes),
        subject=_subject(parameters),
        hints={key: word for key in ("X_SCREEN", "Y_SCREEN") if (word := parameters.text("POINT", key))},
    )


def _unit(parameters: Parameters, path: Path) -> tuple[float, Literal["mm", "m"]]:
    word = parameters.text("POINT", "UNITS")
    factor = length_factor(word)
    if factor not in (1.0, 1e-3):
        raise RecordingError(f"{path}: found length unit {word!r} in POINT:UNITS, expected mm or m")
    return factor, ("mm" if factor == 1e-3 else "m")


def _markers(parameters: Parameters, n_points: int, path: Path) -> tuple[list[int], tuple[str, ...], list[str]]:
    """Indices and names of the points that are markers, and notes on those that are not."""
    labels = parameters.texts("POINT", "LABELS")[:n_points]
    labels += [""] * (n_points - len(labels))
    computed = {text for key in _COMPUTED for text in parameters.texts("POINT", key) if text}
    dropped = [k for k, label in enumerate(labels) if not label or _UNLABELLED.match(label)]
    outputs = [k for k, label in enumerate(labels) if label in computed and k not in dropped]
    notes = []
    if dropped:
        notes.append(f"{len(dropped)} unlabelled points left out.")
    if outputs:
        notes.append(f"{len(outputs)} computed points left out: {', '.join(labels[k] for k in outputs)}.")
    keep = [k for k in range(n_points) if k not in set(dropped) | set(outputs)]
    names = tuple(labels[k] for k in keep)
    check_unique(names, "marker", path)
    return keep, names, notes


def _subject(parameters: Parameters) -> dict[str, float]:
    """Mass and height where the file gives them (Vicon's PROCESSING group, or a SUBJECT(S) group)."""
    subject: dict[str, float] = {}
    for group in ("PROCESSING", "SUBJECTS", "SUBJECT"):
        for key in ("BODYMASS", "MASS", "WEIGHT"):
            mass = parameters.number(group, key)
            if mass and 1 < mass < 500:
                subject.setdefault("mass_kg", mass)
        height = parameters.number(group, "HEIGHT")
        if height and height > 0:
            metres = next((height * f for f in (1.0, 1e-2, 1e-3) if 0.3 < height * f < 3.0), None)
            if metres:
                subject.setdefault("height_m", metres)
    return subject
