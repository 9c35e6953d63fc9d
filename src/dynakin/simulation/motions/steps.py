"""Walking up or down two steps: a walk whose feet stand at different heights, a plate in the floor and on each step."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from dynakin.arrays import Array, cross
from dynakin.simulation.bodies.body import SimulatedBody
from dynakin.simulation.bodies.whole_body import SIDES, Sole, hip_in_pelvis
from dynakin.simulation.jets import Jet
from dynakin.simulation.mechanics import Motion, dynamics, kinematics
from dynakin.simulation.motions.corrections import fit_corrections
from dynakin.simulation.motions.gait import PLATES_AT, draw_walk, fit
from dynakin.simulation.motions.movement import Movement
from dynakin.simulation.motions.posed import whole_motion
from dynakin.simulation.motions.walk import TOE_OFF, Walk, posture, support_of
from dynakin.simulation.support import Footing, Support

# Heights of a step, m: up as public stairs (0.15 to 0.17); down low ones, as one walks down landing on the heel.
_UP_M, _DOWN_M = (0.13, 0.17), (0.09, 0.12)
_SLOWER, _SHORTER = 1.25, 0.92  # strides than over the floor; chosen
_KNOT_S = 0.06
_BEFORE, _AFTER = 1.0, 1.5  # strides for which the walk differs from that over the floor
# What a residual is measured in (m, N m), and how far (m, rad) the pelvis may well leave the walk over the floor.
_COP_M, _FREE_NM = 0.010, 4.0
_SIZES = {"x": 0.02, "z": 0.02, "lumbar_rotation": 0.05}
_STRAIGHTEST, _TOO_STRAIGHT = np.deg2rad(9.0), np.deg2rad(0.5)
_RATE_HZ = 60.0
_ROUNDS = 3


def steps_up(rng: np.random.Generator, body: SimulatedBody, duration_s: float) -> Movement:
    """Up two steps, one foot on each, in the middle of the trial; before and after them a walk over the level.

    Raises:
        ConfigError: too short, or the subject cannot walk so.
    """
    return _over_steps(rng, body, duration_s, 1.0)


def steps_down(rng: np.random.Generator, body: SimulatedBody, duration_s: float) -> Movement:
    """The same down.

    Raises:
        ConfigError: too short, or the subject cannot walk so.
    """
    return _over_steps(rng, body, duration_s, -1.0)


def _over_steps(rng: np.random.Generator, body: SimulatedBody, duration_s: float, sign: float) -> Movement:
    level = draw_walk(rng, body, duration_s)
    rise = sign * float(rng.uniform(*(_UP_M if sign > 0.0 else _DOWN_M)))
    stride, step = level.stride_s * _SLOWER, level.step_m * _SHORTER
    middle = int(np.ceil(duration_s / stride))
    walk = replace(
        level,
        stride_s=stride,
        step_m=step,
        lands_s=0.5 * duration_s - (0.5 * middle + 0.30) * stride,
        at=PLATES_AT - [middle * step + 0.02, min(2.0 * rise, 0.0), 0.0],  # the lowest level is the floor
    )
    return _movement(walk, body, {middle: rise, middle + 1: rise})


def _movement(level: Walk, body: SimulatedBody, climbs: Mapping[int, float]) -> Movement:
    """The walk over the level ``level``, climbing."""
    fitted = fit(replace(level, at=level.at * [1.0, 0.0, 1.0]), body)
    walk = replace(level, climbs=climbs)
    sole, hips_P = Sole.of(body.subject), hip_in_pelvis(body.subject, 0.0)
    middle = min(climbs)
    first, last = (walk.lands(middle) + part * walk.stride_s for part in (-_BEFORE, _AFTER))

    def moved(time: Array, more: Mapping[str, Jet]) -> Motion:
        jets, (x, y, z), feet = posture(walk, body, time, fitted)
        jets["lumbar_rotation"] = jets["lumbar_rotation"] + more["lumbar_rotation"]
        return whole_motion(body.tree, jets, (x + more["x"], y, z + more["z"]), hips_P, feet)

    def residuals(more: Mapping[str, Jet]) -> Array:
        motion = moved(time, more)
        wrench = dynamics(body.tree, motion, kinematics(body.tree, motion)).wrench
        share = on.share[:, None] if on.share is not None else 0.5
        presses = share * on.right + (1.0 - share) * on.left
        force = wrench[:, :3]
        left = wrench[:, 3:] - cross(presses, force)
        dx, dz = left[:, 2] / force[:, 1], -left[:, 0] / force[:, 1]
        free = left[:, 1] - (dz * force[:, 0] - dx * force[:, 2])
        knees = motion.q[:, [motion.names.index(f"knee_angle_{side}") for side, _ in SIDES]]
        straight = np.maximum(_STRAIGHTEST - knees, 0.0) / _TOO_STRAIGHT
        return np.column_stack([dx / _COP_M, dz / _COP_M, free / _FREE_NM, straight])

    time = np.arange(first, last, 1.0 / _RATE_HZ)
    on = support_of(walk, sole, time)
    knots = np.linspace(first, last, int((last - first) / _KNOT_S))
    corrections = fit_corrections(_SIZES, knots, time, residuals, _ROUNDS)

    def at(time: Array) -> Motion:
        return moved(time, corrections.at(time))

    def support(time: Array) -> Support:
        return support_of(walk, sole, time)

    footings = []
    for n, k in enumerate((middle - 1, middle, middle + 1), start=1):
        foot = "right foot" if k % 2 == 0 else "left foot"
        centre = PLATES_AT + np.array([(k - middle) * walk.step_m, walk.at[1] + walk.level(k), 0.0])
        half = (0.5 * walk.step_m, 0.20)
        stance = (foot, walk.lands(k), walk.lands(k) + TOE_OFF * walk.stride_s)
        footings.append(Footing(f"plate {n}", centre, (stance,), half))
    rise = climbs[middle]
    return Movement(
        "steps" if rise > 0.0 else "steps-down",
        at,
        f"walking {'up' if rise > 0.0 else 'down'} {len(climbs)} steps of {100.0 * abs(rise):.0f} cm at "
        f"{walk.speed:.2f} m/s, a plate before them and on each",
        support=support,
        footings=tuple(footings),
    )
