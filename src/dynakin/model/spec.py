"""The one place where a plan becomes specification classes of the compiled core; which of its coordinates are free."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from dynakin.arrays import Array
from dynakin.bindings import _core
from dynakin.model.plan import ModelPlan
from dynakin.model.schema import Segment


def to_core(plan: ModelPlan) -> _core.ModelSpec:
    """The core's specification of a measured model."""
    model, geometry = plan.model, plan.geometry
    coordinates = [
        _core.CoordinateSpec(name=c.name, value=plan.start[c.name], locked=c.name in geometry.locked)
        for c in model.coordinates
    ]
    parameters = [
        _core.ParameterSpec(
            name=entry.name,
            value=geometry.lengths[entry.name],
            estimated=entry.name not in plan.fixed_lengths,
        )
        for entry in model.lengths
    ]
    segments = [
        _core.SegmentSpec(
            name=s.name,
            parent=s.parent,
            rotation=np.array(s.rotation),
            translation=np.array(s.translation),
            lengths=[
                _core.LengthTerm(parameter=term.length, direction=direction)
                for term, direction in zip(s.placement, geometry.directions[s.name], strict=True)
            ],
            axes=axes_to_core(s),
            inertia=plan.inertia[s.name].vector,
            inertia_estimated=list(plan.estimated_inertia(s.name)),
        )
        for s in model.segments
    ]
    axes = list(plan.estimated_axes())
    markers = [
        _core.MarkerSpec(name=site.name, segment=site.segment, position=site.position, measured=axes, estimated=axes)
        for site in plan.sites
    ]
    planar = [True, True, False, False, False, True]
    return _core.ModelSpec(
        name=model.name,
        coordinates=coordinates,
        parameters=parameters,
        segments=segments,
        markers=markers,
        gravity=np.array(model.gravity),
        wrench_measured=planar if model.planar else [True] * 6,
    )


def axes_to_core(segment: Segment) -> list[_core.AxisSpec]:
    """Of the joint by which a segment hangs."""
    return [
        _core.AxisSpec(
            coordinate=axis.coordinate,
            kind=axis.kind,
            direction=np.array(axis.direction) / np.linalg.norm(axis.direction),
            coefficients=list(axis.coefficients),
            scale=axis.scale,
        )
        for axis in segment.axes
    ]


def free_coordinates(spec: _core.ModelSpec) -> list[int]:
    """(K,) numbers of the coordinates that are not locked, in the order in which a state begins with them."""
    return [k for k, coordinate in enumerate(spec.coordinates) if not coordinate.locked]


def free_names(spec: _core.ModelSpec) -> list[str]:
    """(K,) names of the coordinates that are not locked, in the same order."""
    return [coordinate.name for coordinate in spec.coordinates if not coordinate.locked]


def in_layout(names: list[str], values: Mapping[str, float], otherwise: float) -> Array:
    """A vector (n,) in the core's order from values by name; ``otherwise`` where a name has none."""
    return np.array([values.get(name, otherwise) for name in names])
