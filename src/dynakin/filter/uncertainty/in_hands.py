"""A load in the hands that the model does not have: what it does to moments."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from dynakin.bindings import _core
from dynakin.units import GRAVITY_M_S2

Array = npt.NDArray[np.float64]

HANDS = ("hand_r", "hand_l")
"""Segments that may hold something, by their names in `fullbody` and in OpenSim's models."""


class Hands:
    """Where a model, of this spec, can hold something: in the middle of each of its hands, as far as it has any."""

    def __init__(self, spec: _core.ModelSpec, model: _core.Model) -> None:
        names = [segment.name for segment in spec.segments]
        self._model = model
        self._at = [names.index(name) for name in HANDS if name in names]
        inertia = [np.asarray(spec.segments[k].inertia, dtype=float) for k in self._at]
        self._centres = [own[1:4] / own[0] if own[0] > 0.0 else np.zeros(3) for own in inertia]
        self._segments = len(names)

    def variances(self, x: Array, coordinates: int) -> Array:
        """(C,) of the moments of a state (n,) by 1 kg in the hands: by its weight, because who carries something moves
        it at much less than g. Each hand holds 1/sqrt(2) kg, by itself: L5/S1 then bears 1 kg as it does with all of it
        in both, and a shoulder more than half and less than all of it."""
        turns, places = _core.segment_poses(self._model, x)
        nothing = np.zeros((self._segments, 6))
        found = np.zeros(coordinates)
        for k, centre in zip(self._at, self._centres, strict=True):
            load, weight = nothing.copy(), np.array([0.0, -GRAVITY_M_S2, 0.0])
            load[k] = np.concatenate([weight, np.cross(places[k] + turns[k] @ centre, weight)])
            with_it, without = (_core.joint_moments(self._model, x, each) for each in (load, nothing))
            found += 0.5 * np.square((with_it - without)[:coordinates])
        return found
