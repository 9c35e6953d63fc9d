"""The estimated constants of a model, with where they started and how sure the filter is."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from dynakin.model import InitialModel
from dynakin.results import Parameter
from dynakin.results.records import ParameterKind

Array = npt.NDArray[np.float64]

_KINDS: dict[str, ParameterKind] = {"length": "length", "marker": "marker", "inertia": "inertia", "plates": "plates"}
_INERTIA_UNITS = {"mass": "kg", "mx": "kg m", "my": "kg m", "mz": "kg m"}
_PLATE_UNITS = {"delay": "s", "fx": "N", "fy": "N", "fz": "N"}


def parameters_of(initial: InitialModel, state: Array, sd: Array, prior_sd: Array) -> list[Parameter]:
    """Every length, marker place and inertial parameter in the state, and the lengths that were held fixed.

    Args:
        state, sd: (n,) the last frame's. prior_sd: (n,) before the first.
    """
    segments = {marker.name: marker.segment for marker in initial.spec.markers}
    found = []
    for k, name in enumerate(initial.names):
        first, *rest = name.split("/")
        if first not in _KINDS or not rest:
            continue  # a coordinate, speed or acceleration
        kind = _KINDS[first]
        found.append(
            Parameter(
                name=name,
                kind=kind,
                segment=segments[rest[0]] if kind == "marker" else "plates" if kind == "plates" else rest[0],
                unit="1" if rest[0] in initial.dimensionless else _unit(kind, rest[-1]),
                value=float(state[k]),
                sd=float(sd[k]),
                initial=float(initial.x0[k]),
                table=_finite(initial.table[k]),
                lower=_finite(initial.lower[k]),
                upper=_finite(initial.upper[k]),
                at_bound=bool(state[k] <= initial.lower[k] or state[k] >= initial.upper[k]),
                estimated=True,
                prior_sd=float(prior_sd[k]),
            )
        )
    for length in initial.spec.parameters:
        if not length.estimated:
            value = float(length.value)
            name = f"length/{length.name}"
            unit = "1" if length.name in initial.dimensionless else "m"
            found.append(
                Parameter(name, "length", length.name, unit, value, 0.0, value, None, None, None, False, False)
            )
    return found


def _unit(kind: ParameterKind, last: str) -> str:
    if kind == "inertia":
        return _INERTIA_UNITS.get(last, "kg m2")
    return _PLATE_UNITS.get(last, "N m") if kind == "plates" else "m"


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
