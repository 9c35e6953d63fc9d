"""Did the filter learn the constants? Each kind has settled, is still moving, or was never told anything."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from dynakin.results.estimate import Estimate
from dynakin.results.measures.adaptation import BAND, constant_groups
from dynakin.results.records import Parameter

# A constant that still moves by more than that in the last quarter has not settled: over a recording as long again it
# would move by several per cent.
MOVING = BAND
# A standard deviation that shrinks by less than this says that the recording told nothing about the constant.
TAUGHT = 0.05

Verdict = Literal["settled", "moving", "untaught"]


@dataclass(frozen=True)
class Convergence:
    """What became of one kind of constant.

    ``largest_change_percent`` is the largest change from the start, ``sd_left`` the median of the standard deviation at
    the end over that before the first frame, ``moving`` those that had not settled.
    """

    title: str
    count: int
    verdict: Verdict
    largest_change_percent: float
    sd_left: float
    moving: tuple[Parameter, ...]


def convergence(estimate: Estimate) -> list[Convergence]:
    """Lengths, masses, and moments of inertia; a kind that was not estimated is left out."""
    return [_judge(estimate, title, group) for title, group in constant_groups(estimate.parameters).items()]


def _judge(estimate: Estimate, title: str, group: list[Parameter]) -> Convergence:
    moving, left, largest = [], [], 0.0
    for p in group:
        path = estimate.data["state"].sel(element=p.name).values
        sd = estimate.data["state_sd"].sel(element=p.name).values
        late = path[3 * len(path) // 4 :]
        # smoothed, a constant that moves does so by the drift it was given
        if not estimate.smoothed and np.ptp(late) > MOVING * abs(p.initial) and not p.at_bound:
            moving.append(p)
        first = p.prior_sd or float(sd[0])  # a smoothed estimate knows at its first frame what it learnt later
        left.append(float(sd[-1]) / first if first > 0.0 else 1.0)
        largest = max(largest, abs(p.change_percent() or 0.0))
    sd_left = float(np.median(left))
    still = largest < 100.0 * MOVING
    verdict: Verdict = "moving" if moving else "untaught" if sd_left > 1.0 - TAUGHT and still else "settled"
    return Convergence(title, len(group), verdict, largest, sd_left, tuple(moving))
