"""What a batch identification asks for: segments' inertia, lengths, zeros of angles, and each trial's own plates."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from dynakin.arrays import Array
from dynakin.bindings import _core
from dynakin.identification.inertial_parameters import InertialParameters
from dynakin.identification.trials import Common

SCALED_M = 0.4  # of a segment that a dimensionless factor of an OpenSim model scales


@dataclass(frozen=True)
class GeometryPriors:
    """Standard deviations of what geometry may be wrong by, where it is free. Tight, as skin that follows a posture is
    no constant; 10 mm and 2 deg predict one simulated task of three better and two as well (docs/identification.md).
    """

    length_m: float = 0.004
    """Of each length."""
    zero_deg: float = 0.5
    """Of each angle's zero."""
    considered_length_m: float = 0.008
    """What a length that is held may be wrong by: it widens the deviations of what is estimated."""
    considered_zero_deg: float = 2.0
    """The same of a zero: landmarks and skin turn a segment's frame by 1 to 4 deg (docs/validation/geometry.md)."""
    plate_force_n: float = 3.0
    """A trial's own constant error of each force."""
    plate_moment_nm: float = 1.0
    """The same of the moment about the ground origin."""
    plate_delay_s: float = 0.005
    """The plates' delay behind the markers."""


@dataclass(frozen=True, eq=False)
class Unknowns:
    """theta (U,) = [u of the inertia; lengths (m); zeros (rad)], deviations from the start, and which are free.

    A zero is added to its angle at every frame; a length to its own. What is not free stays 0. A floating body's own
    turn in the room is no zero: markers on every segment see it.

    Attributes:
        names: (U,). sd: (U,) prior standard deviations. inertial: u -> phi.
        lengths, rotations, inertia: their columns in a state of the core's model.
        considered_sd: (U,) what each may be wrong by while it is held.
        nuisance_sd: (r + 1,) of a trial's plates: each component of `Common.rows` (N, N m), delay (s).
        free: (U,) bool.
    """

    names: tuple[str, ...]
    sd: Array
    inertial: InertialParameters
    lengths: Array
    rotations: Array
    inertia: Array
    considered_sd: Array
    nuisance_sd: Array
    free: npt.NDArray[np.bool_]

    @classmethod
    def of(cls, common: Common, *, inertia: bool = True, geometry: bool = True) -> Unknowns:
        """All of a measured model's; ``inertia`` and ``geometry`` say what is free.

        Raises:
            ModelError: the model does not estimate what can be identified.
        """
        priors = GeometryPriors()
        inertial = InertialParameters.of(common.initial, common.estimator.priors)
        names = list(common.core.layout.names)
        turning = {
            axis.coordinate
            for segment in common.initial.spec.segments
            for axis in segment.axes
            if axis.kind == "rotation" and not (common.floating and segment.parent == "ground")
        }
        rotations = [k for k in _range(common.columns("coordinates")) if names[k] in turning]
        lengths = list(_range(common.columns("lengths")))
        words = [*inertial.unknowns] + [names[k] for k in lengths] + [f"zero/{names[k]}" for k in rotations]
        metres = np.array([SCALED_M if names[k] in common.initial.dimensionless else 1.0 for k in lengths])
        sd, considered = (
            np.concatenate([inertial.sd, length / metres, np.full(len(rotations), np.deg2rad(zero))])
            for length, zero in (
                (priors.length_m, priors.zero_deg),
                (priors.considered_length_m, priors.considered_zero_deg),
            )
        )
        slow = np.where(common.rows < 3, priors.plate_force_n, priors.plate_moment_nm)
        plates = np.append(slow, priors.plate_delay_s)
        free = np.array([inertia] * len(inertial.sd) + [geometry] * (len(lengths) + len(rotations)))
        columns = np.array([names.index(name) for name in inertial.names])
        return cls(
            tuple(words),
            sd,
            inertial,
            np.array(lengths),
            np.array(rotations),
            columns,
            considered,
            plates,
            free,
        )

    def split(self, theta: Array) -> tuple[Array, Array, Array]:
        """u, lengths, zeros."""
        first, second = len(self.inertial.sd), len(self.inertial.sd) + len(self.lengths)
        return theta[:first], theta[first:second], theta[second:]

    def states(self, states: Array, theta: Array) -> Array:
        """States (T, n) with what ``theta`` says."""
        u, lengths, zeros = self.split(theta)
        found = states.copy()
        found[:, self.lengths] += lengths
        found[:, self.rotations] += zeros
        found[:, self.inertia] = self.inertial.phi(u)
        return found

    def wrench(self, core: _core.Model, states: Array, theta: Array) -> Array:
        """What the plates should say of a movement (T, 6), N and N m about the ground origin."""
        return np.array([_core.wrench(core, x) for x in self.states(states, theta)])

    def jacobian(self, core: _core.Model, states: Array, theta: Array) -> Array:
        """d wrench / d theta (T, 6, U)."""
        u, _, _ = self.split(theta)
        rows = np.array([_core.wrench_jacobian(core, x) for x in self.states(states, theta)])
        inertial = rows[:, :, self.inertia] @ self.inertial.jacobian(u)
        return np.concatenate([inertial, rows[:, :, self.lengths], rows[:, :, self.rotations]], axis=2)


def _range(columns: slice) -> range:
    return range(columns.start, columns.stop)
