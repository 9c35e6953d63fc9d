"""Recordings and live samples as the arrays that the core takes: its markers and the total wrench, ground frame."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from dynakin.arrays import Array
from dynakin.errors import RecordingError
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.recordings.frame import GroundFrame
from dynakin.recordings.limits import FARTHEST_M, LARGEST_MOMENT_NM
from dynakin.recordings.recording import Recording


@dataclass(frozen=True)
class Sample:
    """What the laboratory measured at one instant, in its own frame.

    Attributes:
        time_s: s.
        markers: name in the recording -> (3,) m; a marker that is missing is left out or NaN.
        plates: plate -> (6,) wrench [N, N m], ground on person, about the laboratory origin. One that is left out, or
            NaN, is not known, and then their sum is not; an empty plate has zeros.

    Raises:
        RecordingError: markers or plates are no dictionary.
    """

    time_s: float
    markers: Mapping[str, npt.ArrayLike]
    plates: Mapping[str, npt.ArrayLike] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for what, given in (("markers", self.markers), ("plates", self.plates)):
            if not isinstance(given, Mapping):
                raise RecordingError(
                    f"sample at {self.time_s} s: {what} are of type {type(given).__name__}, expected a dictionary by "
                    "name, empty where there are none"
                )


def marker_paths(
    recording: Recording,
    initial: CalibratedModel,
    ground: GroundFrame | None = None,
    *,
    gaps: bool = False,
    lacking: bool = False,
) -> Array:
    """Paths (T, M, 3) m of the model's markers, ground frame, NaN missing.

    Args:
        ground: another than the model's own.
        gaps: whether frames without any marker are ridden through. lacking: whether the recording may lack markers of
            the model, or show none.

    Raises:
        RecordingError: without ``lacking`` a marker of the model that is not in the recording, or none in any frame;
            without both a frame without any.
    """
    names, missing = recording.marker_names, np.full((recording.n_frames, 3), np.nan)
    paths = [missing if lacking and name not in names else recording.marker(name) for name in initial.recorded_markers]
    markers = (ground or initial.ground).points_to_ground(np.stack(paths, axis=1))
    seen = np.isfinite(markers).all(axis=2)
    blind = np.flatnonzero(np.count_nonzero(seen, axis=1) == 0)
    if len(blind) and not lacking and (not gaps or not seen.any()):
        k = int(blind[0])
        raise RecordingError(
            f"{recording.path or recording.name}: frame {k + 1} ({recording.time[k]:.3f} s) has none of the model's "
            f"{seen.shape[1]} markers, expected at least one ({len(blind)} such frame{'s' if len(blind) > 1 else ''})"
        )
    return np.ascontiguousarray(markers)


def total_wrench(recording: Recording, initial: CalibratedModel, *, gaps: bool = False, lacking: bool = False) -> Array:
    """What all plates measure together (T, 6) N and N m, about the model's ground origin, ground frame; NaN where one
    of them is not measured.

    Args:
        gaps: whether plates that drop out (NaN) are ridden through. lacking: whether there may be no plates, or none
            that ever measure; a floating model needs none.

    Raises:
        RecordingError: without ``lacking`` no plates, or no frame of theirs; without both a frame that is not measured.
    """
    lacking = lacking or bool(initial.feet)
    if not recording.plates and not lacking:
        raise RecordingError(
            f"{recording.path or recording.name}: no force plates, expected at least one: the wrench is a measurement "
            "of this filter (a force file can be given with the markers)"
        )
    if not recording.plates:
        return np.full((recording.n_frames, 6), np.nan)
    wrench = initial.ground.wrench_to_ground(recording.total_wrench())
    bad = np.flatnonzero(~np.isfinite(wrench).all(axis=1))
    if len(bad) and not lacking and (not gaps or len(bad) == len(wrench)):
        k = int(bad[0])
        raise RecordingError(
            f"{recording.plates_file}: the plates' wrench at frame {k + 1} ({recording.time[k]:.3f} s) is {wrench[k]}, "
            f"expected numbers ({len(bad)} such frame{'s' if len(bad) > 1 else ''})"
        )
    wrench[bad] = np.nan
    return np.ascontiguousarray(wrench)


def in_step(time: Array, wrench: Array, delay_s: float | Array) -> Array:
    """The wrench (T, 6), or a part of it, that belongs to each time (T,) s: what plates that lag by ``delay_s``, one or
    (T,), say that much later.

    Linear between samples, NaN where one of them is, the last (or first) one held where the recording ends.
    """
    return np.stack([np.interp(time + delay_s, time, column) for column in wrench.T], axis=1)


def sample_arrays(sample: Sample, initial: CalibratedModel, known: Collection[str] = ()) -> tuple[Array, Array]:
    """Markers (M, 3) and total wrench (6,) of one live sample; what it lacks is NaN.

    Args:
        known: all plates that there are.

    Raises:
        RecordingError: a time, marker or plate that is not made of numbers in the expected shape, or is too large.
    """
    if not np.isfinite(_numbers(sample.time_s, (), "sample: time", np.inf)):
        raise RecordingError(f"sample: time is {sample.time_s} s, expected a number")
    where = f"sample at {sample.time_s} s"
    markers = initial.ground.points_to_ground(_positions(sample, initial.recorded_markers, where))
    if not sample.plates:
        return np.ascontiguousarray(markers), np.full(6, np.nan)
    plates = [_numbers(plate, (6,), f"{where}: {name}", LARGEST_MOMENT_NM) for name, plate in sample.plates.items()]
    complete = all(name in sample.plates for name in known)
    total = np.sum(plates, axis=0) if complete else np.full(6, np.nan)
    return np.ascontiguousarray(markers), initial.ground.wrench_to_ground(total)


def _positions(sample: Sample, names: Sequence[str], where: str) -> Array:
    """(M, 3) m, laboratory frame: all at once, and one by one only to name what is wrong."""
    given = [sample.markers.get(name, _MISSING) for name in names]
    try:
        found = np.array(given, dtype=float)
    except (TypeError, ValueError):
        found = np.zeros(0)
    if found.shape == (len(names), 3) and not (np.abs(found) > FARTHEST_M).any():
        return found
    whats = [f"{where}: marker {name!r}" for name in names]
    return np.stack([_numbers(each, (3,), what, FARTHEST_M) for each, what in zip(given, whats, strict=True)])


_MISSING = np.full(3, np.nan)


def _numbers(given: npt.ArrayLike, shape: tuple[int, ...], what: str, most: float) -> Array:
    try:
        found = np.asarray(given, float)
    except (TypeError, ValueError):
        raise RecordingError(f"{what} is {given!r}, expected {math.prod(shape)} numbers") from None
    if found.shape != shape:
        raise RecordingError(f"{what} has shape {found.shape}, expected {shape}")
    if (np.abs(found) > most).any():
        raise RecordingError(f"{what} is {found}, expected numbers up to {most:g}, or NaN where it is missing")
    return found
