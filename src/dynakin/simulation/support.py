"""Two feet on a floor in space: what each carries of the wrench that the motion takes, and which plate feels it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Support:
    """How the feet stand at some times.

    right, left: (T, 3) m, where each presses if the whole presses where its share says, on the floor y = 0.
    share: (T,) of the right foot, 0 to 1; None: as the whole's centre of pressure lies between the two.
    push: with which the feet push apart along the line between them, over the vertical force, times 1/4 where both
    carry the same.
    """

    right: Array
    left: Array
    share: Array | None = None
    push: float = 0.12


@dataclass(frozen=True)
class Footing:
    """A plate and the feet that stand on it: its name, the middle of its top (3,) m, and (foot, from s, to s)."""

    plate: str
    centre: Array
    stances: tuple[tuple[str, float, float], ...]


def split_between(wrench: Array, support: Support) -> tuple[Array, Array]:
    """The wrench (T, 6) about the ground origin shared by the right and the left foot.

    Mechanics give only the sum. Force and free moment are shared in one proportion. What the whole's centre of pressure
    lies off the weighted mean of both is made up by theirs, the more by the foot that carries more; so the sum is
    kept. The feet push apart along the line between their centres, which changes no sum.
    """
    force = wrench[:, :3]
    # The wrench acts along a line that meets y = 0 at (x, 0, z), with a free moment about the vertical.
    x, z = wrench[:, 5] / force[:, 1], -wrench[:, 3] / force[:, 1]
    whole = np.stack([x, np.zeros_like(x), z], axis=1)
    free = wrench[:, 4] - (z * force[:, 0] - x * force[:, 2])
    across = support.right - support.left
    apart = np.sum(across**2, axis=1)
    share = support.share
    if share is None:
        share = np.clip(np.sum((whole - support.left) * across, axis=1) / apart, 0.0, 1.0)
    more = share**2 + (1.0 - share) ** 2
    beside = whole - (share[:, None] * support.right + (1.0 - share[:, None]) * support.left)
    points = [
        point + (part / more)[:, None] * beside for part, point in ((share, support.right), (1.0 - share, support.left))
    ]
    line = points[0] - points[1]
    inward = (support.push * share * (1.0 - share) * force[:, 1] / np.linalg.norm(line, axis=1))[:, None] * line
    feet = []
    for part, point, push in ((share, points[0], -inward), (1.0 - share, points[1], inward)):
        own = part[:, None] * force + push
        feet.append(np.hstack([own, np.cross(point, own) + np.outer(part * free, [0.0, 1.0, 0.0])]))
    return feet[0], feet[1]


def pressed(carried: Mapping[str, Array], time: Array, footing: Footing) -> Array:
    """What the feet's wrenches (T, 6) do to a plate: all of a foot's while it stands there."""
    total = np.zeros((len(time), 6))
    for foot, start, end in footing.stances:
        stands = (time >= start) & (time <= end)
        total += np.where(stands[:, None], carried[foot], 0.0)
    return total
