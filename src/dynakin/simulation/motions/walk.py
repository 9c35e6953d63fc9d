"""A person who walks straight on at a constant speed: feet that stand, roll over heel and ball and swing; a pelvis, a
trunk and arms of a few harmonics of the stride."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from dynakin.arrays import Array
from dynakin.simulation.bodies.body import SimulatedBody
from dynakin.simulation.bodies.whole_body import SIDES, Sole, ankle_height, hip_in_pelvis
from dynakin.simulation.jets import Jet, constant, step, swift_step
from dynakin.simulation.mechanics import Motion, SegmentMotion
from dynakin.simulation.motions.posed import Point, foot_about, point_of, whole_motion
from dynakin.simulation.support import Support

# Parts of a stride, from a foot's first contact on (Perry & Burnfield 2010, Gait Analysis, ch. 1 and 4).
FLAT, HEEL_OFF, TOE_OFF = 0.15, 0.33, 0.60
BOTH = TOE_OFF - 0.5  # both feet stand
_PITCHED, _LEVELLED, _LANDS = 0.69, 0.62, 0.99  # the foot is pitched most; it turns back; it has its landing pitch
_CLIMBS = 0.75  # of the swing, in which a foot changes its height
_UP, _DOWN = (-0.06, 0.52), (-0.50, 0.02)  # when the pelvis does, from the landing on the other level on
_ROLLS = (0.05, 0.48)  # the centre of pressure goes from the heel to the ball
# What is fitted, by name: amplitudes of cosine and sine of a harmonic of the stride, m or rad, or constants.
HARMONICS = {"x": (2, 4, 6, 8), "y": (2, 4), "z": (1, 3, 5), "lumbar_rotation": (1, 3)}
FITTED = (
    "x0", "y0", "pitch", "lift",
    *(f"{what}{wave}{k}" for what, ks in HARMONICS.items() for k in ks for wave in ("c", "s")),
)  # fmt: skip
Waves = tuple[tuple[int, float, float], ...]
"""Harmonic, amplitude (deg) and phase (part of the stride at which it is largest)."""


@dataclass(frozen=True)
class Walk:
    """How somebody walks.

    Attributes:
        stride_s, step_m: duration of a stride and length of a step.
        half_width_m: of the ankles from the line of progression; toe_out, torsion: rad.
        landing: pitch of the foot when it lands, rad.
        means_deg, waves: coordinates of pelvis and upper body that are not fitted; of arms those of the right side
            (the left one's half a stride later).
        first: step (even: right) that lands at ``lands_s`` and there ``at`` (3,) m is the ankle of a flat foot but for
            its half_width.
        climbs: step -> how much higher (m) it stands than the one before; those that are not named stand level.
    """

    stride_s: float
    step_m: float
    half_width_m: float
    toe_out: float
    torsion: float
    landing: float
    means_deg: Mapping[str, float]
    waves: Mapping[str, Waves]
    lands_s: float
    at: Array
    climbs: Mapping[int, float] = field(default_factory=dict)

    @property
    def speed(self) -> float:
        """m/s."""
        return 2.0 * self.step_m / self.stride_s

    def lands(self, k: int) -> float:
        """When step k touches the floor, s."""
        return self.lands_s + 0.5 * k * self.stride_s

    def foothold(self, k: int, height: float = 0.0) -> Array:
        """Place (3,) m of the ankle of the flat foot, or of the floor below it."""
        sign = 1.0 if k % 2 == 0 else -1.0
        return np.asarray(self.at + np.array([k * self.step_m, height + self.level(k), sign * self.half_width_m]))

    def level(self, k: int) -> float:
        """Height of what step k stands on, m."""
        return float(sum(rise for step, rise in self.climbs.items() if step <= k))

    def climbing(self, time: Array, k: int) -> Jet:
        """The height (m) that the foot of step k gains until it lands next: early on the way up, late on the way
        down, so that it passes the edge."""
        rise = self.level(k + 2) - self.level(k)
        start = TOE_OFF if rise >= 0.0 else 1.0 - _CLIMBS * (1.0 - TOE_OFF)
        return rise * swift_step(time, self.lands(k) + start * self.stride_s, _CLIMBS * (1.0 - TOE_OFF) * self.stride_s)

    def lift(self, time: Array) -> Jet:
        """Height (m) that the pelvis has gained: pushed up by the leg that has landed, let down by the one behind."""
        total = constant(time, 0.0)
        for k, rise in self.climbs.items():
            start, end = _UP if rise >= 0.0 else _DOWN
            total = total + rise * self.phased(time, k, start, end)
        return total

    def steps(self, side: str, time: Array) -> list[int]:
        """The right or left steps that matter at these times."""
        first = int(np.floor(2.0 * (time.min() - self.lands_s) / self.stride_s)) - 4
        last = int(np.ceil(2.0 * (time.max() - self.lands_s) / self.stride_s)) + 2
        return [k for k in range(first, last + 1) if k % 2 == (0 if side == "r" else 1)]

    def swing(self, time: Array, k: int) -> Jet:
        """How far the foot has gone, 0 to 1, from where step k stood to where it lands next."""
        return swift_step(time, self.lands(k) + TOE_OFF * self.stride_s, (1.0 - TOE_OFF) * self.stride_s)

    def phased(self, time: Array, k: int, start: float, end: float) -> Jet:
        """A step from 0 to 1 between two parts of the stride that begins with step k."""
        return step(time, self.lands(k) + start * self.stride_s, (end - start) * self.stride_s)


def foot_motion(
    walk: Walk, sole: Sole, height: float, side: str, time: Array, fitted: Mapping[str, Jet]
) -> SegmentMotion:
    """The foot in the ground: it lands pitched on its heel, rolls to flat, later over its ball, and swings.

    While it stands the point of the sole about which it turns rests in the ground, exactly.
    """
    sign = 1.0 if side == "r" else -1.0
    steps = walk.steps(side, time)
    pitch = constant(time, walk.landing)
    onward, on_ball, raised, climbed = (constant(time, 0.0) for _ in range(4))
    for k in steps:
        pitch = pitch - walk.landing * swift_step(time, walk.lands(k), FLAT * walk.stride_s)
        pitch = pitch - fitted["pitch"] * walk.phased(time, k, HEEL_OFF, _PITCHED)
        pitch = pitch + (fitted["pitch"] + walk.landing) * walk.phased(time, k, _LEVELLED, _LANDS)
        swing = walk.swing(time, k)
        onward = onward + 2.0 * walk.step_m * swing
        if walk.climbs:
            climbed = climbed + walk.climbing(time, k)
        on_ball = on_ball + walk.phased(time, k, FLAT, HEEL_OFF) - swing
        raised = raised + walk.phased(time, k, TOE_OFF, 0.80) - walk.phased(time, k, 0.80, 1.0)
    yaw, turned = constant(time, -sign * walk.toe_out), _turned(-sign * walk.toe_out)
    flat = walk.foothold(steps[0], height)
    about: dict[str, SegmentMotion] = {}
    for name, place in (("heel", sole.heel), ("ball", sole.ball)):
        pivot = flat + turned @ place
        x, y, z = (constant(time, float(v)) for v in pivot)
        about[name] = foot_about((x, y, z), yaw, pitch, place)
    heel, ball = (point_of(about[name]) for name in ("heel", "ball"))
    x, y, z = (h + on_ball * (b - h) for h, b in zip(heel, ball, strict=True))
    x, y = x + onward, y + fitted["lift"] * raised
    if walk.climbs:
        y = y + climbed
    origin, velocity, acceleration = (
        np.stack([getattr(jet, key) for jet in (x, y, z)], axis=1) for key in ("value", "rate", "second")
    )
    turning = about["heel"]
    return SegmentMotion(turning.rotation, origin, velocity, acceleration, turning.omega, turning.alpha)


def _turned(yaw: float) -> Array:
    c, s = np.cos(yaw), np.sin(yaw)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


_PUSH = 0.5


def support_of(walk: Walk, sole: Sole, time: Array) -> Support:
    """Where either foot presses as it rolls from heel to ball, and how the load goes over while both stand."""
    share = constant(time, 0.0)
    presses = {}
    for side, sign in SIDES:
        steps = walk.steps(side, time)
        along = constant(time, 0.0)
        onward, climbed = constant(time, 0.0), constant(time, 0.0)
        start, length = 0.6 * sole.heel[0], 0.75 * sole.ball[0] - 0.6 * sole.heel[0]
        for k in steps:
            swing = walk.swing(time, k)
            along = along + walk.phased(time, k, *_ROLLS) - swing
            onward = onward + 2.0 * walk.step_m * swing
            climbed = climbed + walk.climbing(time, k)
            load = walk.phased(time, k, 0.0, BOTH) - walk.phased(time, k, 0.5, TOE_OFF)
            share = share + load if side == "r" else share
        forward = _turned(-sign * walk.toe_out)[:, 0]
        place = walk.foothold(steps[0]) + np.outer(start + length * along.value, forward)
        presses[side] = place + np.outer(onward.value, [1.0, 0.0, 0.0]) + np.outer(climbed.value, [0.0, 1.0, 0.0])
    return Support(presses["r"], presses["l"], np.clip(share.value, 0.0, 1.0), _PUSH)


def walking_motion(walk: Walk, body: SimulatedBody, time: Array, fitted: Mapping[str, Array]) -> Motion:
    """All coordinates; ``fitted``: by `FITTED`, each a number or (T,).

    Raises:
        ConfigError: a leg does not reach its foot.
    """
    jets, hips, feet = posture(walk, body, time, fitted)
    return whole_motion(body.tree, jets, hips, hip_in_pelvis(body.subject, 0.0), feet)


def posture(
    walk: Walk, body: SimulatedBody, time: Array, fitted: Mapping[str, Array]
) -> tuple[dict[str, Jet], Point, dict[str, SegmentMotion]]:
    """Angles of pelvis and upper body, the middle of the hip centres, and the feet."""
    rest = np.zeros_like(time)
    given = {name: Jet(value + rest, rest, rest) for name, value in fitted.items()}

    def waves(what: str) -> Jet:
        total = constant(time, 0.0)
        for k in HARMONICS[what]:
            cosine = _harmonic(walk, time, k, 0.0)
            sine = _harmonic(walk, time, k, 0.25 / k)
            total = total + given[f"{what}c{k}"] * cosine + given[f"{what}s{k}"] * sine
        return total

    jets: dict[str, Jet] = {"lumbar_rotation": waves("lumbar_rotation")}
    for name, mean in walk.means_deg.items():
        for side, later in (("", 0.0),) if not name.endswith("_") else (("r", 0.0), ("l", 0.5)):
            value = constant(time, float(np.deg2rad(mean)))
            for k, size, phase in walk.waves.get(name, ()):
                value = value + float(np.deg2rad(size)) * _harmonic(walk, time, k, phase + later)
            jets[f"{name}{side}"] = value
    jets |= {f"tibial_torsion_{side}": constant(time, walk.torsion) for side, _ in SIDES}
    travel = Jet(walk.speed * (time - walk.lands_s), np.full_like(time, walk.speed), rest)
    x = travel + waves("x") + given["x0"] + float(walk.at[0])
    y = waves("y") + given["y0"]
    if walk.climbs:
        y = y + walk.lift(time) + float(walk.at[1])
    z = waves("z") + float(walk.at[2])
    sole, height = Sole.of(body.subject), ankle_height(body.subject)
    feet = {f"foot_{side}": foot_motion(walk, sole, height, side, time, given) for side, _ in SIDES}
    return jets, (x, y, z), feet


def _harmonic(walk: Walk, time: Array, k: int, phase: float) -> Jet:
    """cos(2 pi k (s - phase)), s the part of the stride since a right foot landed."""
    omega = 2.0 * np.pi * k / walk.stride_s
    angle = omega * (time - walk.lands_s) - 2.0 * np.pi * k * phase
    return Jet(np.cos(angle), -omega * np.sin(angle), -(omega**2) * np.cos(angle))
