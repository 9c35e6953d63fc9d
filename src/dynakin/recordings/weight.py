"""Whether plates carry the person's weight, standing and stepping; in which other unit than N they are where not."""

from __future__ import annotations

import numpy as np

from dynakin.arrays import Array
from dynakin.messages import Findings
from dynakin.recordings.feet.loads import FootLoads
from dynakin.recordings.frame import GroundFrame
from dynakin.recordings.pushes import JUDGED_N
from dynakin.recordings.recording import Recording
from dynakin.units import GRAVITY_M_S2, PERSON_MASS_KG

UNIT_WITHIN = 0.2
"""A mean load is that of a unit to this part of it: strides that are not whole make no more."""
CONVERT = "The forces are probably in {}: convert them to N in the file"
FORCE_UNITS_N = {"kg of force": GRAVITY_M_S2, "pounds of force": 4.448222, "kN": 1000.0}
"""What forces may be in, in N: by definition."""
STEPPING_S = 0.3
"""How long all feet that stand must be on plates for the load of who steps to be judged."""
MASS_WARNING = 0.05
"""Relative difference between declared mass and the plates' from which it is said."""
MASS_MEAN_RATIO = (0.6, 1.1)
"""The same for the mean of a movement: steps off the plates make it smaller, nothing makes it larger than
m g."""
MASS_RATIO_REFUSED = (0.2, 5.0)
"""Plates' mass over declared mass beyond which the units or plates must be wrong; of who steps also beyond
`MASS_RATIO_OF_UNIT` where a unit explains it."""
MASS_RATIO_OF_UNIT = (0.35, 2.0)
TILT_WARNING_DEG = 10.0
"""Standing force against the vertical; flat standing gives 1 to 3 deg."""


def likely_unit(load: float, mass_kg: float | None = None) -> str:
    """In which other unit a person's mean load of so many "N" may be; "" where it is that of none."""
    units = [("body weights", 1.0), ("N per kg of body mass", GRAVITY_M_S2), ("% of the body weight", 100.0)]
    if mass_kg is None:
        kilograms = 1000.0 * load / GRAVITY_M_S2
        units += [("kN", load)] if PERSON_MASS_KG[0] < kilograms < PERSON_MASS_KG[1] else []
    else:
        units += [(name, mass_kg * GRAVITY_M_S2 / one) for name, one in FORCE_UNITS_N.items()]
    fits = [name for name, of_one in units if abs(load / of_one - 1.0) < UNIT_WITHIN]
    return " or ".join(fits)


def while_loaded(push: Array) -> float:
    """Mean of the larger half of a vertical force (T,)."""
    upward = np.nan_to_num(push)
    return float(upward[upward >= 0.5 * upward.max()].mean())


def check_weight(
    recording: Recording,
    ground: GroundFrame,
    mass_kg: float | None,
    steps_kg: float | None,
    standing: slice | None,
    findings: Findings,
) -> float | None:
    """The mass, kg, by the vertical force, standing or on average over loaded frames, held against the declared one.

    Args:
        mass_kg, steps_kg: as of `check_plates`. standing: frames in which the person stands still on plates.
    """
    total = ground.vectors_to_ground(np.sum([plate.force for plate in recording.plates], axis=0))
    if standing is None:
        loaded = total[np.abs(np.nan_to_num(total[:, 1])) > JUDGED_N]
        when = f"mean of {len(loaded)} loaded frames; the person does not stand still for 0.5 s"
    else:
        loaded = total[standing]
        start, stop = recording.time[standing.start], recording.time[standing.stop - 1]
        when = f"standing still from {start:.4g} s to {stop:.4g} s"
    loaded = loaded[np.isfinite(loaded).all(axis=1)]
    if not len(loaded):
        unit = likely_unit(while_loaded(total[:, 1]), mass_kg or steps_kg)
        action = ""
        if unit:
            action = f". {CONVERT.format(unit)}"
        elif steps_kg is None:
            action = (
                ", and this model needs it; give the forces of the plates that were stood on (--forces), or take "
                "--model fullbody, which does without"
            )
        findings.refuse(f"the plates carry no load: the vertical force stays below {JUDGED_N:g} N{action}")
        return None
    mean = loaded.mean(axis=0)
    vertical = float(mean[1])
    if vertical <= 0:
        findings.refuse(
            f"the vertical force is {vertical:.1f} N ({when}), expected a positive one near m g "
            f"(ground on person, vertical axis {ground.vertical}){_of_the_person(-vertical)}"
        )
        return None
    mass = vertical / GRAVITY_M_S2
    findings.say(f"Vertical force {vertical:.1f} N, that is {mass:.2f} kg ({when}).", "weight")
    tilt = float(np.degrees(np.arctan2(np.hypot(mean[0], mean[2]), vertical)))
    if tilt > TILT_WARNING_DEG:
        findings.warn(f"the mean force is {tilt:.0f} deg off the vertical {ground.vertical}, expected a few degrees.")
    if mass_kg is not None:
        _compare_mass(mass, mass_kg, standing is not None, findings)
    elif standing is not None and not PERSON_MASS_KG[0] < mass < PERSON_MASS_KG[1]:
        findings.refuse(
            f"the plates read {mass:.3g} kg standing, expected a person's mass (nobody on the plates, or another unit "
            "of the forces?)"
        )
    return mass


def _of_the_person(pull: float) -> str:
    """What to do about plates that pull by so much, N, on average: a person's weight is the action on them."""
    if not PERSON_MASS_KG[0] < pull / GRAVITY_M_S2 < PERSON_MASS_KG[1]:
        return ""
    return (
        ". They look like the forces of the person on the plates (action): turn the signs of all forces and moments in "
        "the file"
    )


def check_steps(
    recording: Recording, ground: GroundFrame, mass_kg: float, loads: FootLoads, findings: Findings
) -> None:
    """Hold the load of who lifts each foot in turn against the weight, while all feet that stand are on plates; who
    does not may sit."""
    push = ground.vectors_to_ground(np.sum([plate.force for plate in recording.plates], axis=0))[:, 1]
    known = loads.total_known & np.isfinite(push)
    if not loads.aloft.any(axis=0).all() or not np.count_nonzero(known) >= STEPPING_S * recording.rate:
        return
    load = float(push[known].mean())
    ratio, unit = load / (mass_kg * GRAVITY_M_S2), likely_unit(load, mass_kg)
    low, high = MASS_RATIO_OF_UNIT if unit else MASS_RATIO_REFUSED
    if not low < ratio < high:
        findings.refuse(
            f"the vertical force is {load:.3g} N on average while every foot that stands is on a plate, where "
            f"{mass_kg:g} kg weigh {mass_kg * GRAVITY_M_S2:.0f} N. "
            + (CONVERT.format(unit) if unit else "Look for a wrong unit, or a plate that is missing")
        )


def _compare_mass(mass: float, declared: float, standing: bool, findings: Findings) -> None:
    ratio = mass / declared
    text = f"the plates read {mass:.2f} kg, the declared mass is {declared:g} kg ({100 * (ratio - 1):+z.1f} %)"
    if standing and not MASS_RATIO_REFUSED[0] < ratio < MASS_RATIO_REFUSED[1]:
        findings.refuse(f"{text}; wrong unit, or a plate is missing")
    elif standing and abs(ratio - 1) > MASS_WARNING:
        findings.warn(f"{text}.", "weight")
    elif not standing and not MASS_MEAN_RATIO[0] < ratio < MASS_MEAN_RATIO[1]:
        findings.warn(f"{text}, on average over all loaded frames; another force may act on the plates.", "weight")
    else:
        findings.say(f"Mass: {text}.", "weight")
