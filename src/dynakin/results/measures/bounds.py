"""Parameters on the bounds of (9): how many of each kind, which, and for how much of the time."""

from __future__ import annotations

from typing import Any, get_args

import numpy as np

from dynakin.results.estimate import Estimate
from dynakin.results.records import ParameterKind

KIND_WORDS: dict[ParameterKind, str] = {
    "length": "lengths",
    "marker": "marker places",
    "inertia": "inertial numbers",
    "plates": "plate errors",
}
# A constraint that is solved for may stop short of the bound by rounding: this share of the interval.
ON_THE_BOUND = 1e-9


def bound_shares(estimate: Estimate, window: np.ndarray) -> dict[str, float]:
    """Share of the frames ``window`` (T,) bool that each estimated parameter with bounds spends on one of them."""
    elements = {str(name): k for k, name in enumerate(estimate.data["element"].values)}
    state = estimate.values("state")[window]
    shares = {}
    for p in estimate.parameters:
        if not p.estimated or (p.lower is None and p.upper is None):
            continue
        lower = -np.inf if p.lower is None else p.lower
        upper = np.inf if p.upper is None else p.upper
        slack = ON_THE_BOUND * (upper - lower) if np.isfinite(upper - lower) else 0.0
        path = state[:, elements[p.name]]
        shares[p.name] = float(np.mean((path <= lower + slack) | (path >= upper - slack)))
    return shares


def parameter_bounds(estimate: Estimate, window: np.ndarray) -> dict[str, Any]:
    """The block ``bounds`` of ``metrics.json``: counts of each kind, and the parameters that were on a bound."""
    shares = bound_shares(estimate, window)
    kinds = {}
    for kind in get_args(ParameterKind):
        group = [p for p in estimate.parameters if p.kind == kind and p.estimated and p.lower is not None]
        if group:
            kinds[kind] = {
                "estimated": len(group),
                "at_end": sum(p.at_bound for p in group),
                "ever": sum(p.at_bound or shares.get(p.name, 0.0) > 0.0 for p in group),
            }
    touched = {
        p.name: {"share_of_time": shares.get(p.name, 0.0), "at_end": p.at_bound}
        for p in estimate.parameters
        if p.estimated and (p.at_bound or shares.get(p.name, 0.0) > 0.0)
    }
    return {
        "what": "on a bound in the last frame (at_end), in any frame of the window (ever); share of the frames",
        "by_kind": kinds,
        "parameters": touched,
    }


def counts_in_words(by_kind: dict[str, dict[str, int]]) -> str:
    """`1 of 6 lengths, 0 of 20 marker places`: how many of each kind end on a bound."""
    return ", ".join(f"{n['at_end']} of {n['estimated']} {KIND_WORDS[kind]}" for kind, n in _kinds(by_kind))


def _kinds(by_kind: dict[str, dict[str, int]]) -> list[tuple[ParameterKind, dict[str, int]]]:
    return [(kind, by_kind[kind]) for kind in KIND_WORDS if kind in by_kind]
