"""Two force plates, one under each foot, that measure what the simulated person's motion takes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dynakin.recordings import DEFAULT_THRESHOLD_N, Plate, Surface, plate_from_wrench

Array = NDArray[np.float64]

SIDEWAYS_SHARE = 0.06  # of the vertical force: the feet stand apart and push outward against each other


def split_wrench(wrench: Array, lateral_m: float) -> tuple[Array, Array]:
    """The wrench (T, 6) about the toe shared equally by the right and the left foot, ``lateral_m`` beside the
    midline.

    The body is symmetric, so each foot carries half; the sideways forces cancel in the sum, and so do their
    moments, because both feet press at the same x and y.
    """
    half = 0.5 * wrench
    feet = []
    # The half wrench acts at some point (x, y, 0) of the sagittal plane; the foot's acts there too, moved by
    # +-lateral_m along z.
    lever = half[:, 5] / half[:, 1]  # x of the action line where it meets y = 0: mz = x fy there
    for side in (1.0, -1.0):
        force = half[:, :3].copy()
        force[:, 2] -= side * SIDEWAYS_SHARE * force[:, 1]
        point = np.stack([lever, np.zeros_like(lever), np.full_like(lever, side * lateral_m)], axis=1)
        feet.append(np.hstack([force, np.cross(point, force)]))
    return feet[0], feet[1]


def measure(
    rng: np.random.Generator,
    foot_wrench: Array,
    name: str,
    centre: Array,
    toe: Array,
    force_sd_n: float,
    moment_sd_nm: float,
) -> Plate:
    """The plate's signals in the laboratory frame, with white noise on force and on the moment about the
    plate's centre.

    foot_wrench: (T, 6) about the toe; centre, toe: (3,) m, the middle of the plate's top and the toe
    landmark, laboratory.
    """
    force = foot_wrench[:, :3] + force_sd_n * rng.standard_normal((len(foot_wrench), 3))
    about_centre = foot_wrench[:, 3:] + np.cross(toe - centre, foot_wrench[:, :3])
    about_centre = about_centre + moment_sd_nm * rng.standard_normal(about_centre.shape)
    moment = about_centre + np.cross(centre, force)
    half_x, half_z = 0.30, 0.20
    corners = centre + np.array(
        [[half_x, 0.0, half_z], [half_x, 0.0, -half_z], [-half_x, 0.0, -half_z], [-half_x, 0.0, half_z]]
    )
    return plate_from_wrench(
        name,
        force,
        moment,
        Surface(centre, np.array([0.0, 1.0, 0.0])),
        corners=corners,
        threshold_n=DEFAULT_THRESHOLD_N,
        zero_unloaded=False,
    )
