"""Loads that are not as the model has them: by a clock of the plates that is off, and in the hands."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from dynakin.arrays import Array
from dynakin.bindings import _core
from dynakin.filter.uncertainty.frames import Frame, rates
from dynakin.filter.uncertainty.geometry import Geometry, Parts
from dynakin.recordings.feet.contact import UNMEASURED
from dynakin.results.estimate import values_of
from dynakin.results.measures.sources import MEASURED, wrench_sources
from dynakin.units import GRAVITY_M_S2

if TYPE_CHECKING:
    import xarray as xr


HANDS = ("hand_r", "hand_l")
"""Segments that may hold something, by their names in `fullbody` and in OpenSim's models."""


class Clock:
    """Kind "clock": loads that act a second later than they did."""

    def __init__(self, geometry: Geometry) -> None:
        self._geometry = geometry

    def variances(self, frame: Frame) -> Parts:
        """Of moments, in one frame."""
        moments = self._geometry.moments_by(frame.x, frame.external_rate)
        return {"clock": self._geometry.of_moments(np.square(moments))}


class PlateNoise:
    """Kind "plates": white noise of the plates beyond the usual, which the feet's wrenches follow."""

    def __init__(self, geometry: Geometry) -> None:
        self._geometry = geometry

    def variances(self, frame: Frame) -> Parts:
        """Of moments, in one frame."""
        return {"plates": self._geometry.of_moments(self._of_moments(frame))}

    def _of_moments(self, frame: Frame) -> Array:
        if frame.noise is None or not frame.noise.any():
            return np.zeros(self._geometry.count)
        units = np.eye(len(frame.noise)).reshape(len(frame.noise), -1, 6)
        segments = frame.segments[: units.shape[1]]
        by_each = [self._geometry.moments_by(frame.x, self._geometry.external(unit, segments)) for unit in units]
        J = np.array(by_each)
        return np.asarray(np.maximum((J * (frame.noise @ J)).sum(axis=0), 0.0))


class Hands:
    """Kind "hands": 1 kg in the middle of both together, as far as the model has any."""

    def __init__(self, geometry: Geometry) -> None:
        self._geometry, spec = geometry, geometry.model.spec
        names = [segment.name for segment in spec.segments]
        self._at = [names.index(name) for name in HANDS if name in names]
        inertia = [np.asarray(spec.segments[k].inertia, dtype=float) for k in self._at]
        self._centres = [own[1:4] / own[0] if own[0] > 0.0 else np.zeros(3) for own in inertia]

    def variances(self, frame: Frame) -> Parts:
        """Of moments, in one frame, by its weight, because who carries something moves it at much less than g. Each
        hand holds 1/sqrt(2) kg, by itself: L5/S1 then bears 1 kg as it does with all of it in both, and a shoulder more
        than half and less than all of it."""
        turns, places = _core.segment_poses(self._geometry.model, frame.x)
        found = np.zeros(self._geometry.count)
        for k, centre in zip(self._at, self._centres, strict=True):
            load, weight = np.zeros_like(frame.external), np.array([0.0, -GRAVITY_M_S2, 0.0])
            load[k] = np.concatenate([weight, np.cross(places[k] + turns[k] @ centre, weight)])
            found += 0.5 * np.square(self._geometry.moments_by(frame.x, load))
        return {"hands": self._geometry.of_moments(found)}


def late_by(data: xr.Dataset, clock_sd_s: float) -> dict[str, Any]:
    """Deviations of the contacts' wrenches, and of their sum where that is measured, with a clock of the plates that is
    off by so much: what acts later is off by that times its change, as in moments. No plate's clock is in what none
    measures."""
    time = np.asarray(data["time"].values)
    found: dict[str, Any] = {}
    if "foot_wrench_sd" in data:
        unmeasured = (values_of(data, "foot_contact") == UNMEASURED)[..., None]
        late = clock_sd_s * rates(np.where(unmeasured, np.nan, values_of(data, "foot_wrench")), time)
        found["foot_wrench_sd"] = (("time", "foot", "component"), np.hypot(values_of(data, "foot_wrench_sd"), late))
    if "wrench_sd" in data:
        late = clock_sd_s * rates(values_of(data, "wrench_estimated"), time)
        late = np.where(wrench_sources(data) == MEASURED, late, 0.0)
        found["wrench_sd"] = (("time", "component"), np.hypot(values_of(data, "wrench_sd"), late))
    return found
