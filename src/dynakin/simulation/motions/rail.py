"""Hands on a rail that no plate measures: an arm that reaches to it, and what the rail gives to the hand."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from dynakin.arrays import Array, cross
from dynakin.errors import ConfigError
from dynakin.simulation.bodies.body import SimulatedBody
from dynakin.simulation.bodies.whole_body import SIDES
from dynakin.simulation.jets import constant, sinusoids, step
from dynakin.simulation.mechanics import GRAVITY, Motion, Segment, TreeMotion, kinematics
from dynakin.simulation.motions.movement import Hand, Movement

HARDEST = 0.3  # of body weight, all hands together
# From the shoulder to the rail, over the arm's length: forward, up and outward; of who stays, in his first posture.
# The first that can be reached all the time is taken (who sits down moves back from it).
_REACHES = tuple(np.array([ahead, -down, 0.08]) for down in (0.44, 0.55, 0.70) for ahead in (0.58, 0.45, 0.30, 0.15))
_REACH_WALKING = np.array([0.40, -0.60, 0.10])
_NEAREST, _FARTHEST = 0.40, 0.95  # over the arm's length
_FOLLOWS = ("arm_flex", "arm_add", "elbow_flex")
_SLOW_M_S = 0.2  # slower on average is on the spot: the rail is held at one place, else the hand slides along
_CLOSED_M = 1e-12
_MOST_STEPS = 60


@dataclass(frozen=True)
class Grip:
    """Where a hand holds: segment, place (3,) m in it, and at time 0 in the ground (3,) m, moving with (3,) m/s."""

    side: str
    place: Array
    start: Array
    velocity: Array

    @property
    def segment(self) -> str:
        """That holds."""
        return f"hand_{self.side}"


def hold_rail(
    movement: Movement, body: SimulatedBody, rng: np.random.Generator, size: float, duration_s: float
) -> Movement:
    """The same movement with hands on a rail: the right one where the person stays, both where he walks.

    Shoulder and elbow bring the hand to the rail, where it stays, exactly (walking over the floor: slides at the
    person's speed). The rail pushes up and a little forward, in holds that begin and end smoothly; ``size``: the
    hardest over body weight, all hands together (a tenth is a light hold; the sizes are chosen).

    Raises:
        ConfigError: a size that is no share, a motion of a plane, or an arm that does not reach.
    """
    if not 0.0 < size <= HARDEST:
        raise ConfigError(f"simulation: rail is {size:g}, expected 0 to {HARDEST:g} of body weight")
    if movement.support is None:
        raise ConfigError(f"simulation: rail is {size:g}, expected 0 but for the motions of fullbody")
    weight = -float(GRAVITY[1]) * body.subject.mass_kg
    ahead, lateral = rng.uniform([0.0, -0.10], [0.25, 0.10])
    direction = np.array([ahead, 1.0, lateral]) / np.sqrt(1.0 + ahead**2 + lateral**2)
    holds = [
        (r.start_s, r.end_s, float(rng.uniform(0.7, 1.0))) for r in movement.repetitions
    ] or [(0.25 * duration_s, 0.85 * duration_s, 1.0)]  # fmt: skip
    tones, phases = rng.uniform(0.3, 0.8, 3), rng.uniform(0.0, 2.0 * np.pi, 3)
    grips = _grips(movement, body, duration_s)

    def reach(time: Array, motion: Motion) -> Motion:
        for grip in grips:
            motion = _reaching(body.tree, motion, grip, time)
        return motion

    if movement.refitted is not None:
        movement = movement.refitted(reach)
    moves = movement.at

    def held(time: Array, moving: TreeMotion) -> Mapping[str, Hand]:
        force = np.outer(_size_over_time(time, holds, tones, phases) * size * weight / len(grips), direction)
        taken = {}
        for grip in grips:
            point = moving.segments[grip.segment].point(grip.place)
            taken[_NAMES[grip.side]] = Hand(np.hstack([force, cross(point, force)]), point)
        return taken

    return replace(
        movement,
        at=lambda time: reach(time, moves(time)),
        held=held,
        segments={**movement.segments, **{_NAMES[grip.side]: grip.segment for grip in grips}},
        description=f"{movement.description or movement.name}, {' and '.join(_NAMES[g.side] for g in grips)} on a rail "
        f"with up to {size:.0%} of body weight",
    )


_NAMES = {"r": "right hand", "l": "left hand"}


def _size_over_time(time: Array, holds: Sequence[tuple[float, float, float]], tones: Array, phases: Array) -> Array:
    """0 to 1: each hold swells, wavers and ends."""
    total = constant(time, 0.0)
    for start, end, most in holds:
        swell = 0.3 * (end - start)
        total = total + most * (step(time, start, swell) - step(time, end - swell, swell))
    waver = sinusoids(time, np.full(len(tones), 0.04), tones, phases)
    return np.asarray(total.value * (0.88 + waver.value))


def _grips(movement: Movement, body: SimulatedBody, duration_s: float) -> tuple[Grip, ...]:
    ends = movement.at(np.linspace(0.0, duration_s, 41))
    moving = kinematics(body.tree, ends)
    shift = moving.segments["pelvis"].origin
    slope = np.array([np.polyfit(np.linspace(0.0, duration_s, 41), shift[:, k], 1)[0] for k in range(3)])
    velocity = np.where(np.abs(slope) > _SLOW_M_S, slope, 0.0)
    if np.abs(slope[0]) > _SLOW_M_S and movement.refitted is None:
        raise ConfigError(f"simulation: rail along {movement.name!r}, expected one next to a motion on the level")
    walks = movement.belt_m_s > 0.0 or bool(np.any(velocity != 0.0))
    grips = []
    for side, sign in SIDES:
        if side == "l" and not walks:
            continue
        hand = next(s for s in body.tree if s.name == f"hand_{side}")
        shoulder = moving.segments[f"upper_arm_{side}"].origin
        arm, mirror = sum(_lengths(body.tree, side)), np.array([1.0, 1.0, sign])
        if walks:
            start = shoulder.mean(axis=0) - 0.5 * duration_s * velocity + _REACH_WALKING * mirror * arm
        else:
            start = shoulder[0] + min(
                _REACHES, key=lambda r: _too_far(shoulder, shoulder[0] + r * mirror * arm, arm)
            ) * (mirror * arm)
        grips.append(Grip(side, hand.com, start, velocity))
    return tuple(grips)


def _too_far(shoulder: Array, rail: Array, arm_m: float) -> float:
    """How far (over the arm's length) the rail is from where an arm reaches well, at the worst of times."""
    apart = np.linalg.norm(rail - shoulder, axis=1) / arm_m
    return float(np.maximum(_NEAREST - apart, apart - _FARTHEST).max(initial=0.0))


def _lengths(tree: Sequence[Segment], side: str) -> tuple[float, float]:
    """Of the upper arm, and from the elbow to what the hand holds, m."""
    place = {segment.name: segment.placement for segment in tree}
    held = next(segment.com for segment in tree if segment.name == f"hand_{side}")
    return float(np.linalg.norm(place[f"forearm_{side}"])), float(np.linalg.norm(place[f"hand_{side}"] + held))


def _reaching(tree: Sequence[Segment], motion: Motion, grip: Grip, time: Array) -> Motion:
    """The motion with shoulder and elbow as they bring the hand to its grip: angles by Newton's method, speeds and
    accelerations from the loop differentiated once and twice, as for legs.

    Raises:
        ConfigError: the arm does not reach.
    """
    names = [f"{name}_{grip.side}" for name in _FOLLOWS]
    free = [motion.names.index(name) for name in names]
    branch = [
        s
        for s in tree
        if s.name in ("pelvis", "torso") or s.name.endswith(f"arm_{grip.side}") or s.name == grip.segment
    ]
    keys = [next((s.name, k) for s in branch for k, a in enumerate(s.axes) if a.coordinate == name) for name in names]
    q, qd, qdd = motion.q.copy(), motion.qd.copy(), motion.qdd.copy()
    wanted = grip.start + np.outer(time, grip.velocity)
    q[:, free] = _first_guess(tree, kinematics(branch, motion), wanted, grip.side)

    def found() -> tuple[Callable[[Array], Array], tuple[Array, Array, Array]]:
        moving = kinematics(branch, Motion(motion.names, q, qd, qdd))
        hand = moving.segments[grip.segment]
        point = hand.point(grip.place)
        columns = np.stack([cross(u, point - on_axis) for u, on_axis in (moving.axes[key] for key in keys)], axis=2)
        reached = point, hand.point_velocity(grip.place), hand.point_acceleration(grip.place)
        return lambda gap: np.linalg.solve(columns, gap[:, :, None])[:, :, 0], reached

    for _ in range(_MOST_STEPS):
        solve, (point, _, _) = found()
        gap = wanted - point
        if np.abs(gap).max() < _CLOSED_M:
            break
        q[:, free] += np.clip(solve(gap), -0.3, 0.3)
    else:
        raise ConfigError(
            f"simulation: the {_NAMES[grip.side].split()[0]} arm does not reach the rail in frame "
            f"{int(np.argmax(np.abs(gap).max(axis=1)))}; expected a subject nearer to the table"
        )
    qd[:, free] = qdd[:, free] = 0.0
    solve, (_, velocity, _) = found()
    qd[:, free] = solve(grip.velocity - velocity)
    solve, (_, _, acceleration) = found()
    qdd[:, free] = solve(-acceleration)
    return replace(motion, q=q, qd=qd, qdd=qdd)


def _first_guess(tree: Sequence[Segment], moving: TreeMotion, wanted: Array, side: str) -> Array:
    """Shoulder and elbow (T, 3) rad as in a plane: the elbow from the distance that the arm must span."""
    upper, fore = _lengths(tree, side)
    from_shoulder = wanted - moving.segments[f"upper_arm_{side}"].origin
    down = (np.swapaxes(moving.segments["torso"].rotation, 1, 2) @ from_shoulder[:, :, None])[:, :, 0]
    cosine = (np.sum(down**2, axis=1) - upper**2 - fore**2) / (2.0 * upper * fore)
    elbow = np.arccos(np.clip(cosine, -0.95, 0.95))
    beyond = np.arctan2(fore * np.sin(elbow), upper + fore * np.cos(elbow))
    return np.stack([np.arctan2(down[:, 0], -down[:, 1]) - beyond, np.zeros_like(elbow), elbow], axis=1)
