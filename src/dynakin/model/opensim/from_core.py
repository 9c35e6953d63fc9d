"""From a core specification (a built-in model, measured) to an OpenSim model.

A segment's chain becomes custom joints: translations, then at most three rotations, then the next joint, on a massless
body between. A coordinate belongs to the first joint that it moves; elsewhere a coupled coordinate stands for it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np
import scipy

from dynakin.bindings import _core
from dynakin.model.inertia import INERTIA_NAMES, RigidBody
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
from dynakin.model.opensim.functions import IDENTITY, Function, is_constant, joined, polynomial
from dynakin.model.schema import Interval


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
        x, y, z = scipy.spatial.transform.Rotation.from_matrix(segment.rotation).as_euler("XYZ")
        offset, parent = Offset(_vector(place), (float(x), float(y), float(z))), segment.parent
        groups = _groups(segment.axes)
        for k, group in enumerate(groups):
            last = k == len(groups) - 1
            child = segment.name if last else f"{segment.name}_{k + 1}"
            self.joints.append(self._joint(f"{child}_joint", parent, offset, child, group))
            self.bodies.append(self._body(segment) if last else Body.of(child, RigidBody.nothing()))
            parent, offset = child, Offset()

    def _body(self, segment: _core.SegmentSpec) -> Body:
        names = [f"inertia/{segment.name}/{name}" for name in INERTIA_NAMES]
        numbers = [self.values.get(name, value) for name, value in zip(names, segment.inertia, strict=True)]
        return Body.of(segment.name, RigidBody.from_vector(numbers))

    def _joint(self, name: str, parent: str, offset: Offset, child: str, group: list[_core.AxisSpec]) -> Joint:
        own: dict[str, Coordinate] = {}
        axes = []
        for axis in group:
            functions = self._functions(axis)
            coordinate = None if is_constant(functions) else self._coordinate(axis.coordinate, child, own)
            axes.append(JointAxis(_kind(axis), _vector(axis.direction), coordinate, functions))
        return Joint(
            name,
            "CustomJoint" if group else "WeldJoint",
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


def _kind(axis: _core.AxisSpec) -> Literal["rotation", "translation"]:
    return "rotation" if axis.kind == "rotation" else "translation"


def _groups(axes: list[_core.AxisSpec]) -> list[list[_core.AxisSpec]]:
    """Runs of at most three translations and then at most three rotations, no two along one line, which OpenSim
    refuses; one empty run for a weld."""
    groups: list[list[_core.AxisSpec]] = [[]]
    for axis in axes:
        kinds = [entry.kind for entry in groups[-1]]
        alike = [entry.direction for entry in groups[-1] if entry.kind == axis.kind]
        full = len(alike) == 3 or (axis.kind == "translation" and "rotation" in kinds)
        if full or any(np.linalg.norm(np.cross(axis.direction, other)) < 1e-6 for other in alike):
            groups.append([])
        groups[-1].append(axis)
    return groups
