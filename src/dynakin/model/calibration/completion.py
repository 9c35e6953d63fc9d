"""Landmarks that no marker gives, from the proportions of a standing adult laid on those that are measured.

Segment by segment, from the root on, the template is turned and shifted so that it meets the landmarks of the segment
that are known; weak points far out hold its direction to that of its parent, so that nothing, one, two and more known
landmarks are one formula (Kabsch 1976, Acta Cryst A32:922-923). A side that is not marked takes the other's shape.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib import resources

import numpy as np

from dynakin.arrays import Array
from dynakin.errors import ModelError
from dynakin.messages import Message, note
from dynakin.model.calibration.joint_motion import nearest_rotation
from dynakin.model.calibration.landmarks import BENT, Positions
from dynakin.model.calibration.posture import frame_landmarks
from dynakin.model.markers.anatomy import standing_at
from dynakin.model.mirroring import SUFFIXES
from dynakin.model.schema import Frame, ModelFile, Segment
from dynakin.model.table import BodyTable

_MARKER_WEIGHT = 0.01
"""Of a marker on the skin next to a landmark: people differ there, but it shows where the segment faces."""
_HOLD_WEIGHT = 1e-4
"""Of each of six points a tenth of the height away that hold the segment's direction to its parent's."""
_HOLD = 0.1
_FLIP, _IN_THE_MIDDLE = np.array([1.0, 1.0, -1.0]), np.array([1.0, 1.0, 0.0])
_ONE_PLACE_M = 1e-3
_LEAST = 2
"""Landmarks of the root that must be measured."""


@dataclass(frozen=True, eq=False)
class Proportions:
    """Places in parts of the height, of landmarks by their names with side, and of markers by set name with segment;
    and landmarks next to a hinge, with the limb's and which way it bends."""

    landmarks: dict[str, Array]
    markers: dict[str, tuple[str, Array]]
    hinges: dict[str, tuple[tuple[str, str, str], float]]

    @classmethod
    @cache
    def load(cls) -> Proportions:
        """Those of the file ``proportions.toml``."""
        text = (resources.files("dynakin.model.calibration") / "proportions.toml").read_text(encoding="utf-8")
        content = tomllib.loads(text)
        landmarks: dict[str, Array] = {}
        for name, given in content["landmarks"].items():
            place = _middle_of(given)
            if not name.endswith("_r"):
                place = place * _IN_THE_MIDDLE
            landmarks[name] = place
            if name.endswith("_r"):
                landmarks[f"{name.removesuffix('_r')}_l"] = place * _FLIP
        markers = {
            name: (segment, standing_at()[name][0]) for segment, names in content["markers"].items() for name in names
        }
        hinges = {name: (tuple(entry["limb"]), float(entry["forward"])) for name, entry in content["hinges"].items()}
        return cls(landmarks, markers, hinges)


def _middle_of(given: list[str] | list[float]) -> Array:
    """A place (3,) given as such, or as the middle of places of anatomy.toml."""
    points = [standing_at()[each][0] for each in given if isinstance(each, str)]
    return np.mean(points, axis=0) if points else np.array(given, dtype=float)


@dataclass
class Completed:
    """All landmarks that the model needs, those that were completed, and a sentence on them."""

    landmarks: dict[str, Array]
    added: dict[str, str] = field(default_factory=dict)  # landmark -> segment
    messages: list[Message] = field(default_factory=list)


def wanted_landmarks(
    model: ModelFile, table: BodyTable, locks: Mapping[str, float | None], segment: Segment
) -> list[str]:
    """Names, with side, of what a segment's frame, its children's places and its table parts need."""
    names = frame_landmarks(segment) if free(segment, locks) else []
    children = [child for child in model.segments if child.parent == segment.name]
    names += [child.origin for child in children if child.origin]
    placed = {term.length for child in children for term in child.placement}
    for length in model.lengths:
        if length.name in placed:
            names += [name for pair in length.pairs() for name in pair]
    suffix = SUFFIXES.get(segment.side or "", "")
    for part in (table.part(name) for name in segment.parts):
        for point in (part.origin, part.length_from, part.length_to, part.axis_from, part.axis_to):
            names += [f"{end}{suffix}" for end in (point.start, point.end)]
    plain = [each for name in names for each in _sided(name)]
    others = tuple(other for side, other in SUFFIXES.items() if segment.side not in (None, side))
    return [name for name in dict.fromkeys(plain) if not (others and name.endswith(others))]


def free(segment: Segment, locks: Mapping[str, float | None]) -> bool:
    """Whether landmarks say how a segment stands; else that follows from its parent."""
    return not segment.axes or any(locks.get(axis.coordinate) is None for axis in segment.axes)


