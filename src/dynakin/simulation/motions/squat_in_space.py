"""Squats in space: feet flat and turned out, knees over the toes, arms forward, and a little of everything sideways."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from dynakin.arrays import Array
from dynakin.errors import ConfigError
from dynakin.simulation.bodies.body import SimulatedBody
from dynakin.simulation.bodies.whole_body import SIDES, Sole, ankle_height, hip_in_pelvis
from dynakin.simulation.jets import Jet, constant, polynomial, sinusoids
from dynakin.simulation.mechanics import Axis, Motion, Segment, SegmentMotion, kinematics
from dynakin.simulation.motions.movement import Movement, Repetition, in_order
from dynakin.simulation.motions.posed import Point, foot_about, point_of, whole_motion
from dynakin.simulation.motions.squat import draw_squats, squat_signals
from dynakin.simulation.support import Footing, Support

STANDS_AT = np.array([0.35, 0.0, 0.40])  # middle between the ankles, on the laboratory's floor, m
_PLATE_AHEAD_M = 0.08  # of the ankles
# Angles (deg) while standing, and what the lowest posture adds; the tilt of the pelvis follows from balance.
_ANKLE, _KNEE, _LUMBAR = (8.0, 22.0), (11.0, 84.0), (8.0, -14.0)
ARMS = {"arm_flex": (5.0, 70.0), "arm_add": (-9.0, -4.0), "arm_rot": (0.0, 8.0), "elbow_flex": (14.0, 10.0),
         "pro_sup": (90.0, -15.0)}  # fmt: skip
_OVER_FOOT = 0.30  # the centre of mass, from the ankle towards the toes
_GAZE = -0.55  # of the trunk's lean, undone by the neck
_DEGREE = 4
# Sway that runs through it all: amplitude of each of a few tones, deg and m.
_SWAY_DEG = {"pelvis_tilt": 0.06, "pelvis_list": 0.04, "pelvis_rotation": 0.10, "lumbar_extension": 0.08,
             "lumbar_bending": 0.10, "lumbar_rotation": 0.15, "neck_rotation": 0.4, "neck_bending": 0.15}  # fmt: skip
_SWAY_M = {"x": 0.0008, "z": 0.0010}
_TONES = 4


@dataclass(frozen=True)
class Stance:
    """How somebody squats: half the distance between the ankles (m), feet turned out and the shanks' torsion (rad), and
    what the lowest posture adds sideways: pelvis_list, pelvis_rotation, lumbar_bending, lumbar_rotation (rad), z (m);
    how much more (1 = all) either arm moves. ankle, knee, lumbar and arms_deg: angles (deg) while standing, and what
    the lowest posture adds."""

    half_width_m: float
    toe_out: float
    torsion: float
    sideways: Mapping[str, float]
    shift_m: float
    arms: tuple[float, float]
    ankle: tuple[float, float] = _ANKLE
    knee: tuple[float, float] = _KNEE
    lumbar: tuple[float, float] = _LUMBAR
    arms_deg: Mapping[str, tuple[float, float]] = field(default_factory=lambda: dict(ARMS))


def draw_stance(rng: np.random.Generator, body: SimulatedBody) -> Stance:
    """The subject's own way."""
    width, out, torsion = rng.uniform([0.085, 10.0, -15.0], [0.110, 18.0, -8.0])
    sideways = {
        name: float(np.deg2rad(size * rng.uniform(-1.0, 1.0)))
        for name, size in (
            ("pelvis_list", 2.0), ("pelvis_rotation", 3.0), ("lumbar_bending", 3.0), ("lumbar_rotation", 4.0)
        )
    }  # fmt: skip
    shift = 0.010 * rng.uniform(-1.0, 1.0)
    arms = rng.uniform(0.92, 1.08, 2)
    return Stance(
        width * body.subject.height_m, float(np.deg2rad(out)), float(np.deg2rad(torsion)), sideways, float(shift),
        (float(arms[0]), float(arms[1])),
    )  # fmt: skip


@dataclass(frozen=True)
class Sway:
    """Frequencies (Hz) and phases by what sways."""

    tones: Mapping[str, tuple[Array, Array]]

    @classmethod
    def draw(cls, rng: np.random.Generator) -> Sway:
        """A person's own."""
        return cls({
            name: (rng.uniform(0.08, 0.35, _TONES), rng.uniform(0.0, 2.0 * np.pi, _TONES))
            for name in (*_SWAY_DEG, *_SWAY_M)
        })  # fmt: skip

    def of(self, name: str, time: Array) -> Jet:
        """What it adds, rad or m."""
        size = _SWAY_M[name] if name in _SWAY_M else float(np.deg2rad(_SWAY_DEG[name]))
        return sinusoids(time, np.full(_TONES, size), *self.tones[name])


