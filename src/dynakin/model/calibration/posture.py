"""From landmarks to a posture: segment frames, joint placements, coordinates, those of one joint by itself too. Used
once, when a model is initialised."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import cos, sin, sqrt

import numpy as np
import numpy.typing as npt

from dynakin.arrays import Array, wrapped
from dynakin.bindings import _core
from dynakin.errors import ModelError
from dynakin.model.plan import Geometry
from dynakin.model.schema import Axis, Frame, ModelFile, Segment, kinds_of
from dynakin.model.spec import axes_to_core

_EXACT_M2 = 1e-20
"""Cost of a fit that meets its target: rotations to 1e-10."""
_THIRD = 2.1  # rad: half a turn off is a saddle, a third is not
_SAME_M2 = 1e-12
"""Costs that differ by less are of the same pose."""


def joint_coordinates(
    segment: _core.SegmentSpec,
    coordinates: Sequence[_core.CoordinateSpec],
    target: tuple[Array, Array],
    parameters: Sequence[_core.ParameterSpec] = (),
) -> dict[str, float]:
    """Coordinates that bring a segment nearest to a pose; of several that do, those that turn least from their start.

    Args:
        segment: with the joint by which it hangs on what holds it.
        coordinates: the joint's, among others perhaps; their values are the start, locked ones stay.
        target: rotation (3, 3) and origin (3,) m of the segment in what holds it.
        parameters: those that the joint names.

    Returns:
        The free ones by name; rotations within half a turn.
    """
    own = {axis.coordinate for axis in segment.axes}
    used = [c for c in coordinates if c.name in own]
    free = [c for c in used if not c.locked]
    if not free:
        return {}
    arms = np.sqrt(3.0) * np.eye(3)  # about the origin: what is missed of the turn moves the segment nowhere
    points = [*arms, *-arms]
    markers = [
        _core.MarkerSpec(f"point{k}", segment.name, point, estimated=[False] * 3) for k, point in enumerate(points)
    ]
    alone = _core.SegmentSpec(
        segment.name, rotation=segment.rotation, translation=segment.translation, lengths=segment.lengths,
        axes=segment.axes,
    )  # fmt: skip
    known = [_core.ParameterSpec(p.name, p.value, estimated=False) for p in parameters]
    model = _core.Model(_core.ModelSpec("joint", used, known, [alone], markers))
    kinds = kinds_of([segment])
    turns = np.array([kinds[c.name] == "rotation" for c in free])
    places = np.array([target[0] @ point + target[1] for point in points])
    wide, none = np.full(len(free), np.inf), np.zeros(len(free))

    def fitted(start: Array) -> tuple[Array, float]:
        x = np.zeros(model.layout.size)
        x[: len(free)] = start
        q, cost, _ = _core.fit_posture(model, x, places, -wide, wide, none + 1.0, none, none)
        q[turns] = wrapped(q[turns])
        return q, cost

    def rank(fit: tuple[Array, float]) -> tuple[int, float]:
        return round(fit[1] / _SAME_M2), float(np.abs(fit[0] - rest).sum())

    rest = np.array([c.value for c in free])
    fits = [fitted(rest)]
    if fits[0][1] > _EXACT_M2 or np.abs(fits[0][0] - rest)[turns].max(initial=0.0) > 0.5 * np.pi:
        for k in np.flatnonzero(turns):
            fits += [fitted(rest + angle * np.eye(len(free))[k]) for angle in (_THIRD, -_THIRD)]
        # Three turns at right angles to each other have two readings of every pose.
        fits += [fitted(other_reading(q, turns)) for q, _ in fits]
    best = min(fits, key=rank)[0]
    return {c.name: float(value) for c, value in zip(free, best, strict=True)}


def other_reading(values: Array, turning: npt.NDArray[np.bool_]) -> Array:
    """The same pose by three turns about axes at right angles to each other: half a turn more, the middle one's
    supplement, half a turn more; a start like any other where the axes are not."""
    found = values.copy()
    turns = np.flatnonzero(turning)
    if len(turns) == 3:
        found[turns] = [values[turns[0]] + np.pi, np.pi - values[turns[1]], values[turns[2]] + np.pi]
    return found


_LEAST_M, _LEAST_SINE = 1e-3, 1e-3


def axes_from(main: str, direction: Array, second: str = "", second_direction: Array | None = None) -> Array:
    """Rotation matrix whose columns are x, y, z: ``main`` along ``direction``, ``second`` as near as
    possible to its own.

    Without a second direction it is the ground's Z (right), or the ground's Y where the main axis is z.
    """
    if second_direction is None:
        second, second_direction = ("z", np.array([0.0, 0.0, 1.0])) if main != "z" else ("y", np.array([0.0, 1.0, 0.0]))
    columns: dict[str, Array] = {main: direction / np.linalg.norm(direction)}
    across = second_direction - columns[main] * float(columns[main] @ second_direction)
    columns[second] = across / np.linalg.norm(across)
    third = next(axis for axis in "xyz" if axis not in columns)
    before, after = {"x": ("y", "z"), "y": ("z", "x"), "z": ("x", "y")}[third]
    columns[third] = np.cross(columns[before], columns[after])
    return np.column_stack([columns[axis] for axis in "xyz"])


def frame_rotation(frame: Frame, landmarks: Mapping[str, Array], segment: str = "") -> Array:
    """R_GS (3, 3) of a segment from landmarks in the ground frame.

    Raises:
        ModelError: the landmarks of an axis lie at one place, or those of both axes along one line.
    """
    given = {axis: getattr(frame, axis) for axis in "xyz" if getattr(frame, axis) is not None}
    directions: dict[str, Array] = {a: landmarks[pair[1]] - landmarks[pair[0]] for a, pair in given.items()}
    main: str = frame.main or next(iter(directions))
    other = next((axis for axis in directions if axis != main), "")
    for axis, (start, end) in given.items():
        if not np.linalg.norm(directions[axis]) > _LEAST_M:
            raise ModelError(
                f"segment {segment!r}: landmarks {start} and {end} lie at one place ({landmarks[start].round(3)} m), "
                f"expected them apart: they are its axis {axis}"
            )
    if other and np.linalg.norm(np.cross(directions[main], directions[other])) < _LEAST_SINE * np.linalg.norm(
        directions[main]
    ) * np.linalg.norm(directions[other]):
        raise ModelError(
            f"segment {segment!r}: landmarks {', '.join(dict.fromkeys([*given[main], *given[other]]))} lie along one "
            f"line, expected its axes {main} and {other} to differ"
        )
    return axes_from(main, directions[main], other, directions.get(other))


def frame_landmarks(segment: Segment) -> list[str]:
    """Landmarks that a segment's origin and frame need."""
    names = [segment.origin] if segment.origin else []
    if isinstance(segment.frame, Frame):
        names += [name for axis in "xyz" for name in (getattr(segment.frame, axis) or ())]
    return list(dict.fromkeys(names))


