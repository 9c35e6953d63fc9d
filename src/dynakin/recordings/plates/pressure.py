"""A plate's wrench, its centre of pressure and free moment: the two ways of writing one and the same thing; and where a
wrench presses on a level plane."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from dynakin.arrays import Array, cross, filled
from dynakin.recordings.pushes import JUDGED_N, LOADED_N, MOST_OFFSET_N, NOISE_N
from dynakin.recordings.recording import Plate

_LEAST_IDLE = 0.05
"""Part of the time without a load in which a plate shows what it reads then."""


@dataclass(frozen=True)
class Surface:
    """Plane of a plate: a point on it (3,) m and its unit normal (3,) towards the person, laboratory
    frame."""

    point: Array
    normal: Array


def main_axis(plates: Iterable[Plate]) -> int:
    """Axis of the laboratory along which plates carry the most: the vertical one, where nobody says which that is."""
    return int(np.argmax(np.sum([np.abs(np.nan_to_num(plate.force)).sum(axis=0) for plate in plates], axis=0)))


def main_push(plates: Sequence[Plate]) -> Array:
    """(3,) the way that plates push together along that axis: up, by forces as the file signs them."""
    along = main_axis(plates)
    together = sum(float(np.nan_to_num(plate.force[:, along]).sum()) for plate in plates)
    return np.asarray(np.where(np.arange(3) == along, np.sign(together), 0.0))


def centre_of_pressure(force: Array, moment: Array, surface: Surface, threshold_n: float) -> tuple[Array, Array]:
    """Centre of pressure (T, 3) m and free moment (T, 3) N m of a wrench about the laboratory origin.

    With M_c the moment about the surface's point c and n its normal, M_c = r x F + tau n and n . r = 0 give
    r = (n x M_c) / (n . F). NaN (and no free moment) where the push |n . F| stays below ``threshold_n``.
    """
    n, c = surface.normal, surface.point
    moment_c = moment - cross(c, force)
    push = force @ n  # (T,)
    loaded = np.abs(push) >= max(threshold_n, 1e-9)
    r = np.full_like(force, np.nan)
    r[loaded] = cross(n, moment_c[loaded]) / push[loaded, None]
    free = np.zeros_like(force)
    free[loaded] = np.outer((moment_c[loaded] - cross(r[loaded], force[loaded])) @ n, n)
    return c + r, free


def pressed_at(wrench: Array, height_m: float | Array = 0.0, least_n: float = LOADED_N) -> Array:
    """Centres of pressure (..., 2) m, X and Z, of wrenches (..., 6) about the ground's origin on the level plane
    y = ``height_m``, one or (...); NaN where the push is below ``least_n``. What is not known counts as 0."""
    fx, fy, fz, mx, _, mz = np.moveaxis(filled(wrench), -1, 0)
    push = np.where(fy >= least_n, fy, np.nan)
    return np.stack([mz + fx * height_m, fz * height_m - mx], axis=-1) / push[..., None]


def free_moments(wrench: Array, least_n: float = LOADED_N) -> Array:
    """(...,) N m about the vertical where wrenches (..., 6) press; 0 where the push is below ``least_n``. What is not
    known counts as 0."""
    known, at = filled(wrench), pressed_at(wrench, least_n=least_n)
    free = known[..., 4] - at[..., 1] * known[..., 0] + at[..., 0] * known[..., 2]
    return np.where(np.isfinite(free), free, 0.0)


def read_while_empty(push: Array) -> float:
    """What a plate reads without a load, N: the median of pushes (T,) along its normal that are none; 0 where that is
    noise, or where there are too few."""
    known = np.nan_to_num(push, nan=np.inf)
    idle = (known > -MOST_OFFSET_N) & (known < JUDGED_N)
    enough = np.count_nonzero(idle) >= max(_LEAST_IDLE * len(push), 1.0)
    middle = float(np.median(push[idle])) if enough else 0.0
    return middle if abs(middle) > NOISE_N else 0.0


def part_pulling(push: Array) -> float:
    """Part of the samples (T,) in which a plate pulls by more than an offset does, as no plate in order can."""
    return 0.0 if not len(push) else float(np.mean(np.nan_to_num(push) < -JUDGED_N))


def plate_from_wrench(
    name: str,
    force: Array,
    moment: Array,
    surface: Surface,
    *,
    corners: Array | None,
    threshold_n: float,
    zero_unloaded: bool,
) -> Plate:
    """A plate from its wrench about the laboratory origin.

    ``zero_unloaded``: the whole wrench becomes 0 where the push along the normal stays below the threshold; a
    plate cannot pull a person, so this also takes away a negative offset. The sign must have been settled
    before.
    """
    if zero_unloaded:
        unloaded = force @ surface.normal < threshold_n
        force, moment = force.copy(), moment.copy()
        force[unloaded] = 0.0
        moment[unloaded] = 0.0
    cop, free = centre_of_pressure(force, moment, surface, threshold_n)
    return Plate(name, force, moment, cop, free, corners)