def squat_in_space(rng: np.random.Generator, body: SimulatedBody, duration_s: float) -> Movement:
    """Squats as an analytic function of time; legs follow from pelvis and feet, so their rates are exact too.

    Shank and thigh are led as in the plane (which gives the height and the place of the hips), the pelvis' tilt is the
    polynomial of the depth that keeps the centre of mass over the feet.

    Raises:
        ConfigError: too short, or the subject cannot squat so.
    """
    squats = draw_squats(rng, duration_s)
    stance, sway = draw_stance(rng, body), Sway.draw(rng)
    tilt = _balance(body, stance)

    def at(time: Array) -> Motion:
        level, arms = squat_signals(time, squats)
        jets, shift = upper_body(stance, level, arms, sway, time)
        jets["pelvis_tilt"] = polynomial(level, tilt) + sway.of("pelvis_tilt", time)
        x, y, z = mid_hip(body, stance, level)
        hips = (x + sway.of("x", time), y, z + shift + sway.of("z", time))
        return posed_on_feet(body, stance, jets, hips)

    return Movement(
        "squat",
        at,
        f"{len(squats)} repetitions of varying depth and pace",
        tuple(Repetition(s.start_s, s.end_s, s.depth) for s in squats),
        support=lambda time: on_feet(body, stance, time),
        footings=plates_below(stance),
    )


def on_feet(body: SimulatedBody, stance: Stance, time: Array) -> Support:
    """Both feet pressing at times (T,) s where they do when the person is in balance."""
    ahead = Sole.of(body.subject).ball[0] * 0.5
    right, left = (
        flat_ankle(stance, sign) * [1.0, 0.0, 1.0]
        + ahead * np.array([np.cos(stance.toe_out), 0.0, sign * np.sin(stance.toe_out)])
        for _, sign in SIDES
    )
    return Support(np.tile(right, (len(time), 1)), np.tile(left, (len(time), 1)))


def plates_below(stance: Stance) -> tuple[Footing, ...]:
    """One a foot."""
    return tuple(
        Footing(plate, flat_ankle(stance, sign) * [1.0, 0.0, 1.0] + [_PLATE_AHEAD_M, 0.0, 0.0],
                ((foot, -np.inf, np.inf),))
        for plate, sign, foot in (("plate 1", 1.0, "right foot"), ("plate 2", -1.0, "left foot"))
    )  # fmt: skip


def flat_ankle(stance: Stance, sign: float) -> Array:
    """Place (3,) m of an ankle, on the floor; sign: 1 right, -1 left."""
    return np.asarray(STANDS_AT + np.array([0.0, 0.0, sign * stance.half_width_m]))


def posed_on_feet(body: SimulatedBody, stance: Stance, jets: Mapping[str, Jet], hips: Point) -> Motion:
    """All coordinates, feet flat where they stand."""
    time = hips[0].value
    rest = constant(time, 0.0)
    height = ankle_height(body.subject)
    feet: dict[str, SegmentMotion] = {}
    for side, sign in SIDES:
        x, _, z = (constant(time, float(v)) for v in flat_ankle(stance, sign))
        turned = constant(time, -sign * stance.toe_out)
        feet[f"foot_{side}"] = foot_about((x, constant(time, height), z), turned, rest, np.zeros(3))
    torsion = {f"tibial_torsion_{side}": constant(time, stance.torsion) for side, _ in SIDES}
    return whole_motion(body.tree, {**jets, **torsion}, hips, hip_in_pelvis(body.subject, 0.0), feet)


