"""A measured model whose constants are no longer estimated: lengths and inertia fixed at given values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from dynakin.bindings import _core
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.model.inertia import INERTIA_NAMES
from dynakin.results.estimate import Estimate


def final_values(estimate: Estimate) -> dict[str, float]:
    """Every estimated length, marker place and inertial parameter at the last frame, by its name in the state."""
    return {p.name: p.value for p in estimate.parameters if p.estimated}


def initial_values(initial: CalibratedModel) -> dict[str, float]:
    """The same where a filter starts: lengths and places as measured while standing, inertia by the table."""
    kinds = ("length/", "marker/", "inertia/")
    return {name: float(x) for name, x in zip(initial.names, initial.x0, strict=True) if name.startswith(kinds)}


def freeze(initial: CalibratedModel, values: Mapping[str, float], start: Mapping[str, float]) -> CalibratedModel:
    """The same model with lengths and inertia fixed.

    Marker places begin at ``values`` and stay in the state: their process noise is how the filter follows the skin,
    which no calibration predicts. Everything else keeps its prior, noise and bounds.

    Args:
        values: lengths (m), marker places (m) and inertia (SI), by their names in the state; what is not there stays
            as in ``initial``.
        start: coordinates to begin with, rad or m.
    """
    spec = initial.spec
    parameters = [
        _core.ParameterSpec(entry.name, values.get(f"length/{entry.name}", entry.value), False)
        for entry in spec.parameters
    ]
    segments = [_fixed_inertia(segment, values) for segment in spec.segments]
    coordinates = [
        _core.CoordinateSpec(c.name, c.value if c.locked else start.get(c.name, c.value), c.locked)
        for c in spec.coordinates
    ]
    frozen = _core.ModelSpec(
        spec.name, coordinates, parameters, segments, spec.markers, spec.gravity, spec.wrench_measured
    )
    names = tuple(_core.Model(frozen).layout.names)
    kept = np.array([initial.names.index(name) for name in names])
    lower, upper = initial.lower[kept], initial.upper[kept]
    x0 = np.array(
        [values.get(name, start.get(name, x)) for name, x in zip(names, initial.x0[kept], strict=True)], dtype=float
    )
    return replace(
        initial,
        spec=frozen,
        names=names,
        x0=np.clip(x0, lower, upper),
        sd0=initial.sd0[kept],
        lower=lower,
        upper=upper,
        table=initial.table[kept],
    )


def _fixed_inertia(segment: _core.SegmentSpec, values: Mapping[str, float]) -> _core.SegmentSpec:
    inertia = [
        values.get(f"inertia/{segment.name}/{name}", float(number))
        for name, number in zip(INERTIA_NAMES, segment.inertia, strict=True)
    ]
    return _core.SegmentSpec(
        segment.name,
        segment.parent,
        segment.rotation,
        segment.translation,
        segment.lengths,
        segment.axes,
        np.array(inertia),
        [False] * len(INERTIA_NAMES),
    )
