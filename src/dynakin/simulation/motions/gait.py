"""Walking over three force plates in a row, one foot on each, beginning and ending in mid-stride; and on a moving belt,
a level walk seen from somebody who moves along with the person.

Between two observers of constant speed neither forces nor moments differ (Galilei); the belt does the work that the
feet's friction takes, which on the ground nobody does.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.interpolate import CubicSpline

from dynakin.arrays import Array
from dynakin.errors import ConfigError
from dynakin.simulation.bodies.body import SimulatedBody
from dynakin.simulation.bodies.whole_body import SIDES, Sole, hip_in_pelvis
from dynakin.simulation.mechanics import Motion, dynamics, kinematics
from dynakin.simulation.motions.movement import Movement, Reach
from dynakin.simulation.motions.posed import carried_frame
from dynakin.simulation.motions.walk import FITTED, TOE_OFF, Walk, Waves, posture, support_of, walking_motion
from dynakin.simulation.support import Footing, Support

SHORTEST_S = 2.5
PLATES_AT = np.array([0.60, 0.0, 0.40])  # the middle plate, on the laboratory's floor, m
_PLATES = 3


def draw_walk(rng: np.random.Generator, body: SimulatedBody, duration_s: float) -> Walk:
    """The subject's own way, at 0.9 to 1.05 m/s for a person of 1.75 m; the middle plate in the middle of the trial."""
    H = body.subject.height_m
    stride, step = rng.uniform([1.06, 0.298], [1.16, 0.318])
    width, out, torsion, landing = rng.uniform([0.030, 4.0, -14.0, 14.0], [0.042, 9.0, -7.0, 18.0])
    tilt, list_, turn, arm, elbow = rng.uniform([-11.0, 2.5, 3.0, 16.0, 18.0], [-7.0, 4.0, 5.0, 23.0, 28.0])
    means = {
        "pelvis_tilt": tilt, "pelvis_list": 0.0, "pelvis_rotation": 0.0, "lumbar_extension": -tilt - 3.0,
        "lumbar_bending": 0.0, "neck_extension": 2.0, "neck_bending": 0.0, "neck_rotation": 0.0,
        "arm_flex_": 2.0, "arm_add_": -8.0, "arm_rot_": 0.0, "elbow_flex_": elbow, "pro_sup_": 95.0,
    }  # fmt: skip
    waves: dict[str, Waves] = {
        "pelvis_tilt": ((2, 1.0, 0.05),),
        "pelvis_list": ((1, -list_, 0.16),),
        "pelvis_rotation": ((1, turn, 0.0),),
        "lumbar_extension": ((2, -1.5, 0.10),),
        "lumbar_bending": ((1, list_ + 1.0, 0.18),),
        "neck_rotation": ((1, 2.0, 0.02),),
        "arm_flex_": ((1, -arm, 0.02),),
        "arm_add_": ((2, 1.0, 0.2),),
        "elbow_flex_": ((1, -7.0, 0.07),),
    }
    middle = int(np.ceil(0.5 * duration_s / (0.5 * stride)))
    lands = 0.5 * duration_s - 0.5 * middle * stride - 0.30 * stride
    at = PLATES_AT - np.array([middle * step * H + 0.02, 0.0, 0.0])
    out, torsion, landing = (float(np.deg2rad(v)) for v in (out, torsion, landing))
    return Walk(stride, step * H, width * H, out, torsion, landing, means, waves, lands, at)


def gait_movement(rng: np.random.Generator, body: SimulatedBody, duration_s: float) -> Movement:
    """Walking as an analytic function of time; the trial begins and ends in mid-stride.

    Raises:
        ConfigError: too short, or the subject cannot walk so.
    """
    return gait_on_floor(rng, body, duration_s)[1]


def gait_on_floor(rng: np.random.Generator, body: SimulatedBody, duration_s: float) -> tuple[Walk, Movement]:
    """How the subject walks, and the movement.

    Raises:
        ConfigError: too short, or the subject cannot walk so.
    """
    if not duration_s >= SHORTEST_S:
        raise ConfigError(f"simulated gait: duration_s is {duration_s:g}, expected at least {SHORTEST_S:g} s")
    walk = draw_walk(rng, body, duration_s)
    return walk, walk_over_plates(walk, body)


