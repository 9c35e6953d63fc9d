"""In which other unit than N a file may have its forces."""

from __future__ import annotations

import numpy as np

from dynakin.recordings.recording import Array
from dynakin.units import GRAVITY_M_S2

UNIT_WITHIN = 0.2
"""A mean load is that of a unit to this part of it: strides that are not whole make no more."""
CONVERT = "The forces are probably in {}: convert them to N in the file"
STEPPING_S = 0.3
"""How long all feet that stand must be on plates for the load of who steps to be judged."""


def likely_unit(load: float, mass_kg: float | None = None) -> str:
    """In which other unit a person's mean load of so many "N" may be; "" where it is that of none."""
    units = [("body weights", 1.0), ("N per kg of body mass", GRAVITY_M_S2), ("% of the body weight", 100.0)]
    if mass_kg is not None:
        newtons = [("kg of force", GRAVITY_M_S2), ("pounds of force", 4.448222), ("kN", 1000.0)]
        units += [(name, mass_kg * GRAVITY_M_S2 / one) for name, one in newtons]
    fits = [name for name, of_one in units if abs(load / of_one - 1.0) < UNIT_WITHIN]
    return " or ".join(fits)


def while_loaded(push: Array) -> float:
    """Mean of the larger half of a vertical force (T,)."""
    upward = np.nan_to_num(push)
    return float(upward[upward >= 0.5 * upward.max()].mean())
