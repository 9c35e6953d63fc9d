"""Angles that were held at the ends of their ranges are named."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import xarray as xr

from dynakin.filter.events import _coordinates_at_bounds
from dynakin.model.spec import free_names
from support.systematic_leg import spec


def test_a_limit_that_only_the_filter_met_is_told_where_it_was_in_the_way() -> None:
    """Smoothed, hips that were held 10 deg short of the truth lay inside their range, and the run was clean."""
    person: Any = SimpleNamespace(spec=spec(), lower=np.full(30, -0.7), upper=np.full(30, 0.7))
    names = free_names(person.spec)
    state, held = np.zeros((100, 30)), np.zeros((100, len(names)), dtype=bool)
    held[10:22, names.index("turn")] = True  # 0.12 s
    for first in range(0, 90, 12):
        held[first : first + 10, names.index("knee")] = True  # 0.1 s, again and again: noise at the end of the range
    state[50:52, names.index("flexion")] = 0.7
    data = xr.Dataset(
        {"at_limit": (("time", "coordinate"), held), "state": (("time", "element"), state)},
        coords={"time": 5.0 + 0.01 * np.arange(100), "coordinate": list(names)},
    )
    found = {event.subject: event.message for event in _coordinates_at_bounds(data, person)}
    assert found.keys() == {"turn", "flexion"}
    assert found["turn"].startswith("held at its joint limit for 12 frames")
