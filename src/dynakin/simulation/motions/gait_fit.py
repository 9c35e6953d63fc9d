"""What mechanics ask of a walk: a pelvis between two feet, so that knees bend as people's do and the centre of pressure
stays under the feet.

The height, the place and a few harmonics of the pelvis, the trunk's turn, how far the foot pitches and how high it
swings are fitted by Gauss-Newton to all of that at once. Motion and forces are exact whatever comes out: a poor fit is
a centre of pressure nearer to the edge of the foot.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from dynakin.errors import ConfigError
from dynakin.simulation.bodies.body import SimulatedBody
from dynakin.simulation.bodies.whole_body import SIDES, Sole, hip_in_pelvis
from dynakin.simulation.mechanics import dynamics, kinematics
from dynakin.simulation.motions.posed import carried_frame
from dynakin.simulation.motions.walk import FITTED, Walk, posture, support_of, walking_motion

Array = NDArray[np.float64]

# Knee flexion over a stride from contact on (part of it, deg): as in Perry & Burnfield 2010, ch. 5, but not straighter
# than 12 deg, where the height of the hip would hardly tell the knee's angle.
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


def fit(walk: Walk, body: SimulatedBody) -> dict[str, Array]:
    """What is fitted of a walk, by `FITTED`: first legs of the length that they should have, then balance as well.

    Raises:
        ConfigError: no legs reach the ground.
    """
    H = body.subject.height_m
    start = dict.fromkeys(FITTED, 0.0)
    legs = body.subject.lengths["shank"] + body.subject.lengths["thigh"]
    start |= {"x0": -0.46 * walk.step_m, "y0": 0.035 * H + 0.965 * legs, "pitch": 1.10, "lift": 0.050}
    start |= {"yc2": -0.010, "zc1": -0.006, "zs1": 0.018, "lumbar_rotationc1": float(np.deg2rad(-8.0))}
    x = np.array([start[name] for name in FITTED])
    middle = x.copy()
    for balanced in (False, True):
        best = _residuals(walk, body, x[None], middle, balanced)[0]
        for _ in range(_MOST_ROUNDS):
            moved = np.vstack([x, x + 1e-5 * np.eye(len(x))])
            rows = _residuals(walk, body, moved, middle, balanced)
            jacobian = (rows[1:] - rows[0]).T / 1e-5
            step = np.linalg.lstsq(jacobian, -rows[0], rcond=None)[0]
            for part in (1.0, 0.5, 0.25, 0.1, 0.02):
                try:
                    found = _residuals(walk, body, (x + part * step)[None], middle, balanced)[0]
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


def _residuals(walk: Walk, body: SimulatedBody, values: Array, middle: Array, balanced: bool) -> Array:
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
    thigh, shank = body.subject.lengths["thigh"], body.subject.lengths["shank"]
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
