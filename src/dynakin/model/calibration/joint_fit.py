"""Coordinates of one joint by itself, from where its segment is."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from dynakin.arrays import wrapped
from dynakin.bindings import _core
from dynakin.model.schema import kinds_of

Array = npt.NDArray[np.float64]

_EXACT_M2 = 1e-20
"""Cost of a fit that meets its target: rotations to 1e-10."""
_THIRD = 2.1  # rad: half a turn off is a saddle, a third is not
_SAME_M2 = 1e-12
"""Costs that differ by less are of the same pose."""


def joint_coordinates(
    segment: _core.SegmentSpec,
    coordinates: Sequence[_core.CoordinateSpec],
    target: tuple[Array, Array],
    parameters: Sequence[_core.ParameterSpec] = (),
) -> dict[str, float]:
    """Coordinates that bring a segment nearest to a pose; of several that do, those that turn least from their start.

    Args:
        segment: with the joint by which it hangs on what holds it.
        coordinates: the joint's, among others perhaps; their values are the start, locked ones stay.
        target: rotation (3, 3) and origin (3,) m of the segment in what holds it.
        parameters: those that the joint names.

    Returns:
        The free ones by name; rotations within half a turn.
    """
    own = {axis.coordinate for axis in segment.axes}
    used = [c for c in coordinates if c.name in own]
    free = [c for c in used if not c.locked]
    if not free:
        return {}
    arms = np.sqrt(3.0) * np.eye(3)  # about the origin: what is missed of the turn moves the segment nowhere
    points = [*arms, *-arms]
    markers = [
        _core.MarkerSpec(f"point{k}", segment.name, point, estimated=[False] * 3) for k, point in enumerate(points)
    ]
    alone = _core.SegmentSpec(
        segment.name, rotation=segment.rotation, translation=segment.translation, lengths=segment.lengths,
        axes=segment.axes,
    )  # fmt: skip
    known = [_core.ParameterSpec(p.name, p.value, estimated=False) for p in parameters]
    model = _core.Model(_core.ModelSpec("joint", used, known, [alone], markers))
    kinds = kinds_of([segment])
    turns = np.array([kinds[c.name] == "rotation" for c in free])
    places = np.array([target[0] @ point + target[1] for point in points])
    wide, none = np.full(len(free), np.inf), np.zeros(len(free))

    def fitted(start: Array) -> tuple[Array, float]:
        x = np.zeros(model.layout.size)
        x[: len(free)] = start
        q, cost, _ = _core.fit_posture(model, x, places, -wide, wide, none + 1.0, none, none)
        q[turns] = wrapped(q[turns])
        return q, cost

    def rank(fit: tuple[Array, float]) -> tuple[int, float]:
        return round(fit[1] / _SAME_M2), float(np.abs(fit[0] - rest).sum())

    rest = np.array([c.value for c in free])
    fits = [fitted(rest)]
    if fits[0][1] > _EXACT_M2 or np.abs(fits[0][0] - rest)[turns].max(initial=0.0) > 0.5 * np.pi:
        for k in np.flatnonzero(turns):
            fits += [fitted(rest + angle * np.eye(len(free))[k]) for angle in (_THIRD, -_THIRD)]
        # Three turns at right angles to each other have two readings of every pose.
        fits += [fitted(_other_reading(q, turns)) for q, _ in fits]
    best = min(fits, key=rank)[0]
    return {c.name: float(value) for c, value in zip(free, best, strict=True)}


def _other_reading(values: Array, turning: npt.NDArray[np.bool_]) -> Array:
    """The same pose by three turns about axes at right angles to each other: half a turn more, the middle one's
    supplement, half a turn more; a start like any other where the axes are not."""
    found = values.copy()
    turns = np.flatnonzero(turning)
    if len(turns) == 3:
        found[turns] = [values[turns[0]] + np.pi, np.pi - values[turns[1]], values[turns[2]] + np.pi]
    return found
