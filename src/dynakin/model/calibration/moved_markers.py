"""Markers that sit otherwise in the standing trial than in the trial: put on anew, slipped, or under another's name.

Markers of one segment keep their distances but for what skin moves. A distance that the standing trial has outside all
that the trial shows, by more than a part of what skin does there, is not one segment's. It shows only what changes
distances: a heel marker that is put higher hardly does. Skin goes with the bend of hip and knee, so that only frames
count in which the leg is about as straight as it stands; a trial without such frames shows nothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
import numpy.typing as npt

from dynakin.arrays import Array
from dynakin.messages import Message, warning
from dynakin.model.calibration.frames import MarkedTrial
from dynakin.model.calibration.landmarks import LandmarkFinder
from dynakin.model.calibration.legs_in_motion import LEG_JOINTS
from dynakin.model.markers.fit import LEG, ROOT
from dynakin.model.markers.match import MarkerKey
from dynakin.model.mirroring import SIDES
from dynakin.results.naming import listed

_USUAL = (0.05, 0.95)
"""Quantiles of a distance over the trial between which one segment's may be while standing."""
_FAR = 0.45
"""Part of the declared size of both markers' soft tissue by which the median distance of a marker to the others of its
segment lies outside. Chosen on the walks and squats of `truth3d` 1, 21 and opencap_subject4 (0.2 at most; with a knee
marker 20 mm off 0.5 and 0.6), judged on the others and on ten more real pairs: 0.4 at most, but for medial epicondyles
of `functional`, which are 16 to 20 mm farther from the lateral ones in both its trials, and
L.Knee of rajagopal's static_walk_1, 14 mm from where static_walk_2 and the trial have it."""
_MENDED = 0.35
"""The same, of what may be left after an exchange of two names."""
_LEAST_M = 0.012
"""Of the largest of these distances: so exactly places are found by hand. 11 mm in a drop jump cut to its landing."""
_MANY = 3
"""Markers that sit otherwise from which on all are taken to be put on anew: of 30 that are 14 mm off three to five show
it."""
_STRAIGHT = 0.98
"""Of the distance from pelvis to foot while standing, from which on a leg is as straight (a knee bent by 23 deg). Where
all frames counted, every other squat that was cut to its bottom was accused."""
_FEWEST = 2  # others on its segment
_FEWEST_FRAMES = 5


@dataclass(frozen=True, eq=False)
class Moved:
    """Markers that sit otherwise, whether they are so many that all were put on anew, and sentences on them."""

    keys: frozenset[MarkerKey] = frozenset()
    anew: bool = False
    messages: tuple[Message, ...] = ()

    def hips(self, finder: LandmarkFinder) -> bool:
        """Whether the hips' centres hang on one of them."""
        return self.anew or bool(self.keys & finder.markers_of("hip"))

    def joints(self, finder: LandmarkFinder) -> tuple[str, ...]:
        """Knees and ankles whose centres hang on one of them."""
        if self.anew:
            return LEG_JOINTS
        found = []
        for name in LEG_JOINTS:
            own, plain = finder.of_side(name)
            if self.keys & own.markers_of(plain):
                found.append(name)
        return tuple(found)


def moved_markers(trial: MarkedTrial, source: MarkedTrial) -> Moved:
    """Of pelvis and legs.

    Args:
        source: where the person stands.
    """
    if source is trial:
        return Moved()
    moved: dict[MarkerKey, float] = {}
    messages: list[Message] = []
    compared = 0
    segments = _segments(trial, source)
    straight = _straight(trial, source, segments)
    for (_, side), keys in segments.items():
        frames = straight.get(side, np.zeros(0, dtype=bool))
        if len(keys) <= _FEWEST or np.count_nonzero(frames) < _FEWEST_FRAMES:
            continue
        compared += len(keys)
        here, there = _distances(trial, keys, frames), _distances(source, keys)[1]
        soft = np.array([trial.match.marker_set.marker(name).soft_tissue_m(False) for name, _ in keys])
        size = np.hypot(soft[:, None], soft)
        if pair := _exchanged(here, there, size):
            both = [keys[k] for k in pair]
            names = listed([trial.match.names[key] for key in both])
            messages.append(
                warning(
                    "labels",
                    f"{names} bear each other's names in {source.recording.name} or in {trial.recording.name}: beside "
                    "the other markers of their segment each lies where the other one should. Correct the labels.",
                )
            )
            moved |= dict.fromkeys(both, 0.0)
            continue
        for k, far_m in _apart(here, there, size).items():
            moved[keys[k]] = far_m
    slipped = {key: far_m for key, far_m in moved.items() if far_m}
    anew = len(slipped) >= _MANY
    if slipped:
        names = listed([trial.match.names[key] for key in sorted(slipped, key=lambda key: -slipped[key])])
        text = (
            f"{len(slipped)} of {compared} markers on pelvis and legs {'sits' if len(slipped) == 1 else 'sit'} "
            f"otherwise in {source.recording.name} than in {trial.recording.name} ({names}): distances to others of "
            f"their segment lie up to {1e3 * max(slipped.values()):.0f} mm outside those of the trial. "
            + ("It looks as if all were put on anew" if anew else "A marker has slipped, or was put on anew")
            + ": joints that hang on them are less sure, as their deviations say. Give a standing trial of the same "
            "session (--static)."
        )
        messages.append(warning("calibration", text))
    return Moved(frozenset(moved), anew, tuple(messages))


