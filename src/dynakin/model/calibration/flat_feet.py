"""How steeply the line from heel to toe rises on a foot that stands flat: where the ankle's angle is zero."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np

from dynakin.messages import Message, note, warning
from dynakin.model.calibration.frames import MarkedTrial
from dynakin.model.calibration.landmarks import LandmarkFinder, slope
from dynakin.model.calibration.sites import Candidate
from dynakin.model.markers.anatomy import standing_at
from dynakin.model.mirroring import OTHER_SIDE, SIDES
from dynakin.model.schema import ModelFile
from dynakin.recordings.feet.contact import foot_contacts
from dynakin.results.naming import listed

_USUAL_OFF_DEG, _UNKNOWN_OFF_DEG = 5, 15
"""Of the zero of an ankle's angle where heel and toes count as an adult's on a flat foot, and where there is no such
line: by simulated walks 1 to 4 deg and 5 to 15."""
RAISED_DEG = 12.0
"""A heel that is so much higher (or lower) over the toes than an adult's is not on the ground with them: a person on
tiptoe is high over the floor all the time, and each marker is low by its own measure. Chosen on simulated standing (0
to 4 deg) and tiptoe (28), and on `opencap_subject4` (3 to 6); of 20 other real recordings 0 to 8, and two beyond: a
walk whose own standing trial says that it is 14 deg off, and a leg that is held up."""


def flat_slopes(trial: MarkedTrial) -> dict[str, float]:
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


def lost_on_feet(trial: MarkedTrial, standing: MarkedTrial) -> list[Message]:
    """Sentences on markers of a foot that the standing trial has and the trial has not: they end its sole."""
    found = []
    for side, names in standing.match.foot_markers.items():
        lost = [name for key, name in standing.match.names.items() if name in names and key not in trial.match.names]
        if not lost:
            continue
        other = len(trial.match.foot_markers[OTHER_SIDE[side]])
        known = len(trial.match.foot_markers[side]) < other
        how = "as far as by the other foot" if known else "no further than its other markers"
        found.append(
            note(
                "calibration",
                f"{listed(lost)} of the {side} foot {'are' if len(lost) > 1 else 'is'} in {standing.recording.name}, "
                f"not in {trial.recording.name}: on a plate the foot reaches {how}.",
            )
        )
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


def raised_heels(flat: Mapping[str, float], usual: Mapping[str, float]) -> dict[str, float]:
    """Side -> how much higher (deg) than usual a heel is whose foot does not lie flat where `flat_slopes` has it."""
    above = {side: float(np.degrees(usual[side] - slope)) for side, slope in flat.items() if side in usual}
    return {side: deg for side, deg in above.items() if abs(deg) > RAISED_DEG}


def never_flat(
    model: ModelFile,
    flat: Collection[str],
    usual: Collection[str],
    raised: Mapping[str, float],
    chosen: Sequence[Candidate],
) -> list[Message]:
    """Sentences on marked feet, but for those of ``flat`` sides, of which it is known how they stand: the line from
    heel to toe is the usual one's, or there is none and the foot counts as flat in a frame in which it may not be."""
    marked = {candidate.segment for candidate in chosen}
    own = [s.side for s in model.segments if s.side is not None and "foot" in s.parts and s.name in marked]
    how = "heel and toes together on the ground, or standing still"
    if raised:
        off = {side: f"{abs(deg):.0f} deg too {'high' if deg > 0.0 else 'low'}" for side, deg in raised.items()}
        heels = [f"the {side} heel is {by}" for side, by in off.items()]
        how = f"{listed(heels)} over the toes, as on tiptoe, in equinus or in shoes with heels"
    found = []
    for off_deg, feet in (
        (_USUAL_OFF_DEG, [f"the {side} foot" for side in own if side in usual and side not in flat]),
        (_UNKNOWN_OFF_DEG, [f"the {side} foot" for side in own if side not in usual and side not in flat]),
    ):
        if feet:
            found.append(
                warning(
                    "ankles",
                    f"nothing shows the sole flat of {listed(feet)} ({how}): the zero of the ankle's angle may be "
                    f"{off_deg} deg off.",
                )
            )
    return found
