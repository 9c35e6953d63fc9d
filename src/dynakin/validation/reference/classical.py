"""The paper's reference: joint angles between adjacent vectors of landmarks (section II.A), frame by frame.

Nothing is fitted and nothing is smoothed: the direction of each segment in the sagittal plane is that of the line
between two landmarks, and a joint angle is the difference of two directions. Zeros and signs are the model's, so that
a filter's coordinates can be subtracted.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from dynakin.arrays import Array
from dynakin.errors import ModelError
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.model.calibration.frames import MarkedTrial
from dynakin.model.calibration.landmarks import LandmarkFinder
from dynakin.model.definition import ModelDefinition
from dynakin.model.markers.recognise import recognise
from dynakin.model.mirroring import SIDES
from dynakin.model.plan import ModelPlan
from dynakin.model.schema import Frame
from dynakin.model.schema import Segment as SegmentEntry
from dynakin.recordings.recording import Recording
from dynakin.validation.reference.chain import PlanarChain


def classical_angles(chain: PlanarChain, plan: ModelPlan, landmarks: Mapping[str, Array]) -> Array:
    """Coordinates (T, C) rad in the model's order; NaN where a landmark is missing, the lock's value where locked.

    Args:
        landmarks: (T, 3) m each, ground frame, as `landmark_paths` gives them.

    Raises:
        ModelError: the recording does not give a landmark that a direction needs.

    Source: Bonnet et al., section II.A, after Cappozzo et al. 1995 [1].
    """
    frames = len(next(iter(landmarks.values())))
    values: dict[str, Array] = {name: np.full(frames, value) for name, value in chain.locked.items()}
    directions: dict[str | None, Array] = {None: np.zeros(frames)}
    for link, entry in zip(chain.links, plan.model.segments, strict=True):
        below = directions[link.parent] + link.offset
        if link.coordinate is None:
            directions[link.name] = below
            continue
        if link.coordinate in values:
            directions[link.name] = below + link.slope * values[link.coordinate]
        else:  # the direction itself goes on, so that a gap below stays below
            directions[link.name] = _direction(plan, entry, landmarks)
            values[link.coordinate] = _continuous((directions[link.name] - below) / link.slope)
    return np.column_stack([values[name] for name in chain.coordinates])


def hinge_paths(chain: PlanarChain, plan: ModelPlan, landmarks: Mapping[str, Array], angles: Array) -> Array:
    """Place (T, S, 2) m of each hinge in its parent's frame as the landmarks have it at every frame; the measured,
    constant one where the model names no landmark for it.

    Args:
        angles: (T, C) rad, of `classical_angles`.
    """
    frames = len(angles)
    turns: dict[str | None, Array] = {None: np.zeros(frames)}
    origins: dict[str | None, Array] = {None: np.zeros((frames, 2))}
    paths = np.empty((frames, len(chain.links), 2))
    for k, (link, entry) in enumerate(zip(chain.links, plan.model.segments, strict=True)):
        c, s = np.cos(turns[link.parent])[:, None], np.sin(turns[link.parent])[:, None]
        if entry.origin is not None and entry.origin in landmarks:
            away = landmarks[entry.origin][:, :2] - origins[link.parent]
            paths[:, k] = np.hstack([c, -s]) * away[:, :1] + np.hstack([s, c]) * away[:, 1:]
        else:
            paths[:, k] = link.placement[:2]
        x, y = paths[:, k, :1], paths[:, k, 1:]
        origins[link.name] = origins[link.parent] + np.hstack([c * x - s * y, s * x + c * y])
        turn = 0.0 if link.coordinate is None else link.slope * angles[:, chain.coordinates.index(link.coordinate)]
        turns[link.name] = turns[link.parent] + link.offset + turn
    return paths


def _direction(plan: ModelPlan, segment: SegmentEntry, landmarks: Mapping[str, Array]) -> Array:
    """Angle (T,) rad of the segment's X axis from the ground's X, positive towards Y."""
    if isinstance(segment.frame, Frame):
        main = segment.frame.main or ("x" if segment.frame.x else "y")
        start, end = segment.frame.x or ("", "") if main == "x" else segment.frame.y or ("", "")
        return _angle(_line(landmarks, segment.name, start, end)) - (0.0 if main == "x" else 0.5 * np.pi)
    # Axes of the ground while standing: since then turned with the line to the next joint.
    for child in plan.model.segments:
        start, end = segment.origin or "", child.origin or ""
        if child.parent == segment.name and start in landmarks and end in landmarks:
            return _angle(landmarks[end] - landmarks[start]) - _angle(plan.geometry.placement(child))
    return np.zeros(len(next(iter(landmarks.values()))))


def _line(landmarks: Mapping[str, Array], segment: str, start: str, end: str) -> Array:
    missing = [name for name in (start, end) if name not in landmarks]
    if missing:  # lengths may come from another recording, standing, that has the markers
        raise ModelError(
            f"the classical direction of {segment} needs the landmarks {start} and {end}, and the recording's markers "
            f"do not give {' and '.join(missing)}"
        )
    return landmarks[end] - landmarks[start]


def _angle(line: Array) -> Array:
    return np.asarray(np.arctan2(line[..., 1], line[..., 0]))


def _continuous(angle: Array) -> Array:
    """The same angle without jumps of a turn, starting within half a turn of zero."""
    found = np.full_like(angle, np.nan)
    seen = np.isfinite(angle)
    if seen.any():
        path = np.unwrap(angle[seen])
        found[seen] = path - 2.0 * np.pi * np.round(path[0] / (2.0 * np.pi))
    return found


def landmark_paths(recording: Recording, initial: CalibratedModel, definition: ModelDefinition) -> dict[str, Array]:
    """Every landmark (T, 3) m in the ground frame of ``initial`` (z = 0 in a planar model), NaN where one of its
    markers is missing.

    The limb markers are those of the side that the model was measured with. For "both" a landmark is the middle of
    the two sides wherever both are known in the recording, and NaN where one is lost for a while: the mean of one
    side would be a jump.

    Args:
        definition: the model that ``initial`` was measured from (it holds the marker set and the sex of the subject).

    Raises:
        ModelError: the recording's markers fit no marker set.
    """
    match = recognise(recording, definition.marker_set).match
    trial = MarkedTrial.of(recording, match, initial.ground)
    sides = SIDES if initial.side == "both" else (initial.side,)
    finders = [
        LandmarkFinder(match, side, definition.subject.sex, initial.measured_plan().model.planar) for side in sides
    ]
    each = [_one_side(finder, trial) for finder in finders]
    names = dict.fromkeys(name for paths in each for name in paths)
    return {name: np.mean([paths[name] for paths in each if name in paths], axis=0) for name in names}


def _one_side(finder: LandmarkFinder, trial: MarkedTrial) -> dict[str, Array]:
    names = [name for name in finder.match.marker_set.landmarks if finder.known(name)]
    paths = {name: np.full((trial.recording.n_frames, 3), np.nan) for name in names}
    for frame in range(trial.recording.n_frames):
        for name, point in finder.find({key: path[frame] for key, path in trial.paths.items()}).items():
            paths[name][frame] = point
    return paths
