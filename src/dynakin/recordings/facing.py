"""Which way the person faces."""

from __future__ import annotations

import numpy as np

from dynakin.errors import RecordingError
from dynakin.recordings.landmarks import FacingPairs, mean_position, present_pairs
from dynakin.recordings.recording import Array, Recording
from dynakin.recordings.standing import standing_window

FACING_WINDOW_S = 1.0
WALKS_M = 0.7
"""Horizontal way of the markers' mean from which the person is said to walk (a squat moves it by 0.3 m at
most)."""
_MAX_DISAGREEMENT_DEG = 30.0


def find_forward(recording: Recording, up: Array, pairs: FacingPairs) -> tuple[Array, list[str]]:
    """Horizontal unit vector (3,), laboratory frame, in which the person faces, and sentences on how it was
    found.

    From heel to toe, mean direction of each foot over the first standing second (the first second where
    nobody stands), both feet with equal weight so that turned-out feet cancel; else from the back of the
    pelvis to its front; else the walking direction. The others are compared, and a difference beyond 30 deg
    is said.

    Raises:
        RecordingError: no foot or pelvis pair, and the person does not walk.
    """
    frames = _window(recording)
    feet, n_feet = _mean_direction(recording, pairs.heel_toe, up, frames)
    pelvis, _ = _mean_direction(recording, pairs.pelvis, up, frames)
    walk, way = _walking(recording, up)
    found = [
        (f"from heel to toe ({'both feet' if n_feet > 1 else 'one foot only'})", feet),
        ("from the back of the pelvis to its front", pelvis),
        (f"the walking direction ({way:.2g} m)", walk),
    ]
    known = [(why, direction) for why, direction in found if direction is not None]
    if not known:
        raise RecordingError(
            f"{recording.path or recording.name}: facing direction not found "
            "(no heel and toe, no pelvis markers, the "
            f"person walks {way:.2g} m only), expected it to be given"
        )
    why, forward = known[0]
    written = ", ".join(f"{value:.3f}" for value in forward + 0.0)
    how = [f"Forward ({written}) in the laboratory: {why}."]
    for other, direction in known[1:]:
        angle = float(np.degrees(np.arccos(np.clip(forward @ direction, -1, 1))))
        verdict = "agrees" if angle <= _MAX_DISAGREEMENT_DEG else "DISAGREES, check the marker names"
        how.append(f"Forward: {other} {verdict} ({angle:.0f} deg).")
    return forward, how


def horizontal(direction: Array, up: Array) -> Array | None:
    """Unit vector of the horizontal part of a direction, None where it has none."""
    flat = direction - (direction @ up) * up
    length = float(np.linalg.norm(flat))
    return flat / length if np.isfinite(length) and length > 1e-9 else None


def _window(recording: Recording) -> slice:
    standing = standing_window(recording)
    start = standing.start if standing else 0
    stop = standing.stop if standing else recording.n_frames
    last = int(np.searchsorted(recording.time, recording.time[start] + FACING_WINDOW_S, side="right"))
    return slice(start, max(min(stop, last), start + 1))


def _mean_direction(
    recording: Recording, pairs: tuple[tuple[str, str], ...], up: Array, frames: slice
) -> tuple[Array | None, int]:
    directions = []
    for back, front in present_pairs(recording, pairs):
        vectors = recording.marker(front) - recording.marker(back)
        seen = np.asarray(np.isfinite(vectors).all(axis=1))
        part = vectors[frames][seen[frames]]
        direction = horizontal((part if len(part) else vectors[seen]).mean(axis=0), up)
        if direction is not None:
            directions.append(direction)
    return (horizontal(np.sum(directions, axis=0), up) if directions else None), len(directions)


def _walking(recording: Recording, up: Array) -> tuple[Array | None, float]:
    """Horizontal direction and length (m) of the way of the markers that are seen at both ends."""
    size = max(1, min(round(0.1 * recording.rate), recording.n_frames // 4)) if recording.n_frames > 1 else 1
    ends = [
        [mean_position(recording, [name], part) for part in (slice(0, size), slice(-size, None))]
        for name in recording.marker_names
    ]
    ways = [last - first for first, last in ends if first is not None and last is not None]
    if not ways:
        return None, 0.0
    way = np.mean(ways, axis=0)
    way = way - (way @ up) * up
    length = float(np.linalg.norm(way))
    return (way / length if length >= WALKS_M else None), length