def _sided(name: str) -> list[str]:
    """A landmark that the template has on each side, where it is asked for as the middle of both."""
    known = Proportions.load().landmarks
    for suffix in SUFFIXES.values():
        if name not in known and name.removesuffix(suffix) in known:
            return [name.removesuffix(suffix)]  # lumbar_r is the lumbar joint
    if name not in known and f"{name}_r" in known:
        return [f"{name}{suffix}" for suffix in SUFFIXES.values()]
    return [name]


def completed(
    model: ModelFile,
    table: BodyTable,
    locks: Mapping[str, float | None],
    landmarks: Mapping[str, Array],
    positions: Positions,
    height_m: float,
    where: str,
) -> Completed:
    """Every landmark that the model needs, (3,) m, ground frame (X forward), measured or from proportions.

    Args:
        locks: coordinates that are locked, None: at the angle found.
        landmarks: as `LandmarkFinder.find_in_space` gives them. positions: of the markers.
        height_m: of the body.

    Raises:
        ModelError: too little of the root is measured to say where the body is, or a landmark of a model of one's own
            that neither markers nor proportions give.
    """
    template = Proportions.load()
    known = {name: place for name, place in landmarks.items() if np.isfinite(place).all()}
    for name in _on_the_skin(model, known):
        del known[name]
    found = Completed(dict(known))
    turns: dict[str, Array] = {}
    shapes: dict[str, dict[str, Array]] = {}  # of the second side, as the first one has it
    nominal = {name: height_m * place for name, place in template.landmarks.items()}
    lacking: dict[str, str] = {}
    for segment in _better_side_first(model, table, locks, known):
        wanted = wanted_landmarks(model, table, locks, segment)
        shape = nominal | shapes.get(segment.name, {})
        own = [name for name in wanted if name in shape]
        lacking |= {name: segment.name for name in _needed(segment, locks, wanted) if name not in shape | known}
        have = [name for name in own if name in found.landmarks]
        missing = [name for name in own if name not in found.landmarks]
        if segment.parent == "ground" and len(set(own) & set(known)) < _LEAST:
            raise ModelError(
                f"{where}: segment {segment.name!r} of model {model.name} has {len(set(own) & set(known))} of the "
                f"landmarks {', '.join(own)}, expected {_LEAST} or more: markers on it, or joint centres"
            )
        pairs = [(shape[name], found.landmarks[name], 1.0) for name in have]
        pairs += _centre_markers(segment, positions, height_m)
        source, target, weights = (np.array(column) for column in zip(*pairs, strict=True))
        turn, shift = laid(source, target, weights, _held(segment, turns), height_m)
        turns[segment.name] = turn
        for name in missing:
            found.landmarks[name] = turn @ shape[name] + shift
            found.added[name] = segment.name
            _at_hinge(name, segment.side, known, found.landmarks)
        _flat_floor(segment, missing, turn, found.landmarks)
        if segment.side is not None:
            mine, other = SUFFIXES[segment.side], next(s for side, s in SUFFIXES.items() if side != segment.side)
            shapes[f"{segment.name.removesuffix(mine)}{other}"] = {
                f"{name.removesuffix(mine)}{other}": (turn.T @ (found.landmarks[name] - shift)) * _FLIP
                for name in own
                if name.endswith(mine)
            }
    if lacking:
        raise ModelError(
            f"{where}: neither markers nor proportions give "
            + ", ".join(f"landmark {name!r} (segment {segment})" for name, segment in lacking.items())
        )
    _middles(found.landmarks, set(template.landmarks))
    if found.added:
        text = (
            f"From the proportions of an adult of {height_m:.2f} m, or the other side, because no markers give them: "
        )
        found.messages.append(note("calibration", f"{text}{', '.join(sorted(found.added))}."))
    return found


def _centre_markers(segment: Segment, positions: Positions, height_m: float) -> list[tuple[Array, Array, float]]:
    """Of each marker in the middle of a segment that is seen: the template's place (3,) m, its own (3,) m, a weight."""
    markers = Proportions.load().markers
    seen = {name: positions.get((name, "centre")) for name, (home, _) in markers.items() if home == segment.name}
    return [
        (height_m * markers[name][1], place, _MARKER_WEIGHT)
        for name, place in seen.items()
        if place is not None and np.isfinite(place).all()
    ]


def _flat_floor(segment: Segment, added: list[str], turn: Array, landmarks: dict[str, Array]) -> None:
    """Puts the landmark over the floor of a segment whose frame is completed, in place: flat in the proportions."""
    frame = frame_landmarks(segment)
    if not set(added) & set(frame):
        return
    for floor in (name for name in frame if name.startswith("floor")):
        up = next(name for name in frame if name.startswith("over_floor"))
        landmarks[up] = landmarks[floor] + turn @ np.array([0.0, 1.0, 0.0])


