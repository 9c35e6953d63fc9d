"""From the oracle's plain data to the core's classes."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from dynakin.bindings import _core
from support.oracle.spec import Axis, Spec


def to_core(spec: Spec) -> _core.ModelSpec:
    """The same specification in the core's classes."""
    segments = []
    for s in spec.segments:
        lengths = [_core.LengthTerm(t.parameter, t.direction) for t in s.lengths]
        axes = [
            _core.AxisSpec(a.coordinate, a.kind, a.direction, a.coefficients, a.scale, functions_of(a)) for a in s.axes
        ]
        segments.append(
            _core.SegmentSpec(
                name=s.name,
                parent=s.parent,
                rotation=s.rotation,
                translation=s.translation,
                lengths=lengths,
                axes=axes,
                inertia=s.inertia,
                inertia_estimated=s.inertia_estimated,
            )
        )
    return _core.ModelSpec(
        name=spec.name,
        coordinates=[_core.CoordinateSpec(c.name, c.value, c.locked) for c in spec.coordinates],
        parameters=[_core.ParameterSpec(p.name, p.value, p.estimated) for p in spec.parameters],
        segments=segments,
        markers=[
            _core.MarkerSpec(m.name, m.segment, m.position, m.measured, m.estimated, m.soft_tissue)
            for m in spec.markers
        ],
        gravity=spec.gravity,
        wrench_measured=spec.wrench_measured,
        wrench_offset=spec.wrench_offset,
        wrench_delay=spec.wrench_delay,
        contacts=spec.contacts,
        wrench_offset_point=spec.wrench_offset_point,
    )


def functions_of(axis: Axis) -> list[_core.FunctionSpec]:
    return [_core.FunctionSpec(f.kind, f.coefficients, f.x, f.y) for f in axis.functions]


def model_of(spec: Spec) -> _core.Model:
    return _core.Model(to_core(spec))


def filter_of(spec: Spec, settings: dict[str, Any], x0: NDArray, P0: NDArray) -> _core.Filter:
    """A core filter; ``settings`` are those of ``random_models.settings``."""
    return _core.Filter(model_of(spec), _core.FilterSettings(**settings), np.array(x0), np.array(P0))


def close(actual: NDArray, expected: NDArray, relative: float) -> None:
    """Equal to ``relative`` times the largest of the expected numbers (at least 1)."""
    scale = max(1.0, np.abs(expected).max(initial=0.0))
    np.testing.assert_allclose(actual, expected, rtol=0, atol=relative * scale)
