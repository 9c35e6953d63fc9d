"""Which way the coordinates of a model count, by how its segments turn: files of one name have knees of both signs."""

from __future__ import annotations

import numpy as np

from dynakin.bindings import _core
from dynakin.filter.sources import moved_segments
from dynakin.results.measures.angles import Convention, convention_of

_STEP = 1e-3
_MOSTLY = 0.5
"""Of a coordinate's turn: an axis that is further from the clinical one has no clinical direction."""


def clinical_signs(model: _core.Model) -> list[int]:
    """Of each coordinate (C,): 1 where it grows as the clinical angle of its name does, -1 against it, 0 where it has
    no clinical name or turns about another axis.

    By a small turn from the posture in which all coordinates are 0, where X is forward, Y up and Z to the right.
    """
    straight = model.spec  # a copy
    straight.coordinates = [_core.CoordinateSpec(name=name) for name in model.coordinate_names]  # none is locked
    free = _core.Model(straight)
    still, segments = free.initial_state(), free.segment_names
    R_still, origins = _core.segment_poses(free, still)
    named = [convention_of(c.name) for c in straight.coordinates]
    parents = {s.name: s.parent for s in straight.segments}
    moved = moved_segments(straight)

    def rises(segment: str) -> bool:
        parent = parents[segment]
        return parent in parents and origins[segments.index(segment), 1] > origins[segments.index(parent), 1]

    # a planar leg stands on its toe: there the thigh turns on the shank
    knees = [s for s, found in zip(moved, named, strict=True) if found and found[0].name == "knee_flexion"]
    stands = any(map(rises, knees))

    def sign(k: int, convention: Convention, side: str) -> int:
        turned = still.copy()
        turned[k] += _STEP
        place = segments.index(moved[k])
        R = _core.segment_poses(free, turned)[0][place] @ R_still[place].T
        axis = "xyz".index(convention.axis[1])
        turn = (R - R.T)[(axis + 2) % 3, (axis + 1) % 3] / (2.0 * _STEP)
        turn *= -1.0 if convention.axis[0] == "-" else 1.0
        turn *= -1.0 if side == "_l" and axis != 2 else 1.0
        turn *= -1.0 if stands and convention.leg else 1.0
        return int(np.sign(turn)) if abs(turn) > _MOSTLY else 0

    return [0 if found is None else sign(k, *found) for k, found in enumerate(named)]
