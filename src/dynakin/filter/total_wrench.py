"""When the plates tell the total external wrench of a body that is fixed nowhere, and when they do not."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from dynakin.errors import RecordingError
from dynakin.filter.foot_wrenches import FootWrenches
from dynakin.filter.noise import Noise
from dynakin.model import InitialModel
from dynakin.recordings import PlateCheck, Recording, check_plates
from dynakin.recordings import foot_loads as on_plates
from dynakin.recordings.foot_loads import LOADED_N, FootLoads, foot_loads
from dynakin.results.feet import IN_THE_AIR, MEASURED, NOT_MEASURED
from dynakin.units import GRAVITY_M_S2

Array = npt.NDArray[np.float64]


MASS_APART = 0.05
"""Part of the weight by which the plates' mean may differ before the mass is doubted: movement explains 2 or 3 %."""

_CONTACT = {
    on_plates.SWING: IN_THE_AIR,
    on_plates.MEASURED: MEASURED,
    on_plates.SHARED: MEASURED,
    on_plates.OFF_PLATE: NOT_MEASURED,
    on_plates.UNKNOWN: NOT_MEASURED,
}
_SHARED_PART = 0.2
"""Part of a foot's load by which the division of a shared plate may err."""
_SHARED_REACH_M = 0.1
"""How far, as an arm of that force, its point may err."""


def foot_wrenches(loads: FootLoads, initial: InitialModel, noise: Noise) -> FootWrenches:
    """Each foot's wrench with its uncertainty: the plates' noise at the foot's centre of pressure.

    On a shared plate the division is known to a fifth of the load, and to the feet's distance.
    """
    contact = np.vectorize(_CONTACT.get, otypes=[np.uint8])(loads.reason)
    wrench = np.nan_to_num(loads.wrench)
    push = np.maximum(wrench[..., 1], LOADED_N)
    zero = np.zeros_like(push)
    pressure = np.stack([wrench[..., 5] / push, zero, -wrench[..., 3] / push], axis=-1)
    shared = np.where(loads.reason == on_plates.SHARED, _SHARED_PART * push, 0.0)[..., None]
    force = np.hypot(np.sqrt(noise.force / 2.0), shared)  # the noise declared is that of both together
    moment = np.hypot(np.sqrt(noise.moment / 2.0), _SHARED_REACH_M * shared)
    segments = [initial.feet[foot] for foot in loads.feet]
    return FootWrenches.of(loads.feet, segments, loads.wrench, contact, force, moment, pressure)


def known_total(
    recording: Recording, initial: InitialModel, wrench: Array, assigned: Mapping[str, str] | None = None
) -> tuple[PlateCheck, FootLoads | None, list[str]]:
    """Check the plates, and leave out (NaN, in place) the frames in which they do not tell the total wrench (T, 6) of a
    floating model.

    Args:
        recording: with plates. assigned: plate -> foot, as for `foot_loads`.

    Returns:
        What the check found, the load of each foot (None for a model that stands fixed), and what there is to say.

    Raises:
        RecordingError: the plates are refused.
    """
    loads = foot_loads(recording, initial.ground, assigned=assigned) if initial.feet else None
    # steps beside the plates: their mean load is no mass
    check = check_plates(recording, initial.ground, None if initial.feet else initial.weighed_kg)
    if check.refusal:
        raise RecordingError(f"{recording.path or recording.name}: {check.refusal}")
    return check, loads, [*check.messages, *(leave_out_unknown(loads, wrench) if loads is not None else [])]


def leave_out_unknown(loads: FootLoads, wrench: Array) -> list[str]:
    """Make the rows of the total wrench (T, 6) NaN, in place, where the plates do not tell all of it.

    Returns:
        What there is to say, with times.
    """
    wrench[~loads.total_known] = np.nan
    used = int(np.count_nonzero(np.isfinite(wrench).all(axis=1)))
    return [*loads.messages, f"The total wrench is measured in {used} of {len(wrench)} frames."]


def doubtful_mass(wrench: Array, mass_kg: float) -> str | None:
    """A sentence where the mean vertical force of the known frames of the wrench (T, 6) contradicts the mass."""
    load = _mean_load_kg(wrench, least=50)
    if load is None or abs(load - mass_kg) <= MASS_APART * mass_kg:
        return None
    return (
        f"Warning: the plates carry {load:.1f} kg on average where the person weighs {mass_kg:.1f} kg "
        f"({100.0 * abs(load - mass_kg) / mass_kg:.0f} % apart, expected within {100.0 * MASS_APART:.0f} %): check the "
        "mass. Forces, moments and inertia take the error on, and no delay of the plates is taken off, because a wrong "
        "mass looks like one."
    )


def leave_out_foreign(check: PlateCheck, wrench: Array, initial: InitialModel, tolerance: float | None) -> list[str]:
    """Make the wrench (T, 6) NaN, in place, where the plates' load is not the person's weight; a sentence then.

    Args:
        tolerance: part of the weight by which they may differ; None: nobody asks.
    """
    mass_kg = initial.weighed_kg
    if initial.feet:
        load, mean, bears = _mean_load_kg(wrench, least=10), " on average", "a weight, a cable, a rail"
    else:
        load = check.mass_kg_from_plates if check.mass_kg_from_plates is not None else check.mean_mass_kg
        mean, bears = "", "a weight, a cable, a rail, a foot beside a plate"
    if tolerance is None or load is None or abs(load - mass_kg) <= tolerance * mass_kg:
        return []
    wrench[:] = np.nan
    return [
        f"Warning: the plates carry {load:.1f} kg{mean} where the person weighs {mass_kg:.1f} kg (more than "
        f"{100.0 * tolerance:.0f} % apart): the mass is wrong, or something that the model does not have bears on them "
        f"({bears}). The plates are not used."
    ]


def _mean_load_kg(wrench: Array, least: int) -> float | None:
    """Mean vertical force of the known frames of a wrench (T, 6) as a mass; None of fewer than ``least``."""
    push = wrench[np.isfinite(wrench).all(axis=1), 1]
    return float(push.mean()) / GRAVITY_M_S2 if len(push) >= least else None
