"""A drop jump: both feet off a box, a landing with an impact, a jump up at once, a soft landing.

The vertical force is given (`flight.py`), and with it the height of the centre of mass. Feet are led: on the ball of
the foot while the heel is up, with the centre of mass while in the air. The pelvis follows a posture that bends with
the height, and smooth corrections of its place and turn are fitted so that the ground gives just that force, under the
feet, and in flight neither force nor moment. A fit ends: what is left in flight is 2 to 4 N and 0.4 to 0.6 N m at the
worst of 100 frames a second (seeds 1, 3, 5), which the truth's wrench shows and no contact carries.

Not as people do: knees are bent by 50 deg when the feet leave the ground (near a straight knee small changes of the
hip's height turn it fast, and no fit is found), and knee moments have a spike of 30 ms at landing.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import numpy as np

from dynakin.arrays import Array, cross
from dynakin.errors import ConfigError
from dynakin.simulation.bodies.body import SimulatedBody
from dynakin.simulation.bodies.whole_body import SIDES, Sole, ankle_height, hip_in_pelvis
from dynakin.simulation.jets import Jet, constant, step
from dynakin.simulation.mechanics import GRAVITY, Motion, dynamics, kinematics
from dynakin.simulation.motions.corrections import Corrections, fit_corrections
from dynakin.simulation.motions.flight import Flight, Jump, plan_flight
from dynakin.simulation.motions.movement import Movement, Repetition
from dynakin.simulation.motions.posed import foot_about, whole_motion
from dynakin.simulation.support import Footing, Support

_G = -float(GRAVITY[1])

STARTS_S = 1.2  # quiet standing on the box
SHORTEST_S = 4.6
LANDS_AT = np.array([0.55, 0.0, 0.40])  # middle between the ankles, on the laboratory's floor, m
# Sizes of countermovement drop jumps from 0.3 m: a landing of 3 to 5 times body weight, 0.5 s on the floor (cf. Bobbert
# et al. 1987, Med Sci Sports Exerc 19:332-338, 339-346).
_BOX_M, _OFF_M_S, _IMPACT, _UP_M_S = (0.28, 0.32), (0.25, 0.35), (3.5, 4.0), (1.50, 1.65)
_EXTENDED_M = -0.015
_AHEAD_M = 0.40  # of the box's feet, where they land
_PITCH_DEG = (48.0, 46.0)  # toes down, in the first and the second flight
_GOES_S = 0.35  # how long before leaving the box the body goes forward, and after landing
_ROLL_S, _BEYOND_S = 0.10, 0.06  # over the ball on the ground, and what of that turn is in the air
_FOLLOWS_S = 0.055  # in which a foot that leaves the ground takes up the speed of the body, and gives it up
_KNEE_DEG, _LEAN_DEG = 24.0, 6.0  # of who stands ready
_BENT = {"pelvis_tilt": -75.0, "lumbar_extension": -35.0, "neck_extension": 45.0}  # deg a metre that the body is lower
_PRESSES = (0.50, 0.95)  # from the ankle to the ball: flat, and with the heel up
# How far a coefficient may well be from that posture (m, rad), and what a residual is measured in (N, N m, m).
_SIZES = {"x": 0.05, "y": 0.05, "z": 0.01, "pelvis_tilt": 0.15, "pelvis_list": 0.02, "pelvis_rotation": 0.03}
_FORCE_N, _FLYING_N, _FLYING_NM, _COP_M, _FREE_NM = 4.0, 0.2, 0.05, 0.010, 4.0
_RUBS = 0.12, 0.04  # friction forward and sideways, over the load
_STRAIGHTEST, _TOO_STRAIGHT = np.deg2rad(8.0), np.deg2rad(1.0)
_KNOT_S, _FINE_KNOT_S = 0.020, 0.0050
# How much softer forces are asked for at first, rounds, and what is changed.
_LEAD = ("x", "y", "pelvis_tilt")
_STAGES = (
    (300.0, 2, _LEAD), (60.0, 2, _LEAD), (20.0, 2, _LEAD), (6.0, 3, _LEAD), (4.0, 2, tuple(_SIZES)),
)  # fmt: skip


@dataclass(frozen=True)
class Jumper:
    """How somebody stands and moves: half the distance between the ankles (m), feet turned out and the shanks' torsion
    (rad), how much either arm swings (1 = all), the right foot's share of the load."""

    half_width_m: float
    toe_out: float
    torsion: float
    arms: tuple[float, float]
    share: float


