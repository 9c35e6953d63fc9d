"""Sitting down and standing up in space: down to a seat in balance over the feet, which then shares the load as the
trunk leans back."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dynakin.arrays import Array
from dynakin.simulation.bodies.body import SimulatedBody
from dynakin.simulation.bodies.whole_body import Sole
from dynakin.simulation.jets import constant, polynomial
from dynakin.simulation.mechanics import Motion
from dynakin.simulation.motions.movement import Movement, Repetition
from dynakin.simulation.motions.sit_to_stand import SEAT_FROM_HIP, draw_sittings, sitting_signals
from dynakin.simulation.motions.squat_in_space import (
    ARMS,
    Stance,
    Sway,
    balanced_tilt,
    draw_stance,
    mid_hip,
    on_feet,
    over_feet_x,
    plates_below,
    posed_on_feet,
    upper_body,
)
from dynakin.simulation.support import Footing, Seated, Support

# Angles (deg) standing, and what sitting adds: feet drawn back under a seat as high as the knee, as people place them
# before they rise (Janssen et al. 2002, Phys Ther 82:866-879); arms reach forward.
_ANKLE, _KNEE, _LUMBAR = (8.0, 22.0), (11.0, 98.0), (8.0, -22.0)
_ARMS = ARMS | {"arm_flex": (5.0, 55.0)}
_LEAST_SHARE, _MOST_SHARE = (
    0.55,
    0.70,
)  # of the weight on the seat; the feet of who sits upright carry a quarter to a half
_BACKWARD = 0.30  # of the tip of the sole: how far the centre of mass goes back over the feet, to the ankles
_HALF_SEAT_M = (0.20, 0.20)
_DEGREE = 6


def sit_in_space(rng: np.random.Generator, body: SimulatedBody, duration_s: float) -> Movement:
    """From standing down to a seat and up again, an analytic function of time, on a seat under the pelvis.

    Lowering and rising are in balance over the feet. Between them, hips at rest, the trunk leans back and the seat
    takes over by a smooth step of time; the pelvis' tilt is the polynomial of the seat's share that puts the centre of
    mass where seat and feet share it so.

    Raises:
        ConfigError: too short, or the subject cannot sit so.
    """
    sittings = draw_sittings(rng, duration_s)
    shares = [float(rng.uniform(_LEAST_SHARE, _MOST_SHARE)) for _ in sittings]
    stance = replace(draw_stance(rng, body), ankle=_ANKLE, knee=_KNEE, lumbar=_LUMBAR, arms_deg=_ARMS)
    sway = Sway.draw(rng)
    seat = _seat(body, stance)
    lowering, leaning = _tilts(body, stance, float(seat[0]))

    def at(time: Array) -> Motion:
        level, share = sitting_signals(time, sittings, shares)
        jets, shift = upper_body(stance, level, level, sway, time)
        jets["pelvis_tilt"] = polynomial(level, lowering) + polynomial(share, leaning) + sway.of("pelvis_tilt", time)
        x, y, z = mid_hip(body, stance, level)
        return posed_on_feet(body, stance, jets, (x + sway.of("x", time), y, z + shift + sway.of("z", time)))

    def support(time: Array) -> Support:
        return replace(
            on_feet(body, stance, time), seated=Seated(sitting_signals(time, sittings, shares)[1].value, seat)
        )

    return Movement(
        "sit",
        at,
        f"{len(sittings)} times down to a seat and up again",
        tuple(Repetition(s.start_s, s.end_s, 1.0) for s in sittings),
        support=support,
        footings=(*plates_below(stance), Footing("plate 3", seat, (("seat", -np.inf, np.inf),), _HALF_SEAT_M)),
        segments={"seat": "pelvis"},
    )


def _seat(body: SimulatedBody, stance: Stance) -> Array:
    """Where (3,) m the seat carries: below the hips of the seated person."""
    seated = constant(np.zeros(1), 1.0)
    _, shift = upper_body(stance, seated, seated, None, seated.value)
    x, y, z = (jet.value[0] for jet in mid_hip(body, stance, seated))
    ahead, up = (body.subject.height_m * part for part in SEAT_FROM_HIP)
    return np.array([x + ahead, y + up, z + shift.value[0]])


def _tilts(body: SimulatedBody, stance: Stance, seat_x: float) -> tuple[Array, Array]:
    """Coefficients of the tilt by the level, and of what the seat's share adds to it."""
    feet_x, back_m = over_feet_x(body, stance), _BACKWARD * Sole.of(body.subject).tip_x
    levels, shares = np.linspace(0.0, 1.0, 9), np.linspace(0.0, _MOST_SHARE, 9)
    down = balanced_tilt(body, stance, levels, feet_x - back_m * levels)
    seated_x = feet_x - back_m * np.array([1.0])
    back = balanced_tilt(body, stance, np.ones_like(shares), seated_x + shares * (seat_x - seated_x))
    fitted = np.polynomial.polynomial.polyfit
    leaning = np.linalg.lstsq(np.vander(shares, _DEGREE, increasing=True)[:, 1:], back - back[0], rcond=None)[0]
    return np.asarray(fitted(levels, down, 4)), np.concatenate([[0.0], leaning])
