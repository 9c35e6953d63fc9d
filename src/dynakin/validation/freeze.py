"""A measured model whose constants are no longer estimated: lengths and inertia fixed at given values."""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from dataclasses import replace

import numpy as np

from dynakin.bindings import _core
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.model.inertia import INERTIA_NAMES, inertia_from
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
    frozen = copy(initial.spec)
    coordinates, parameters, segments = frozen.coordinates, frozen.parameters, frozen.segments
    for coordinate in coordinates:
        if not coordinate.locked:
            coordinate.value = start.get(coordinate.name, coordinate.value)
    for parameter in parameters:
        parameter.value, parameter.estimated = values.get(f"length/{parameter.name}", parameter.value), False
    for segment in segments:
        segment.inertia = inertia_from(values, segment.name, segment.inertia)
        segment.inertia_estimated = [False] * len(INERTIA_NAMES)
    frozen.coordinates, frozen.parameters, frozen.segments = coordinates, parameters, segments
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
