"""Walking over three force plates in a row, one foot on each; the trial begins and ends in mid-stride."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dynakin.errors import ConfigError
from dynakin.simulation.bodies.body import SimulatedBody
from dynakin.simulation.bodies.whole_body import Sole
from dynakin.simulation.mechanics import Motion
from dynakin.simulation.motions.gait_fit import fit
from dynakin.simulation.motions.movement import Movement
from dynakin.simulation.motions.walk import TOE_OFF, Walk, Waves, support_of, walking_motion
from dynakin.simulation.support import Footing, Support

Array = NDArray[np.float64]

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
    if not duration_s >= SHORTEST_S:
        raise ConfigError(f"simulated gait: duration_s is {duration_s:g}, expected at least {SHORTEST_S:g} s")
    walk = draw_walk(rng, body, duration_s)
    fitted = fit(walk, body)
    sole = Sole.of(body.subject)

    def at(time: Array) -> Motion:
        return walking_motion(walk, body, time, fitted)

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
    return Movement("gait", at, description, support=support, footings=tuple(footings))
