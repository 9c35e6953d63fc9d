"""What one step of the filter gives, by name, and how sure it is."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin

from dynakin.arrays import Array, Codes
from dynakin.bindings import _core
from dynakin.errors import ModelError
from dynakin.model.spec import free_coordinates
from dynakin.results.measures.sources import ABSENT
from dynakin.settings.strict import nearest
from dynakin.units import COMPONENTS

Places = Mapping[str, int]

_WRENCH: Places = {name: k for k, name in enumerate(COMPONENTS)}


class Labelled(NDArrayOperatorsMixin):
    """An array whose first axis has names: `moments["knee_angle_r"]`, and else as the array itself. A view, made when
    it is asked for: nothing is copied.

    Args:
        values: (C, ...). places: name -> place on the first axis.
    """

    __slots__ = ("places", "values")

    def __init__(self, values: Array, places: Places) -> None:
        self.values, self.places = values, places

    def __getitem__(self, key: Any) -> Any:
        """One entry by its name; anything else as of the array.

        Raises:
            ModelError: a name that is not there.
        """
        if not isinstance(key, str):
            return self.values[key]
        if key not in self.places:
            names = list(self.places)
            raise ModelError(f"{key!r}: unknown{nearest(key, names)}; expected one of {', '.join(names)}")
        return self.values[self.places[key]]

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Array:
        """The array itself."""
        return np.array(self.values, dtype=dtype, copy=True) if copy else np.asarray(self.values, dtype=dtype)

    def __array_ufunc__(self, function: np.ufunc, method: str, *inputs: Any, **options: Any) -> Any:
        """Arithmetic is the array's, and gives plain arrays."""
        plain = [entry.values if isinstance(entry, Labelled) else entry for entry in inputs]
        return getattr(function, method)(*plain, **options)

    def __len__(self) -> int:
        """How many names there are."""
        return len(self.values)

    def __iter__(self) -> Iterator[Any]:
        """Over the values, as an array does."""
        return iter(self.values)

    def __repr__(self) -> str:
        """Names with their values."""
        return f"Labelled({', '.join(f'{name}: {self.values[k]}' for name, k in self.places.items())})"

    def as_dict(self) -> dict[str, Any]:
        """Name -> value."""
        return {name: self.values[k] for name, k in self.places.items()}


@dataclass(frozen=True, slots=True)
class Labels:
    """Places of a model's coordinates and markers in the arrays of a step."""

    coordinates: Places
    markers: Places

    @classmethod
    def of(cls, model: _core.Model) -> Labels:
        """Those of a compiled model; markers have the model's own names."""
        return cls(
            {name: k for k, name in enumerate(model.coordinate_names)},
            {marker.name: k for k, marker in enumerate(model.spec.markers)},
        )

    def on(self, name: str) -> Places:
        """The names along the first axis of one of a step's arrays."""
        return _WRENCH if name == "wrench" else self.markers if name == "markers" else self.coordinates


@dataclass(frozen=True, eq=False, slots=True)
class StepEstimate:
    """One frame's estimate: all coordinates of the model in order, and how well the sample was expected.

    Attributes:
        time_s: s.
        values: the arrays that the properties label, by the properties' names.
        labels: whose names they have.
        report: of the filter, on this step's sensors; None of a frame that was smoothed afterwards.
    """

    time_s: float
    values: Mapping[str, Any]
    labels: Labels
    report: _core.StepReport | None

    @property
    def coordinates(self) -> Labelled:
        """(C,) rad or m."""
        return Labelled(self.values["coordinates"], self.labels.coordinates)

    @property
    def speeds(self) -> Labelled:
        """(C,) rad/s or m/s."""
        return Labelled(self.values["speeds"], self.labels.coordinates)

    @property
    def accelerations(self) -> Labelled:
        """(C,) rad/s^2 or m/s^2."""
        return Labelled(self.values["accelerations"], self.labels.coordinates)

    @property
    def moments(self) -> Labelled:
        """(C,) N m or N; NaN where nobody knows them (`moment_sources`)."""
        return Labelled(self.values["moments"], self.labels.coordinates)

    @property
    def moment_sources(self) -> Labelled:
        """(C,) codes of where each moment comes from: 0 measured, 1 derived, 2 prior, 3 absent (the moment is NaN), as
        `results.measures.sources` has them."""
        return Labelled(self.values["moment_sources"], self.labels.coordinates)

    @property
    def wrench(self) -> Labelled:
        """(6,) N, N m: fx to mz about the model's ground origin."""
        return Labelled(self.values["wrench"], _WRENCH)

    @property
    def markers(self) -> Labelled:
        """(M, 3) m, ground frame."""
        return Labelled(self.values["markers"], self.labels.markers)


def step_estimate(
    model: _core.Model,
    labels: Labels,
    time_s: float,
    x: Array,
    report: _core.StepReport | None,
    sources: Codes,
    feet: _core.ContactLoads | None = None,
    *,
    by_plates: bool = False,
) -> StepEstimate:
    """Everything that a state x (n,) says of its frame; with one frame of feet the moments that these leave.

    Args:
        sources: (C,) codes of the moments; what is absent becomes NaN. by_plates: whether plates measure all of the
            feet, of which the last is the residual: their sum is the total wrench then.
    """
    q, qd, qdd = _core.coordinates(model, x)
    found = {} if feet is None else _core.contact_moments(model, x, feet)
    moments = found["moments"] if found else _core.joint_moments(model, x)
    values = {
        "coordinates": q,
        "speeds": qd,
        "accelerations": qdd,
        "moments": np.where(sources == ABSENT, np.nan, moments),
        "moment_sources": sources,
        "wrench": found["foot_wrench"][:-1].sum(axis=0) if by_plates else _core.wrench(model, x),
        "markers": _core.marker_positions(model, x),
    }
    return StepEstimate(time_s, values, labels, report)


def deviations_of(
    model: _core.Model, x: Array, covariance: Array, feet: _core.ContactLoads | None, plates_sd: Array | None
) -> dict[str, Array]:
    """Standard deviations of a state's outputs: J P J' for moments and wrench.

    Args:
        x: (n,). covariance: (n, n). feet: one frame, whose wrenches the moments come from; NaN where these are unknown.
            plates_sd: (6,) of their sum where plates measure all of it (`ContactLoads.plates_sd`).

    Returns:
        coordinates, speeds, accelerations, moments (C,), 0 where a coordinate is locked (not its moment); wrench (6,).
    """
    variance = np.diagonal(covariance)
    free = free_coordinates(model.spec)
    found: dict[str, Array] = {}
    for name in ("coordinates", "speeds", "accelerations"):
        offset, size = model.layout.blocks[name]
        found[name] = np.zeros(len(model.coordinate_names))
        found[name][free] = np.sqrt(variance[offset : offset + size])
    found["wrench"] = _propagated(_core.wrench_jacobian(model, x), covariance)
    if feet is None:
        found["moments"] = _propagated(_core.moment_jacobian(model, x), covariance)
    else:
        by_feet = _core.contact_moments(model, x, feet, 0, covariance)
        found["moments"] = by_feet["moments_sd"]
        if plates_sd is not None:
            found["wrench"] = np.fmin(plates_sd, by_feet["foot_wrench_sd"][:-1].sum(axis=0))
    return found


def _propagated(jacobian: Array, covariance: Array) -> Array:
    used = np.flatnonzero(jacobian.any(axis=0))
    part = jacobian[:, used]
    return np.asarray(np.sqrt(((part @ covariance[np.ix_(used, used)]) * part).sum(axis=1)))
