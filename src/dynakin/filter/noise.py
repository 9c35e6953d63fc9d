"""From noise settings to the core's arrays."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
from scipy.special import chdtri

from dynakin.arrays import Array
from dynakin.bindings import _core
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.settings.model import QUANTITIES, Quantity
from dynakin.settings.noise import JointGroup, Noise

MOVED_S = 0.1
"""Over which the way of markers says how much somebody moves, where noise is found in innovations."""
SETTLING_S = 0.3
"""Left out there: the first frames' covariances are the priors'."""
LATE_SHARE = 0.8
"""Part of the found factor's logarithm that is believed of estimates without any lag: they are late where accelerations
change, which the next frame hardly shows."""


def process_variance(noise: Noise, layout: _core.StateLayout) -> Array:
    """Diagonal of Q (n,) a step, in the order of the state."""
    values = {
        "coordinates": noise.coordinate_variance,
        "speeds": noise.speed_variance,
        "accelerations": noise.acceleration_variance,
        "lengths": noise.length_variance,
        "markers": noise.marker_place_variance_m2,
        "inertia": noise.inertia_variance,
    }
    return np.concatenate([np.full(size, values.get(name, 0.0)) for name, (_, size) in layout.blocks.items()])


def wrench_covariance(noise: Noise) -> Array:
    """R (6, 6) of the total wrench about the reference point."""
    return np.diag([noise.force_variance_n2] * 3 + [noise.moment_variance_n2_m2] * 3)


def plate_sd(noise: Noise) -> Array:
    """Standard deviations (6,) of the plates' slow error, N and N m."""
    return np.array([noise.plate_force_sd_n] * 3 + [noise.plate_moment_sd_nm] * 3)


def jerk_densities(noise: Noise, floating: bool) -> dict[str, float]:
    """Density by kind of axis, of a model that is fixed in the ground or of a floating one."""
    rotation, translation = noise.jerk_density_rad2_s5, noise.translation_jerk_density_m2_s5
    if floating:
        rotation = rotation if noise.floating_jerk_density_rad2_s5 is None else noise.floating_jerk_density_rad2_s5
        translation = (
            translation
            if noise.floating_translation_jerk_density_m2_s5 is None
            else noise.floating_translation_jerk_density_m2_s5
        )
    return {"rotation": rotation, "translation": translation}


def soft_tissue_sd(noise: Noise, declared_m: Array) -> Array:
    """Standard deviation (M,) m of each marker's displacement; 0 where none is estimated.

    Args:
        declared_m: (M,) m, size of the displacement as the marker set has it.
    """
    sd = noise.soft_tissue_sd_fraction * declared_m
    return np.where(sd < noise.soft_tissue_least_sd_m, 0.0, sd)


def soft_tissue_time_s(noise: Noise, initial: CalibratedModel) -> float:
    """Time constant of that displacement, of a model that is fixed in the ground or of a floating one."""
    floating = noise.floating_soft_tissue_time_s if initial.feet else None
    return noise.soft_tissue_time_s if floating is None else initial.skin_lasts * floating


def marker_variance(initial: CalibratedModel, noise: Noise, estimate: Collection[Quantity] = QUANTITIES) -> Array:
    """R (M,) m^2 of the markers of a model that has the states these settings ask for; without soft tissue among them,
    all of its displacement is noise."""
    variance = noise.marker_variance_scale * initial.marker_variance
    if noise.marker_sd_m is not None:  # the marker set's R holds all of what follows already
        declared = initial.soft_tissue_m
        unmodelled = np.where(soft_tissue_sd(noise, declared) == 0.0, noise.soft_tissue_least_sd_m, 0.0)
        if "soft_tissue" not in estimate:
            unmodelled = np.maximum(noise.soft_tissue_sd_fraction * declared, noise.soft_tissue_least_sd_m)
        variance = noise.marker_sd_m**2 + unmodelled**2 + initial.unmodelled_m**2
    names = initial.recorded_markers
    by_name = [noise.marker_variance_m2.get(name, value) for name, value in zip(names, variance, strict=True)]
    return noise.variance_scale * np.array(by_name)


def gate_limits(probability: float, scale: float = 1.0) -> list[float] | None:
    """Largest normalised innovation squared that is believed of 1 to 6 rows; None: no gate.

    Args:
        scale: on the variances; below 1 the limit goes by those without it.
    """
    if probability == 0.0:
        return None
    return [float(chdtri(rows, probability)) / min(scale, 1.0) for rows in range(1, 7)]


BEGUN_SD = {"speed": 3.0, "acceleration": 40.0}
"""How fast people move when a recording begins, rad or m a second, a second squared: the knee of a walk swings at 7 and
gains speed by 40 to 80. By the priors (1 and 10), scaled as the noise, hips of walks were 45 N m off in the first 50
ms, said to 8."""
SOUGHT_SD = {"coordinate": 0.5, "speed": 2.0, "acceleration": 20.0}
"""The same of a motion that was lost and is sought anew, by the declared variances. Half as much: markers that were
refused until now may be wrong still, and the less a speed is known the more of them the next frames agree with."""


def limit_sd(noise: Noise, declared: float | None) -> float:
    """A limit on the deviation of a coordinate (rad or m) that goes by the declared variances, in those that the filter
    has; infinite where there is none."""
    return np.inf if declared is None else float(declared * np.sqrt(noise.variance_scale))


def prior_factor(noise: Noise) -> float:
    """By which deviations of what rests on a contact that no plate measures are widened when they are reported: what is
    expected of it is a prior, whose errors small innovations do not show."""
    return max(1.0, float(noise.variance_scale**-0.5))


_ALONG = 0.7
"""Of a direction of length 1: more along Y than across it. Segments have their lengths along Y, as OpenSim's."""


def joint_groups(initial: CalibratedModel) -> dict[str, JointGroup]:
    """Coordinate -> its group, by its place between the root and the feet; empty of a model that is fixed in the
    ground. A trunk has little inertia about its length and turns about it twice a step, arms and all: it has a group of
    its own."""
    tree = initial.tree
    joints: dict[str, JointGroup] = dict.fromkeys(tree.roots, "pelvis")
    turning = {segment.name for segment in initial.spec.segments if segment.axes}
    order: tuple[JointGroup, ...] = ("hips", "knees")
    for foot in initial.feet.values():
        moving = [name for name in reversed(tree.up(foot)) if name in turning and name not in joints]
        joints |= {name: order[k] if k < len(order) and name != foot else "feet" for k, name in enumerate(moving)}
    found: dict[str, JointGroup] = {}
    for segment in initial.spec.segments if initial.feet else ():
        above = joints[tree.nearest(segment.name, joints)]  # toes, patella: the group of what they hang on
        group = joints.get(segment.name) or ("upper_body" if above == "pelvis" else above)
        is_trunk = group == "upper_body" and segment.parent in tree.roots
        for axis in segment.axes:
            about_length = is_trunk and axis.kind == "rotation" and abs(axis.direction[1]) > _ALONG
            found.setdefault(axis.coordinate, "trunk_rotation" if about_length else group)
    return found
