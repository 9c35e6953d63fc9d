"""Gestures of ten seconds that people can do between two force plates, as motions of the simulated whole body."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from dynakin.simulation.bodies.body import SimulatedBody
from dynakin.simulation.bodies.whole_body import SIDES, Sole, ankle_height, hip_in_pelvis
from dynakin.simulation.contacts import mechanical_state
from dynakin.simulation.jets import Jet, constant, sinusoids, step
from dynakin.simulation.mechanics import Motion, SegmentMotion
from dynakin.simulation.motions.movement import Movement
from dynakin.simulation.motions.posed import foot_about, whole_motion
from dynakin.simulation.support import Footing, Support

Array = np.ndarray

GESTURE_S, RAMP_S = 10.0, 1.0
MIDDLE = np.array([0.35, 0.0, 0.40])  # between the ankles, on the laboratory's floor, m
HALF_WIDTH_M, STANDING = 0.09, 0.985  # of the ankles' distance; height of the hips over that with straight legs
PLATE_AHEAD_M = 0.08
HALF_SOLE_M = 0.045
STANDING_DEG = {"arm_flex": 5.0, "arm_add": -9.0, "elbow_flex": 14.0, "pro_sup": 90.0}

Waves = Mapping[str, tuple[float, float, float, float]]
"""Coordinate -> mean and amplitude (deg; m for hips_* and lifted_*), frequency (Hz), phase (parts of a turn)."""


def both(name: str, mean: float, size: float, hertz: float, left: float = 0.0) -> dict[str, tuple[float, ...]]:
    """A coordinate of both sides; ``left``: by how much of a turn the left one is behind."""
    return {f"{name}_r": (mean, size, hertz, 0.0), f"{name}_l": (mean, size, hertz, left)}


@dataclass(frozen=True)
class Gesture:
    """What moves. stands: feet on the ground ("rl", "r" or "l"); the other one is lifted."""

    words: str
    waves: Waves
    stands: str = "rl"


def beside(ahead_m: float, sign: float) -> Array:
    """(3,) m on the floor by the right (1) or the left (-1) ankle."""
    return np.asarray(MIDDLE + np.array([ahead_m, 0.0, sign * HALF_WIDTH_M]))


def gestures() -> list[Gesture]:
    """What is tried; sizes and paces of exercise without training."""
    apart = 0.5
    found = [
        Gesture("both arms swing forward and up, straight", both("arm_flex", 60.0, 60.0, 0.5)),
        Gesture("both arms swing forward and up, brisk", both("arm_flex", 45.0, 40.0, 1.0)),
        Gesture("arms swing in turn, straight", both("arm_flex", 25.0, 50.0, 0.8, apart)),
        Gesture("both arms rise sideways, straight", both("arm_add", -60.0, 50.0, 0.5)),
        Gesture("both arms rise sideways, brisk", both("arm_add", -50.0, 35.0, 1.0)),
        Gesture(
            "elbows bend and stretch, upper arms forward",
            both("arm_flex", 80.0, 0.0, 0.5) | both("elbow_flex", 70.0, 55.0, 0.8),
        ),
        Gesture("the trunk twists, arms out sideways",
                both("arm_add", -80.0, 0.0, 0.5) | {"lumbar_rotation": (0.0, 25.0, 0.5, 0.0)}),
        Gesture("the trunk twists, arms down", {"lumbar_rotation": (0.0, 25.0, 0.7, 0.0)}),
        Gesture("the trunk bends sideways", {"lumbar_bending": (0.0, 18.0, 0.5, 0.0)}),
        Gesture("the trunk bows and straightens",
                {"lumbar_extension": (-10.0, 10.0, 0.3, 0.0), "hips_x": (-0.04, 0.04, 0.3, 0.5)}),
        Gesture("the pelvis tilts forward and back", {"pelvis_tilt": (-5.0, 8.0, 0.5, 0.0)}),
        Gesture("the head nods and the trunk rests", {"neck_extension": (0.0, 25.0, 0.8, 0.0)}),
        Gesture("knee bends, a third deep",
                {"hips_y": (-0.08, 0.08, 0.5, 0.25), "lumbar_extension": (-6.0, 6.0, 0.5, 0.25)}),
        Gesture("the weight shifts from foot to foot", {"hips_z": (0.0, 0.06, 0.4, 0.0)}),
        Gesture("rises and sinks quickly in the knees", {"hips_y": (-0.04, 0.03, 1.2, 0.0)}),
    ]  # fmt: skip
    for side, name in (("r", "left"), ("l", "right")):
        found += [
            Gesture(f"on one foot, the {name} leg swings forward and back",
                    {"lifted_x": (0.05, 0.22, 0.5, 0.0), "lifted_y": (0.10, 0.0, 0.5, 0.0)}, side),
            Gesture(f"on one foot, the {name} leg swings sideways",
                    {"lifted_z": (0.14, 0.12, 0.4, 0.0), "lifted_y": (0.12, 0.0, 0.5, 0.0)}, side),
            Gesture(f"on one foot, the {name} knee rises and sinks",
                    {"lifted_y": (0.20, 0.15, 0.5, 0.0), "lifted_x": (0.08, 0.0, 0.5, 0.0)}, side),
        ]  # fmt: skip
    return found


def movement_of(body: SimulatedBody, chosen: Sequence[Gesture]) -> Movement:
    """The gestures one after the other, each from standing to standing."""

    def window(time: Array, k: int) -> Jet:
        start = k * GESTURE_S
        return step(time, start + 0.2, RAMP_S) + -1.0 * step(time, start + GESTURE_S - 0.2 - RAMP_S, RAMP_S)

    def summed(time: Array, name: str, unit: float = 1.0) -> Jet:
        total = constant(time, 0.0)
        for k, gesture in enumerate(chosen):
            if name in gesture.waves:
                mean, size, hertz, phase = gesture.waves[name]
                rest = _REST.get(name, 0.0)
                at = time - k * GESTURE_S
                wave = sinusoids(at, np.array([size]), np.array([hertz]), np.array([2.0 * np.pi * phase]))
                total = total + window(time, k) * (wave + (mean - rest))
        return unit * total

    def at(time: Array) -> Motion:
        names = {axis.coordinate for segment in body.tree for axis in segment.axes}
        degree = float(np.deg2rad(1.0))
        jets = {
            name: summed(time, name, degree) + degree * _REST.get(name, 0.0)
            for name in names
            if not name.startswith(("pelvis_t", "hip_", "knee_", "ankle_", "subtalar_", "tibial_"))
            or name == "pelvis_tilt"
        }
        rest = constant(time, 0.0)
        jets |= {f"tibial_torsion_{side}": rest for side, _ in SIDES}
        jets |= {f"knee_adduction_{side}": rest for side, _ in SIDES if f"knee_adduction_{side}" in names}
        L = body.lengths
        high = ankle_height(body.subject) + STANDING * (L["shank"] + L["thigh"])
        hips = [constant(time, float(v)) for v in MIDDLE + np.array([_HIPS_AHEAD_M, high, 0.0])]
        hips = [jet + summed(time, f"hips_{axis}") for jet, axis in zip(hips, "xyz", strict=True)]
        feet: dict[str, SegmentMotion] = {}
        for side, sign in SIDES:
            other = "l" if side == "r" else "r"
            alone = [k for k, gesture in enumerate(chosen) if gesture.stands == side]
            lift = [constant(time, 0.0)] * 3
            for k, gesture in enumerate(chosen):
                if gesture.stands == other:
                    for axis, way in (("x", 1.0), ("y", 1.0), ("z", sign)):
                        if f"lifted_{axis}" in gesture.waves:
                            mean, size, hertz, phase = gesture.waves[f"lifted_{axis}"]
                            wave = sinusoids(
                                time - k * GESTURE_S, np.array([size]), np.array([hertz]), np.array([phase])
                            )
                            index = "xyz".index(axis)
                            lift[index] = lift[index] + way * (_late(time, k) * (wave + mean))
            for k in alone:  # the hips go over that foot, and down by what the other leg would not reach
                hips[2] = hips[2] + 0.9 * sign * HALF_WIDTH_M * window(time, k)
                hips[1] = hips[1] + -0.015 * window(time, k)
            x, _, z = (constant(time, float(v)) for v in beside(0.0, sign))
            y = constant(time, ankle_height(body.subject))
            feet[f"foot_{side}"] = foot_about((x + lift[0], y + lift[1], z + lift[2]), rest, rest, np.zeros(3))
        x, y, z = hips
        return whole_motion(body.tree, jets, (x, y, z), hip_in_pelvis(body.subject, 0.0), feet)

    def support(time: Array) -> Support:
        shares = np.full(len(time), 0.5)
        for k, gesture in enumerate(chosen):
            if len(gesture.stands) == 1:
                shares = shares + (0.5 if gesture.stands == "r" else -0.5) * window(time, k).value
        points = {side: np.tile(beside(PLATE_AHEAD_M, sign), (len(time), 1)) for side, sign in SIDES}
        return Support(points["r"], points["l"], shares)

    always = (-np.inf, np.inf)
    footings = tuple(
        Footing(plate, beside(PLATE_AHEAD_M, sign), ((foot, *always),))
        for plate, foot, sign in (("plate 1", "right foot", 1.0), ("plate 2", "left foot", -1.0))
    )
    words = f"{len(chosen)} gestures of {GESTURE_S:g} s"
    return Movement("gestures", at, words, end_s=GESTURE_S * len(chosen), support=support, footings=footings)


def possible(body: SimulatedBody, gesture: Gesture) -> bool:
    """Whether nobody falls: the centre of pressure stays under the feet, or under the one that carries alone."""
    time = np.arange(0.0, GESTURE_S, 0.04)
    total = sum(mechanical_state(body, movement_of(body, [gesture]), time).carried.values())
    x, z = total[:, 5] / total[:, 1] - MIDDLE[0], -total[:, 3] / total[:, 1] - MIDDLE[2]
    sole = Sole.of(body.subject)
    stands = (sole.back_x < x.min()) and (x.max() < sole.tip_x) and np.abs(z).max() < HALF_WIDTH_M + HALF_SOLE_M
    alone = (time > 1.9) & (time < GESTURE_S - 1.9)
    if len(gesture.stands) == 1:
        foot = HALF_WIDTH_M if gesture.stands == "r" else -HALF_WIDTH_M
        stands = stands and np.abs(z[alone] - foot).max() < HALF_SOLE_M
    return bool(stands and total[:, 1].min() > 0.5 * total[:, 1].mean())


_CLOSED = ("pelvis_t", "hip_", "knee_", "ankle_", "subtalar_", "tibial_")  # they follow from hips and feet
_REST = {f"{name}_{side}": value for name, value in STANDING_DEG.items() for side in "rl"}
_HIPS_AHEAD_M = 0.03


def _late(time: Array, k: int) -> Jet:
    """A foot leaves the ground after the weight has left it, and is back before it returns."""
    start = k * GESTURE_S
    return step(time, start + 1.4, RAMP_S) + -1.0 * step(time, start + GESTURE_S - 1.4 - RAMP_S, RAMP_S)