def drop_jump(rng: np.random.Generator, body: SimulatedBody, duration_s: float) -> Movement:
    """One drop jump from a box that nothing measures on two plates, one a foot.

    Raises:
        ConfigError: too short, or the subject cannot jump so.
    """
    if not duration_s >= SHORTEST_S:
        raise ConfigError(f"simulated drop-jump: duration_s is {duration_s:g}, expected at least {SHORTEST_S:g} s")
    box, off, impact, up = (float(rng.uniform(*limits)) for limits in (_BOX_M, _OFF_M_S, _IMPACT, _UP_M_S))
    width, out, torsion, share = rng.uniform([0.060, 4.0, -14.0, 0.47], [0.075, 9.0, -7.0, 0.53])
    arms = rng.uniform(0.92, 1.08, 2)
    jumper = Jumper(
        width * body.subject.height_m, float(np.deg2rad(out)), float(np.deg2rad(torsion)),
        (float(arms[0]), float(arms[1])), float(share),
    )  # fmt: skip
    flight = plan_flight(Jump(STARTS_S, box, off, impact, up, _EXTENDED_M), duration_s)
    posed = _Posed.standing(body, jumper, flight)
    corrections = _fit(posed)

    def at(time: Array) -> Motion:
        return posed.motion(time, corrections.at(time))

    footings = tuple(
        Footing(name, LANDS_AT + np.array([0.06, 0.0, sign * 0.25]), ((foot, flight.lands[0], np.inf),), (0.30, 0.25))
        for name, foot, sign in (("plate 1", "right foot", 1.0), ("plate 2", "left foot", -1.0))
    )
    return Movement(
        "drop-jump",
        at,
        f"off a box of {100.0 * box:.0f} cm, landing with {impact:.1f} times body weight, and up again",
        (Repetition(STARTS_S, flight.rests_s, 1.0),),
        support=posed.support,
        footings=footings,
    )


