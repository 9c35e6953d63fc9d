"""How alike the two sides are."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from dynakin.results.feet import DERIVED, NOT_MEASURED
from dynakin.results.power import work_of

if TYPE_CHECKING:
    from dynakin.results.estimate import Estimate

Array = npt.NDArray[np.float64]

WHAT = "(right - left) / mean of both, per cent (Robinson, Herzog and Nigg 1987): positive where the right is larger"


def symmetry_index(right: float, left: float) -> float | None:
    """Symmetry index in per cent, -200 to 200; None where both are zero or one is not known.

    Robinson, Herzog and Nigg, Use of force platform variables to quantify the effects of chiropractic manipulation on
    gait symmetry, J Manipulative Physiol Ther 10 (1987) 172-176.

    Args:
        right, left: magnitudes of the same kind, zero or more.
    """
    if not (np.isfinite(right) and np.isfinite(left)) or right + left <= 0.0:
        return None
    return 100.0 * (right - left) / (0.5 * (right + left))


def paired(names: Sequence[str]) -> Iterator[tuple[str, int, int]]:
    """(name without side, index of the right one, of the left one) where both are there: ``knee_angle_r``, ``_l``."""
    for k, name in enumerate(names):
        if name.endswith("_r") and f"{name[:-2]}_l" in names:
            yield name[:-2], k, names.index(f"{name[:-2]}_l")


def asymmetry(estimate: Estimate, window: npt.NDArray[np.bool_]) -> dict[str, Any] | None:
    """Symmetry indices over the frames ``window``; None in a model that has no left and right.

    Frames in which a moment or a foot's wrench is derived from the motion, because a plate is missing, do not count.

    Returns:
        ``coordinates``: by name without side, of the range of motion, the largest moment (absolute), positive and
        negative work. ``feet``: of the largest vertical force and of the impulse, where the feet's wrenches are known.
    """
    time = estimate.time[window]
    angles, moments = (
        estimate.data[name].transpose("time", "coordinate").values[window] for name in ("coordinates", "moments")
    )
    # What is derived from the motion carries its errors: peaks of it would be taken for the person's.
    derived = _derived(estimate, "moment_source", "coordinate", DERIVED)[window]
    moments, power = np.where(derived, np.nan, moments), np.where(derived, np.nan, estimate.powers()[window])
    found: dict[str, Any] = {}
    for name, *sides in paired(estimate.coordinate_names):
        done = [work_of(time, power[:, k]) for k in sides]
        magnitudes = {
            "range": [_range(angles[:, k]) for k in sides],
            "peak_moment": [_largest(moments[:, k]) for k in sides],
            "positive_work": [w.positive_j for w in done],
            "negative_work": [-w.negative_j for w in done],
        }
        found[name] = {key: symmetry_index(*pair) for key, pair in magnitudes.items()}
    feet = _feet(estimate, time, window)
    if not found and feet is None:
        return None
    return {"what": WHAT, "coordinates": found, "feet": feet}


def _feet(estimate: Estimate, time: Array, window: npt.NDArray[np.bool_]) -> dict[str, float | None] | None:
    names = estimate.foot_names
    if "right" not in names or "left" not in names:
        return None
    push = estimate.data["foot_wrench"].sel(component="fy").transpose("time", "foot").values[window]
    push = np.where(_derived(estimate, "foot_contact", "foot", NOT_MEASURED)[window], np.nan, push)
    sides = [push[:, names.index(side)] for side in ("right", "left")]
    return {
        "peak_vertical_force": symmetry_index(*(_largest(side) for side in sides)),
        "impulse": symmetry_index(*(work_of(time, side).positive_j for side in sides)),
    }


def _derived(estimate: Estimate, name: str, across: str, code: int) -> npt.NDArray[np.bool_]:
    """(T, across) bool: where the code of ``name`` says so; nowhere in a model that has no such codes."""
    if name not in estimate.data:
        return np.zeros((len(estimate.time), estimate.data.sizes[across]), dtype=bool)
    return np.asarray(estimate.data[name].transpose("time", across).values == code)


def _range(values: Array) -> float:
    known = values[np.isfinite(values)]
    return float(np.ptp(known)) if len(known) else float("nan")


def _largest(values: Array) -> float:
    known = np.abs(values[np.isfinite(values)])
    return float(known.max()) if len(known) else float("nan")
