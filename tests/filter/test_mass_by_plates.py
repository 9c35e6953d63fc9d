"""What the plates say of the mass: the same whatever mass is given, and nothing that a short stretch cannot show."""

from __future__ import annotations

import numpy as np
import pytest

from dynakin.filter.ground.load_ratio import load_ratio
from dynakin.messages import about
from support.plates import person, trial, with_forces


@pytest.mark.parametrize("times", [0.88, 0.95, 1.0, 1.05, 1.14])
def test_the_mass_by_the_plates_does_not_rest_on_the_declared_one(times: float) -> None:
    """A walk's 62.6 kg were 61.7 where 55 were given, and 64.4 where it was 75: who took them over was 3 % off."""
    time = np.arange(400) / 100.0
    weight = 600.0
    need = weight * (1.0 + 0.2 * np.sin(2.0 * np.pi * 1.8 * time))
    off = 0.05 * np.sin(2.0 * np.pi * 0.7 * time)
    found = load_ratio(need, times * need * (1.0 + off), np.ones(400, dtype=bool), weight, 100, 0.2, 0.0)
    assert found == pytest.approx(times, abs=0.006)


@pytest.mark.parametrize(
    ("start_s", "lasts_s", "times", "told"),
    [
        (1.52, 0.13, 1.0, False),  # the plates carry 1.22 times the weight
        (1.96, 0.13, 1.0, False),  # 0.77
        (1.96, 0.09, 1.0, False),  # 0.72
        (1.5, 0.19, 2.0, True),
        (1.9, 0.19, 0.6, True),
    ],
)
def test_a_right_mass_is_not_doubted_by_what_lifts_the_body(
    start_s: float, lasts_s: float, times: float, told: bool
) -> None:
    """So few frames of a walk were said to show a wrong mass, and the plates were not used."""
    cut = with_forces(trial("gait"), lambda force: times * force).window(start_s, start_s + lasts_s)
    ready = person().prepare(cut)
    said = [message for message in about(ready.messages, "weight") if "the plates carry" in message.text]
    assert len(said) == told
