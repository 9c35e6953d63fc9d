"""How markers show a posture by a model whose joints may err, and what moments that posture has."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from dynakin.arrays import Array, Flags
from dynakin.bindings import _core
from dynakin.filter.noise import marker_variance, soft_tissue_sd
from dynakin.filter.uncertainty.joint_errors import OF_FRAMES, JointErrors
from dynakin.filter.uncertainty.upright import neutral, trunks_of
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.model.spec import free_coordinates
from dynakin.settings.noise import Noise

BLOCKS = ("coordinates", "speeds", "accelerations", "moments")
Blocks = dict[str, Array]
"""Block -> (..., C)."""
Parts = dict[str, Blocks]
"""Kind of error -> block -> (..., C) variances by errors of size 1 (m, rad, declared size; `Sizes`)."""

_UNSEEN_SD = 0.5
"""Standard deviation, rad or m, of a coordinate before any marker is seen: keeps what no marker shows finite."""


class Geometry:
    """Of one person, of S segments with M markers.

    Attributes:
        model: as the filter has it. errors: a larger one, whose joints may err.
        free: (K,) places of the free ones among all ``count`` coordinates. reference: (K,) the upright posture.
        x0: (n,) where the filter starts. segment: (M,) place of each marker's segment.
    """

    def __init__(self, calibrated: CalibratedModel, noise: Noise) -> None:
        spec = calibrated.spec
        self.model = _core.Model(spec)
        self.free = np.array(free_coordinates(spec))
        self.count = len(spec.coordinates)
        self.x0 = np.array(calibrated.x0)
        reference = neutral(calibrated)
        self.errors = JointErrors.of(spec, reference, calibrated.held, trunks_of(calibrated))
        self.reference = reference[self.free]
        self._segments = {segment.name: k for k, segment in enumerate(spec.segments)}
        self.segment = np.array([self._segments[marker.segment] for marker in spec.markers])
        measured = np.array([marker.measured for marker in spec.markers]).ravel()
        sd = np.hypot(np.sqrt(marker_variance(calibrated, noise)), soft_tissue_sd(noise, calibrated.soft_tissue_m))
        self._root_weight = np.repeat(1.0 / sd, 3) * measured
        x = self.upright()
        self._R0 = _core.segment_poses(self.errors.model, x)[0]
        self._D0 = self._displacements(_core.marker_jacobian(self.errors.model, x))
        self._D0[:, [kind in OF_FRAMES for kind in self.errors.kinds]] = 0.0

    def upright(self) -> Array:
        """(n,) state of the larger model that stands still in the reference posture."""
        still = np.zeros_like(self.reference)
        return self.errors.state(self.reference, still, still)

    def _displacements(self, jacobian: Array) -> Array:
        """(3 M, S): what each source does to the markers of the model as it is posed."""
        return np.asarray(jacobian[:, self.errors.placed] @ self.errors.sources)

    def gain(self, x: Array, used: Flags | None = None) -> tuple[Array, Array]:
        """Minus the least squares gain (K, 3 M) of the markers ``used`` (M,), all where not given, and the net
        displacements N (3 M, S) of the geometry: markers sit where the reference posture showed them, regardless of
        what is wrong with the joints.

        Args:
            x: state of the larger model.
        """
        jacobian = _core.marker_jacobian(self.errors.model, x)
        turned = (_core.segment_poses(self.errors.model, x)[0] @ self._R0.swapaxes(-1, -2))[self.segment]
        carried = turned @ self._D0.reshape(len(self.segment), 3, -1)
        N = self._displacements(jacobian) - carried.reshape(self._D0.shape)
        weight = self._root_weight if used is None else np.where(np.repeat(used, 3), self._root_weight, 0.0)
        A = jacobian[:, self.errors.free] * weight[:, None]
        return -cho_solve(normal_factor(A), (A * weight[:, None]).T), N

    def external(self, wrench: Array, segments: Sequence[str]) -> Array:
        """(S, 6) by segment of the model: wrenches (F, 6) of contacts on these."""
        external = np.zeros((len(self._segments), 6))
        for name, values in zip(segments, wrench, strict=True):
            external[self._segments[name]] += values
        return external

    def moments_by(self, x: Array, load: Array) -> Array:
        """(C,): what loads (S, 6) on the segments add to the moments of a state (n,). Moments are linear in them."""
        moments = _core.joint_moments(self.model, x, load) - _core.joint_moments(self.model, x, np.zeros_like(load))
        return np.asarray(moments)

    def blocks(self, q: Array, qd: Array, qdd: Array, moments: Array) -> Blocks:
        """Of all coordinates, from those of the free ones (K,), and of moments (C,)."""
        found = {}
        for name, values in zip(BLOCKS, (q, qd, qdd), strict=False):
            found[name] = np.zeros(self.count)
            found[name][self.free] = values
        return found | {"moments": moments}

    def of_moments(self, moments: Array) -> Blocks:
        """Of errors that no marker shows."""
        still = np.zeros(len(self.free))
        return self.blocks(still, still, still, moments)


def normal_factor(A: Array) -> tuple[Array, bool]:
    """Cholesky factor, as `cho_factor`, of the normal equations of markers' weighted Jacobian A (3 M, K): coordinates
    that no marker shows are 0 to `_UNSEEN_SD`."""
    normal = A.T @ A
    normal.flat[:: len(normal) + 1] += _UNSEEN_SD**-2
    found: tuple[Array, bool] = cho_factor(normal)
    return found