def turned(vector: Array) -> Array:
    """Rotation matrix (3, 3) by an angle, rad, about a direction: (3,), their product, by the quaternion. SciPy's, to
    the last bit, would load a tenth of all libraries that a run starts with."""
    x, y, z = map(float, vector)
    angle = sqrt(x * x + y * y + z * z)
    scale = 0.5 - angle**2 / 48.0 + angle**4 / 3840.0 if angle <= 1e-3 else sin(0.5 * angle) / angle
    x, y, z, w = scale * x, scale * y, scale * z, cos(0.5 * angle)
    return np.array(
        [
            [x * x - y * y - z * z + w * w, 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
            [2.0 * (x * y + z * w), -x * x + y * y - z * z + w * w, 2.0 * (y * z - x * w)],
            [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), -x * x - y * y + z * z + w * w],
        ]
    )


def joint_motion(
    axes: tuple[Axis, ...], values: Mapping[str, float], lengths: Mapping[str, float]
) -> tuple[Array, Array]:
    """Rotation (3, 3) and translation (3,) m of a chain of axes, each moved along by those before it."""
    rotation, translation = np.eye(3), np.zeros(3)
    for axis in axes:
        q = values[axis.coordinate]
        s = sum(c * q**k for k, c in enumerate(axis.coefficients)) * (lengths[axis.scale] if axis.scale else 1.0)
        direction = np.array(axis.direction)
        if axis.kind == "rotation":
            rotation = rotation @ turned(s * direction)
        else:
            translation = translation + rotation @ (s * direction)
    return rotation, translation


def solve_joint(
    segment: Segment, target: tuple[Array, Array], fixed: Mapping[str, float], lengths: Mapping[str, float]
) -> dict[str, float]:
    """Coordinates of a joint that come nearest to a rotation (3, 3) and translation (3,) of the child in the
    joint frame."""
    names = dict.fromkeys(axis.coordinate for axis in segment.axes)
    coordinates = [_core.CoordinateSpec(name, fixed.get(name, 0.0), name in fixed) for name in names]
    used = dict.fromkeys(axis.scale for axis in segment.axes if axis.scale)
    parameters = [_core.ParameterSpec(name, lengths[name]) for name in used]
    return joint_coordinates(
        _core.SegmentSpec(segment.name, axes=axes_to_core(segment)), coordinates, target, parameters
    )


@dataclass
class Posture:
    """Poses of all segments in the ground frame and the coordinates that lead there."""

    rotations: dict[str, Array] = field(default_factory=dict)  # R_GS (3, 3)
    origins: dict[str, Array] = field(default_factory=dict)  # (3,) m
    coordinates: dict[str, float] = field(default_factory=dict)

    def to_local(self, segment: str, point: Array) -> Array:
        """A point (3,) m of the ground frame in a segment's frame."""
        return np.asarray(self.rotations[segment].T @ (point - self.origins[segment]))


