"""Walking on a moving belt: a level walk seen from somebody who moves along with the person.

Between two observers of constant speed neither forces nor moments differ (Galilei); the belt does the work that the
feet's friction takes, which on the ground nobody does.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from dynakin.simulation.bodies.body import SimulatedBody
from dynakin.simulation.mechanics import Motion
from dynakin.simulation.motions.gait import PLATES_AT, gait_on_floor
from dynakin.simulation.motions.movement import Movement, Reach
from dynakin.simulation.support import Footing, Support

Array = NDArray[np.float64]

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
