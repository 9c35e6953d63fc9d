"""Sitting down and standing up: the seat on a plate of its own, the trunk's lean bringing the weight over the
feet before the hip leaves it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dynakin.arrays import Array
from dynakin.errors import ConfigError
from dynakin.simulation.bodies.body import SimulatedBody
from dynakin.simulation.bodies.posture import PosturePath, balance, balanced_angle, posture_jets
from dynakin.simulation.jets import Jet, constant, step
from dynakin.simulation.mechanics import Motion, at_rest
from dynakin.simulation.motions.movement import STANDING_S, Movement, Repetition, Seat, in_order
from dynakin.simulation.motions.squat import add_wander, draw_wander

SHORTEST_S = 10.5
SEAT_FROM_HIP = (-0.02, -0.05)  # forward and up, of body height: flesh and the sitting bones, a little behind
FEET_REAR = 0.116  # behind the toe landmark, of body height: seated, the feet press in front of the heel marker (0.128)


@dataclass(frozen=True)
class Sitting:
    """Sitting down and standing up once: start (s), and durations (s) of lowering, leaning back, resting, leaning
    forward and rising; share: of the weight that rests on the seat."""

    start_s: float
    lower_s: float
    back_s: float
    rest_s: float
    lean_s: float
    rise_s: float
    share: float

    @property
    def end_s(self) -> float:
        """When the subject stands again."""
        return self.start_s + self.lower_s + self.back_s + self.rest_s + self.lean_s + self.rise_s


def draw_sittings(rng: np.random.Generator, duration_s: float) -> list[Sitting]:
    """Repetitions from `STANDING_S` to shortly before the end, each of its own pace.

    Raises:
        ConfigError: too short for standing and one repetition.
    """
    if not duration_s >= SHORTEST_S:
        raise ConfigError(f"simulated sit-to-stand: duration_s is {duration_s:g}, expected at least {SHORTEST_S:g} s")
    sittings: list[Sitting] = []
    start = STANDING_S
    while True:
        lower, back, stay, lean, rise = rng.uniform([1.5, 1.1, 0.4, 1.1, 1.3], [2.1, 1.5, 1.0, 1.5, 1.8])
        share, rest = rng.uniform([0.3, 0.3], [0.45, 0.8])
        sitting = Sitting(start, lower, back, stay, lean, rise, share)
        if sitting.end_s > duration_s - 0.3:
            return sittings
        sittings.append(sitting)
        start = sitting.end_s + rest


def sit_to_stand_movement(rng: np.random.Generator, body: SimulatedBody, duration_s: float) -> Movement:
    """From standing down to a seat and up again, an analytic function of time.

    Lowering and rising run along postures in balance over the foot; only between them, at the lowest level, the
    trunk leans back, and the seat takes over what would be behind the feet.
    """
    sittings = draw_sittings(rng, duration_s)
    wander = draw_wander(rng)
    path = body.paths["sit-to-stand"]
    balanced = balance(body.tree, path)
    seat = _seat(body, path)
    back = [float(_seated_hip(body, path, seat, r.share) - np.sum(balanced)) for r in sittings]

    def at(time: Array) -> Motion:
        level, lean = sitting_signals(time, sittings, back)
        jets = posture_jets(path, balanced, level, level)
        jets[path.balanced] = jets[path.balanced] + lean
        return in_order(body.coordinates, add_wander(jets, wander, time))

    return Movement(
        "sit-to-stand",
        at,
        f"{len(sittings)} times down to a chair and up again",
        tuple(Repetition(s.start_s, s.end_s, 1.0) for s in sittings),
        seat=seat,
    )


def sitting_signals(time: Array, sittings: Sequence[Sitting], back: Sequence[float]) -> tuple[Jet, Jet]:
    """Level (0 standing, 1 seated), and what the hip angle has on top of the balanced one; ``back``: how much of it
    while resting (rad), for each sitting."""
    level = lean = constant(time, 0.0)
    for r, angle in zip(sittings, back, strict=True):
        sat = r.start_s + r.lower_s
        up = sat + r.back_s + r.rest_s
        level = level + step(time, r.start_s, r.lower_s) - step(time, up + r.lean_s, r.rise_s)
        lean = lean + angle * (step(time, sat, r.back_s) - step(time, up, r.lean_s))
    return level, lean


def _seated_hip(body: SimulatedBody, path: PosturePath, seat: Seat, share: float) -> float:
    """The hip angle (rad) at which the resting person loads the seat with ``share`` of the weight: the centre of
    mass lies between the feet's limit and the seat by that share."""
    target = seat.feet_rear_x + share * (float(seat.point[0]) - seat.feet_rear_x)
    return float(balanced_angle(body.tree, path, np.ones(1), np.array([target]))[0])


def _seat(body: SimulatedBody, path: PosturePath) -> Seat:
    """Below the hip of the lowest posture."""
    angles = {n: np.deg2rad(path.standing_deg[n] + path.added_deg[n]) for n in path.standing_deg}
    q = np.array([[(angles | {path.balanced: 0.0})[name] for name in body.coordinates]])
    hip = at_rest(body.tree, body.coordinates, q).segments["pelvis"].origin[0]
    point = hip + body.subject.height_m * np.array([*SEAT_FROM_HIP, 0.0])
    return Seat("pelvis", point, -FEET_REAR * body.subject.height_m, body.floor_m)
