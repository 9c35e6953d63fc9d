"""OpenSim's joints as chains of 1-DoF axes in the joint's frame: translations in the parent, then rotations."""

from __future__ import annotations

from itertools import combinations
from typing import Literal

import numpy as np

from dynakin.model.opensim.description import Coordinate, JointAxis, Vector
from dynakin.model.opensim.functions import KNOWN, Chain, function_of, is_constant, polynomial, read_function
from dynakin.model.opensim.xml_file import Node

X: Vector = (1.0, 0.0, 0.0)
Y: Vector = (0.0, 1.0, 0.0)
Z: Vector = (0.0, 0.0, 1.0)
UNITS: tuple[Vector, Vector, Vector] = (X, Y, Z)

# Kinds with axes of their own: (kind, direction) of each coordinate, in the order of the file's coordinates.
# Ball and free joints turn about the moving axes X, Y, Z; OpenSim's speeds of these are angular velocities.
SIMPLE: dict[str, tuple[tuple[Literal["rotation", "translation"], Vector], ...]] = {
    "WeldJoint": (),
    "PinJoint": (("rotation", Z),),
    "SliderJoint": (("translation", X),),
    "UniversalJoint": (("rotation", X), ("rotation", Y)),
    "BallJoint": (("rotation", X), ("rotation", Y), ("rotation", Z)),
    "GimbalJoint": (("rotation", X), ("rotation", Y), ("rotation", Z)),
    "PlanarJoint": (("rotation", Z), ("translation", X), ("translation", Y)),
    "FreeJoint": (
        ("rotation", X),
        ("rotation", Y),
        ("rotation", Z),
        ("translation", X),
        ("translation", Y),
        ("translation", Z),
    ),
}
JOINTS = ("CustomJoint", *SIMPLE)
_PARALLEL = 1e-3  # sine of the angle between axes
TRANSFORM_AXES = ("translation1", "translation2", "translation3", "rotation1", "rotation2", "rotation3")


def read_axes(joint: Node, coordinates: tuple[Coordinate, ...]) -> tuple[JointAxis, ...]:
    """Axes of a joint of either version, in the order of the chain.

    Raises:
        ModelError: the joint or one of its functions is of a kind that is not supported, or contradicts itself.
    """
    if joint.tag == "CustomJoint":
        axes = _custom(joint, {c.name for c in coordinates})
        used = {axis.coordinate for axis in axes}
        for c in coordinates:
            if c.name not in used:
                joint.fail(f"coordinate {c.name!r} moves no axis")
        return axes
    kinds = SIMPLE.get(joint.tag)
    if kinds is None:
        joint.fail(f"this kind of joint is not supported; expected one of {', '.join(JOINTS)}")
    if len(kinds) != len(coordinates):
        joint.fail(f"found {len(coordinates)} coordinates, expected {len(kinds)}")
    axes = tuple(JointAxis(kind, at, c.name) for (kind, at), c in zip(kinds, coordinates, strict=True))
    return tuple(sorted(axes, key=lambda axis: axis.kind == "rotation"))  # a stable sort: translations first


def _custom(joint: Node, coordinates: set[str]) -> tuple[JointAxis, ...]:
    transform = joint.need("SpatialTransform")
    given = {node.name: node for node in transform if node.tag == "TransformAxis"}
    axes = []
    for index, name in enumerate(TRANSFORM_AXES):
        node = given.get(name)
        if node is None:
            axes.append(JointAxis(_kind(name), UNITS[index % 3], None, (polynomial(0.0),)))
        else:
            axes.append(_transform_axis(joint, node, coordinates, UNITS[index % 3]))
    for one, other in combinations([axis for axis in axes if not is_constant(axis.functions)], 2):
        same = one.kind == other.kind and one.coordinate != other.coordinate
        if same and np.linalg.norm(np.cross(one.direction, other.direction)) < _PARALLEL:
            joint.fail(
                f"found parallel {one.kind} axes of {one.coordinate} and {other.coordinate}; "
                "expected axes in different directions. Correct axis in its SpatialTransform"
            )
    return tuple(axes)


def _kind(name: str) -> Literal["rotation", "translation"]:
    return "rotation" if name.startswith("rotation") else "translation"


def _transform_axis(joint: Node, node: Node, coordinates: set[str], otherwise: Vector) -> JointAxis:
    names = node.word("coordinates").split()
    if len(names) > 1:
        node.fail(f"functions of several coordinates ({', '.join(names)}) are not supported")
    if names and names[0] not in coordinates:
        node.fail(f"coordinate {names[0]!r} is none of joint {joint.name!r} (it has {', '.join(sorted(coordinates))})")
    chain = _chain(node, bool(names))
    if not names and not is_constant(chain):
        node.fail("a function that is not constant, and no coordinate for it")
    x, y, z = _unit(node, otherwise)
    if is_constant(chain):
        return JointAxis(_kind(node.name), (x, y, z), names[0] if names else None, chain)
    return JointAxis(_kind(node.name), (x, y, z), names[0], chain)


def _chain(node: Node, has_coordinate: bool) -> Chain:
    function = function_of(node)
    if function is None:
        return () if has_coordinate else (polynomial(0.0),)
    if function.tag not in KNOWN:
        function.fail(f"this kind of function is not supported; expected one of {', '.join(KNOWN)}")
    return read_function(function)


def _unit(node: Node, otherwise: Vector) -> Vector:
    given = np.array(node.numbers("axis", 3, otherwise))
    length = float(np.linalg.norm(given))
    if length == 0.0:
        node.fail("axis 0 0 0 has no direction")
    x, y, z = given if length == 1.0 else given / length
    return float(x), float(y), float(z)


def read_coordinate(node: Node, fallback: str) -> Coordinate:
    """A coordinate of either version."""
    if node.flag("prescribed"):
        node.fail("a prescribed motion is not supported")
    if "/" in node.name:
        node.fail("a coordinate's name has no /, which parts it from its derivatives")
    limits = node.numbers("range", 2, (-np.inf, np.inf))
    if limits[0] >= limits[1]:
        node.need("range").fail(f"found {limits[0]:g} to {limits[1]:g}, expected an increasing pair")
    return Coordinate(
        name=node.name or fallback,
        value=node.number("default_value", 0.0),
        range=(limits[0], limits[1]) if node.find("range") is not None else None,
        clamped=node.flag("clamped", True),
        locked=node.flag("locked"),
    )