def mid_hip(body: SimulatedBody, stance: Stance, level: Jet) -> Point:
    """Middle of the hip centres over shanks and thighs that lean as in the plane; what the wide stance costs of the
    height while standing is taken off everywhere."""
    L = body.lengths
    nothing, up = np.zeros(3), np.array([0.0, 1.0, 0.0])
    plane = [
        Segment("shank", None, nothing, (Axis("ankle", (0.0, 0.0, -1.0)),), 1.0, nothing, np.eye(3)),
        Segment("thigh", "shank", L["shank"] * up, (Axis("knee", (0.0, 0.0, 1.0)),), 1.0, nothing, np.eye(3)),
    ]
    jets = {"ankle": _between(stance.ankle, level), "knee": _between(stance.knee, level)}
    standing = {
        "ankle": _between(stance.ankle, constant(np.zeros(1), 0.0)),
        "knee": _between(stance.knee, constant(np.zeros(1), 0.0)),
    }
    thigh, upright = (kinematics(plane, in_order(("ankle", "knee"), j)).segments["thigh"] for j in (jets, standing))
    top = L["thigh"] * up
    lateral = stance.half_width_m - hip_in_pelvis(body.subject, 1.0)[2]
    high = float(upright.point(top)[0, 1])
    lower = high - np.sqrt(high**2 - lateral**2)
    place = STANDS_AT + np.array([0.0, ankle_height(body.subject) - lower, 0.0])
    x, y, z = point_of(
        SegmentMotion(
            thigh.rotation, thigh.point(top), thigh.point_velocity(top), thigh.point_acceleration(top), thigh.omega,
            thigh.alpha,
        )
    )  # fmt: skip
    return x + float(place[0]), y + float(place[1]), z + float(place[2])


def _between(angles_deg: tuple[float, float], level: Jet) -> Jet:
    return float(np.deg2rad(angles_deg[1])) * level + float(np.deg2rad(angles_deg[0]))


def upper_body(stance: Stance, level: Jet, arms: Jet, sway: Sway | None, time: Array) -> tuple[dict[str, Jet], Jet]:
    """Coordinates above the hips but the pelvis' tilt, and the pelvis' shift to the right (m)."""
    jets = {"lumbar_extension": _between(stance.lumbar, level)}
    jets |= {name: size * level for name, size in stance.sideways.items()}
    jets["neck_extension"] = float(np.deg2rad(_GAZE * -35.0)) * level
    jets |= {name: constant(time, 0.0) for name in ("neck_bending", "neck_rotation")}
    for (side, _), more in zip(SIDES, stance.arms, strict=True):
        jets |= {
            f"{name}_{side}": _between((low, more * added), arms) for name, (low, added) in stance.arms_deg.items()
        }
    for name in _SWAY_DEG:
        if sway is not None and name in jets:
            jets[name] = jets[name] + sway.of(name, time)
    return jets, stance.shift_m * level


def _balance(body: SimulatedBody, stance: Stance) -> Array:
    """Coefficients of the pelvis' tilt (rad) as a polynomial of the level that keeps the centre of mass over the feet.

    Raises:
        ConfigError: no tilt does.
    """
    levels = np.linspace(0.0, 1.0, 9)
    tilt = balanced_tilt(body, stance, levels, np.full_like(levels, over_feet_x(body, stance)))
    return np.asarray(np.polynomial.polynomial.polyfit(levels, tilt, _DEGREE), dtype=float)


def over_feet_x(body: SimulatedBody, stance: Stance) -> float:
    """Where the centre of mass is over the feet, m."""
    return float(STANDS_AT[0] + _OVER_FOOT * Sole.of(body.subject).tip_x * np.cos(stance.toe_out))


def balanced_tilt(body: SimulatedBody, stance: Stance, levels: Array, target: Array) -> Array:
    """The pelvis' tilt (rad) that has the centre of mass at x = ``target`` (m), at levels from 0 standing to 1 lowest,
    all (N,).

    Raises:
        ConfigError: no tilt does.
    """
    rest = np.zeros_like(levels)
    level = Jet(levels, rest, rest)

    def beyond(tilt: Array) -> Array:
        jets, shift = upper_body(stance, level, level, None, levels)
        x, y, z = mid_hip(body, stance, level)
        motion = posed_on_feet(body, stance, jets | {"pelvis_tilt": Jet(tilt, rest, rest)}, (x, y, z + shift))
        moving = kinematics(body.tree, motion)
        weighted = sum(s.mass * moving.segments[s.name].point(s.com)[:, 0] for s in body.tree)
        return np.asarray(weighted / body.subject.mass_kg - target)

    before, tilt = np.deg2rad(-5.0 - 25.0 * levels), np.deg2rad(-8.0 - 30.0 * levels)
    off_before, off = beyond(before), beyond(tilt)
    for _ in range(20):  # secants
        if np.abs(off).max() < 1e-9:
            return tilt
        step = -off * (tilt - before) / np.where(off == off_before, 1.0, off - off_before)
        before, off_before = tilt, off
        tilt = tilt + np.clip(step, -0.3, 0.3)
        off = beyond(tilt)
    raise ConfigError(
        "simulation: no tilt of the pelvis balances this subject over its feet; expected a subject nearer to the table "
        "(a smaller spread, or another seed)"
    )