@dataclass(frozen=True)
class _Posed:
    """What is led; hips: the middle of the hip centres of who stands, from the middle between the ankles (3,) m."""

    body: SimulatedBody
    jumper: Jumper
    flight: Flight
    hips: Array

    @classmethod
    def standing(cls, body: SimulatedBody, jumper: Jumper, flight: Flight) -> _Posed:
        """With the centre of mass over the middle of the feet."""
        L = body.lengths
        leg = np.sqrt(L["shank"] ** 2 + L["thigh"] ** 2 + 2.0 * L["shank"] * L["thigh"] * np.cos(np.deg2rad(_KNEE_DEG)))
        lateral = jumper.half_width_m - hip_in_pelvis(body.subject, 1.0)[2]
        hips = np.array([0.0, ankle_height(body.subject) + np.sqrt(leg**2 - lateral**2 - 0.02**2), 0.0])
        target = _PRESSES[0] * Sole.of(body.subject).ball[0] * np.cos(jumper.toe_out)
        start = np.zeros(1)
        for _ in range(30):
            posed = cls(body, jumper, flight, hips)
            moving = kinematics(body.tree, posed.motion(start, {}))
            mass = sum(s.mass * moving.segments[s.name].point(s.com)[0] for s in body.tree) / body.subject.mass_kg
            middle = LANDS_AT - [_AHEAD_M, 0.0, 0.0]
            if np.abs(mass[[0, 2]] - middle[[0, 2]] - [target, 0.0]).max() < 1e-12:
                break
            hips = hips - [mass[0] - middle[0] - target, 0.0, mass[2] - middle[2]]
        return posed

    def base(self, time: Array) -> tuple[Jet, Jet, Jet]:
        """Forward place and height (m) of what the feet stand on or, in flight, follow; and how far (0 to 1) the
        heels are up."""
        flight = self.flight
        up, heels = constant(time, flight.jump.box_m), constant(time, 0.0)
        for leaves, lands in zip(flight.leaves, flight.lands, strict=True):
            up = up + _carried_along(flight, time, leaves, lands)
            heels = heels + _heels_up(time, leaves, lands)
        forward = step(time, flight.leaves[0], flight.lands[0] - flight.leaves[0])
        return _AHEAD_M * (forward - 1.0), up, heels

    def feet_turn(self, time: Array) -> Jet:
        """Pitch of the feet, rad."""
        total = constant(time, 0.0)
        for deg, leaves, lands in zip(_PITCH_DEG, self.flight.leaves, self.flight.lands, strict=True):
            total = total - float(np.deg2rad(deg)) * _heels_up(time, leaves, lands)
        return total

    def motion(self, time: Array, more: Mapping[str, Jet]) -> Motion:
        """All coordinates, with corrections by `_SIZES`."""
        forward, up, _ = self.base(time)
        pitch, rest = self.feet_turn(time), constant(time, 0.0)
        sole, subject = Sole.of(self.body.subject), self.body.subject
        feet = {}
        for side, sign in SIDES:
            yaw = -sign * self.jumper.toe_out
            c, s = np.cos(yaw), np.sin(yaw)
            ball = LANDS_AT + c * sole.ball[0] * np.array([1.0, 0.0, 0.0])
            ball[2] += sign * self.jumper.half_width_m - s * sole.ball[0]
            pivot = (forward + float(ball[0]), up, rest + float(ball[2]))
            feet[f"foot_{side}"] = foot_about(pivot, constant(time, yaw), pitch, sole.ball)
        rises = self.flight.height(time) - up
        jets = {name: float(np.deg2rad(-per_m)) * rises for name, per_m in _BENT.items()}
        jets["pelvis_tilt"] = jets["pelvis_tilt"] - float(np.deg2rad(_LEAN_DEG))
        jets["lumbar_extension"] = jets["lumbar_extension"] + float(np.deg2rad(4.0))
        held = ("pelvis_list", "pelvis_rotation", "lumbar_bending", "lumbar_rotation", "neck_bending", "neck_rotation")
        jets |= dict.fromkeys(held, rest)
        swing = self._arms(time)
        for (side, _), much in zip(SIDES, self.jumper.arms, strict=True):
            jets |= {
                f"arm_flex_{side}": much * swing + float(np.deg2rad(5.0)),
                f"arm_add_{side}": constant(time, float(np.deg2rad(-10.0))),
                f"arm_rot_{side}": rest,
                f"elbow_flex_{side}": 0.25 * much * swing + float(np.deg2rad(30.0)),
                f"pro_sup_{side}": constant(time, float(np.deg2rad(90.0))),
                f"tibial_torsion_{side}": constant(time, self.jumper.torsion),
            }
        off, lands = self.flight.leaves[0], self.flight.lands[0]
        goes = _AHEAD_M * (step(time, off - _GOES_S, lands - off + 2.0 * _GOES_S) - 1.0)
        hips = [goes + float(LANDS_AT[0] + self.hips[0]), up + rises + float(self.hips[1]),
                rest + float(LANDS_AT[2] + self.hips[2])]  # fmt: skip
        for k, name in enumerate("xyz"):
            hips[k] = hips[k] + more[name] if name in more else hips[k]
        for name in ("pelvis_tilt", "pelvis_list", "pelvis_rotation"):
            jets[name] = jets[name] + more[name] if name in more else jets[name]
        x, y, z = hips
        return whole_motion(self.body.tree, jets, (x, y, z), hip_in_pelvis(subject, 0.0), feet)

    def _arms(self, time: Array) -> Jet:
        """Flexion (rad): a little forward off the box, back on landing, forward and up to jump, down again."""
        (off, again), (lands, down) = self.flight.leaves, self.flight.lands
        parts = (
            (25.0, off - 0.45, 0.55), (-45.0, lands - 0.10, 0.40), (70.0, again - 0.28, 0.40),
            (-30.0, down - 0.15, 0.5), (-20.0, down + 0.35, 0.8),
        )  # fmt: skip
        total = constant(time, 0.0)
        for deg, start, lasting in parts:
            total = total + float(np.deg2rad(deg)) * step(time, start, lasting)
        return total

    def support(self, time: Array) -> Support:
        """Under the middle of the flat foot, under the ball with the heel up; nothing in flight."""
        forward, up, heels = (jet.value for jet in self.base(time))
        along = (_PRESSES[0] + (_PRESSES[1] - _PRESSES[0]) * heels) * Sole.of(self.body.subject).ball[0]
        pressed = []
        for _, sign in SIDES:
            yaw = -sign * self.jumper.toe_out
            x, z = forward + np.cos(yaw) * along, sign * self.jumper.half_width_m - np.sin(yaw) * along
            pressed.append(np.stack([LANDS_AT[0] + x, up, LANDS_AT[2] + z], axis=1))
        share = np.full_like(time, self.jumper.share)
        return Support(pressed[0], pressed[1], share, in_flight=self.flight.in_flight(time))


def _heels_up(time: Array, leaves: float, lands: float) -> Jet:
    """How far (0 to 1) the heels are up around a flight."""
    whole = _ROLL_S + _BEYOND_S
    return step(time, leaves - _ROLL_S, whole) - step(time, lands - _BEYOND_S, whole)


