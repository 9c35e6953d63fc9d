"""What is looked at: a model measured on a person, what is known before the recording, and how well it is sensed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dynakin.arrays import Array
from dynakin.bindings import _core
from dynakin.filter.augment import initial_covariance
from dynakin.filter.noise import marker_variance, wrench_covariance
from dynakin.filter.tracker import Tracker
from dynakin.model.calibration.calibrated import CalibratedModel

_FASTEST, _HARDEST = 3.0, 30.0
"""rad/s and rad/s^2 (m/s, m/s^2): standard deviations of random motion, those of brisk gestures. Rank and gauges do not
depend on them."""
_FREE = 1.0  # rad or m: half width of the postures of a coordinate without limits


@dataclass(frozen=True, eq=False)
class MeasuredModel:
    """A tracker's model.

    Attributes:
        core: the compiled model. initial: as the filter starts, soft tissue and plate errors among its states.
        prior: (n, n) covariance before the first frame.
        marker_sd: (M,) m. wrench_sd: (6,) N and N m, about the noise's reference point.
    """

    core: _core.Model
    initial: CalibratedModel
    prior: Array
    marker_sd: Array
    wrench_sd: Array

    @classmethod
    def of(cls, tracker: Tracker) -> MeasuredModel:
        """The model that a tracker has."""
        initial, noise = tracker.calibrated, tracker.noise
        variance = marker_variance(initial, noise, tracker.estimate)
        return cls(
            tracker.core_model,
            initial,
            initial_covariance(initial, noise),
            np.sqrt(variance),
            np.sqrt(np.diag(wrench_covariance(noise))),
        )

    @property
    def names(self) -> tuple[str, ...]:
        """Names (n,) of the state's elements."""
        return self.initial.names

    def block(self, name: str) -> slice:
        """Where a block stands in the state."""
        offset, size = self.core.layout.blocks[name]
        return slice(offset, offset + size)

    def random_states(self, count: int, seed: int = 0) -> Array:
        """States (count, n) with the constants of the start, postures within the joints' limits, and any motion."""
        rng = np.random.default_rng(seed)
        states = np.tile(self.initial.x0, (count, 1))
        at = self.block("coordinates")
        lower, upper = self.initial.lower[at], self.initial.upper[at]
        known = np.isfinite(lower) & np.isfinite(upper)
        lower, upper = np.where(known, lower, -_FREE), np.where(known, upper, _FREE)
        size = (count, len(lower))
        states[:, at] = rng.uniform(lower, upper, size)
        states[:, self.block("speeds")] = _FASTEST * rng.standard_normal(size)
        states[:, self.block("accelerations")] = _HARDEST * rng.standard_normal(size)
        return states

    def marker_rows(self, x: Array) -> Array:
        """d (measured marker coordinates) / dx, (r, n), in units of their standard deviations."""
        measured = np.array([marker.measured for marker in self.initial.spec.markers]).ravel()
        rows: Array = _core.marker_jacobian(self.core, x)[measured]
        return rows / np.repeat(self.marker_sd, 3)[measured, None]

    def wrench_rows(self, x: Array) -> Array:
        """d (measured wrench components) / dx, (r, n), N and N m about the ground origin."""
        return np.asarray(_core.wrench_jacobian(self.core, x))[list(self.initial.spec.wrench_measured)]

    def wrench_sigma(self) -> Array:
        """(r,) standard deviations of the measured components."""
        return self.wrench_sd[list(self.initial.spec.wrench_measured)]
