"""Inverse kinematics as it is commonly run: each frame by itself, least squares of all markers with equal weights.

The problem is that of OpenSim's tool (Delp et al. 2007, IEEE Trans Biomed Eng 54:1940-1950; Lu and O'Connor 1999,
J Biomech 32:129-134): markers fixed in rigid segments, joints within their ranges, no time. The core's least squares
solves it, from the frame before.
"""

from __future__ import annotations

import numpy as np

from dynakin.arrays import Array
from dynakin.bindings import _core
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.model.calibration.pose_start import bare
from dynakin.model.spec import free_coordinates

FEWEST_MARKERS = 3
_HOLD_M = 1e-4
"""m a radian: what no marker shows stays as it was the frame before; of what one shows it takes a millionth."""


def fixed_model(calibrated: CalibratedModel) -> _core.Model:
    """The calibrated person as a rigid model: lengths, marker places and inertia as they are at the start."""
    return _core.Model(bare(_core.Model(calibrated.spec).spec))  # of a copy


def inverse_kinematics(calibrated: CalibratedModel, markers: Array) -> Array:
    """Free coordinates (T, F) rad or m that bring the model's markers nearest to the measured ones, frame by frame.

    Args:
        calibrated: floating or not; its bounds are the joints' ranges.
        markers: (T, M, 3) m, ground frame, in the order of the model's markers; NaN: not seen.

    Returns:
        In the order of `free_coordinates`; NaN where fewer than three markers are seen.
    """
    fit = _FrameFit(calibrated)
    found = np.full((len(markers), len(fit.start)), np.nan)
    q = fit.start
    for k, measured in enumerate(markers):
        if np.count_nonzero(np.isfinite(measured).all(axis=1)) >= FEWEST_MARKERS:
            q = found[k] = fit.solve(q, measured)
    return found


class _FrameFit:
    """Least squares of one frame's markers, within the joints' ranges."""

    def __init__(self, calibrated: CalibratedModel) -> None:
        self.model = fixed_model(calibrated)
        coordinates = [self.model.spec.coordinates[k] for k in free_coordinates(self.model.spec)]
        at = [calibrated.names.index(coordinate.name) for coordinate in coordinates]
        self.lower, self.upper, self.start = calibrated.lower[at], calibrated.upper[at], calibrated.x0[at]
        turns = {a.coordinate for s in self.model.spec.segments for a in s.axes if a.kind == "rotation"}
        self.hold = np.array([_HOLD_M if coordinate.name in turns else 0.0 for coordinate in coordinates])
        self.scale = np.ones(len(at))
        self.state = np.zeros(self.model.layout.size)

    def solve(self, before: Array, measured: Array) -> Array:
        """Coordinates (F,) of one frame (M, 3), from those of the frame before."""
        self.state[: len(before)] = before
        seen = np.isfinite(measured).all(axis=1, keepdims=True)
        q, _, _ = _core.fit_posture(
            self.model, self.state, np.where(seen, measured, np.nan), self.lower, self.upper, self.scale, self.hold,
            before,
        )  # fmt: skip
        return np.asarray(q)
