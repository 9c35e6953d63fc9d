"""What is known of a subject's bodies before any trial, and what holds in the plane and in space alike."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class BodyPriors:
    """Standard deviations about the table, a segment."""

    log_mass: float = 0.10
    """Of the logarithm of each mass, before the total is held: tables differ by that much (settings.model)."""
    centre_fraction: float = 0.03
    """Of the centre of mass along each axis, over the segment's length. Tables differ by 2 to 5 %."""
    log_gyration: float = 0.07
    """Of the logarithm of the radius of gyration about the centre of mass."""
    sides_apart: float = 0.25
    """Of what a left segment may differ by from the right one, over the deviations above: 2.5 % of a mass."""


def masses_of(total: float, table: Array, a: Array) -> Array:
    """(S,) kg from logarithms a (S,): positive, and their sum is ``total``."""
    weight = table * np.exp(a - a.max())
    return np.asarray(total * weight / weight.sum())


def paired_with(name: str, names: tuple[str, ...]) -> str | None:
    """The right segment (``_r``) of a left one (``_l``); None where there is none."""
    right = f"{name[:-2]}_r"
    return right if name.endswith("_l") and right in names else None
