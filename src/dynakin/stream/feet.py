"""Which foot each plate carries at this moment, so that joint moments of a floating model know the ground's push."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from dynakin import _core
from dynakin.filter import FootWrenches, Noise, StepEstimate
from dynakin.filter.foot_wrenches import IN_THE_AIR, MEASURED, NOT_MEASURED
from dynakin.model import InitialModel
from dynakin.stream.picture import arrow

Array = npt.NDArray[np.float64]

_REACH_M = 0.25  # a centre of pressure that is farther from both feet is nobody's
_RAISED_M = 0.05  # a foot whose lowest marker is this much above its place while standing is in the air


class LiveFeet:
    """Gives each plate to the foot nearest to its centre of pressure, frame by frame; offline (`foot_loads`) whole
    stances are seen, which tells more where feet are close together.

    Args:
        assigned: plate -> "right" or "left", where it is known.
    """

    def __init__(
        self, initial: InitialModel, noise: Noise, plates: tuple[str, ...], assigned: Mapping[str, str]
    ) -> None:
        self.initial, self.plates, self.assigned = initial, plates, dict(assigned)
        self.feet = tuple(initial.feet)
        self._own = [
            [k for k, marker in enumerate(initial.spec.markers) if marker.segment == initial.feet[foot]]
            for foot in self.feet
        ]
        self._floor = [np.inf] * len(self.feet)
        self._sd = (np.sqrt(noise.force / 2.0), np.sqrt(noise.moment / 2.0))

    def moments(self, model: _core.Model, state: Array, estimate: StepEstimate, wrenches: Array | None) -> StepEstimate:
        """The estimate with moments that the feet's wrenches leave, as `Estimator.run` has them; NaN where the push on
        a foot is not known.

        Args:
            wrenches: (P, 6) N and N m, laboratory frame, or None.
        """
        count = len(self.feet)
        wrench, contact = np.zeros((1, count, 6)), np.full((1, count), IN_THE_AIR, dtype=np.uint8)
        points = np.zeros((1, count, 3))
        for f, own in enumerate(self._own):
            height = float(estimate.markers[own, 1].min()) if own else 0.0
            self._floor[f] = min(self._floor[f], height)
            if height < self._floor[f] + _RAISED_M:
                contact[0, f] = NOT_MEASURED
        if wrenches is not None:
            for name, load in zip(self.plates, self.initial.ground.wrench_to_ground(wrenches), strict=True):
                found = arrow(load)
                foot = self._foot(name, found[:3], estimate.markers)
                if foot is not None:
                    wrench[0, foot] += load
                    points[0, foot] = found[:3]
                    contact[0, foot] = MEASURED
        segments = [self.initial.feet[foot] for foot in self.feet]
        loads = FootWrenches.of(self.feet, segments, wrench, contact, *self._sd, points).core()
        return replace(estimate, moments=_core.contact_moments(model, state, loads)["moments"])

    def _foot(self, plate: str, point: Array, markers: Array) -> int | None:
        if not np.isfinite(point).all():
            return None
        if plate in self.assigned:
            return self.feet.index(self.assigned[plate])
        away = [
            float(np.linalg.norm((markers[own] - point)[:, [0, 2]].mean(axis=0))) if own else np.inf
            for own in self._own
        ]
        nearest = int(np.argmin(away))
        return nearest if away[nearest] < _REACH_M else None
