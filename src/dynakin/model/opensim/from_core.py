"""From a core specification (a built-in model, measured) to an OpenSim model.

A segment's chain becomes custom joints: translations, then at most three rotations, then the next joint, on a massless
body between. A coordinate belongs to the first joint that it moves; elsewhere a coupled coordinate stands for it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import scipy

from dynakin.arrays import Array
from dynakin.bindings import _core
from dynakin.model.calibration.posture import turned
from dynakin.model.inertia import RigidBody, inertia_from
from dynakin.model.opensim.description import (
    Body,
    Coordinate,
    Coupler,
    Joint,
    JointAxis,
    Marker,
    Offset,
    OpenSimModel,
    Vector,
)
from dynakin.model.opensim.functions import IDENTITY, Function, constant, is_constant, joined, polynomial
from dynakin.model.schema import Interval, Kind

_APART = 1e-6  # sine of the angle between two axes


def from_core(
    spec: _core.ModelSpec, values: Mapping[str, float] | None = None, limits: Mapping[str, Interval] | None = None
) -> OpenSimModel:
    """An OpenSim model of a specification.

    Args:
        values: of lengths, marker places and inertia by the core's names; the specification's where not given.
        limits: (lower, upper) rad or m of coordinates that have any.
    """
    found = dict(values or {})
    tree = _Tree(spec, found, dict(limits or {}))
    for segment in spec.segments:
        tree.hang(segment)
    markers = []
    for m in spec.markers:
        place = [found.get(f"marker/{m.name}/{axis}", p) for axis, p in zip("xyz", m.position, strict=True)]
        markers.append(Marker(m.name, m.segment, _vector(place)))
    return OpenSimModel(
        name=spec.name,
        path=Path(f"{spec.name}.osim"),
        gravity=_vector(spec.gravity),
        bodies=tuple(tree.bodies),
        joints=tuple(tree.joints),
        couplers=tuple(tree.couplers),
        markers=tuple(markers),
    )


def _vector(numbers: object) -> Vector:
    x, y, z = np.asarray(numbers, dtype=float)
    return float(x), float(y), float(z)


@dataclass(eq=False)
class _Run:
    """Axes of one joint, after a turn and a place that no coordinate changes."""

    turn: Array = field(default_factory=lambda: np.eye(3))
    place: Array = field(default_factory=lambda: np.zeros(3))
    moving: list[JointAxis] = field(default_factory=list)

    def takes(self, axis: JointAxis, fixed: bool) -> bool:
        """Whether the axis may follow in the same joint."""
        if any(entry.kind == "rotation" for entry in self.moving) and (fixed or axis.kind == "translation"):
            return False
        alike = [entry.direction for entry in self.moving if entry.kind == axis.kind]
        apart = all(np.linalg.norm(np.cross(axis.direction, other)) >= _APART for other in alike)
        return fixed or (len(alike) < 3 and apart)

    def add(self, axis: JointAxis, fixed: bool) -> None:
        """Put the axis last. Nothing turns before one that is fixed, so that translations before it may follow it, in
        its frame."""
        if not fixed:
            self.moving.append(axis)
        elif axis.kind == "translation":
            self.place = self.place + self.turn @ np.array(axis.direction) * constant(axis.functions)
        else:
            turn = turned(constant(axis.functions) * np.array(axis.direction))
            self.turn = self.turn @ turn
            self.moving = [replace(entry, direction=_vector(turn.T @ entry.direction)) for entry in self.moving]


@dataclass
class _Tree:
    spec: _core.ModelSpec
    values: dict[str, float]
    limits: dict[str, Interval]
    bodies: list[Body] = field(default_factory=list)
    joints: list[Joint] = field(default_factory=list)
    couplers: list[Coupler] = field(default_factory=list)
    owners: set[str] = field(default_factory=set)

    def length(self, name: str) -> float:
        value = next(p.value for p in self.spec.parameters if p.name == name)
        return float(self.values.get(f"length/{name}", value))

    def hang(self, segment: _core.SegmentSpec) -> None:
        """One joint, or several with massless bodies between, and the body itself."""
        place = np.array(segment.translation)
        for term in segment.lengths:
            place = place + self.length(term.parameter) * np.array(term.direction)
        parent, turn = segment.parent, np.array(segment.rotation)
        runs = self._runs(segment.axes)
        for k, run in enumerate(runs):
            last = k == len(runs) - 1
            child = segment.name if last else f"{segment.name}_{k + 1}"
            x, y, z = scipy.spatial.transform.Rotation.from_matrix(turn @ run.turn).as_euler("XYZ")
            offset = Offset(_vector(place + turn @ run.place), (float(x), float(y), float(z)))
            self.joints.append(self._joint(f"{child}_joint", parent, offset, child, run.moving))
            self.bodies.append(self._body(segment) if last else Body.of(child, RigidBody.nothing()))
            parent, place, turn = child, np.zeros(3), np.eye(3)

    def _runs(self, axes: list[_core.AxisSpec]) -> list[_Run]:
        """Of at most three translations and then at most three rotations, no two along one line, which OpenSim
        refuses; one empty run for a weld.

        What turns by a constant is part of where a joint lies: OpenSim's velocities are wrong where a rotation that
        moves follows one that does not (4.6).
        """
        runs = [_Run()]
        for axis in axes:
            found = JointAxis(_kind(axis), _vector(axis.direction), axis.coordinate, self._functions(axis))
            fixed = is_constant(found.functions)
            if fixed and constant(found.functions) == 0.0:
                continue
            if not runs[-1].takes(found, fixed):
                runs.append(_Run())
            runs[-1].add(found, fixed)
        return runs

    def _body(self, segment: _core.SegmentSpec) -> Body:
        numbers = inertia_from(self.values, segment.name, segment.inertia)
        return Body.of(segment.name, RigidBody.from_vector(numbers))

    def _joint(self, name: str, parent: str, offset: Offset, child: str, moving: list[JointAxis]) -> Joint:
        own: dict[str, Coordinate] = {}
        axes = [replace(axis, coordinate=self._coordinate(str(axis.coordinate), child, own)) for axis in moving]
        return Joint(
            name,
            "CustomJoint" if moving else "WeldJoint",
            parent,
            offset,
            child,
            Offset(),
            tuple(own.values()),
            tuple(axes),
        )

    def _functions(self, axis: _core.AxisSpec) -> tuple[Function, ...]:
        factor = self.length(axis.scale) if axis.scale else 1.0
        before = [Function(f.kind, tuple(f.coefficients), tuple(f.x), tuple(f.y)) for f in axis.functions]  # type: ignore[arg-type]
        return joined([*before, polynomial(*axis.coefficients), polynomial(0.0, factor)])

    def _coordinate(self, name: str, child: str, own: dict[str, Coordinate]) -> str:
        """Its own name in the joint that has it; elsewhere that of a coupled one."""
        if name in own or f"{name}_in_{child}" in own:
            return name if name in own else f"{name}_in_{child}"
        entry = next(c for c in self.spec.coordinates if c.name == name)
        low, high = self.limits.get(name, (-np.inf, np.inf))
        limited = bool(np.isfinite(low) and np.isfinite(high))
        here = name if name not in self.owners else f"{name}_in_{child}"
        own[here] = Coordinate(
            here, float(entry.value), (low, high) if limited else None, limited, entry.locked and here == name
        )
        if here != name:
            self.couplers.append(Coupler(f"{here}_coupler", here, name, (IDENTITY,)))
        self.owners.add(name)
        return here


def _kind(axis: _core.AxisSpec) -> Kind:
    return "rotation" if axis.kind == "rotation" else "translation"
