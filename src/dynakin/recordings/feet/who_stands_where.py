"""Who stands where, in sentences: what comes of an assignment of plates to feet (`assignment`)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from dynakin.arrays import Array, Flags, runs
from dynakin.messages import Message, note, warning
from dynakin.recordings.feet.contact import FootContact
from dynakin.recordings.plates.ground_plate import GroundPlate
from dynakin.recordings.pushes import JUDGED_N
from dynakin.recordings.times import span, spans


@dataclass(frozen=True, eq=False)
class WhoStandsWhere:
    """
    Attributes:
        time: (T,) s. feet: names. contacts: of those with markers. plates: P.
        fixed: plate -> foot or contact, as given. given: place of a plate -> the declared contacts on it.
        on: (T, F, P) this foot stands on this plate. off: (T, F) it may stand off the plates. hidden: (T, F) nobody
            sees it, and it may stand anywhere.
    """

    time: Array
    feet: tuple[str, ...]
    contacts: Mapping[str, FootContact]
    plates: Sequence[GroundPlate]
    fixed: Mapping[str, str]
    given: Mapping[int, tuple[str, ...]]
    on: Flags
    off: Flags
    hidden: Flags

    def said(self) -> list[Message]:
        """Belts, and which plate carries whom."""
        return [*self._belt(), *(text for p in range(len(self.plates)) for text in self._owners(p))]

    def reasons(self) -> list[Message]:
        """Why something is not measured."""
        every = range(len(self.plates))
        shared = [text for p in every for text in self._shared(p)]
        return [*self._off(), *shared, *(text for p in every for text in self._lost(p))]

    def _belt(self) -> list[Message]:
        found = []
        for name, foot in self.contacts.items():
            speed = np.linalg.norm(foot.support_velocity, axis=1)
            if speed.any():
                low, high = speed[speed > 0.0].min(), speed.max()
                size = f"{high:.2f}" if high - low < 0.02 else f"{low:.2f} to {high:.2f}"
                found.append(
                    note("plates", f"The {name} foot stands on a belt that moves at {size} m/s, by its markers.")
                )
        return found

    def _off(self) -> list[Message]:
        if not self.plates:
            return []
        time, found, out = self.time, list[Message](), "what it carries is estimated there."
        for k, foot in enumerate(self.feet):
            for a, b in runs(self.off[:, k]):
                stands = self.contacts[foot].stands[a:b].any()
                text = "stands off the plates" if stands else "may set down off the plates"
                found.append(note("plates", f"The {foot} foot {text} from {span(time, a, b)}: {out}"))
            if self.hidden[:, k].any():
                found.append(
                    note(
                        "plates",
                        f"Nobody sees where the {foot} foot is from {spans(time, runs(self.hidden[:, k]))}: it may "
                        f"stand off the plates, so {out}",
                    )
                )
        return found

    def _owners(self, p: int) -> list[Message]:
        plate, owners, found = self.plates[p], self.on[:, :, p], list[Message]()
        if p in self.given:
            names = self.given[p]
            shared = ": how they divide its load is assumed" if len(names) > 1 else ""
            found.append(note("plates", f"{plate.name} carries the {' and the '.join(names)}{shared}."))
        for k, foot in enumerate(self.feet):
            if owners[:, k].any():
                how = "given" if plate.name in self.fixed else "by its centre of pressure"
                found.append(
                    note(
                        "plates",
                        f"{plate.name} carries the {foot} foot ({how}): {spans(self.time, runs(owners[:, k]))}.",
                    )
                )
        return found

    def _shared(self, p: int) -> list[Message]:
        both = self.on[:, :, p].sum(axis=1) > 1
        if not both.any():
            return []
        text = (
            f"Both feet stand on {self.plates[p].name} in {np.count_nonzero(both)} frames, "
            f"{spans(self.time, runs(both))}: how they divide its load is assumed."
        )
        return [note("plates", text)]

    def something_else(self, p: int, beyond: Flags) -> Message:
        """On frames (T,) in which a plate under both feet presses beyond both."""
        return warning(
            "plates",
            f"{self.plates[p].name} presses beyond both feet that stand on it, from {spans(self.time, runs(beyond))}: "
            "something else bears on it, too (a chair, a hand, a knee), or it lies off its place; what each of them "
            "bears is not known there. Record what else bears beside that plate, or on one of its own.",
        )

    def _lost(self, p: int) -> list[Message]:
        plate, time = self.plates[p], self.time
        found = [
            note(
                "plates",
                f"{plate.name} is not measured or at the end of its range {_when(time, a, b)}: "
                "what it carries is estimated there.",
            )
            for a, b in runs(~plate.known)
        ]
        if len(self.contacts) == len(self.feet) and p not in self.given:
            alone = ~self.on[:, :, p].any(axis=1) & (plate.push > JUDGED_N) & ~self.hidden.any(axis=1)
            where = "the foot that it is given to does not stand" if plate.name in self.fixed else "no foot stands"
            found += [
                warning(
                    "plates",
                    f"{plate.name} carries up to {np.nanmax(plate.wrench[a:b, 1]):.0f} N where {where}, "
                    f"from {span(time, a, b)}: the total wrench is left out there.",
                )
                for a, b in runs(alone)
            ]
        return found


def _when(time: Array, first: int, end: int) -> str:
    """When frames [first, end) are."""
    if end - first == 1:
        return f"at {time[first]:.3f} s (one frame)"
    return f"from {span(time, first, end)}"
