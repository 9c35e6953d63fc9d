"""Random motions of an OpenSim model, of its free coordinates and of all, and sums over the coupled ones."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from dynakin.bindings import _core
from dynakin.model.opensim.description import Coupler, OpenSimModel
from dynakin.model.opensim.spec import independent_coordinates
from support.oracle.functions import axis_function
from support.oracle.spec import Axis, Function

Motion = tuple[dict[str, float], dict[str, float], dict[str, float]]


def random_motion(source: OpenSimModel, rng: Generator) -> Motion:
    """Values within the ranges (and +-1), speeds and accelerations of the free coordinates."""
    free = independent_coordinates(source)
    q = {c.name: rng.uniform(max(c.limits[0], -1.0), min(c.limits[1], 1.0)) for c in free}
    return q, {name: 2.0 * rng.normal() for name in q}, {name: 10.0 * rng.normal() for name in q}


def as_state(model: _core.Model, motion: Motion) -> NDArray:
    """The core's state."""
    x, n = model.initial_state(), len(model.coordinate_names)
    for block, values in enumerate(motion):
        x[block * n : (block + 1) * n] = [values[name] for name in model.coordinate_names]
    return x


def _coupled_value(coupler: Coupler, q: float) -> tuple[float, float, float]:
    functions = [Function(f.kind, list(f.coefficients), list(f.x), list(f.y)) for f in coupler.functions]
    axis = Axis("", "rotation", np.zeros(3), functions=functions)
    value, first, second = axis_function(axis, np.array(q), 1.0)
    return float(value), float(first), float(second)


def coupled(source: OpenSimModel, motion: Motion) -> Motion:
    """Values of all coordinates; couplers of couplers are not needed here."""
    q, qd, qdd = (dict(values) for values in motion)
    for coupler in source.couplers:
        by, name = coupler.independent, coupler.dependent
        q[name], first, second = _coupled_value(coupler, q[by])
        qd[name] = first * qd[by]
        qdd[name] = first * qdd[by] + second * qd[by] ** 2
    return q, qd, qdd


def summed(source: OpenSimModel, q: dict[str, float], forces: dict[str, float]) -> dict[str, float]:
    """Forces along the free coordinates: theirs, and what the coupled ones say times their slopes."""
    total = dict(forces)
    for coupler in source.couplers:
        total[coupler.independent] += _coupled_value(coupler, q[coupler.independent])[1] * total.pop(coupler.dependent)
    return total
