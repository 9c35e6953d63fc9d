"""Writes a model as an .osim file of version 4 that OpenSim loads."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from xml.sax.saxutils import escape, quoteattr

import numpy as np

from dynakin.errors import OutputError
from dynakin.files import write_text
from dynakin.model.opensim.description import (
    GROUND,
    Body,
    Coordinate,
    Coupler,
    Joint,
    JointAxis,
    Marker,
    Offset,
    OpenSimModel,
)
from dynakin.model.opensim.functions import Chain, Function, is_constant
from dynakin.model.opensim.joints import UNITS

VERSION = 40000
Lines = list[str]


def write_osim(model: OpenSimModel, path: Path) -> None:
    """Write a model; reading the file again gives the same one.

    Raises:
        OutputError: the file cannot be written, or a function has no form in OpenSim (a chain that is not a
            polynomial of a function).
    """
    text = "\n".join(_indented(_document(model))) + "\n"
    write_text(path, text, OutputError)


def _document(model: OpenSimModel) -> Lines:
    inner = [
        '<Ground name="ground"/>',
        _element("gravity", _numbers(model.gravity)),
        "<length_units>meters</length_units>",
        "<force_units>N</force_units>",
        *_set("BodySet", (_body(body) for body in model.bodies)),
        *_set("JointSet", (_joint(joint) for joint in model.joints)),
        *_set("ConstraintSet", (_coupler(coupler) for coupler in model.couplers)),
        *_set("MarkerSet", (_marker(marker) for marker in model.markers)),
    ]
    body = _block(f"Model name={quoteattr(model.name)}", inner)
    return ['<?xml version="1.0" encoding="UTF-8"?>', *_block(f'OpenSimDocument Version="{VERSION}"', body)]


def _block(head: str, inner: Iterable[str]) -> Lines:
    return [f"<{head}>", *inner, f"</{head.split(' ', 1)[0]}>"]


def _element(tag: str, text: str) -> str:
    return f"<{tag}>{escape(text)}</{tag}>"


def _set(name: str, members: Iterable[Lines]) -> Lines:
    objects = _block("objects", [line for member in members for line in member])
    return _block(f'{name} name="{name.lower()}"', objects)


def _indented(lines: Lines) -> Lines:
    depth, result = 0, []
    for line in lines:
        closes = line.startswith("</")
        depth -= closes
        result.append("\t" * depth + line)
        opens = not closes and not line.endswith("/>") and not line.startswith("<?") and "</" not in line
        depth += opens
    return result


def _number(value: float) -> str:
    return repr(float(value))  # the shortest text that reads as the same number


def _numbers(values: Iterable[float]) -> str:
    return " ".join(_number(value) for value in values)


def _body(body: Body) -> Lines:
    inner = [
        _element("mass", _number(body.mass)),
        _element("mass_center", _numbers(body.centre)),
        _element("inertia", _numbers(body.inertia)),
    ]
    return _block(f"Body name={quoteattr(body.name)}", inner)


def _path(body: str) -> str:
    return f"/{GROUND}" if body == GROUND else f"/bodyset/{body}"


def _frame(name: str, body: str, offset: Offset) -> Lines:
    inner = [
        _element("socket_parent", _path(body)),
        _element("translation", _numbers(offset.translation)),
        _element("orientation", _numbers(offset.orientation)),
    ]
    return _block(f"PhysicalOffsetFrame name={quoteattr(name)}", inner)


def _joint(joint: Joint) -> Lines:
    parent, child = f"{joint.parent}_offset", f"{joint.child}_offset"
    inner = [
        _element("socket_parent_frame", parent),
        _element("socket_child_frame", child),
        *_block("coordinates", [line for c in joint.coordinates for line in _coordinate(c)]),
        *_block(
            "frames",
            [*_frame(parent, joint.parent, joint.parent_offset), *_frame(child, joint.child, joint.child_offset)],
        ),
    ]
    if joint.kind == "CustomJoint":
        inner += _transform(joint)
    return _block(f"{joint.kind} name={quoteattr(joint.name)}", inner)


def _coordinate(c: Coordinate) -> Lines:
    inner = [_element("default_value", _number(c.value))]
    if c.range is not None:
        inner.append(_element("range", _numbers(c.range)))
    clamped = c.clamped and c.range is not None
    inner += [_element("clamped", str(clamped).lower()), _element("locked", str(c.locked).lower())]
    return _block(f"Coordinate name={quoteattr(c.name)}", inner)


def _transform(joint: Joint) -> Lines:
    """Six axes, filled up with constant ones where the joint has less."""
    lines: Lines = []
    for kind in ("rotation", "translation"):
        axes = [axis for axis in joint.axes if axis.kind == kind]
        for k in range(3):
            if k < len(axes):
                axis = axes[k]
            else:
                axis = JointAxis(kind, _across(axes, k), None, (Function("polynomial", (0.0,)),))
                axes.append(axis)
            lines += _transform_axis(f"{kind}{k + 1}", axis)
    return _block("SpatialTransform", lines)


def _across(axes: list[JointAxis], k: int) -> tuple[float, float, float]:
    """A direction for an axis that does nothing, as far from those before it as there is."""
    if not axes:
        return UNITS[k]
    given = np.array([axis.direction for axis in axes])
    x, y, z = np.linalg.svd(given)[2][-1] if len(axes) < 3 else UNITS[k]
    return float(x), float(y), float(z)


def _transform_axis(name: str, axis: JointAxis) -> Lines:
    coordinate = "" if axis.coordinate is None else axis.coordinate
    inner = [_element("coordinates", coordinate), _element("axis", _numbers(axis.direction))]
    return _block(f'TransformAxis name="{name}"', [*inner, *_function(axis.functions, name)])


def _function(chain: Chain, where: str) -> Lines:
    """One of OpenSim's functions: a function, or a multiple of one."""
    if not chain:
        return _block('LinearFunction name="function"', [_element("coefficients", "1.0 0.0")])
    if is_constant(chain):
        return _block('Constant name="function"', [_element("value", _number(chain[-1].coefficients[0]))])
    first, *others = chain
    factor = others[0].coefficients if others and others[0].kind == "polynomial" else ()
    if len(others) > 1 or (others and (len(factor) != 2 or factor[0] != 0.0)):
        raise OutputError(f"{where}: a chain of {len(chain)} functions has no form in OpenSim")
    if not others:
        return _plain(first)
    inner = [*_block("function", _plain(first)), _element("scale", _number(factor[1]))]
    return _block('MultiplierFunction name="function"', inner)


def _plain(f: Function) -> Lines:
    if f.kind == "polynomial":
        tag = "LinearFunction" if len(f.coefficients) == 2 else "PolynomialFunction"
        return _block(f'{tag} name="function"', [_element("coefficients", _numbers(reversed(f.coefficients)))])
    tag = "SimmSpline" if f.kind == "spline" else "PiecewiseLinearFunction"
    return _block(f'{tag} name="function"', [_element("x", _numbers(f.x)), _element("y", _numbers(f.y))])


def _coupler(coupler: Coupler) -> Lines:
    inner = [
        _element("isEnforced", "true"),
        *_block("coupled_coordinates_function", _function(coupler.functions, coupler.name)),
        _element("independent_coordinate_names", coupler.independent),
        _element("dependent_coordinate_name", coupler.dependent),
        _element("scale_factor", "1.0"),
    ]
    return _block(f"CoordinateCouplerConstraint name={quoteattr(coupler.name)}", inner)


def _marker(marker: Marker) -> Lines:
    inner = [
        _element("socket_parent_frame", _path(marker.body)),
        _element("location", _numbers(marker.location)),
        _element("fixed", str(marker.fixed).lower()),
    ]
    return _block(f"Marker name={quoteattr(marker.name)}", inner)
