"""How a moving floor moves: the speed of a treadmill's belt, by the feet that it carries along."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from dynakin.arrays import Array, Flags, runs

WINDOW_S = 4.0
"""Stretch over which a belt's speed is taken for one: some strides. It may change from one to the next."""
SEEN_S = 0.6
"""Shorter stretches show no belt: in them a foot may do nothing but swing, which takes up to 0.5 s, low over the floor
and at one speed for a tenth of a second."""
STILL_M_S = 0.3
"""Slower than this no belt is looked for: a foot on it is slow enough to stand."""
ALIKE_M_S, ALIKE = 0.15, 0.1
"""Velocities that differ by no more than the larger of this and that part of their size are one and the same."""
STRAIGHT, CARRIED_M = 0.15, 0.2
"""So far a foot must be carried straight on, its velocity the belt's within that part. A pedal (at 60 rpm, crank of
0.17 m) goes straight for 0.05 m at its lowest place."""
BODY = 0.5
"""Part of the belt's speed below which the body's own stays: on a treadmill it stays where it is; a foot that swings
past the floor moves with the body, and faster."""
MOST_SAMPLES = 200


def belt_velocities(feet: Sequence[tuple[Array, Flags]], body: Array, time: Array) -> list[Array]:
    """Horizontal velocity (T, 2) m/s of what each foot stands on; 0 of a floor.

    Args:
        feet: of each, the velocity (T, K, 3) m/s of its markers, ground frame, and (T, K) those near their lowest
            place. body: (T, 3) m/s of the body as a whole. time: (T,) s.
    """
    centres: list[list[float]] = [[] for _ in feet]
    found: list[list[Array]] = [[] for _ in feet]
    for start in np.arange(time[0], max(time[-1] - 0.25 * WINDOW_S, time[0] + 1e-9), 0.5 * WINDOW_S):
        inside = (time >= start) & (time < start + WINDOW_S)
        parts = [(velocity[inside], low[inside]) for velocity, low in feet]
        for f, speed in enumerate(velocities(parts, body[inside], time[inside])):
            if speed is not None:
                centres[f].append(float(time[inside].mean()))
                found[f].append(speed)
    return [_drawn(time, at, speeds) for at, speeds in zip(centres, found, strict=True)]


def _drawn(time: Array, centres: list[float], found: list[Array]) -> Array:
    if not found:
        return np.zeros((len(time), 2))
    return np.stack([np.interp(time, centres, [v[c] for v in found]) for c in (0, 1)], axis=1)


def velocities(feet: Sequence[tuple[Array, Flags]], body: Array, time: Array) -> list[Array | None]:
    """`one_velocity` of each foot. A belt that carries one foot need not be shown by the other as well: what goes along
    with it is on it."""
    found = [one_velocity(velocity, low, body, time) for velocity, low in feet]
    belts = [v for v in found if v is not None and v.any()]
    for f, (velocity, low) in enumerate(feet):
        if found[f] is None and belts and (mode := _most(velocity, low)) is not None:
            size = float(np.linalg.norm(belts[0]))
            if np.linalg.norm(mode.velocity - belts[0]) < max(ALIKE_M_S, ALIKE * size):
                found[f] = belts[0]
    return found


class _Mode(NamedTuple):
    """The velocity (2,) m/s that low markers have most often, of how many, and how many stand still."""

    velocity: Array
    alike: int
    still: int


def _most(velocity: Array, low: Flags) -> _Mode | None:
    every = velocity[..., [0, 2]][np.asarray(np.isfinite(velocity).all(axis=2)) & low]
    if not len(every):
        return None
    sample = every[:: max(1, len(every) // MOST_SAMPLES)]
    apart = np.linalg.norm(sample[:, None] - sample[None], axis=2)
    reach = np.maximum(ALIKE_M_S, ALIKE * np.linalg.norm(sample, axis=1))
    alike = np.count_nonzero(apart < reach[:, None], axis=1)
    best = int(np.argmax(alike))
    still = np.count_nonzero(np.linalg.norm(sample, axis=1) < STILL_M_S)
    return _Mode(np.median(sample[apart[best] < reach[best]], axis=0), int(alike[best]), int(still))


def one_velocity(velocity: Array, low: Flags, body: Array, time: Array) -> Array | None:
    """(2,) of one stretch, 0 where low markers stand still; None where neither that nor a belt is to be seen.

    Args:
        as of `belt_velocities`, of one foot.
    """
    level, known = velocity[..., [0, 2]], np.asarray(np.isfinite(velocity).all(axis=2)) & low
    most = _most(velocity, low)
    if most is None:
        return None
    mode, size = most.velocity, float(np.linalg.norm(most.velocity))
    if size < STILL_M_S or most.still > 0.5 * most.alike:
        return np.zeros(2)
    if time[-1] - time[0] < SEEN_S:
        return None
    seen = np.isfinite(body).all(axis=1)
    moves = np.linalg.norm(body[seen].mean(axis=0)[[0, 2]]) if seen.any() else np.inf
    return np.asarray(mode) if moves < BODY * size and _carries(level, known, mode, time) else None


def _carries(level: Array, known: Flags, mode: Array, time: Array) -> bool:
    """Whether some marker goes along with a velocity for long enough."""
    size = float(np.linalg.norm(mode))
    with np.errstate(invalid="ignore"):
        along = known & (np.linalg.norm(level - mode, axis=2) < STRAIGHT * size)
    return any(
        size * (time[end - 1] - time[first]) > CARRIED_M
        for m in range(along.shape[1])
        for first, end in runs(along[:, m])
    )
