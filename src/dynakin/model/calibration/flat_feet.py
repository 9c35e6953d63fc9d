"""How steeply the line from heel to toe rises on a foot that stands flat: where the ankle's angle is zero."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from dynakin.messages import Message, warning
from dynakin.model.calibration.frames import Trial
from dynakin.model.calibration.landmarks import SIDES, LandmarkFinder, slope
from dynakin.model.calibration.sites import Candidate
from dynakin.model.markers.anatomy import standing_at
from dynakin.model.schema import ModelFile
from dynakin.recordings.feet.contact import foot_contacts
from dynakin.results.naming import listed

_USUAL_OFF_DEG, _UNKNOWN_OFF_DEG = 5, 15
"""Of the zero of an ankle's angle where heel and toes count as an adult's on a flat foot, and where there is no such
line: by simulated walks 1 to 4 deg and 5 to 15."""


def flat_slopes(trial: Trial) -> dict[str, float]:
    """Side -> slope (rad) of the line from heel to toe while that foot stands flat; none for a foot that never does."""
    found: dict[str, float] = {}
    for side in SIDES:
        names = trial.match.heel_toe(side)
        own = {side: list(names)} if names else {}
        contact = foot_contacts(trial.recording, trial.ground, own).get(side)
        if contact is None or contact.touching.shape[1] != 2:
            continue
        flat = contact.touching.all(axis=1)
        if flat.any():
            heel, toe = (trial.ground.points_to_ground(trial.recording.marker(n)) for n in own[side])
            found[side] = float(np.median(slope((toe - heel)[flat])))
    return found


def usual_slopes(finder: LandmarkFinder) -> dict[str, float]:
    """Side -> slope (rad) of the line from heel to toe on an adult's flat foot, by the places that these are of."""
    found: dict[str, float] = {}
    for side in SIDES:
        recipes = [finder.recipe(name, side) for name in ("heel", "toe")]
        inputs = [recipe.inputs if recipe is not None else () for recipe in recipes]
        if all(inputs) and all(name in standing_at() for names in inputs for name in names):
            heel, toe = (np.mean([standing_at()[name][0] for name in names], axis=0) for names in inputs)
            found[side] = float(slope(toe - heel))
    return found


def never_flat(
    model: ModelFile, flat: Collection[str], usual: Collection[str], chosen: Sequence[Candidate]
) -> list[Message]:
    """Sentences on marked feet of a person who does not stand still, but for those of ``flat`` sides, whose heel and
    toes show how they stand: the line between these is the usual one's, or there is none and the foot counts as flat in
    a frame in which it may not be."""
    marked = {candidate.segment for candidate in chosen}
    own = [s.side for s in model.segments if s.side is not None and "foot" in s.parts and s.name in marked]
    found = []
    for off_deg, feet in (
        (_USUAL_OFF_DEG, [f"the {side} foot" for side in own if side in usual and side not in flat]),
        (_UNKNOWN_OFF_DEG, [f"the {side} foot" for side in own if side not in usual and side not in flat]),
    ):
        if feet:
            found.append(
                warning(
                    "ankles",
                    f"nothing shows the sole flat of {listed(feet)} (heel and toes together on the ground, or "
                    "standing still): the "
                    f"zero of the ankle's angle may be {off_deg} deg off. Give a standing trial (--static).",
                )
            )
    return found
