"""What is known of each foot's wrench, as the core takes it for moments that leave no residual."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from dynakin.bindings import _core
from dynakin.errors import ModelError
from dynakin.filter.samples import in_step
from dynakin.recordings.feet.contact import NO_CONTACT, ON_PLATE, UNMEASURED

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class FootWrenches:
    """Wrenches of F feet over T frames, ground on person, ground frame, about the ground's origin.

    Attributes:
        names: of the feet ("right", "left").
        segments: of the model, one a foot.
        wrench: (T, F, 6) N and N m; counts where measured.
        covariance: (T, F, 6, 6) of its errors, positive definite.
        contact: (T, F) NO_CONTACT, ON_PLATE or UNMEASURED.
    """

    names: tuple[str, ...]
    segments: tuple[str, ...]
    wrench: Array
    covariance: Array
    contact: npt.NDArray[np.uint8]

    @classmethod
    def of(
        cls,
        names: Sequence[str],
        segments: Sequence[str],
        wrench: Array,
        contact: npt.ArrayLike,
        force_sd: npt.ArrayLike,
        moment_sd: npt.ArrayLike,
        reference: npt.ArrayLike,
    ) -> FootWrenches:
        """With errors that are given about a reference point: 20 N there are 20 N m at a metre's distance.

        Args:
            force_sd: N, of each component; moment_sd: N m, about the reference point. Both broadcast to (T, F, 3).
                Where two feet share a plate, make them as large as the division of its load is unsure.
            reference: m, ground frame, broadcast to (T, F, 3): the plate's middle, say.

        Raises:
            ValueError: shapes that do not fit.
        """
        codes = np.ascontiguousarray(contact, dtype=np.uint8)
        shape = (*codes.shape, 3)
        force, moment, point = (np.broadcast_to(np.asarray(a, float), shape) for a in (force_sd, moment_sd, reference))
        carry = np.zeros((*codes.shape, 6, 6))
        carry[..., :, :] = np.eye(6)
        carry[..., 3:, :3] = np.cross(point[..., None, :], np.eye(3)).swapaxes(-1, -2)  # f -> point x f
        variance = np.concatenate([force, moment], axis=-1) ** 2
        covariance = (carry * variance[..., None, :]) @ np.swapaxes(carry, -1, -2)
        known = np.where((codes == ON_PLATE)[..., None], wrench, np.where(codes == NO_CONTACT, 0.0, np.nan)[..., None])
        return cls(tuple(names), tuple(segments), known, covariance, codes)

    def check(self, model: _core.Model) -> None:
        """
        Raises:
            ModelError: a segment that the model does not have, or twice the same; a measured wrench that is NaN.
        """
        for name, segment in zip(self.names, self.segments, strict=True):
            if segment not in model.segment_names:
                raise ModelError(
                    f"foot {name!r}: segment {segment!r} is not in the model, expected one of "
                    f"{', '.join(model.segment_names)}"
                )
            if self.segments.count(segment) > 1:
                raise ModelError(f"foot {name!r}: segment {segment!r} is given twice, expected one foot a segment")
        bad = np.argwhere((self.contact == ON_PLATE) & ~np.isfinite(self.wrench).all(axis=2))
        if len(bad):
            frame, foot = bad[0]
            raise ModelError(
                f"foot {self.names[foot]!r}: frame {frame + 1} is measured but its wrench is "
                f"{self.wrench[frame, foot]}, expected numbers"
            )

    def core(self) -> _core.FootLoads:
        """As the core takes them."""
        return _core.FootLoads(
            list(self.segments),
            np.ascontiguousarray(self.wrench),
            np.ascontiguousarray(self.covariance),
            np.ascontiguousarray(self.contact),
        )

    def in_step(self, time: Array, delay_s: float) -> FootWrenches:
        """What belongs to each time (T,) s where the plates lag by ``delay_s``; contacts by the nearest frame."""
        if delay_s == 0.0:
            return self
        wrench = np.stack([in_step(time, self.wrench[:, k], delay_s) for k in range(len(self.names))], axis=1)
        nearest = np.clip(np.searchsorted(time, time + delay_s - 0.5 * np.median(np.diff(time))), 0, len(time) - 1)
        contact = self.contact[nearest]
        contact = np.where((contact == ON_PLATE) & ~np.isfinite(wrench).all(axis=2), UNMEASURED, contact)
        return replace(self, wrench=wrench, covariance=self.covariance[nearest], contact=contact.astype(np.uint8))
