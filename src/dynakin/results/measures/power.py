"""Power of the joints and the work that they do."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from dynakin.arrays import Array
from dynakin.results.estimate import Estimate, tree_of
from dynakin.results.measures.stances import counted


class Work(NamedTuple):
    """Work of one coordinate, J: what it gave (positive) and what it took up (negative), and the power's peaks, W."""

    positive_j: float
    negative_j: float
    peak_w: float
    lowest_w: float


def work_of(time: Array, power: Array) -> Work:
    """By the trapezium rule on the positive and on the negative part; where the power is NaN nothing is counted.

    Args:
        time: (T,) s. power: (T,) W.
    """
    parts = []
    for part in (np.maximum(power, 0.0), np.minimum(power, 0.0)):
        steps = np.diff(time) * 0.5 * (part[1:] + part[:-1])
        parts.append(float(np.nansum(steps)))
    known = power[np.isfinite(power)]
    peak, lowest = (float(known.max()), float(known.min())) if len(known) else (float("nan"), float("nan"))
    return Work(parts[0], parts[1], peak, lowest)


def root_coordinates(estimate: Estimate) -> set[str]:
    """Coordinates of the joints by which the body hangs on the ground; empty where an estimate does not hold them."""
    if "coordinate_segment" not in estimate.data.coords:
        return set()
    roots = tree_of(estimate.data).roots
    segments = estimate.data["coordinate_segment"].values
    return {n for n, s in zip(estimate.coordinate_names, segments, strict=True) if str(s) in roots}


def work(estimate: Estimate, window: npt.NDArray[np.bool_]) -> dict[str, dict[str, float | None]]:
    """Of each coordinate that a measured moment acts along: work in J and J/kg, peaks in W, over the frames ``window``.

    Where a leg's moments are not measured throughout, over its whole measured stances and swings (`counted`);
    ``frames`` says over how many. Coordinates of the root are left out: the moment of a fixed one (a planar model's
    toe) is the ground's, and a floating one has none.
    """
    mass, root = estimate.mass_kg, root_coordinates(estimate)
    taken = counted(estimate, window)
    powers = np.where(taken, estimate.powers(), np.nan)
    found: dict[str, dict[str, float | None]] = {}
    for k, name in enumerate(estimate.coordinate_names):
        if name in root or not np.abs(np.nan_to_num(powers[:, k])).any():  # locked, or never known
            continue
        own = work_of(estimate.time, powers[:, k])
        per_kg = {
            "positive_j_per_kg": own.positive_j / mass if mass else None,
            "negative_j_per_kg": own.negative_j / mass if mass else None,
        }
        found[name] = own._asdict() | per_kg | {"frames": int(taken[:, k].sum())}
    return found
