"""What is known of each contact's wrench in each frame: what the filter's total and the moments are made of."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from dynakin.arrays import Array, Codes, Flags
from dynakin.bindings import _core
from dynakin.errors import ModelError
from dynakin.filter.samples import in_step
from dynakin.recordings.feet.contact import NO_CONTACT, ON_PLATE, SHARED_PLATE, UNMEASURED
from dynakin.recordings.times import step_of

RESIDUAL = "residual"
"""Name of the contact that is none: what the model does not explain, on the root (docs/design.md)."""


@dataclass(frozen=True, eq=False)
class ContactLoads:
    """Expected wrenches of C contacts over T frames, on the person, ground frame, about the ground's origin.

    Attributes:
        names: of the contacts ("right", "left", "seat").
        segments: of the model, one a contact.
        wrench: (T, C, 6) N and N m: what the plates measured, or what is expected where none does; 0 where nothing
            touches.
        covariance: (T, 6 C, 6 C) of their errors; those of contacts that share a plate go together.
        effects: (T, 6, 6 K): what the six states, of unit variance, of each of the first K contacts add to its wrench.
        contact: (T, C) NO_CONTACT, ON_PLATE, UNMEASURED or SHARED_PLATE.
        known: (T,) frames in which these contacts are all that acts on the person: in others the filter takes nothing
            from their sum.
        noise: (T, K, 6, 6) the part of the covariances of the first K contacts that is white noise of their own plates
            beyond the usual (`filter.ground.plate_noise`); None: none is.
    """

    names: tuple[str, ...]
    segments: tuple[str, ...]
    wrench: Array
    covariance: Array
    effects: Array
    contact: Codes
    known: Flags
    noise: Array | None = None

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
        states: int = 0,
    ) -> ContactLoads:
        """With independent errors that are given about a reference point: 20 N there are 20 N m at a metre's distance.

        Args:
            force_sd: N, of each component; moment_sd: N m, about the reference point. Both broadcast to (T, C, 3).
            reference: m, ground frame, broadcast to (T, C, 3): the plate's middle, say.
            states: of how many contacts, the first ones, the model has states.
        """
        codes = np.ascontiguousarray(contact, dtype=np.uint8)
        shape = (*codes.shape, 3)
        force, moment, point = (np.broadcast_to(np.asarray(a, float), shape) for a in (force_sd, moment_sd, reference))
        variance = np.concatenate([force, moment], axis=-1) ** 2
        X = carry(point)
        each = (X * variance[..., None, :]) @ np.swapaxes(X, -1, -2)
        known = np.where((codes == NO_CONTACT)[..., None], 0.0, wrench)
        return cls(
            tuple(names),
            tuple(segments),
            known,
            _joint(each),
            np.zeros((len(codes), 6, 6 * states)),
            codes,
            np.ones(len(codes), dtype=bool),
        )

    def check(self, model: _core.Model) -> None:
        """
        Raises:
            ModelError: a segment that the model does not have; an expected wrench that is NaN.
        """
        for name, segment in zip(self.names, self.segments, strict=True):
            if segment not in model.segment_names:
                raise ModelError(
                    f"contact {name!r}: segment {segment!r} is not in the model, expected one of "
                    f"{', '.join(model.segment_names)}"
                )
        bad = np.argwhere((self.contact != NO_CONTACT) & ~np.isfinite(self.wrench).all(axis=2))
        if len(bad):
            frame, contact = bad[0]
            raise ModelError(
                f"contact {self.names[contact]!r}: in frame {frame + 1} its wrench is {self.wrench[frame, contact]}, "
                "expected numbers"
            )

    def core(self) -> _core.ContactLoads:
        """As the core takes them."""
        return _core.ContactLoads(
            list(self.segments),
            np.ascontiguousarray(self.wrench),
            np.ascontiguousarray(self.covariance),
            np.ascontiguousarray(self.contact),
            np.ascontiguousarray(self.effects),
        )

    def total(self) -> tuple[Array, Array, Array]:
        """How the filter measures the total wrench: the sum (T, 6), NaN where it is not all that acts, its covariance
        (T, 6, 6), and the effects (T, 6, 6 K) of the contacts' states."""
        touches = self.contact != NO_CONTACT
        frames, count = touches.shape
        blocks = self.covariance.reshape(frames, count, 6, count, 6)
        both = touches[:, :, None, None, None] & touches[:, None, None, :, None]
        total = np.where(self.known[:, None], self.wrench.sum(axis=1), np.nan)
        covariance = np.where(both, blocks, 0.0).sum(axis=(1, 3))
        states = np.repeat(touches[:, : self.effects.shape[2] // 6], 6, axis=1)
        return total, covariance, np.where(states[:, None], self.effects, 0.0)

    @property
    def undeclared(self) -> Flags:
        """(T,) frames in which something bears the person that is none of these contacts."""
        if self.names[-1] != RESIDUAL:
            return ~self.known
        return np.asarray(self.contact[:, -1] == UNMEASURED)

    @property
    def blind(self) -> Flags:
        """(T,) frames in which a contact bears, no plate measures any, and these contacts are all that acts."""
        own = self.contact[:, :-1] if self.names[-1] == RESIDUAL else self.contact  # the residual is none
        measured = ((own == ON_PLATE) | (own == SHARED_PLATE)).any(axis=1)
        return np.asarray(self.known & ~measured & (own == UNMEASURED).any(axis=1))

    @property
    def by_plates(self) -> Flags:
        """(T,) frames in which plates measure all that acts, and what the model does not explain stands apart from it:
        the contacts' sum is the total wrench then, and not what the movement needs, which has that in it."""
        if self.names[-1] != RESIDUAL:
            return np.zeros(len(self.contact), dtype=bool)
        measured = (self.contact[:, :-1] != UNMEASURED).all(axis=1) & (self.contact[:, -1] == ON_PLATE)
        return np.asarray(measured & self.known)

    def plates_sd(self) -> Array:
        """(T, 6) of the contacts' sum as plates measure it, without the residual. The filter leaves no more of it: it
        knows what is needed at least as well as the sum with the residual (docs/derivations.md, section 15)."""
        names = [name for name in self.names if name != RESIDUAL]
        own = slice(0, 6 * len(names))
        plates = replace(
            self,
            names=tuple(names),
            wrench=self.wrench[:, : len(names)],
            covariance=self.covariance[:, own, own],
            contact=self.contact[:, : len(names)],
        )
        return np.sqrt(np.diagonal(plates.total()[1], axis1=1, axis2=2))

    def noise_left(self) -> Array | None:
        """(T, 6 K, 6 K) what of `noise` is left in the wrenches of these contacts: all of it, but for what each takes
        of what the sum lacks (docs/derivations.md, section 15). None where there is none."""
        if self.noise is None:
            return None
        touches, (frames, count) = self.contact != NO_CONTACT, self.contact.shape
        both = touches[:, :, None, None, None] & touches[:, None, None, :, None]
        with_sum = np.where(both, self.covariance.reshape(frames, count, 6, count, 6), 0.0).sum(axis=3)
        total = with_sum.sum(axis=1)
        total[~touches.any(axis=1)] = np.eye(6)
        K = self.noise.shape[1]
        own = with_sum[:, :K].reshape(frames, 6 * K, 6)
        share = np.swapaxes(np.linalg.solve(total, np.swapaxes(own, 1, 2)), 1, 2)
        left = np.eye(6 * K) - np.tile(share, (1, 1, K))
        return np.asarray(left @ _joint(self.noise) @ np.swapaxes(left, 1, 2))

    def weighed(self, variance_scale: float) -> ContactLoads:
        """With the errors of frames in which feet bear and no plate measures anything on the scale of all other noise
        (`Noise.variance_scale`): what is left there, priors and what the model does not explain, is weighed against the
        markers alone, and keeps its weight."""
        if variance_scale == 1.0:
            return self
        scale = np.where(self.blind, variance_scale, 1.0)
        return replace(self, covariance=scale[:, None, None] * self.covariance)

    def first(self, frames: int) -> ContactLoads:
        """Those of the first frames."""
        names = ("wrench", "covariance", "effects", "contact", "known")
        noise = None if self.noise is None else self.noise[:frames]
        return replace(self, **{name: getattr(self, name)[:frames] for name in names}, noise=noise)

    def in_step(self, time: Array, delay_s: float) -> ContactLoads:
        """What belongs to each time (T,) s where the plates lag by ``delay_s``; contacts and priors by the nearest
        frame."""
        if delay_s == 0.0:
            return self
        wrench = np.stack([in_step(time, self.wrench[:, k], delay_s) for k in range(len(self.names))], axis=1)
        nearest = np.clip(np.searchsorted(time, time + delay_s - 0.5 * step_of(time)), 0, len(time) - 1)
        contact = self.contact[nearest]
        same = (contact == self.contact) & (contact != UNMEASURED)  # else plates and priors would be mixed
        wrench = np.where(same[..., None], wrench, self.wrench[nearest])
        return replace(
            self,
            wrench=wrench,
            covariance=self.covariance[nearest],
            effects=self.effects[nearest],
            contact=contact,
            known=self.known[nearest],
            noise=None if self.noise is None else self.noise[nearest],
        )


def carry(point: Array) -> Array:
    """(..., 6, 6) that takes a wrench about a point (..., 3) m to the ground's origin: n += point x f."""
    found = np.zeros((*point.shape[:-1], 6, 6))
    found[..., :, :] = np.eye(6)
    x, y, z = np.moveaxis(point, -1, 0)
    found[..., 3, 1], found[..., 3, 2] = -z, y
    found[..., 4, 0], found[..., 4, 2] = z, -x
    found[..., 5, 0], found[..., 5, 1] = -y, x
    return found


def _joint(each: Array) -> Array:
    """(T, 6 C, 6 C) of independent covariances (T, C, 6, 6)."""
    frames, count = each.shape[:2]
    joint = np.zeros((frames, count, 6, count, 6))
    for k in range(count):
        joint[:, k, :, k] = each[:, k]
    return joint.reshape(frames, 6 * count, 6 * count)


def stands_off_plates(contact: Codes, feet: int) -> bool:
    """Whether some foot stands off the plates, by contacts (T, F) of which the first are feet."""
    return bool((contact[:, :feet] == UNMEASURED).any())
