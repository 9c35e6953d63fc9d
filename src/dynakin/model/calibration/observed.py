"""Which coordinates the markers show at all, by how far each would be known from one frame; the others are held."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt
import scipy.linalg

from dynakin.bindings import _core
from dynakin.model.plan import Geometry, ModelPlan
from dynakin.model.schema import kinds_of
from dynakin.model.spec import free_names, to_core

Array = npt.NDArray[np.float64]

MARKER_SD_M, LOOSE_SD_M, LOOSE_FROM_M = 0.005, 0.015, 0.020
"""Skin with noise; and of what moves by 20 mm or more, such as joint centres that cameras guess."""
PRIOR_SD_RAD, PRIOR_SD_M = np.deg2rad(60.0), 1.0
"""Of each coordinate, before any marker."""
HELD_SD_RAD = 0.2
"""From this deviation on, of the median frame, a coordinate is held: a lever of 25 mm. The least that sets of the field
show is a forearm by two markers at its wrist (0.14); by joint centres alone the trunk on the pelvis has 0.22 to 0.3."""
_ALIKE_RAD = np.deg2rad(5.0)


def hold_unseen(plan: ModelPlan, postures: list[Array]) -> tuple[ModelPlan, dict[str, str]]:
    """The plan with the coordinates locked where they stand that its markers do not show, and why, by coordinate.

    Of several that can stand for each other the one furthest from the root is held first. Coordinates of the root
    never are: something moves the body. All markers count, also those that some frames miss: what is not seen for a
    time is the filter's to hold.

    Args:
        postures: states (n,) of the plan's model at some frames.
    """
    held: dict[str, str] = {}
    depth = _depths(plan)
    kinds = kinds_of(plan.model.segments)
    model = _core.Model(to_core(plan))
    free = free_names(model.spec)
    loose = np.array([site.soft_tissue_m >= LOOSE_FROM_M for site in plan.sites])
    sd_m = np.repeat(np.where(loose, LOOSE_SD_M, MARKER_SD_M), 3)
    jacobians = [_core.marker_jacobian(model, x)[:, : len(free)] / sd_m[:, None] for x in postures]
    prior = np.array([PRIOR_SD_RAD if kinds[name] == "rotation" else PRIOR_SD_M for name in free])
    kept = np.ones(len(free), dtype=bool)
    while True:
        sd = np.median([_deviations(J[:, kept], prior[kept]) for J in jacobians], axis=0)
        names = [name for name, keep in zip(free, kept, strict=True) if keep]
        worst = [
            (round(value / _ALIKE_RAD), depth[name], name)
            for value, name in zip(sd, names, strict=True)
            if value > HELD_SD_RAD and depth[name] > 0 and kinds[name] == "rotation"
        ]
        if not worst:
            break
        name = max(worst)[2]
        kept[free.index(name)] = False
        held[name] = "the markers do not show it"
    if not held:
        return plan, held
    geometry = plan.geometry
    locked = {**geometry.locked, **{name: plan.start[name] for name in held}}
    return replace(plan, geometry=Geometry(geometry.lengths, geometry.directions, locked)), held


def _deviations(J: Array, prior: Array) -> Array:
    """Standard deviations (n,) of each coordinate with the others free, from rows that are in units of theirs."""
    root = np.linalg.cholesky(J.T @ J + np.diag(prior**-2.0))
    spread = scipy.linalg.solve_triangular(root, np.eye(len(root)), lower=True)  # its square is the inverse
    return np.asarray(np.linalg.norm(spread, axis=0))


def _depths(plan: ModelPlan) -> dict[str, int]:
    """How many joints each coordinate's first one is away from the root's."""
    deep = {"ground": -1}
    found: dict[str, int] = {}
    for segment in plan.model.segments:
        deep[segment.name] = deep[segment.parent] + 1
        for axis in segment.axes:
            found.setdefault(axis.coordinate, deep[segment.name])
    return found
