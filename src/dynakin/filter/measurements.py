"""What a filter takes of a recording, as arrays."""

from __future__ import annotations

from typing import NamedTuple

from dynakin.arrays import Array
from dynakin.filter.contacts import ContactLoads
from dynakin.filter.samples import in_step


class Measurements(NamedTuple):
    """What a filter runs over: T frames, ground frame, in the order of the model's markers; NaN: not measured.

    Attributes:
        time: (T,) s. markers: (T, M, 3) m. wrench: (T, 6) N and N m, ground on person, about the ground origin.
        contacts: the wrenches of which that is the sum; None: nothing is known of them.
    """

    time: Array
    markers: Array
    wrench: Array
    contacts: ContactLoads | None = None

    def first(self, frames: int) -> Measurements:
        """Its first frames."""
        contacts = self.contacts and self.contacts.first(frames)
        return Measurements(self.time[:frames], self.markers[:frames], self.wrench[:frames], contacts)

    def in_step(self, delay_s: float) -> Measurements:
        """With what plates that lag by ``delay_s`` say so much later."""
        if not delay_s:
            return self
        contacts = self.contacts and self.contacts.in_step(self.time, delay_s)
        return self._replace(wrench=in_step(self.time, self.wrench, delay_s), contacts=contacts)
