"""Joints whose centres and axes lie elsewhere: what that does to what is estimated."""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy

import numpy as np

from dynakin.arrays import Array
from dynakin.bindings import _core
from dynakin.filter.uncertainty.frames import Frame, differences
from dynakin.filter.uncertainty.geometry import Geometry, Parts
from dynakin.filter.uncertainty.joint_errors import BALLS
from dynakin.filter.uncertainty.sizes import OF_JOINTS, hips_unshown, less_sure
from dynakin.filter.uncertainty.upright import Turned, rolling_more, rolls
from dynakin.model.calibration.calibrated import CalibratedModel


class Joints:
    """Kinds `OF_JOINTS`, "roll" (how far a joint's centre moves with the square of its angle), and "hips" (what the
    priors leave open of their centres and a recording does not show; until `with_hips` what the filter lacks of
    them)."""

    def __init__(self, geometry: Geometry, calibrated: CalibratedModel) -> None:
        self._geometry, errors = geometry, geometry.errors
        first = {name: k for k, name in enumerate(calibrated.names)}
        self._rolls = [first[name] for name in rolls(calibrated.spec) if name in first]
        gain, N = geometry.gain(geometry.upright())
        self._rolling = _core.Model(rolling_more(calibrated.spec))
        self._B0 = gain @ np.hstack([N, self._rolled(geometry.reference)])
        kinds = np.array([*errors.kinds, *("roll" for _ in self._rolls)])
        self._columns = {kind: np.flatnonzero(kinds == kind) for kind in (*OF_JOINTS, "roll")}
        none = np.zeros(len(self._rolls))
        self._times = np.append(less_sure(calibrated, errors.kinds, errors.joints), none + 1.0)
        self._hips_open_m = np.append(errors.hips_open_m(calibrated, calibrated.prior_sd), none)
        self._hips_kept_m = np.append(errors.hips_open_m(calibrated, calibrated.unshown_sd), none)
        self._hips_unshown_m = self._hips_kept_m

    def with_hips(self, turned: Mapping[str, Turned]) -> Joints:
        """The same in a recording in which hips turn so far, of what the priors leave open of their centres.

        Args:
            turned: as of `hips_turned`.
        """
        other, errors = copy(self), self._geometry.errors
        unshown = np.zeros(len(self._hips_open_m))
        for joint, each in turned.items():
            own = [k for k, kind in enumerate(errors.kinds) if errors.joints[k] == joint and kind in BALLS]
            unshown[own] = hips_unshown(each)[: len(own)]
        # what the filter is not given counts even where frames behind a first run show it
        other._hips_unshown_m = np.maximum(self._hips_open_m * unshown, self._hips_kept_m)
        return other

    def variances(self, frame: Frame) -> Parts:
        """By kind of error, in one frame."""
        errors = self._geometry.errors
        B, Bd, Bdd = differences([gain @ np.hstack([N, self._rolled(q)]) for q, gain, N in frame.around])
        T = frame.moment_jacobian
        Tq, Tv, Ta = frame.moments_by_motion
        direct = np.hstack([T[:, errors.placed] @ errors.sources, self._rolled_moments(frame)])
        moved = Tq @ B + Tv @ Bd + Ta @ Bdd + direct
        # of angles what changes with the posture: a zero is a definition
        squares = [np.square(values) for values in (B - self._B0, Bd, Bdd, moved)]
        found = {}
        for kind, chosen in self._columns.items():
            found[kind] = self._geometry.blocks(*(values[:, chosen] @ self._times[chosen] ** 2 for values in squares))
        found["hips"] = self._geometry.blocks(*(values @ self._hips_unshown_m**2 for values in squares))
        return found

    def _rolled(self, q: Array) -> Array:
        """(3 M, L): what joints' centres that move with their angle's square do to the markers, a m/rad^2."""
        if not self._rolls:
            return np.zeros((3 * len(self._geometry.segment), 0))
        x = self._geometry.x0.copy()
        x[: len(q)] = q
        return np.asarray(_core.marker_jacobian(self._rolling, x)[:, self._rolls])

    def _rolled_moments(self, frame: Frame) -> Array:
        """(C, L): what they do to moments."""
        if not self._rolls:
            return np.zeros((self._geometry.count, 0))
        x, moving = self._geometry.x0.copy(), np.concatenate(frame.motion)
        x[: len(moving)] = moving
        T = _core.moment_jacobian(self._rolling, x, frame.external)
        return np.asarray(T[: self._geometry.count, self._rolls])
