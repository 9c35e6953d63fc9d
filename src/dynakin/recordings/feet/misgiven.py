"""Plates that the user gives to a foot, or to a declared contact, while another foot stands where they are pressed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from dynakin.arrays import Array, Flags, runs
from dynakin.recordings.feet.contact import ALONE_M, COP_REFUSED_M, NEAR_M, FootContact
from dynakin.recordings.feet.findings import reach_m
from dynakin.recordings.hull import distance_to_hull
from dynakin.recordings.plates.ground_plate import SAME_LEVEL_M, GroundPlate
from dynakin.recordings.pushes import JUDGED_N

OFF_M = 0.10
"""A plate that lies so far off its place, which is warned of elsewhere, is still that of the foot on it."""
MOST = 0.5
"""Part of a press, and of a plate's load, that must lie under another foot."""


@dataclass(frozen=True, eq=False)
class Misgiven:
    """Where a plate is not its declared owner's.

    Attributes:
        presses: (T,) frames of the presses that another foot bears.
        why: a sentence where these are most of the plate's load, else "".
    """

    presses: Flags
    why: str

    @staticmethod
    def of(
        plate: GroundPlate,
        owner: str,
        place: Array | None,
        contacts: Mapping[str, FootContact],
        plates: Sequence[GroundPlate],
        rate: float,
    ) -> Misgiven:
        """Of a plate that is given to a foot, or to a contact at these places (T, 3) m.

        Args:
            contacts: of the feet with markers. plates: all of them: a foot that has another one is no witness.
        """
        judged = np.asarray(plate.push > JUDGED_N)
        away = _away(plate, owner, place, contacts)
        far = OFF_M + reach_m(contacts[owner], rate) if owner in contacts else COP_REFUSED_M
        under = dict[str, Flags]()
        for name, foot in contacts.items():
            if name == owner:
                continue
            with np.errstate(invalid="ignore"):
                near = NEAR_M if owner in contacts else ALONE_M
                level = plate.height_m is None or np.abs(foot.support_m - plate.height_m) < SAME_LEVEL_M
                there = (distance_to_hull(plate.cop, foot.outline) < near) & level & (foot.stands | foot.low)
                own = [other.loaded & (distance_to_hull(other.cop, foot.outline) < ALONE_M)
                       for other in plates if other is not plate]  # fmt: skip
                under[name] = np.asarray(there & (away > far) & ~np.any([np.zeros_like(there), *own], axis=0))
        wrong = np.any([np.zeros_like(judged), *under.values()], axis=0) & judged
        presses = np.zeros_like(judged)
        for first, end in runs(judged):
            presses[first:end] = wrong[first:end].mean() > MOST
        load = plate.push * judged
        if not load.any() or load[presses].sum() <= MOST * load.sum():
            return Misgiven(presses, "")
        other = max(under, key=lambda name: int(np.count_nonzero(under[name] & presses)))
        what = f"the {owner} foot" if owner in contacts else owner
        found = others_plate(plate.name, owner, what, float(np.median(away[wrong])), other)
        advice = "Correct that key, or take the plate out of it: then it is the foot's that stands on it."
        return Misgiven(presses, f"{found} {advice}")


def others_plate(plate: str, owner: str, what: str, away_m: float, other: str) -> str:
    """The sentence that says so, live and afterwards."""
    return (
        f'plates: "{plate}" is given to "{owner}", but {what} is {away_m:.2f} m from its centre of pressure and the '
        f"{other} foot stands there, for most of its load."
    )


def _away(plate: GroundPlate, owner: str, place: Array | None, contacts: Mapping[str, FootContact]) -> Array:
    """(T,) m from the centre of pressure to the declared owner; NaN where nobody sees that."""
    if owner in contacts:
        return distance_to_hull(plate.cop, contacts[owner].outline)
    if place is None:
        return np.full(len(plate.push), np.nan)
    pressed = np.stack([plate.cop[:, 0], np.full(len(place), plate.height_m or 0.0), plate.cop[:, 1]], axis=1)
    return np.asarray(np.linalg.norm(place - pressed, axis=1))
