"""By how much the sensors of plates are off: one value, of what the motion, or a moment, says of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dynakin.arrays import Array, Flags
from dynakin.messages import Message, warning
from dynakin.recordings.feet.loads import FootLoads

NOISE_N, NOISE_NM = 2.0, 0.5
"""White noise of the usual plates, the moment about the centre of pressure."""
ANY_N = 1e4
"""Deviation, N (N m of the moment about the vertical), of what is not measured: any that a person makes, and little
enough to be inverted beside a plate's noise."""


@dataclass(frozen=True, eq=False)
class PlateErrors:
    """What is wrong with P plates, as far as something contradicts them.

    Attributes:
        shear_zero_n: N, X and Z of the ground, what the horizontal force of their sum reads too much all the time.
        shear_gain_error: part of any horizontal force by which it may be off.
        unmeasured: no plate measures horizontal forces, nor the moment about the vertical.
        gain_error: (P,) part of its load by which each plate may be off.
        gain: (P,) what each says over what it should, as far as that is known; 1 of plates of which one is wrong and
            nobody knows which.
        noise: (P, 6, 6) covariance of each plate's white noise beyond the usual, about the ground's origin
            (`plate_noise`).
        said: what there is to say, of what looks like such errors, too.
        turn_error_nm: (P,) N m by which the moment about the vertical of each may be off while it is loaded.
        turn_gain_error: part of any free moment by which it may be off, too.
        borne: (C,) declared contacts that it is laid to instead.
    """

    shear_zero_n: tuple[float, float] = (0.0, 0.0)
    shear_gain_error: float = 0.0
    unmeasured: bool = False
    gain_error: Array | float = 0.0
    gain: Array | float = 1.0
    noise: Array | None = None
    said: tuple[Message, ...] = ()
    borne: Flags | bool = False
    turn_error_nm: Array | float = 0.0
    turn_gain_error: float = 0.0

    def shear_sd(self, wrench: Array) -> Array:
        """(T,) N, of each horizontal component of a plate's wrench (T, 6), because any may have all of the zero; 0
        where nothing bears on it."""
        if self.unmeasured:
            return np.full(len(wrench), ANY_N)
        sd = np.hypot(np.hypot(*self.shear_zero_n), self.shear_gain_error * np.hypot(wrench[:, 0], wrench[:, 2]))
        return np.where(wrench[:, 1] > 0.0, sd, 0.0)

    def gain_error_of_feet(self, loads: FootLoads) -> Array:
        """(T, F) part of its load by which what each foot stands on may be off."""
        return np.asarray((loads.on * self.gain_error).max(axis=2, initial=0.0))

    def turn_error_of_feet(self, loads: FootLoads) -> Array:
        """(T, F) N m by which the moment about the vertical of what each foot stands on may be off."""
        return np.asarray((loads.on * self.turn_error_nm).max(axis=2, initial=0.0))

    def noise_of(self, loads: FootLoads, contacts: Sequence[str]) -> Array:
        """(T, F + C, 6, 6) of what each foot stands on, and of what measures each declared contact."""
        on = np.concatenate([loads.on, np.zeros((len(loads.on), len(contacts), loads.on.shape[2]), dtype=bool)], axis=1)
        if self.noise is None:
            return np.zeros((*on.shape[:2], 6, 6))
        for p, names in loads.given.items():
            on[:, [len(loads.feet) + contacts.index(name) for name in names], p] = True
        return np.tensordot(on, self.noise, axes=1)

    def zeroed(self, wrench: Array) -> Array:
        """The sum over the plates (T, 6) without its zero."""
        return np.asarray(wrench - np.array([self.shear_zero_n[0], 0.0, self.shear_zero_n[1], 0.0, 0.0, 0.0]))

    def righted(self, total: Array, wrenches: Array) -> Array | None:
        """The sum (T, 6) of plates (P, T, 6) as it were had each the gain of the others; None where nothing differs, or
        nobody knows which plate is wrong."""
        if np.all(self.gain == 1.0):
            return None
        return np.asarray(total - np.tensordot(1.0 - 1.0 / self.gain, np.nan_to_num(wrenches), axes=1))


NO_ERRORS = PlateErrors()
VERTICAL_ONLY = warning(
    "vertical only",
    "the plates measure the vertical force only: their horizontal forces are 0 or follow it, whatever the person does. "
    "Horizontal forces, and moments of the legs that rest on them, are those of the motion and not measured.",
)
"""What there is to say of plates whose horizontal forces are ``unmeasured``."""
