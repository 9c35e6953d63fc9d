"""A plate's wrench, its centre of pressure and free moment: the two ways of writing one and the same thing; and where a
wrench presses on a level plane."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from dynakin.arrays import cross, filled
from dynakin.recordings.recording import Array, Plate

UNLOADED_N = 10.0
"""Push below which a plate is empty: a few times the noise of the usual plates (1 to 3 N), and small against the errors
that its centre of pressure has there (1 N m of noise moves it by 0.1 m)."""
LOADED_N = 20.0
"""Push from which a plate, or a foot, is loaded: its centre of pressure is then known to a few cm (1 N m: 5 cm), which
is what it takes to say which foot presses."""
JUDGED_N = 50.0
"""Push from which something is said of a plate: a load where no foot stands, a force beyond friction, standing. What is
lighter may be a cable, a step on the edge, a drift; no offset of a plate in order reaches it."""

MOST_OFFSET_N = 2.0 * JUDGED_N
"""What a plate reads beside the load, at most: a press that stays below it may be nobody's, and shows no place."""


@dataclass(frozen=True)
class Surface:
    """Plane of a plate: a point on it (3,) m and its unit normal (3,) towards the person, laboratory
    frame."""

    point: Array
    normal: Array


def main_axis(plates: Iterable[Plate]) -> int:
    """Axis of the laboratory along which plates carry the most: the vertical one, where nobody says which that is."""
    return int(np.argmax(np.sum([np.abs(np.nan_to_num(plate.force)).sum(axis=0) for plate in plates], axis=0)))


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
