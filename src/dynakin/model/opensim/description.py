"""An OpenSim model as plain data: what a file of any version says; also what is written back."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
import scipy

from dynakin.arrays import Array
from dynakin.errors import ModelError
from dynakin.model.inertia import RigidBody
from dynakin.model.opensim.functions import Function
from dynakin.tree import Tree

GROUND = "ground"
"""Name of what the first body hangs on."""

Vector = tuple[float, float, float]
ZERO: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Offset:
    """A frame on a body: origin (m) and body-fixed X, Y, Z angles (rad)."""

    translation: Vector = ZERO
    orientation: Vector = ZERO

    @property
    def rotation(self) -> Array:
        """R (3, 3) of the frame in its body."""
        return np.asarray(scipy.spatial.transform.Rotation.from_euler("XYZ", self.orientation).as_matrix())

    def then(self, other: Offset) -> Offset:
        """A frame that lies at ``other`` in this one."""
        if self == Offset():
            return other
        if other.orientation == ZERO:
            turned = self.orientation
        else:
            x, y, z = scipy.spatial.transform.Rotation.from_matrix(self.rotation @ other.rotation).as_euler("XYZ")
            turned = (float(x), float(y), float(z))
        x, y, z = np.array(self.translation) + self.rotation @ np.array(other.translation)
        return Offset((float(x), float(y), float(z)), turned)


@dataclass(frozen=True)
class Body:
    """Mass (kg), its centre (3,) m, and the tensor about the centre: xx, yy, zz, xy, xz, yz (kg m^2)."""

    name: str
    mass: float
    centre: Vector
    inertia: tuple[float, ...]

    @property
    def rigid(self) -> RigidBody:
        """About the body's origin."""
        xx, yy, zz, xy, xz, yz = self.inertia
        return RigidBody.from_centre(self.mass, self.centre, [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])

    @classmethod
    def of(cls, name: str, rigid: RigidBody) -> Body:
        """The way back of ``rigid``."""
        if rigid.mass == 0.0:
            return cls(name, 0.0, ZERO, (0.0,) * 6)
        x, y, z = (float(v) for v in rigid.centre)
        c = rigid.centre
        at_centre = rigid.inertia - rigid.mass * (np.dot(c, c) * np.eye(3) - np.outer(c, c))
        entries = [at_centre[i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
        return cls(name, float(rigid.mass), (x, y, z), tuple(float(v) for v in entries))


@dataclass(frozen=True)
class Coordinate:
    """A generalised coordinate (rad or m); limits are infinite where the file clamps it to none."""

    name: str
    value: float = 0.0
    range: tuple[float, float] | None = None
    clamped: bool = False
    locked: bool = False

    @property
    def limits(self) -> tuple[float, float]:
        """(lower, upper), rad or m."""
        return self.range if self.clamped and self.range is not None else (-np.inf, np.inf)


@dataclass(frozen=True)
class JointAxis:
    """Motion along or about ``direction`` (a unit vector in the joint's frame) by functions of a coordinate, applied
    one after the other; none: a constant."""

    kind: Literal["rotation", "translation"]
    direction: Vector
    coordinate: str | None
    functions: tuple[Function, ...] = ()


@dataclass(frozen=True)
class Joint:
    """How a body hangs on another: axes in the order of the chain, translations first."""

    name: str
    kind: str  # OpenSim's class
    parent: str
    parent_offset: Offset
    child: str
    child_offset: Offset
    coordinates: tuple[Coordinate, ...]
    axes: tuple[JointAxis, ...]


@dataclass(frozen=True)
class Coupler:
    """One coordinate as functions of another."""

    name: str
    dependent: str
    independent: str
    functions: tuple[Function, ...]


@dataclass(frozen=True)
class Marker:
    """A marker (3,) m on a body."""

    name: str
    body: str
    location: Vector
    fixed: bool = False


@dataclass(frozen=True)
class OpenSimModel:
    """A whole model; joints in an order in which a parent comes before its children.

    Attributes:
        left_out: sentences on what of the file is not part of this.
    """

    name: str
    path: Path
    gravity: Vector
    bodies: tuple[Body, ...]
    joints: tuple[Joint, ...]
    couplers: tuple[Coupler, ...]
    markers: tuple[Marker, ...]
    left_out: tuple[str, ...] = ()

    def body(self, name: str) -> Body:
        """The body of that name."""
        return next(body for body in self.bodies if body.name == name)

    @property
    def mass(self) -> float:
        """kg."""
        return sum(body.mass for body in self.bodies)

    @property
    def tree(self) -> Tree:
        """Which body hangs on which."""
        return Tree((joint.child for joint in self.joints), (joint.parent for joint in self.joints))

    @property
    def floating(self) -> tuple[str, ...]:
        """The six coordinates by which the body may be anywhere in the ground; none where it is held in some way."""
        roots = [joint for joint in self.joints if joint.parent == GROUND]
        free = [c.name for joint in roots for c in joint.coordinates if not c.locked]
        driven = {coupler.dependent for coupler in self.couplers}
        return tuple(free) if len(roots) == 1 and len(free) == 6 and not driven & set(free) else ()


def person_of(source: OpenSimModel) -> OpenSimModel:
    """The model without bodies that hang on the ground apart from the person (a chair, a treadmill, a bar), which would
    share the person's mass; a sentence in ``left_out`` names them. Without markers nothing is told apart.

    Raises:
        ModelError: markers on several trees, or a coordinate of the person that follows one of what is left out.
    """
    tree = source.tree
    root = {name: tree.up(name)[-1] for name in tree.parents}
    marked: dict[str, list[str]] = {}
    for marker in source.markers:
        if marker.body != GROUND:
            marked.setdefault(root[marker.body], []).append(marker.name)
    if not marked or len(set(root.values())) == 1:
        return source
    if len(marked) > 1:
        found = " and ".join(f"{name} ({', '.join(markers[:3])})" for name, markers in marked.items())
        raise ModelError(
            f"{source.path}: markers lie on bodies that hang on the ground apart from each other: {found}; expected "
            "one person. Delete the markers of what is not the person from the file"
        )
    person = next(iter(marked))
    others = {body for body, own in root.items() if own != person}
    lost = {c.name for joint in source.joints if joint.child in others for c in joint.coordinates}
    couplers = tuple(coupler for coupler in source.couplers if coupler.dependent not in lost)
    for coupler in couplers:
        if coupler.independent in lost:
            raise ModelError(
                f"{source.path}: coupler {coupler.name!r}: {coupler.dependent} follows {coupler.independent}, "
                f"expected a coordinate of the person (of the tree of {person}). Delete the coupler from the file"
            )
    named = ", ".join(f"{body.name} ({body.mass:g} kg)" for body in source.bodies if body.name in others)
    return replace(
        source,
        bodies=tuple(body for body in source.bodies if body.name not in others),
        joints=tuple(joint for joint in source.joints if joint.child not in others),
        couplers=couplers,
        left_out=(*source.left_out, f"Left out, as no part of the person whose markers are on {person}: {named}."),
    )
