"""Where the markers of each foot are, and how high they are while it stands flat."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from dynakin.arrays import Array, runs
from dynakin.recordings.frame import GroundFrame
from dynakin.recordings.landmarks import find_marker
from dynakin.recordings.recording import Recording

SWAYS_M = 0.01
"""How far every marker of a foot that is held in the air goes (all but a tenth of the time): of who stands on one leg
0.03 and more in 2 s; of a foot that stands they keep their places to 0.003 (squats of `truth3d`)."""


def foot_places(
    recording: Recording, ground: GroundFrame, markers: Mapping[str, Sequence[str]]
) -> dict[str, tuple[list[int], Array]]:
    """The columns of each foot's markers and their places (T, K, 3) m, ground frame; of feet of which one is seen."""
    found = {}
    for foot, names in markers.items():
        own = dict.fromkeys(marker for name in names if (marker := find_marker(recording, name)))
        columns = [recording.marker_names.index(name) for name in own]
        columns = [k for k in columns if np.isfinite(recording.markers[:, k]).all(axis=1).any()]
        if columns:
            found[foot] = (columns, ground.points_to_ground(recording.markers[:, columns]))
    return found


def flat_heights(places: Sequence[Array], near_m: float, aloft_m: float) -> list[Array]:
    """Heights (K,) m of each foot's markers, (T, K, 3) m, while it stands flat: the lowest that they come to (5th
    percentile). Of a foot that never comes down, by the other one's: none of its markers is ever nearer than ``near_m``
    to the height of that one's, pair by pair from the lowest on, on average they stay ``aloft_m`` away, and none keeps
    its place, as on a box it would."""
    flats = [np.nanpercentile(points[:, :, 1], 5.0, axis=0) for points in places]
    if len(flats) != 2:
        return flats
    for k in range(2):
        count = min(len(flat) for flat in flats)
        over = np.sort(flats[k])[:count] - np.sort(flats[1 - k])[-count:]  # of unequal numbers the least that it can be
        if over.min() > near_m and over.mean() > aloft_m and _sways(places[k]):
            flats[k] = flats[k] - over.min()
            break
    return flats


def lowest_together(
    points: Array, velocity: Array, flat: Array, near_m: float, still_m_s: float, frames: float
) -> Array:
    """Heights (K,) m of a foot's markers while it stands flat, of which ``flat`` says each one's lowest alone: no
    posture of a foot that only sets down where it is lowest, its heel up. It has the one in which it rests elsewhere,
    on the step above.

    Args:
        points: (T, K, 3) m. velocity: (T, K, 3) m/s. near_m: how far from its height a marker may be that is there.
        still_m_s: speed of a marker that rests. frames: for how long it does.
    """
    with np.errstate(invalid="ignore"):
        still = np.asarray((np.linalg.norm(velocity, axis=2) < still_m_s).all(axis=1))
    rests = [points[first:end, :, 1] - flat for first, end in runs(still) if end - first >= frames]
    if not rests or (np.abs(over := np.concatenate(rests)) < near_m).all(axis=1).any():
        return flat
    over = over[(over > near_m).all(axis=1)]  # elsewhere: on its own level it may never be flat
    if not len(over):
        return flat
    posture = np.median(over - over.mean(axis=1, keepdims=True), axis=0)
    return np.asarray(flat + posture - posture.max()) if np.ptp(posture) > near_m else flat


def _sways(points: Array) -> bool:
    """Whether each of a foot's markers (T, K, 3) m goes to and fro."""
    ways = np.nanpercentile(points, 95.0, axis=0) - np.nanpercentile(points, 5.0, axis=0)
    return bool(ways.max(axis=1).min() > SWAYS_M)


def filled_by_others(points: Array) -> Array:
    """Points (T, K, D) of one body, a missing one as far from those that are seen as before and after; NaN where none
    is seen."""
    seen = np.asarray(np.isfinite(points).all(axis=2))
    if seen.all() or not seen.any():
        return points
    found, frames = points.copy(), np.arange(len(points))
    for m in range(points.shape[1]):
        guesses = np.full_like(points, np.nan)
        for other in range(points.shape[1]):
            both = seen[:, m] & seen[:, other]
            if other != m and both.any():
                offset = points[both, m] - points[both, other]
                drawn = [np.interp(frames, frames[both], offset[:, c]) for c in range(points.shape[2])]
                guesses[:, other] = points[:, other] + np.stack(drawn, axis=1)
        count = np.isfinite(guesses).all(axis=2).sum(axis=1)
        fill = ~seen[:, m] & (count > 0)
        found[fill, m] = np.nansum(guesses[fill], axis=1) / count[fill, None]
    return found
