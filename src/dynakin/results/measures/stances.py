"""What a peak, an impulse or work is taken over: whole stances and swings of a leg, measured from end to end.

The peak of the measured part of a stance need not be the stance's, and the impulse of a part is no impulse. So where
some of a leg's moments are not measured, only those of its stances (touch-down to toe-off) and swings count that are
measured in every frame.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from dynakin.arrays import Flags
from dynakin.recordings.feet.contact import NO_CONTACT, ON_PLATE
from dynakin.results.estimate import Estimate
from dynakin.results.measures import sources


@dataclass(frozen=True)
class Phase:
    """A stance or a swing of one foot: frames ``first`` to ``end``, which is the next one's first.

    whole: it begins and ends within the window, or it is all of it (standing); measured: the foot's wrench is, in
    every frame.
    """

    first: int
    end: int
    stance: bool
    whole: bool
    measured: bool

    @property
    def frames(self) -> slice:
        """Of the recording."""
        return slice(self.first, self.end)


def phases(estimate: Estimate, foot: str, window: Flags) -> list[Phase]:
    """Stances and swings of a foot within the frames ``window`` (T,), which lie side by side."""
    at = np.flatnonzero(window)
    start, stop = int(at[0]), int(at[-1]) + 1
    contact = estimate.data["foot_contact"].sel(foot=foot).values[start:stop]
    stands = contact != NO_CONTACT
    edges = [0, *(np.flatnonzero(np.diff(stands)) + 1), len(stands)]
    found = []
    for first, end in pairwise(edges):
        own = contact[first:end]
        whole = (first > 0 and end < len(stands)) or len(edges) == 2
        known = bool(((own == ON_PLATE) | (own == NO_CONTACT)).all())
        found.append(Phase(start + int(first), start + int(end), bool(stands[first]), whole, known))
    return found


def compared_stances(estimate: Estimate, window: Flags) -> dict[str, list[slice]] | None:
    """The whole measured stances of each foot; None where no foot leaves the ground or touches down within the window:
    who stays on the feet is judged over all of it."""
    every = {foot: phases(estimate, foot, window) for foot in estimate.foot_names}
    if all(len(own) == 1 for own in every.values()):
        return None
    return {foot: [p.frames for p in own if p.stance and p.whole and p.measured] for foot, own in every.items()}


def counted(estimate: Estimate, window: Flags) -> Flags:
    """(T, C) frames in which a moment counts: all of the window where it is measured throughout; of a leg else the
    stances and swings that are whole and measured in every frame, if there is a stance among them; of anything else
    none."""
    measured = sources.moment_sources(estimate.data) == sources.MEASURED
    found = np.zeros(measured.shape, dtype=bool)
    found[window] = measured[window].all(axis=0)
    legs = sources.legs_of(estimate.data)
    for foot in estimate.foot_names:
        whole = [phase for phase in phases(estimate, foot, window) if phase.whole]
        known = np.zeros((len(whole), len(legs)), dtype=bool)  # of no rows, where the foot changes once in the window
        for k, phase in enumerate(whole):
            known[k] = measured[phase.frames].all(axis=0)
        own = np.array([leg == foot for leg in legs])
        own &= known[np.array([phase.stance for phase in whole], dtype=bool)].any(axis=0)
        for phase, throughout in zip(whole, known, strict=True):
            found[phase.frames] |= own & throughout
    return found