def _segments(trial: MarkedTrial, source: MarkedTrial) -> dict[tuple[str, str], list[MarkerKey]]:
    """The markers of each segment of pelvis ("centre") and legs that both recordings have, by segment and side."""
    found: dict[tuple[str, str], list[MarkerKey]] = {}
    for key in sorted(trial.match.names.keys() & source.match.names.keys()):
        marker = trial.match.marker_set.marker(key[0])
        if marker.measures(planar=False) and marker.segment in (ROOT, *LEG):
            found.setdefault((marker.segment, "centre" if marker.segment == ROOT else key[1]), []).append(key)
    return found


def _straight(
    trial: MarkedTrial, source: MarkedTrial, segments: dict[tuple[str, str], list[MarkerKey]]
) -> dict[str, npt.NDArray[np.bool_]]:
    """Side -> (T,) frames of the trial in which its leg is about as straight as it stands; "centre": both are."""
    found: dict[str, npt.NDArray[np.bool_]] = {}
    for side in SIDES:
        ends = segments.get((ROOT, "centre")), segments.get((LEG[-1], side))
        if ends[0] is not None and ends[1] is not None:
            here, there = (
                np.linalg.norm(_middle(each, ends[0]) - _middle(each, ends[1]), axis=1) for each in (trial, source)
            )
            found[side] = here >= _STRAIGHT * np.nanmedian(there) if np.isfinite(there).any() else here < 0.0
    return found | ({"centre": np.all(list(found.values()), axis=0)} if found else {})


def _middle(trial: MarkedTrial, keys: list[MarkerKey]) -> Array:
    """Of some markers (T, 3) m."""
    return np.asarray(np.mean([trial.paths[key] for key in keys], axis=0))


def _distances(trial: MarkedTrial, keys: list[MarkerKey], frames: npt.NDArray[np.bool_] | None = None) -> Array:
    """Lower, median and upper distance (3, K, K) m between markers; NaN of what is not seen together."""
    found = np.full((3, len(keys), len(keys)), np.nan)
    for a, b in combinations(range(len(keys)), 2):
        apart = np.linalg.norm(trial.paths[keys[a]] - trial.paths[keys[b]], axis=1)
        apart = apart if frames is None else apart[frames]
        apart = apart[np.isfinite(apart)]
        if len(apart):
            found[:, a, b] = found[:, b, a] = np.quantile(apart, [_USUAL[0], 0.5, _USUAL[1]])
    return found


def _outside(here: Array, there: Array) -> Array:
    """By how much (K, K) m distances lie outside what the trial shows; NaN where they are not known."""
    return np.asarray(np.maximum(np.maximum(here[0] - there, there - here[2]), 0.0))


def _exchanged(here: Array, there: Array, size: Array) -> tuple[int, int] | None:
    """The two whose exchange puts distances right that are not; None where there are none."""
    before = np.nan_to_num(_outside(here, there) / size)
    for a, b in combinations(range(len(there)), 2):
        others = [k for k in range(len(there)) if k not in (a, b)]
        order = np.arange(len(there))
        order[[a, b]] = b, a
        after = np.nan_to_num(_outside(here, there[np.ix_(order, order)]) / size)
        wrong = min(before[a, others].max(), before[b, others].max())
        if wrong > _FAR and max(after[a, others].max(), after[b, others].max()) < _MENDED:
            return a, b
    return None


def _apart(here: Array, there: Array, size: Array) -> dict[int, float]:
    """Markers that lie otherwise than most others have them, the worst first, and by how much (m)."""
    outside = _outside(here, there)
    np.fill_diagonal(outside, np.nan)
    found: dict[int, float] = {}
    left = list(range(len(there)))
    while len(left) > _FEWEST:
        parts = (outside / size)[np.ix_(left, left)]
        if np.isfinite(parts).sum(axis=1).min() < _FEWEST:
            break
        far = np.nanmedian(parts, axis=1)
        worst = int(np.argmax(far))
        if far[worst] <= _FAR:
            break
        k = left.pop(worst)
        far_m = float(np.nanmax(outside[k, left]))
        if far_m > _LEAST_M:
            found[k] = far_m
    return found