def _on_the_skin(model: ModelFile, known: Mapping[str, Array]) -> set[str]:
    """Joint centres that for want of anything better are taken to be where a marker near them is."""
    found = set()
    for segment in model.segments:
        for axis in ("x", "y", "z") if isinstance(segment.frame, Frame) else ():
            start, end = getattr(segment.frame, axis) or ("", "")
            if start in known and end in known and np.linalg.norm(known[end] - known[start]) < _ONE_PLACE_M:
                found.add(start)
    return found


def _needed(segment: Segment, locks: Mapping[str, float | None], wanted: list[str]) -> list[str]:
    """Of these the ones without which the segment has no frame."""
    if not free(segment, locks):
        return []
    frame = [name for name in frame_landmarks(segment) if not name.startswith(("floor", "over_floor"))]
    return [each for name in frame for each in _sided(name) if each in wanted]


def _better_side_first(
    model: ModelFile, table: BodyTable, locks: Mapping[str, float | None], known: Mapping[str, Array]
) -> list[Segment]:
    """The model's segments, parents first, and of two sides the one first of which more is measured."""
    count = {s.name: sum(name in known for name in wanted_landmarks(model, table, locks, s)) for s in model.segments}
    sides = {side: sum(count[s.name] for s in model.segments if s.side == side) for side in SUFFIXES}
    order = sorted(SUFFIXES, key=lambda side: -sides[side])
    centre = [s for s in model.segments if s.side is None]
    rest = [s for side in order for s in model.segments if s.side == side]
    ordered: list[Segment] = []
    waiting = [*centre, *rest]
    while waiting:  # a middle segment may hang on a limb in a model of one's own
        done = {"ground", *(s.name for s in ordered)}
        nearest = next(s for s in waiting if s.parent in done)
        ordered.append(nearest)
        waiting.remove(nearest)
    return ordered


def _held(segment: Segment, turns: Mapping[str, Array]) -> Array:
    """Rotation (3, 3) of the template to which a segment is held: upright, as the root faces, of what hangs on the
    root; else that of the parent."""
    if segment.parent == "ground":
        return np.eye(3)
    parent = turns[segment.parent]
    if segment.parent != next(iter(turns)):
        return parent
    ahead = parent[:, 0] * np.array([1.0, 0.0, 1.0])
    if np.linalg.norm(ahead) < 0.1:
        return parent
    ahead /= np.linalg.norm(ahead)
    up = np.array([0.0, 1.0, 0.0])
    return np.column_stack([ahead, up, np.cross(ahead, up)])


def laid(source: Array, target: Array, weights: Array, hold: Array, height_m: float) -> tuple[Array, Array]:
    """Rotation (3, 3) and shift (3,) that lay points (K, 3) best on targets, directions held to a rotation weakly.

    Args:
        height_m: of the body.
    """
    weights = weights / weights.sum()
    a, b = weights @ source, weights @ target
    covariance = (target - b).T @ (weights[:, None] * (source - a))
    covariance += _HOLD_WEIGHT * 2.0 * (_HOLD * height_m) ** 2 * hold
    turn = nearest_rotation(covariance)
    return turn, b - turn @ a


def _at_hinge(name: str, side: str | None, known: Mapping[str, Array], found: dict[str, Array]) -> None:
    """Turns a completed landmark next to a hinge, in place, to where the measured limb's plane has it."""
    suffix = SUFFIXES.get(side or "", "")
    limb, forward = Proportions.load().hinges.get(name.removesuffix(suffix), ((), 0.0))
    ends = [f"{end}{suffix}" for end in limb]
    if not ends or not all(end in known for end in ends):
        return
    upper, middle, lower = (known[end] for end in ends)
    line, rest = upper - middle, lower - middle
    plane = forward * np.cross(rest, line) / (np.linalg.norm(rest) * np.linalg.norm(line))  # to the right
    offset = found[name] - middle
    size = float(np.linalg.norm(offset))
    across = offset / size + BENT * (plane if side == "right" else -plane)
    line = line / np.linalg.norm(line)
    across = across - line * float(across @ line)
    found[name] = middle + size * across / np.linalg.norm(across)


def _middles(landmarks: dict[str, Array], template: set[str]) -> None:
    """Middle of both sides under the plain name, and middle landmarks under both sides' names, in place."""
    for name in sorted(template):
        plain = next((name.removesuffix(s) for s in SUFFIXES.values() if name.endswith(s)), name)
        sides = [f"{plain}{suffix}" for suffix in SUFFIXES.values()]
        if plain not in landmarks and all(side in landmarks for side in sides):
            landmarks[plain] = np.mean([landmarks[side] for side in sides], axis=0)
        if plain in template and plain in landmarks:
            for side in sides:
                landmarks.setdefault(side, landmarks[plain])