def _carried_along(flight: Flight, time: Array, leaves: float, lands: float) -> Jet:
    """How high (m) feet are over where they left: they take up the body's vertical speed after leaving the ground and
    give it up before they touch it, so that they meet it at rest; what then lacks of the way they make in between."""
    ends = (leaves, lands - _FOLLOWS_S, lands)
    taken, given = (step(time, start, _FOLLOWS_S) for start in ends[:2])
    body, at = flight.height(time), flight.height(np.array([*ends, leaves + _FOLLOWS_S]))

    def way(taken_s: Array, given_s: Array, height: Array) -> Array:
        """The integral of what the feet take of the speed: all of it, but for the two steps."""
        late = at.rate[0] * taken_s - 0.5 * _G * taken_s**2 - _way_taken(taken_s, float(at.rate[0]))
        return np.asarray(height - at.value[0] - late - _way_taken(given_s, float(at.rate[1])))

    height = flight.height(np.clip(time, leaves, lands)).value
    taken_s, given_s = (np.clip(time - start, 0.0, _FOLLOWS_S) for start in ends[:2])
    full = np.full(1, _FOLLOWS_S)
    lacking = float(at.value[2] - at.value[0] - way(full, full, at.value[2])[0])
    share = taken * (1.0 + -1.0 * given)
    speed = Jet(share.value * body.rate, share.rate * body.rate + share.value * body.second, np.zeros_like(time))
    made = lacking * step(time, leaves + _FOLLOWS_S, lands - leaves - 2.0 * _FOLLOWS_S)
    return Jet(way(taken_s, given_s, height), speed.value, speed.rate) + made


def _way_taken(lasting_s: Array, speed: float) -> Array:
    """Integral (m) of `step` over `_FOLLOWS_S` times the speed (m/s) of who falls, ``speed`` at its start."""
    s = lasting_s / _FOLLOWS_S
    uniform = s**5 * (7.0 - 14.0 * s + 10.0 * s**2 - 2.5 * s**3)
    falling = s**6 * (35.0 / 6.0 - 12.0 * s + 70.0 / 8.0 * s**2 - 20.0 / 9.0 * s**3)
    return np.asarray(_FOLLOWS_S * (speed * uniform - _G * _FOLLOWS_S * falling))


def _fit(posed: _Posed) -> Corrections:
    body, flight = posed.body, posed.flight
    start, end = STARTS_S - 0.1, flight.rests_s + 0.3
    knots = _knots(flight, start, end)
    time = (knots[:-1, None] + np.diff(knots)[:, None] * [0.25, 0.75]).ravel()
    on, flying = posed.support(time), flight.in_flight(time)
    weight = _G * body.subject.mass_kg
    load = flight.load(time) * weight
    assert on.share is not None
    presses = on.share[:, None] * on.right + (1.0 - on.share[:, None]) * on.left
    rubs = load + 0.03 * weight
    by_force = np.where(
        flying[:, None], _FLYING_N, np.stack([_RUBS[0] * rubs, np.full_like(load, _FORCE_N), _RUBS[1] * rubs], axis=1)
    )
    lever = _COP_M * (load + 0.02 * weight)
    by_moment = np.where(flying[:, None], _FLYING_NM, np.stack([lever, np.full_like(load, _FREE_NM), lever], axis=1))

    def residuals(more: Mapping[str, Jet], softer: float) -> Array:
        motion = posed.motion(time, more)
        moving = kinematics(body.tree, motion)
        wrench = dynamics(body.tree, motion, moving).wrench
        force = wrench[:, :3]
        about = np.where(flying[:, None], moving.segments["torso"].origin, presses)
        moment = wrench[:, 3:] - cross(about, force)
        wanted = np.stack([np.zeros_like(load), load, np.zeros_like(load)], axis=1)
        knees = motion.q[:, [motion.names.index(f"knee_angle_{side}") for side, _ in SIDES]]
        straight = np.maximum(_STRAIGHTEST - knees, 0.0) / _TOO_STRAIGHT
        by_f, by_m = (np.where(flying[:, None], softer * by, by * min(softer, 5.0)) for by in (by_force, by_moment))
        return np.hstack([(force - wanted) / by_f, moment / by_m, straight])

    found: Corrections | None = None
    for softer, rounds, names in _STAGES:
        found = fit_corrections(_SIZES, knots, time, partial(residuals, softer=softer), rounds, names, found)
    assert found is not None
    return found


def _knots(flight: Flight, start: float, end: float) -> Array:
    """Close together around the flights, where forces change fastest."""
    fast = np.array([[leaves - 0.05, lands + 0.10] for leaves, lands in zip(flight.leaves, flight.lands, strict=True)])
    edges = [start, *fast.ravel(), end]
    parts = []
    for n, (a, b) in enumerate(pairwise(edges)):
        count = int(np.ceil((b - a) / (_KNOT_S if n % 2 == 0 else _FINE_KNOT_S)))
        parts.append(np.linspace(a, b, count, endpoint=False))
    return np.concatenate([*parts, [end]])