def find_posture(
    model: ModelFile, geometry: Geometry, landmarks: Mapping[str, Array], standing: Posture | None = None
) -> Posture:
    """Coordinates and poses from landmarks, given the geometry.

    Args:
        standing: None while the person stands (a "ground" frame is then the ground's own); later the
            standing posture, from which such a segment is turned so that its line to the next joint meets
            the landmarks.
    """
    posture = Posture({"ground": np.eye(3)}, {"ground": np.zeros(3)}, dict(geometry.locked))
    for segment in model.segments:
        R_GP, p_GP = posture.rotations[segment.parent], posture.origins[segment.parent]
        R_PJ, p_PJ = np.array(segment.rotation), geometry.placement(segment)
        fixed = {
            a.coordinate: posture.coordinates[a.coordinate] for a in segment.axes if a.coordinate in posture.coordinates
        }
        if any(axis.coordinate not in fixed for axis in segment.axes):
            R_GS = _target_rotation(model, segment, landmarks, standing)
            R_JS = (R_GP @ R_PJ).T @ R_GS
            origin = landmarks[segment.origin] if segment.origin else p_GP + R_GP @ p_PJ
            p_JS = (R_GP @ R_PJ).T @ (origin - p_GP - R_GP @ p_PJ)
            if all(axis.kind == "rotation" for axis in segment.axes):
                p_JS = np.zeros(3)
            posture.coordinates.update(solve_joint(segment, (R_JS, p_JS), fixed, geometry.lengths))
        R_JS, p_JS = joint_motion(segment.axes, posture.coordinates, geometry.lengths)
        posture.rotations[segment.name] = R_GP @ R_PJ @ R_JS
        posture.origins[segment.name] = p_GP + R_GP @ (p_PJ + R_PJ @ p_JS)
    return posture


def _target_rotation(
    model: ModelFile, segment: Segment, landmarks: Mapping[str, Array], standing: Posture | None
) -> Array:
    if isinstance(segment.frame, Frame):
        return frame_rotation(segment.frame, landmarks, segment.name)
    if standing is None:
        return np.eye(3)
    R_standing, p_standing = standing.rotations[segment.name], standing.origins[segment.name]
    for child in model.segments:
        ends = (child.origin, segment.origin)
        if child.parent == segment.name and all(end in landmarks for end in ends):
            before = standing.origins[child.name] - p_standing
            now = landmarks[str(child.origin)] - landmarks[str(segment.origin)]
            axis = np.cross(before, now)
            sine, cosine = float(np.linalg.norm(axis)), float(before @ now)
            turn = np.arctan2(sine, cosine) * (axis / sine if sine > 0.0 else np.array([0.0, 0.0, 1.0]))
            return turned(turn) @ R_standing
    return R_standing


def find_geometry(
    model: ModelFile,
    landmarks: Mapping[str, Array],
    locks: Mapping[str, float | None],
    unmeasured: Mapping[str, float],
) -> tuple[Geometry, Posture]:
    """Lengths, measured directions, values of locked coordinates and the posture, from landmarks while
    standing.

    Args:
        locks: coordinates to lock; None means at the angle found here.
        unmeasured: lengths (m) that no landmarks give.

    Raises:
        ModelError: a length of zero (two landmarks at one place).
    """
    lengths: dict[str, float] = dict(unmeasured)
    for length in model.lengths:
        if length.value_m is not None:
            lengths[length.name] = length.value_m
        elif all(name in landmarks for pair in length.pairs() for name in pair):
            apart = [float(np.linalg.norm(landmarks[end] - landmarks[start])) for start, end in length.pairs()]
            lengths[length.name] = float(np.mean(apart))
            if lengths[length.name] < 1e-3:
                start, end = length.pairs()[0]
                raise ModelError(f"length {length.name}: landmarks {start} and {end} lie at one place")
    directions = {s.name: [np.array(t.direction) for t in s.placement] for s in model.segments}
    given = {name: value for name, value in locks.items() if value is not None}
    geometry = Geometry(lengths, directions, given)
    for segment in model.segments:  # parents first: a measured direction needs its parent's pose
        measured = any(term.measured for term in segment.placement)
        if not measured or segment.origin is None or segment.origin not in landmarks:
            continue
        above = _without(model, segment)
        posture = find_posture(above, geometry, landmarks)
        offset = posture.to_local(segment.parent, landmarks[segment.origin]) - np.array(segment.translation)
        own = next(k for k, term in enumerate(segment.placement) if term.measured)  # the others are zero as yet
        if segment.side is None:
            lengths[segment.placement[own].length] = float(np.linalg.norm(offset))
        directions[segment.name][own] = offset / np.linalg.norm(offset)
    posture = find_posture(model, geometry, landmarks)
    locked = {name: posture.coordinates[name] if value is None else value for name, value in locks.items()}
    return Geometry(lengths, directions, locked), posture


def _without(model: ModelFile, segment: Segment) -> ModelFile:
    """The model as far as the segments that stand before ``segment``."""
    before = model.segments[: model.segments.index(segment)]
    return model.model_copy(update={"segments": before})
