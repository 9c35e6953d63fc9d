"""Inertia that a recording leaves open."""

from __future__ import annotations

import numpy as np

from dynakin.bindings import _core
from dynakin.filter.uncertainty.frames import Frame
from dynakin.filter.uncertainty.geometry import Geometry, Parts
from dynakin.model.calibration.calibrated import CalibratedModel


class Inertia:
    """Kind "inertia": by the declared noise."""

    def __init__(self, geometry: Geometry, calibrated: CalibratedModel) -> None:
        self._geometry = geometry
        self._at = [k for k, name in enumerate(calibrated.names) if name.startswith("inertia/")]

    def variances(self, frame: Frame) -> Parts:
        """Of moments, in one frame."""
        if not self._at:
            return {"inertia": self._geometry.of_moments(np.zeros(self._geometry.count))}
        sd, known = frame.known
        covariance = sd[self._at, None] * known[np.ix_(self._at, self._at)] * sd[self._at]
        T = _core.moment_jacobian(self._geometry.model, frame.x, frame.external)[: self._geometry.count, self._at]
        return {"inertia": self._geometry.of_moments(np.asarray(((T @ covariance) * T).sum(axis=1)))}
