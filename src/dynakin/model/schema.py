"""What a model file (TOML) may hold: a tree of segments joined by chains of axes, with lengths and joint
limits.

A file of a user's own works as the built-in ones in ``builtin/`` do; those are commented and serve as
examples.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import AfterValidator, Field, model_validator

from dynakin.model.mirroring import SUFFIXES, mirrored
from dynakin.settings.strict import CoordinateName, Name, Strict, nearest
from dynakin.tree import Tree
from dynakin.units import GRAVITY_M_S2, gravity_problem

Vector3 = Annotated[tuple[float, float, float], Field(description="three numbers")]
LandmarkPair = tuple[str, str]
Interval = tuple[float, float]
Kind = Literal["rotation", "translation"]
_MOST = 1000  # segments, lengths, coordinates: five times those of a whole body with fingers and vertebrae


class Axis(Strict):
    """One degree of freedom: ``scale * sum_k coefficients[k] q^k``, rad about or m along ``direction``."""

    coordinate: str
    kind: Kind = "rotation"
    direction: Vector3 = (0.0, 0.0, 1.0)
    coefficients: tuple[float, ...] = (0.0, 1.0)
    scale: str = ""

    @model_validator(mode="after")
    def _unit_direction(self) -> Self:
        norm = float(np.linalg.norm(self.direction))
        if abs(norm - 1.0) > 1e-6:
            raise ValueError(f"direction has length {norm:.6g}, expected a unit vector")
        return self


def kinds_of(joints: Iterable[Any]) -> dict[str, Kind]:
    """What each coordinate does, of segments or joints with axes: one that turns anything is a rotation, even if it
    also moves along something (a knee that rolls)."""
    found: dict[str, Kind] = {}
    for axis in (axis for joint in joints for axis in joint.axes):
        if found.get(axis.coordinate) != "rotation":
            found[axis.coordinate] = axis.kind
    return found


class Placement(Strict):
    """The joint lies at ``direction * length`` in the parent; a measured direction replaces the nominal one. Terms
    next to a measured one correct it: their lengths start at zero."""

    length: str
    direction: Vector3
    measured: bool = False


class Frame(Strict):
    """Axes of a segment from landmarks: [from, to] of a main axis, then of a second one made orthogonal to
    it."""

    main: Literal["x", "y", "z"] | None = None
    x: LandmarkPair | None = None
    y: LandmarkPair | None = None
    z: LandmarkPair | None = None

    @model_validator(mode="after")
    def _has_main(self) -> Self:
        given = [axis for axis in ("x", "y", "z") if getattr(self, axis) is not None]
        if not 1 <= len(given) <= 2:
            raise ValueError(f"one or two of x, y, z expected, found {given or 'none'}")
        if self.main is None and len(given) == 2:
            raise ValueError("two axes are given: main = 'x', 'y' or 'z' must say which one is kept")
        if self.main is not None and self.main not in given:
            raise ValueError(f"main is {self.main!r}, but only {given} are given")
        return self


class WithoutMarkers(Strict):
    """What happens to a segment that the recording has no marker of: the joint to ``lock_to`` is locked."""

    lock_to: str
    value_deg: float | None = None  # None: at the angle found while standing
    still: bool = False  # moves so little against its neighbour that the joint's moment is given all the same


class Segment(Strict):
    """A rigid segment, the joint by which it hangs on its parent, and the parts of the body in it."""

    name: Name
    parent: str = "ground"
    origin: str | None = None  # landmark of the joint by which it hangs
    frame: Literal["ground"] | Frame = "ground"  # "ground": axes of the ground frame while standing
    parts: tuple[str, ...] = ()  # names of the table and of the marker set
    side: Literal["right", "left"] | None = None  # of a limb whose sides are modelled apart
    both_sides: bool = False  # lump right and left
    straight: Vector3 | None = None  # lay the parts one after the other along this direction
    translation: Vector3 = (0.0, 0.0, 0.0)
    rotation: tuple[Vector3, Vector3, Vector3] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    placement: tuple[Placement, ...] = ()
    axes: tuple[Axis, ...] = ()
    without_markers: WithoutMarkers | None = None
    when_marked: bool = False  # part of the model only where a recording has markers and the origin of it
    takes_markers_of: tuple[str, ...] = ()  # parts whose markers it carries where the model has no segment of theirs
    inertia: Annotated[tuple[float, ...], Field(min_length=10, max_length=10)] | None = None
    inertia_estimated: bool = True

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        rotation = np.array(self.rotation)
        if np.abs(rotation @ rotation.T - np.eye(3)).max() > 1e-6 or np.linalg.det(rotation) < 0.0:
            raise ValueError("rotation is not a proper rotation matrix (three rows, orthonormal, determinant 1)")
        if sum(term.measured for term in self.placement) > 1:
            raise ValueError("placement: a measured direction is possible with one length only")
        if self.inertia is not None and self.parts:
            raise ValueError("inertia: either ten numbers or parts of the table, not both")
        return self


class Coordinate(Strict):
    """A generalised coordinate: limits of (9), start or locked value; degrees for rotations, metres
    otherwise."""

    name: CoordinateName
    description: str = ""
    minimum_deg: float | None = None
    maximum_deg: float | None = None
    minimum_m: float | None = None
    maximum_m: float | None = None
    value_deg: float | None = None
    value_m: float | None = None
    locked: bool = False
    as_measured: bool = False  # locked at the angle found while standing
    source: str = ""

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        for low, high, unit in (
            (self.minimum_deg, self.maximum_deg, "deg"),
            (self.minimum_m, self.maximum_m, "m"),
        ):
            if low is not None and high is not None and low >= high:
                raise ValueError(f"minimum_{unit} is {low:g}, expected less than maximum_{unit} ({high:g})")
        return self

    @property
    def limits(self) -> tuple[float, float]:
        """(lower, upper) in rad or m, infinite where none is given."""
        low = np.deg2rad(self.minimum_deg) if self.minimum_deg is not None else self.minimum_m
        high = np.deg2rad(self.maximum_deg) if self.maximum_deg is not None else self.maximum_m
        return (-np.inf if low is None else float(low), np.inf if high is None else float(high))

    @property
    def value(self) -> float | None:
        """Start or locked value in rad or m, None where the file gives none."""
        return float(np.deg2rad(self.value_deg)) if self.value_deg is not None else self.value_m


class Length(Strict):
    """A geometry parameter: the distance between two landmarks, or a value."""

    name: Name
    between: LandmarkPair | None = None
    shared: bool = False  # the same for both sides: measured on each, the mean is taken
    value_m: Annotated[float, Field(ge=0.0)] | None = None  # zero: a correction of a measured place, with sd_m
    sd_m: Annotated[float, Field(gt=0.0)] | None = None  # how well it is known; not given: to a part of it (`Priors`)
    minimum_m: float | None = None  # beyond which nobody's is: narrows the bounds that follow from sd_m
    maximum_m: float | None = None
    estimated: bool = True

    @model_validator(mode="after")
    def _known(self) -> Self:
        if (self.between is None) == (self.value_m is None):
            raise ValueError("expected either between = [landmark, landmark] or value_m")
        if self.value_m == 0.0 and self.sd_m is None:
            raise ValueError("value_m is 0: expected sd_m, how far from zero it may be")
        low, high = self.limits
        if np.isfinite(self.limits).any() and self.value_m is None:
            raise ValueError("minimum_m, maximum_m: expected with value_m; what is measured is bounded by its size")
        if self.value_m is not None and not low <= self.value_m <= high:
            raise ValueError(f"value_m is {self.value_m:g}, expected from minimum_m ({low:g}) to maximum_m ({high:g})")
        return self

    @property
    def limits(self) -> Interval:
        """(lower, upper) in m that the file gives, infinite where none is given."""
        low, high = self.minimum_m, self.maximum_m
        return (-np.inf if low is None else low, np.inf if high is None else high)

    def pairs(self) -> tuple[LandmarkPair, ...]:
        """The landmarks between which it is measured: one pair, or one a side."""
        if self.between is None:
            return ()
        if not self.shared:
            return (self.between,)
        return tuple((f"{self.between[0]}{s}", f"{self.between[1]}{s}") for s in SUFFIXES.values())


class Ground(Strict):
    """Where the ground origin lies (a landmark), and how far that landmark may move during a trial."""

    origin: str | None = None
    fixed_within_m: Annotated[float, Field(gt=0.0)] | None = None


def _on_earth(gravity: Vector3) -> Vector3:
    if problem := gravity_problem(gravity):
        raise ValueError(problem)
    return gravity


class ModelFile(Strict):
    """A whole model file."""

    schema_version: Literal[1]
    name: Name
    description: str = ""
    planar: bool = False
    gravity: Annotated[Vector3, AfterValidator(_on_earth)] = (0.0, -GRAVITY_M_S2, 0.0)
    ground: Ground = Ground()
    lengths: Annotated[tuple[Length, ...], Field(max_length=_MOST)] = ()
    coordinates: Annotated[tuple[Coordinate, ...], Field(max_length=_MOST)]
    segments: Annotated[tuple[Segment, ...], Field(min_length=1, max_length=_MOST)]

    @property
    def feet(self) -> dict[str, str]:
        """ "right", "left" -> segment on which the ground acts."""
        return {s.side: s.name for s in self.segments if s.side is not None and "foot" in s.parts}

    @property
    def tree(self) -> Tree:
        """Which segment hangs on which."""
        return Tree.of(self.segments)

    @property
    def sided(self) -> bool:
        """Whether right and left limbs are modelled apart."""
        return any(segment.side is not None for segment in self.segments)

    @property
    def floating(self) -> bool:
        """Whether the body may be anywhere and head anywhere: one root with six free coordinates without limits."""
        roots = self.tree.roots
        own = {axis.coordinate for segment in self.segments if segment.name in roots for axis in segment.axes}
        free = {c.name for c in self.coordinates if not c.locked and not np.isfinite(c.limits).any()}
        return self.sided and self.ground.origin is None and len(roots) == 1 and len(own & free) == len(own) == 6

    def without(self, names: Collection[str]) -> ModelFile:
        """The model without some segments that carry no others, and the coordinates and lengths that only they have."""
        gone = [segment for segment in self.segments if segment.name in names]
        kept = tuple(segment for segment in self.segments if segment.name not in names)
        lost = _of_axes(gone) - _of_axes(kept)
        lengths = _of_places(gone) - _of_places(kept)
        return self.model_copy(
            update={
                "segments": kept,
                "coordinates": tuple(c for c in self.coordinates if c.name not in lost),
                "lengths": tuple(length for length in self.lengths if length.name not in lengths),
            }
        )

    @model_validator(mode="before")
    @classmethod
    def _both_sides(cls, data: Any) -> Any:
        return mirrored(data) if isinstance(data, dict) else data

    @model_validator(mode="after")
    def _references(self) -> Self:
        for kind, items in (
            ("lengths", self.lengths),
            ("coordinates", self.coordinates),
            ("segments", self.segments),
        ):
            names = [item.name for item in items]
            double = next((name for name in names if names.count(name) > 1), None)
            if double:
                raise ValueError(f"{kind}: the name {double!r} is given twice")
        lengths = {length.name for length in self.lengths}
        zero = {length.name: length.value_m == 0.0 for length in self.lengths}
        coordinates = {coordinate.name for coordinate in self.coordinates}
        used: set[str] = set()
        seen: list[str] = ["ground"]
        for segment in self.segments:
            where = f'segments "{segment.name}"'
            _need(segment.parent, seen, f"{where}: parent", "a segment that stands before it, or 'ground'")
            for term in segment.placement:
                _need(term.length, lengths, f"{where}: placement.length", "a name in lengths")
                if not term.measured and zero[term.length] != any(each.measured for each in segment.placement):
                    raise ValueError(
                        f"{where}: placement.length {term.length!r}: expected value_m = 0 of a length that corrects a "
                        "measured place, and of no other"
                    )
            for axis in segment.axes:
                _need(axis.coordinate, coordinates, f"{where}: axes.coordinate", "a name in coordinates")
                if axis.scale:
                    _need(axis.scale, lengths, f"{where}: axes.scale", "a name in lengths")
                used.add(axis.coordinate)
            seen.append(segment.name)
        tree = self.tree
        for segment in self.segments:
            if segment.without_markers is not None:
                other = segment.without_markers.lock_to
                _need(other, tree.parents, f'segments "{segment.name}": without_markers.lock_to', "a segment")
                if not tree.adjacent(segment.name, other):
                    raise ValueError(
                        f'segments "{segment.name}": without_markers.lock_to: {other!r} is '
                        "no neighbour of it in the tree"
                    )
        idle = coordinates - used
        if idle:
            raise ValueError(f"coordinates: no axis uses {sorted(idle)[0]!r}")
        return self


def _of_axes(segments: Iterable[Segment]) -> set[str]:
    return {axis.coordinate for segment in segments for axis in segment.axes}


def _of_places(segments: Iterable[Segment]) -> set[str]:
    scales = {axis.scale for segment in segments for axis in segment.axes if axis.scale}
    return scales | {term.length for segment in segments for term in segment.placement}


def _need(name: str, known: object, where: str, expected: str) -> None:
    names = list(known)  # type: ignore[call-overload]
    if name not in names:
        raise ValueError(f"{where} is {name!r}{nearest(name, names)}, expected {expected}: {', '.join(names)}")
