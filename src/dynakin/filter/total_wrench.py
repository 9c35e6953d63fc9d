"""When the plates tell the total external wrench of a body that is fixed nowhere, and when they do not."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from dynakin.model import InitialModel
from dynakin.recordings import Recording
from dynakin.recordings.foot_loads import foot_loads
from dynakin.units import GRAVITY_M_S2

Array = npt.NDArray[np.float64]


def leave_out_unknown(
    recording: Recording, initial: InitialModel, wrench: Array, assigned: Mapping[str, str]
) -> list[str]:
    """Make the rows of the total wrench (T, 6) NaN, in place, where the plates do not tell all of it.

    Args:
        assigned: plate -> foot, where the user knows better.

    Returns:
        What there is to say, with times.
    """
    if not recording.plates:
        return ["No force plates: the total wrench is left out, and inertial parameters stay as the table has them."]
    loads = foot_loads(recording, initial.ground, assigned=assigned)
    wrench[~loads.total_known] = np.nan
    used = int(np.count_nonzero(np.isfinite(wrench).all(axis=1)))
    return [*loads.messages, f"The total wrench is measured in {used} of {len(wrench)} frames."]


def foreign_total(wrench: Array, mass_kg: float, tolerance: float | None) -> str | None:
    """A sentence where the mean vertical force of the known frames of the wrench (T, 6) is not the person's weight.

    Args:
        tolerance: part of the weight by which they may differ; None: nobody asks.
    """
    push = wrench[np.isfinite(wrench).all(axis=1), 1]
    if tolerance is None or len(push) < 10:
        return None
    load = float(push.mean()) / GRAVITY_M_S2
    if abs(load - mass_kg) <= tolerance * mass_kg:
        return None
    return (
        f"Warning: the plates carry {load:.1f} kg on average where the person weighs {mass_kg:.1f} kg (more than "
        f"{100.0 * tolerance:.0f} % apart): the mass is wrong, or something that the model does not have bears on them "
        "(a weight, a cable, a rail). The plates are not used."
    )
