"""A person in space on two feet, on a seat as well or in flight: what each contact carries of the wrench that the
motion takes, and which plate feels it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dynakin.arrays import Array, cross
from dynakin.errors import ConfigError

HALF_PLATE_M = (0.30, 0.20)  # half the length and width of a plate
PRESSES_N = 5.0
"""Below it a simulated push has no centre of pressure. It has no noise yet, so that less is enough than of a measured
one (`recordings.pushes.LOADED_N`)."""


@dataclass(frozen=True)
class Seated:
    """What a seat carries: share (T,) of the whole, 0 to 1; it presses at ``place`` (3,) m where the whole's centre of
    pressure lies as the shares say."""

    share: Array
    place: Array


@dataclass(frozen=True)
class Support:
    """How the feet stand at some times.

    right, left: (T, 3) m, where each presses if the whole presses where its share says, on what it stands on.
    share: (T,) of the right foot, 0 to 1; None: as the whole's centre of pressure lies between the two.
    push: with which the feet push apart along the line between them, over the vertical force, times 1/4 where both
    carry the same.
    seated: what a seat takes off the feet. in_flight: (T,) when nothing touches the ground.
    """

    right: Array
    left: Array
    share: Array | None = None
    push: float = 0.12
    seated: Seated | None = None
    in_flight: NDArray[np.bool_] | None = None


@dataclass(frozen=True)
class Footing:
    """A plate and what presses on it: its name, the middle of its top (3,) m, (contact, from s, to s), and half its
    length and width, m."""

    plate: str
    centre: Array
    stances: tuple[tuple[str, float, float], ...]
    half_m: tuple[float, float] = HALF_PLATE_M


def carried_by_contacts(wrench: Array, support: Support) -> tuple[dict[str, Array], dict[str, Array]]:
    """The wrench (T, 6) about the ground origin shared out: by the contact's name (T, 6), and where each presses
    (T, 3) m, NaN below `PRESSES_N`."""
    parts: dict[str, Array] = {}
    on_feet = wrench
    if support.seated is not None:
        seat = np.tile(support.seated.place, (len(wrench), 1))
        between = 0.5 * (support.right + support.left)
        parts["seat"], on_feet = split_between(wrench, Support(seat, between, support.seated.share, push=0.0))
    with np.errstate(divide="ignore", invalid="ignore"):  # nothing presses in flight
        feet = split_between(on_feet, support)
    if support.in_flight is not None:
        right, left = (np.where(support.in_flight[:, None], 0.0, foot) for foot in feet)
        feet = right, left
    carried = {"right foot": feet[0], "left foot": feet[1], **parts}
    heights = {"right foot": support.right[:, 1], "left foot": support.left[:, 1]}
    if support.seated is not None:
        heights["seat"] = np.full(len(wrench), support.seated.place[1])
    return carried, {name: pressed_point(carried[name], heights[name]) for name in carried}


def pressed_point(wrench: Array, height: Array) -> Array:
    """Centre of pressure (T, 3) m of a wrench (T, 6) about the ground origin, at a height (T,) m."""
    fx, fy, fz = wrench[:, :3].T
    loaded = fy > PRESSES_N
    fy = np.where(loaded, fy, np.nan)
    return np.stack([(wrench[:, 5] + height * fx) / fy, height, (height * fz - wrench[:, 3]) / fy], axis=1)


PLATES = ("feet", "all", "shared", "right", "left", "none")
"""What of the contacts has a plate: each foot; the seat as well; one plate below all feet; one foot only; nothing."""


def one_plate(footings: Sequence[Footing]) -> tuple[Footing, ...]:
    """A single plate as large as those of all feet together, in their middle.

    Raises:
        ConfigError: they lie at different heights.
    """
    feet = [f for f in footings if _bears_feet(f)]
    if len({float(f.centre[1]) for f in feet}) != 1:
        raise ConfigError("simulation: plates is 'shared', expected another value where the feet's heights differ")
    half = np.array([[f.half_m[0], 0.0, f.half_m[1]] for f in feet])
    centres = np.array([f.centre for f in feet])
    low, high = (centres - half).min(axis=0), (centres + half).max(axis=0)
    size = 0.5 * (high - low)
    return (
        Footing(
            feet[0].plate,
            0.5 * (low + high),
            tuple(stance for f in feet for stance in f.stances),
            (float(size[0]), float(size[2])),
        ),
    )


def plates_that_measure(footings: Sequence[Footing], plates: str) -> set[str]:
    """Names of those that `PLATES` leaves."""
    wanted = {"all": footings, "none": ()}.get(plates, [f for f in footings if _bears_feet(f)])
    if plates in ("right", "left"):
        wanted = [f for f in wanted if all(contact == f"{plates} foot" for contact, _, _ in f.stances)]
    return {f.plate for f in wanted}


def _bears_feet(footing: Footing) -> bool:
    return all(contact.endswith("foot") for contact, _, _ in footing.stances)


def split_between(wrench: Array, support: Support) -> tuple[Array, Array]:
    """The wrench (T, 6) about the ground origin shared by the right and the left foot.

    Mechanics give only the sum. Force and free moment are shared in one proportion. What the whole's centre of pressure
    lies off the weighted mean of both is made up by theirs, the more by the foot that carries more; so the sum is
    kept. The feet push apart along the line between their centres, which changes no sum.
    """
    force, share = wrench[:, :3], support.share
    # The wrench acts along a line that meets the level between the feet at (x, y, z), with a free moment about the
    # vertical.
    part = 0.5 if share is None else share
    y = part * support.right[:, 1] + (1.0 - part) * support.left[:, 1]
    x, z = (wrench[:, 5] + y * force[:, 0]) / force[:, 1], -(wrench[:, 3] - y * force[:, 2]) / force[:, 1]
    whole = np.stack([x, y, z], axis=1)
    free = wrench[:, 4] - (z * force[:, 0] - x * force[:, 2])
    across = support.right - support.left
    apart = np.sum(across**2, axis=1)
    if share is None:
        share = np.clip(np.sum((whole - support.left) * across, axis=1) / apart, 0.0, 1.0)
    more = share**2 + (1.0 - share) ** 2
    excess = whole - (share[:, None] * support.right + (1.0 - share[:, None]) * support.left)
    points = [
        point + (part / more)[:, None] * excess for part, point in ((share, support.right), (1.0 - share, support.left))
    ]
    line = points[0] - points[1]
    inward = (support.push * share * (1.0 - share) * force[:, 1] / np.linalg.norm(line, axis=1))[:, None] * line
    feet = []
    for part, point, push in ((share, points[0], -inward), (1.0 - share, points[1], inward)):
        own = part[:, None] * force + push
        feet.append(np.hstack([own, cross(point, own) + np.outer(part * free, [0.0, 1.0, 0.0])]))
    return feet[0], feet[1]


def pressed(carried: Mapping[str, Array], time: Array, footing: Footing) -> Array:
    """What the feet's wrenches (T, 6) do to a plate: all of a foot's while it stands there."""
    total = np.zeros((len(time), 6))
    for foot, start, end in footing.stances:
        stands = (time >= start) & (time <= end)
        total += np.where(stands[:, None], carried[foot], 0.0)
    return total