def walk_over_plates(walk: Walk, body: SimulatedBody, reach: Reach | None = None) -> Movement:
    """The walk, fitted, with its arms as they swing or as they ``reach``.

    Raises:
        ConfigError: the subject cannot walk so.
    """
    fitted = fit(walk, body, reach)
    sole = Sole.of(body.subject)

    def at(time: Array) -> Motion:
        motion = walking_motion(walk, body, time, fitted)
        return motion if reach is None else reach(time, motion)

    def support(time: Array) -> Support:
        return support_of(walk, sole, time)

    middle = round((PLATES_AT[0] - walk.at[0]) / walk.step_m)
    footings = []
    for n, k in enumerate(range(middle - _PLATES // 2, middle + _PLATES // 2 + 1), start=1):
        foot = "right foot" if k % 2 == 0 else "left foot"
        centre = PLATES_AT + np.array([(k - middle) * walk.step_m, 0.0, 0.0])
        footings.append(
            Footing(f"plate {n}", centre, ((foot, walk.lands(k), walk.lands(k) + TOE_OFF * walk.stride_s),))
        )
    description = f"walking at {walk.speed:.2f} m/s over {_PLATES} plates, one foot on each"
    return Movement(
        "gait", at, description, support=support, footings=tuple(footings),
        refitted=lambda reach: walk_over_plates(walk, body, reach),
    )  # fmt: skip


# Knee flexion over a stride from contact on (part of it, deg): as in Perry & Burnfield 2010, ch. 5, but not straighter
# than 12 deg, where the height of the hip would hardly show the knee's angle.
_KNEE = np.array([
    (0.00, 12.0), (0.08, 17.0), (0.15, 20.0), (0.25, 16.0), (0.35, 12.0), (0.42, 12.0), (0.50, 19.0), (0.61, 42.0),
    (0.72, 62.0), (0.80, 54.0), (0.90, 24.0), (0.96, 12.0), (1.00, 12.0),
])  # fmt: skip
# What a residual is measured in: centre of pressure (m), length of a standing and of a swinging leg (m), free moment
# (N m); a leg straighter than _STRAIGHTEST is hardly allowed.
_COP_M, _STANDING_M, _SWINGING_M, _FREE_NM = 0.010, 0.004, 0.012, 4.0
_STRAIGHTEST, _TOO_LONG_M = np.deg2rad(8.0), 0.0003
# How far what is fitted may well go from where it starts (m, rad); waves by their first letter or name, fast ones less.
_SIZES = {
    "x0": 0.06, "y0": 0.1, "pitch": 0.05, "lift": 0.003, "x": 0.01, "y": 0.0012, "z": 0.03, "lumbar_rotation": 0.06,
}  # fmt: skip
_FRAMES = 40  # of half a stride
_MOST_ROUNDS = 12


def fit(walk: Walk, body: SimulatedBody, reach: Reach | None = None) -> dict[str, Array]:
    """What is fitted of a walk, by `FITTED`: first legs of the length that they should have, then balance as well.

    Raises:
        ConfigError: no legs reach the ground.
    """
    H = body.subject.height_m
    start = dict.fromkeys(FITTED, 0.0)
    legs = body.lengths["shank"] + body.lengths["thigh"]
    start |= {"x0": -0.46 * walk.step_m, "y0": 0.035 * H + 0.965 * legs, "pitch": 1.10, "lift": 0.050}
    start |= {"yc2": -0.010, "zc1": -0.006, "zs1": 0.018, "lumbar_rotationc1": float(np.deg2rad(-8.0))}
    x = np.array([start[name] for name in FITTED])
    middle = x.copy()
    for balanced in (False, True):
        best = _residuals(walk, body, x[None], middle, balanced, reach)[0]
        for _ in range(_MOST_ROUNDS):
            moved = np.vstack([x, x + 1e-5 * np.eye(len(x))])
            rows = _residuals(walk, body, moved, middle, balanced, reach)
            jacobian = (rows[1:] - rows[0]).T / 1e-5
            step = np.linalg.lstsq(jacobian, -rows[0], rcond=None)[0]
            for part in (1.0, 0.5, 0.25, 0.1, 0.02):
                try:
                    found = _residuals(walk, body, (x + part * step)[None], middle, balanced, reach)[0]
                except ConfigError:  # a leg does not reach
                    continue
                if found @ found < best @ best:
                    break
            else:
                break
            gain = 1.0 - (found @ found) / (best @ best)
            x, best = x + part * step, found
            if gain < 1e-4:
                break
    return {name: np.asarray(value) for name, value in zip(FITTED, x, strict=True)}


def _residuals(
    walk: Walk, body: SimulatedBody, values: Array, middle: Array, balanced: bool, reach: Reach | None
) -> Array:
    """Rows (K, R) for K sets of values (K, N): half a stride is enough, the other half is its mirror image."""
    sets, frames = len(values), _FRAMES
    part = np.arange(frames) / (2.0 * frames)
    time = np.tile(walk.lands_s + part * walk.stride_s, sets)
    fitted = {name: np.repeat(values[:, k], frames) for k, name in enumerate(FITTED)}
    jets, hips, feet = posture(walk, body, time, fitted)
    rows: list[Array] = []
    spline = CubicSpline(_KNEE[:, 0], np.deg2rad(_KNEE[:, 1]), bc_type="periodic")
    free = body.tree[0].axes
    at_hips = dict(zip(("pelvis_tx", "pelvis_ty", "pelvis_tz"), hips, strict=True))
    thigh, shank = body.lengths["thigh"], body.lengths["shank"]
    for side, sign in SIDES:
        own = np.tile(part if side == "r" else part + 0.5, sets)
        across = hip_in_pelvis(body.subject, sign) - hip_in_pelvis(body.subject, 0.0)
        hip = carried_frame({**jets, **at_hips}, free, across).origin
        length = np.linalg.norm(hip - feet[f"foot_{side}"].origin, axis=1)
        wanted = np.sqrt(thigh**2 + shank**2 + 2.0 * thigh * shank * np.cos(spline(own)))
        rows.append(np.maximum(length - (thigh + shank) * np.cos(0.5 * _STRAIGHTEST), 0.0) / _TOO_LONG_M)
        rows.append((length - wanted) / np.where(np.abs((own + 0.17) % 1.0 - 0.36) < 0.36, _STANDING_M, _SWINGING_M))
    if balanced:
        motion = walking_motion(walk, body, time, fitted)
        motion = motion if reach is None else reach(time, motion)
        wrench = dynamics(body.tree, motion, kinematics(body.tree, motion)).wrench
        x, z = wrench[:, 5] / wrench[:, 1], -wrench[:, 3] / wrench[:, 1]
        support = support_of(walk, Sole.of(body.subject), time)
        assert support.share is not None
        share = support.share[:, None]
        presses = share * support.right + (1.0 - share) * support.left
        rows += [(x - presses[:, 0]) / _COP_M, (z - presses[:, 2]) / _COP_M]
        rows.append((wrench[:, 4] - (z * wrench[:, 0] - x * wrench[:, 2])) / _FREE_NM)
    stacked = np.concatenate([row.reshape(sets, frames) for row in rows], axis=1)
    sizes = _sizes() * np.array([1.0 if balanced or name[0] not in "xz" else 0.1 for name in FITTED])
    return np.hstack([stacked, (values - middle) / sizes])


def _sizes() -> Array:
    """How far each of `FITTED` may well go from where it starts."""
    return np.array([_SIZES.get(name) or _SIZES[name[:-2]] * min(1.0, 8.0 / int(name[-1]) ** 2) for name in FITTED])


HALF_BELT_M = (0.90, 0.25)  # half the length and width of one belt of two (Bertec's instrumented treadmill: 1.75 m)


def belt_movement(rng: np.random.Generator, body: SimulatedBody, duration_s: float) -> Movement:
    """The walk of `gait_movement` on two belts side by side, one a foot, that move backward at the person's speed.

    Raises:
        ConfigError: too short, or the subject cannot walk so.
    """
    walk, on_floor = gait_on_floor(rng, body, duration_s)
    return on_belt(on_floor, walk.speed, 0.5 * duration_s)


def on_belt(on_floor: Movement, speed: float, middle_s: float) -> Movement:
    """A walk over the floor as it is on belts of its speed (m/s), in the same place at ``middle_s``."""
    walking, standing, refitted = on_floor.at, on_floor.support, on_floor.refitted
    assert standing is not None
    assert refitted is not None

    def seen_from(moving: float, time: Array, motion: Motion) -> Motion:
        """By somebody who moves forward (m/s) over what the motion was given on."""
        q, qd = motion.q.copy(), motion.qd.copy()
        along = motion.names.index("pelvis_tx")
        q[:, along] -= moving * (time - middle_s)
        qd[:, along] -= moving
        return replace(motion, q=q, qd=qd)

    def at(time: Array) -> Motion:
        return seen_from(speed, time, walking(time))

    def with_arms(reach: Reach) -> Movement:
        def on_floor_too(time: Array, motion: Motion) -> Motion:
            return seen_from(-speed, time, reach(time, seen_from(speed, time, motion)))

        return on_belt(refitted(on_floor_too), speed, middle_s)

    def support(time: Array) -> Support:
        on = standing(time)
        back = np.outer(speed * (time - middle_s), [1.0, 0.0, 0.0])
        return replace(on, right=on.right - back, left=on.left - back)

    footings = tuple(
        Footing(
            f"plate {n}",
            PLATES_AT + np.array([0.0, 0.0, side * HALF_BELT_M[1]]),
            ((foot, -np.inf, np.inf),),
            HALF_BELT_M,
        )
        for n, foot, side in ((1, "right foot", 1.0), (2, "left foot", -1.0))
    )
    description = f"walking at {speed:.2f} m/s on a belt"
    return Movement("belt", at, description, support=support, footings=footings, refitted=with_arms, belt_m_s=speed)
