"""Find a stretch in which the person stands still."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from dynakin.arrays import Array, runs
from dynakin.recordings.recording import Recording

STILL_SPEED_M_S = 0.06
"""Still: the 90th percentile of the markers' speeds stays below this. Quiet standing sways with 0.01 to 0.03
m/s, the slowest phases of a slow squat reach this only for instants at its turning points."""

MIN_STILL_S = 0.5
"""Shortest stretch that counts, so that a squat's turning point does not."""

SPAN_S = 0.1  # speeds are taken over this span, so that 1 mm of marker noise counts as 0.01 m/s only


def marker_velocities(recording: Recording) -> Array:
    """Velocity of each marker (T, M, 3) m/s, laboratory frame, over 0.1 s around each frame, less where a gap is nearer
    than that or the recording ends; NaN where it is not seen, or for one frame only."""
    half = max(1, round(0.5 * SPAN_S * recording.rate)) if recording.n_frames > 1 else 0
    frames = np.arange(recording.n_frames)[:, None]
    first_seen, last_seen = _seen_without_break(np.asarray(np.isfinite(recording.markers).all(axis=2)))
    before, after = np.maximum(frames - half, first_seen), np.minimum(frames + half, last_seen)
    along = np.arange(recording.markers.shape[1])
    with np.errstate(invalid="ignore", divide="ignore"):
        travelled = recording.markers[after, along] - recording.markers[before, along]
        return np.asarray(travelled / (recording.time[after] - recording.time[before])[..., None])


def _seen_without_break(seen: npt.NDArray[np.bool_]) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
    """First and last frame (T, M) of the stretch in which a marker is seen (T, M) about each frame; the frame itself
    where it is not."""
    frames = np.arange(len(seen))[:, None]
    first = np.maximum.accumulate(np.where(seen, 0, frames + 1), axis=0)
    last = np.minimum.accumulate(np.where(seen, len(seen) - 1, frames - 1)[::-1], axis=0)[::-1]
    return np.where(seen, first, frames), np.where(seen, last, frames)


def marker_speeds(recording: Recording) -> Array:
    """Speed of each marker (T, M) m/s; see `marker_velocities`."""
    return np.asarray(np.linalg.norm(marker_velocities(recording), axis=2))


def standing_window(recording: Recording) -> slice | None:
    """Frames of the first stretch of at least 0.5 s in which the person is still, None where there is none.

    Still is a frame in which the 90th percentile of the speeds of the markers that are seen is below
    ``STILL_SPEED_M_S``; a frame without markers is not still. It need not be upright: a squat held at its
    bottom for half a second counts too, and the plates then carry m g just the same.
    """
    if recording.n_frames < 2 or not recording.marker_names:
        return None
    speeds = marker_speeds(recording)
    still = np.zeros(recording.n_frames, dtype=bool)
    seen = np.isfinite(speeds).any(axis=1)
    still[seen] = _percentile_90(speeds[seen]) < STILL_SPEED_M_S
    for start, stop in runs(still):
        if recording.time[stop - 1] - recording.time[start] >= MIN_STILL_S - 1.5 / recording.rate:
            return slice(start, stop)
    return None


def _percentile_90(values: Array) -> Array:
    """(T,) of the finite ones of each row (T, M); `np.nanpercentile` takes a hundred times as long."""
    ordered = np.sort(values, axis=1)  # NaN last
    place = 0.9 * (np.count_nonzero(np.isfinite(values), axis=1) - 1)
    below = np.floor(place).astype(int)
    rows = np.arange(len(values))
    low, high = ordered[rows, below], ordered[rows, np.ceil(place).astype(int)]
    return np.asarray(low + (place - below) * (high - low))
