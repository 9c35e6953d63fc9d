"""When each foot stands on the floor, from its markers alone: near the floor, and slow."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
import numpy.typing as npt

from dynakin.arrays import runs
from dynakin.recordings.frame import GroundFrame
from dynakin.recordings.landmarks import find_marker
from dynakin.recordings.plates.surfaces import floor_height
from dynakin.recordings.recording import Array, Recording
from dynakin.recordings.standing import marker_speeds

Flags = npt.NDArray[np.bool_]

NO_CONTACT, ON_PLATE, UNMEASURED, SHARED_PLATE = range(4)
"""Status of a contact, which is a segment that something may push (a foot), in a frame: nothing touches it and its
wrench is zero; plates bear it; it touches something that measures nothing. Codes of ``foot_contact``."""
NEAR_FLOOR_M = 0.025
"""Height of a marker over its own lowest place (5th percentile) up to which the skin under it may touch the floor."""
SLOW_M_S = 0.5
"""Speed up to which a foot stands. A swinging toe passes the floor within 2 cm too, but at 1.5 to 5 m/s."""
GAP_S = 0.08
"""Shorter interruptions of a stance, or stances, are none: a foot takes 0.2 s and more for a step."""
ALOFT_M = 0.05
"""Height from which a moving foot touches no floor: twice what the skin of a standing foot rises by."""
BEFORE_S, AFTER_S = 0.05, 0.15
"""A foot may bear load that long before its markers are slow (heel strike), and after the last one has left the floor
(push-off: the toe rolls on while the marker over it rises)."""


@dataclass(frozen=True, eq=False)
class FootContact:
    """What the markers show of one foot.

    Attributes:
        outline: (T, K, 2) m, horizontal places [X, Z of the ground] of its markers, NaN where not seen.
        support_m: (T,) height of what it stands on, or stood on last.
        touching: (T, K) markers that are near the floor and slow.
        stands: (T,) in a stance; short gaps closed.
        stances: frames [first, end) of each stance, not padded.
        low: (T,) one of its markers is not high over its own lowest place.
        moves: (T,) all of its markers seen move.
        aloft: (T,) it moves, and all of its markers seen are high. A foot on a belt is low, one on a step or a box
            stands still; one on a pedal is aloft too.
    """

    outline: Array
    support_m: Array
    touching: Flags
    stands: Flags
    stances: tuple[tuple[int, int], ...]
    low: Flags
    moves: Flags
    aloft: Flags

    def padded(self, stance: tuple[int, int], rate: float) -> slice:
        """The frames in which this stance may bear load, as far as markers show."""
        before, after = round(BEFORE_S * rate), round(AFTER_S * rate)
        return slice(max(0, stance[0] - before), min(len(self.stands), stance[1] + after))

    def bears(self, rate: float) -> Flags:
        """(T,) frames in which one of its stances may bear load."""
        found = np.zeros(len(self.stands), dtype=bool)
        for stance in self.stances:
            found[self.padded(stance, rate)] = True
        return found


def foot_contact(recording: Recording, ground: GroundFrame, names: list[str]) -> FootContact | None:
    """Contact of the foot that has these markers (heel, toe, ...), None where the recording has none of them."""
    own = list(dict.fromkeys(marker for name in names if (marker := find_marker(recording, name))))
    own = [name for name in own if np.isfinite(recording.marker(name)).all(axis=1).any()]
    if not own:
        return None
    places = ground.points_to_ground(np.stack([recording.marker(name) for name in own], axis=1))
    columns = [recording.marker_names.index(name) for name in own]
    speed = marker_speeds(recording)[:, columns]
    height = places[:, :, 1] - np.nanpercentile(places[:, :, 1], 5.0, axis=0)
    with np.errstate(invalid="ignore"):
        touching = (height < NEAR_FLOOR_M) & (speed < SLOW_M_S)
        low = np.asarray((height < ALOFT_M).any(axis=1))
        high, fast = height > ALOFT_M, speed > SLOW_M_S
    seen = np.isfinite(height)
    moves = np.asarray(seen.any(axis=1) & (fast | ~seen).all(axis=1))
    aloft = np.asarray(moves & (high | ~seen).all(axis=1))
    gap = max(1, round(GAP_S * recording.rate)) if recording.n_frames > 1 else 1
    stands = _closed(np.asarray(touching.any(axis=1)), gap)
    support = np.full(recording.n_frames, floor_height(recording, ground))
    return FootContact(places[:, :, [0, 2]], support, touching, stands, tuple(runs(stands)), low, moves, aloft)


def _closed(flags: Flags, gap: int) -> Flags:
    """Flags with short gaps closed, and then short stretches dropped, but for those at either end."""
    flags = flags.copy()
    for value in (True, False):
        for first, end in runs(flags != value):
            if end - first < gap and first > 0 and end < len(flags):
                flags[first:end] = value
    return flags


DEFAULT_FOOT_MARKERS: dict[str, list[str]] = {
    "left": ["LHEE", "LTOE", "LMT5", "LANK", "L_calc", "L_toe", "L_5meta", "L_ankle"],
    "right": ["RHEE", "RTOE", "RMT5", "RANK", "r_calc", "r_toe", "r_5meta", "r_ankle"],
}
"""Plug-in-Gait and OpenCap's laboratory markers on each foot."""


def foot_outline(recording: Recording, ground: GroundFrame, names: list[str]) -> Array:
    """Horizontal places (T, K, 2) m [X, Z of the ground frame] of those of the markers that the recording
    has."""
    own = list(dict.fromkeys(marker for name in names if (marker := find_marker(recording, name))))
    if not own:
        return np.empty((recording.n_frames, 0, 2))
    points = np.stack([recording.marker(name) for name in own], axis=1)
    return ground.points_to_ground(points)[:, :, [0, 2]]


def distance_to_hull(points: Array, outline: Array) -> Array:
    """Distance (T,) m of points (T, 2) from the convex hull of the corners (T, K, 2), 0 inside, NaN corners
    left out.

    A point outside is as far from the hull as from the nearest of all lines between two corners; it is inside
    if it lies in some triangle of corners. NaN where the point or all corners are missing.
    """
    n_corners = outline.shape[1]
    distance = np.full(len(points), np.inf)
    for i in range(n_corners):  # alone: where the only other corners are missing
        distance = np.fmin(distance, np.linalg.norm(points - outline[:, i], axis=1))
    for i, j in combinations(range(n_corners), 2):
        distance = np.fmin(distance, _to_segment(points, outline[:, i], outline[:, j]))
    for i, j, k in combinations(range(n_corners), 3):
        sides = np.stack([_side(points, outline[:, a], outline[:, b]) for a, b in ((i, j), (j, k), (k, i))], axis=1)
        distance[(sides > 0).all(axis=1) | (sides < 0).all(axis=1)] = 0.0
    return np.where(np.isfinite(distance) & np.isfinite(points).all(axis=1), distance, np.nan)


def _to_segment(points: Array, a: Array, b: Array) -> Array:
    along = b - a
    with np.errstate(invalid="ignore", divide="ignore"):
        share = np.clip(((points - a) * along).sum(axis=1) / (along**2).sum(axis=1), 0.0, 1.0)
        return np.asarray(np.linalg.norm(points - a - share[:, None] * along, axis=1))


def _side(points: Array, a: Array, b: Array) -> Array:
    along, to_point = b - a, points - a
    return np.asarray(along[:, 0] * to_point[:, 1] - along[:, 1] * to_point[:, 0])
