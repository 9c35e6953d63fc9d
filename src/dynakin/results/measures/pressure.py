"""Centres of pressure: of an estimate's feet, and of any wrench that is given about the ground's origin."""

from __future__ import annotations

import numpy as np

from dynakin.arrays import Array
from dynakin.recordings.plates.ground_plate import SAME_LEVEL_M, surface_height
from dynakin.recordings.plates.ground_plate import floor_height as recorded_floor
from dynakin.recordings.plates.pressure import pressed_at
from dynakin.recordings.pushes import LOADED_N
from dynakin.results.estimate import Estimate


def centre_of_pressure(wrench: Array, height_m: float | Array, threshold_n: float = LOADED_N) -> tuple[Array, Array]:
    """Where on the level plane y = ``height_m`` a wrench has no moment but about the vertical.

    Args:
        wrench: (T, 6) N and N m about the ground's origin, ground frame; what is not modelled is NaN.
        height_m: of the plane, one or (T,).

    Returns:
        Point (T, 3) m and free moment (T,) N m about the vertical; NaN where the vertical force is below
        ``threshold_n`` or a component that it takes is not known (in a plane: z and the free moment).
    """
    wrench = np.asarray(wrench, dtype=float)
    known = np.isfinite(wrench)
    x, z = pressed_at(wrench, height_m, threshold_n).T
    free = wrench[:, 4] - (z * wrench[:, 0] - x * wrench[:, 2])
    given = np.stack([known[:, [0, 1, 5]].all(axis=1), np.isfinite(x), known[:, 1:4].all(axis=1)], axis=1)
    point = np.stack([x, np.broadcast_to(height_m, x.shape), z], axis=1)
    return np.where(given, point, np.nan), np.where(known.all(axis=1), free, np.nan)


def foot_pressure(estimate: Estimate, foot: str | None = None) -> tuple[Array, Array]:
    """Centre of pressure (T, 3) m, ground frame, and free moment (T,) N m, of a foot at the height of what it stands
    on, or of the estimated total wrench on the floor; NaN below `LOADED_N` and where the model does not have the
    components.

    Raises:
        KeyError: no such foot.
    """
    if foot is None:
        wrench, height = estimate.data["wrench_estimated"], floor_height(estimate)
        return centre_of_pressure(wrench.transpose("time", "component").values, height)
    wrench = estimate.data["foot_wrench"].sel(foot=foot).transpose("time", "component")
    return centre_of_pressure(wrench.values, support_height(estimate, wrench.values))


def support_height(estimate: Estimate, wrench: Array) -> float | Array:
    """Height (m, ground frame; one, or (T,)) of the plate that gives a foot its wrench (T, 6): the floor's where all
    are on one level, else that of the plate whose vertical force is nearest to the foot's."""
    floor, ground = floor_height(estimate), estimate.ground
    heights = [(plate, surface_height(plate, ground)) for plate in estimate.recording.plates]
    known = [(plate, height) for plate, height in heights if height is not None]
    if all(abs(height - floor) < SAME_LEVEL_M for _, height in known):
        return floor
    pushes = np.stack([ground.vectors_to_ground(plate.force)[:, 1] for plate, _ in known])
    apart = np.abs(np.nan_to_num(pushes) - np.nan_to_num(wrench[:, 1]))
    return np.asarray(np.array([height for _, height in known])[apart.argmin(axis=0)])


def floor_height(estimate: Estimate) -> float:
    """Height (m, ground frame) of the floor; see `ground_plate.floor_height`."""
    return recorded_floor(estimate.recording, estimate.ground)
