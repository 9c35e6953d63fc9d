"""How alike the two sides are."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from dynakin.arrays import Array
from dynakin.results.estimate import Estimate
from dynakin.results.measures import sources
from dynakin.results.measures.feet import foot_sources
from dynakin.results.measures.power import work_of
from dynakin.results.measures.stances import compared_stances

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

    What depends on the ground's reaction is compared where both sides are measured: who steps by the means over each
    foot's whole measured stances (touch-down to toe-off), who stays on the feet, and arms, over the whole window. The
    impulse of a part of a stance, or a peak that may lie outside it, is never compared.

    Returns:
        ``coordinates``: by name without side, of the range of motion, the largest moment (absolute), positive and
        negative work. ``small``: by name those whose sides are both next to nothing, so that the ratio says little.
        ``feet``: of the largest vertical force and of the impulse, where the feet's wrenches are known.
        ``stances``: how many of each foot were compared, None where the window was. ``reason``: why legs are not.
    """
    time = estimate.time
    angles = estimate.known("coordinates")[window]
    moments = sources.measured_moments(estimate.data)
    power = sources.measured_only(estimate.powers(), sources.moment_sources(estimate.data))
    stances, legs = compared_stances(estimate, window), sources.legs_of(estimate.data)
    start, end = int(np.flatnonzero(window)[0]), int(np.flatnonzero(window)[-1]) + 1
    sizes: dict[str, dict[str, tuple[float, float]]] = {}
    held = estimate.held
    for name, *sides in paired(estimate.coordinate_names):
        if any(estimate.coordinate_names[k] in held for k in sides):
            continue  # nothing is known of that side
        parts = [[slice(start, end)] if stances is None or not legs[k] else stances[legs[k]] for k in sides]
        each = [
            {
                "range": _range(angles[:, k]),
                "peak_moment": _mean(_largest, moments[:, k], own),
                "positive_work": _mean(lambda w, at: work_of(at, w).positive_j, power[:, k], own, time),
                "negative_work": _mean(lambda w, at: work_of(at, -w).positive_j, power[:, k], own, time),
            }
            for k, own in zip(sides, parts, strict=True)
        ]
        sizes[name] = {key: (each[0][key], each[1][key]) for key in each[0]}
    found = {name: {key: symmetry_index(*pair) for key, pair in own.items()} for name, own in sizes.items()}
    feet = _feet(estimate, stances, slice(start, end))
    if not found and feet is None:
        return None
    return {
        "what": WHAT,
        "coordinates": found,
        "small": _small(sizes),
        "feet": feet,
        "stances": None if stances is None else {foot: len(own) for foot, own in stances.items()},
        "reason": _reason(estimate, stances, window),
    }


NOT_MEANT = 0.02
"""Below this share of the largest of its kind a quantity is too small for a ratio of the sides to say anything."""


def _small(sizes: Mapping[str, Mapping[str, tuple[float, float]]]) -> dict[str, list[str]]:
    """Of the right and left sizes of each quantity by stem those whose larger side is a small part (`NOT_MEANT`) of the
    largest of all."""
    larger = {stem: {key: np.nanmax([*pair, 0.0]) for key, pair in own.items()} for stem, own in sizes.items()}
    most = {key: max(own[key] for own in larger.values()) for own in larger.values() for key in own}
    small = {stem: [key for key in own if own[key] < NOT_MEANT * most[key]] for stem, own in larger.items()}
    return {stem: keys for stem, keys in small.items() if keys}


def _reason(estimate: Estimate, stances: dict[str, list[slice]] | None, window: npt.NDArray[np.bool_]) -> str | None:
    """Why moments, work or forces of the sides are not compared; None where they are."""
    if stances is None:
        codes, legs = sources.moment_sources(estimate.data)[window], sources.legs_of(estimate.data)
        if not codes[:, [bool(leg) or not any(legs) for leg in legs]].any():
            return None
        return "Moments of the legs are not measured in every frame, and what is missing may hold the peak."
    lacking = [foot for foot, own in stances.items() if not own]
    if not lacking:
        return None
    noun, verb = ("foot", "has") if len(lacking) == 1 else ("feet", "have")
    return (
        f"The {' and '.join(lacking)} {noun} {verb} no stance that is measured from touch-down to toe-off: a part of "
        "one has no peak and no impulse to compare."
    )


def _feet(estimate: Estimate, stances: dict[str, list[slice]] | None, window: slice) -> dict[str, float | None] | None:
    names = estimate.foot_names
    if "right" not in names or "left" not in names or "foot_wrench" not in estimate.data:
        return None
    push = estimate.data["foot_wrench"].sel(component="fy").transpose("time", "foot").values
    push = sources.measured_only(push, foot_sources(estimate.data))
    parts = {foot: [window] if stances is None else stances[foot] for foot in ("right", "left")}
    columns = {foot: push[:, names.index(foot)] for foot in parts}
    return {
        "peak_vertical_force": symmetry_index(*(_mean(_largest, columns[foot], own) for foot, own in parts.items())),
        "impulse": symmetry_index(
            *(_mean(np.trapezoid, columns[foot], own, estimate.time) for foot, own in parts.items())
        ),
    }


def _mean(of: Callable[..., float], values: Array, parts: Sequence[slice], *along: Array) -> float:
    """Mean over the parts that are known throughout; NaN where none is."""
    each = [of(values[p], *(a[p] for a in along)) for p in parts if np.isfinite(values[p]).all()]
    return float(np.mean(each)) if each else float("nan")


def _range(values: Array) -> float:
    """NaN where not all is known: what is missing may hold the largest or the smallest."""
    return float(np.ptp(values)) if len(values) else float("nan")


def _largest(values: Array) -> float:
    return float(np.abs(values).max())
