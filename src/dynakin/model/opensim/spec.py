"""From an OpenSim model to the core's specification; the coordinates that couplers drive, which are no states; and
those of which OpenSim says *Coupled*, which is something else."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np

from dynakin.bindings import _core
from dynakin.model.calibration.calibrated import Coupled
from dynakin.model.opensim.chains import ChainAxis, Placed, place, resolved
from dynakin.model.opensim.description import (
    GROUND,
    ZERO,
    Body,
    Coordinate,
    Joint,
    JointAxis,
    Marker,
    Offset,
    OpenSimModel,
)
from dynakin.model.opensim.functions import is_as_steep
from dynakin.model.opensim.joints import X
from dynakin.model.schema import kinds_of

AXES = [True, True, True]


def independent_coordinates(model: OpenSimModel) -> list[Coordinate]:
    """Coordinates that no coupler drives, in the order of the joints."""
    driven = {coupler.dependent for coupler in model.couplers}
    return [c for joint in model.joints for c in joint.coordinates if c.name not in driven]


def placements(model: OpenSimModel, scales: Mapping[str, str]) -> dict[str, Placed]:
    """How each body is placed, by its name, in the order of the joints."""
    couplers = {coupler.dependent: coupler for coupler in model.couplers}
    return {joint.child: place(joint, couplers, scales) for joint in model.joints}


def unseen(model: OpenSimModel, bodies: Collection[str]) -> list[str]:
    """Independent coordinates that move none of these bodies and are not locked by the file."""
    placed = placements(model, {})
    seen = {axis.coordinate for body in model.tree.up(*bodies) for axis in placed[body].axes}
    return [c.name for c in independent_coordinates(model) if c.name not in seen and not c.locked]


def moved_by(model: OpenSimModel, coordinates: Collection[str]) -> set[str]:
    """Bodies that one of these coordinates moves."""
    placed = placements(model, {})
    own = [body for body, on in placed.items() if any(axis.coordinate in coordinates for axis in on.axes)]
    return {*own, *model.tree.below(*own)}


def used_scales(placed: Mapping[str, Placed]) -> list[str]:
    """Scale parameters that place something, in the order of the tree."""
    names: dict[str, None] = {}
    for segment in placed.values():
        names |= {name: None for name, _ in segment.terms}
        names |= {axis.scale: None for axis in segment.axes if axis.scale}
    return list(names)


def to_spec(
    model: OpenSimModel,
    scales: Mapping[str, str],
    *,
    markers: Sequence[Marker] | None = None,
    estimate_inertia: Collection[str] = (),
    estimate_places: bool = True,
    values: Mapping[str, float] | None = None,
    lock: Collection[str] = (),
) -> _core.ModelSpec:
    """The core's specification.

    Args:
        scales: scale parameter of each body that has one, as `scale_names` gives them.
        markers: those that are measured; all of the model's that sit on bodies where not given.
        estimate_inertia: bodies whose ten numbers are estimated. estimate_places: whether the markers' places are.
        values: coordinates at the start, by name; the file's defaults where not given.
        lock: coordinates that are locked in addition to those of the file.
    """
    placed, tree = placements(model, scales), model.tree
    start = dict(values or {})
    moving = {axis.coordinate for segment in placed.values() for axis in segment.axes}
    sites = [m for m in model.markers if m.body != GROUND] if markers is None else markers
    return _core.ModelSpec(
        name=model.name,
        coordinates=[
            _core.CoordinateSpec(c.name, start.get(c.name, c.value), c.locked or c.name in lock)
            for c in independent_coordinates(model)
            if c.name in moving
        ],
        parameters=[_core.ParameterSpec(name, 1.0, True) for name in used_scales(placed)],
        segments=[
            _core.SegmentSpec(
                name=name,
                parent=tree.parents[name],
                rotation=segment.rotation,
                translation=segment.translation,
                lengths=[_core.LengthTerm(parameter, direction) for parameter, direction in segment.terms],
                axes=[_axis(axis) for axis in segment.axes],
                inertia=model.body(name).rigid.vector,
                inertia_estimated=[name in estimate_inertia] * 10,
            )
            for name, segment in placed.items()
        ],
        markers=[_core.MarkerSpec(m.name, m.body, np.array(m.location), AXES, [estimate_places] * 3) for m in sites],
        gravity=np.array(model.gravity),
    )


def _axis(axis: ChainAxis) -> _core.AxisSpec:
    functions = [_core.FunctionSpec(f.kind, f.coefficients, f.x, f.y) for f in axis.functions]
    return _core.AxisSpec(axis.coordinate, axis.kind, axis.direction, list(axis.coefficients), axis.scale, functions)


def in_radians(source: OpenSimModel) -> frozenset[str]:
    """Rotations that are radians in any table that OpenSim reads or writes, whatever its header says of degrees
    (motion type *Coupled*): those that turn nothing by themselves, but by a function of another slope than 1 or -1."""
    axes = [axis for joint in source.joints for axis in joint.axes if axis.kind == "rotation"]
    plain = {axis.coordinate for axis in axes if is_as_steep(axis.functions)}
    return frozenset(axis.coordinate for axis in axes if axis.coordinate is not None) - plain


def coupled_of(source: OpenSimModel) -> Coupled | None:
    """The coupled coordinates of a model: each as the place of a slider, so that the core's own functions give them."""
    couplers = {coupler.dependent: coupler for coupler in source.couplers}
    if not couplers:
        return None
    hosts = {name: resolved(name, couplers)[0] for name in couplers}
    names = [*dict.fromkeys(hosts.values()), *couplers]
    sliders = tuple(
        Joint(name, "SliderJoint", GROUND, Offset(), name, Offset(), (Coordinate(name),), (_along(name),))
        for name in names
    )
    bodies = tuple(Body(name, 1.0, ZERO, (1.0, 1.0, 1.0, 0.0, 0.0, 0.0)) for name in names)
    spec = to_spec(replace(source, bodies=bodies, joints=sliders, markers=()), {}, markers=[])
    kinds = kinds_of(source.joints)
    return Coupled(spec, {name: (kinds[name], host) for name, host in hosts.items()})


def _along(name: str) -> JointAxis:
    return JointAxis("translation", X, name)
