"""Squats: repetitions of varying depth and pace, arms moving, in balance over flat feet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dynakin.errors import ConfigError
from dynakin.simulation.jets import Jet, constant, polynomial, sinusoids, step
from dynakin.simulation.mechanics import Motion, Segment, kinematics
from dynakin.simulation.sagittal import COORDINATES

Array = NDArray[np.float64]

STANDING_S = 1.5  # quiet standing before the first repetition: the filter's and the plates' start
SHORTEST_S = 5.0


@dataclass(frozen=True)
class Repetition:
    """One squat: start (s), durations of descent, hold and ascent (s), depth (1 = `FULL`), lift of the arms
    (1 = `FULL`)."""

    start_s: float
    down_s: float
    hold_s: float
    up_s: float
    depth: float
    arms: float

    @property
    def end_s(self) -> float:
        """When the subject stands again."""
        return self.start_s + self.down_s + self.hold_s + self.up_s


# Angles (deg) while standing, and what a full squat adds; the hip follows from balance.
STANDING = {"toe": 0.0, "ankle": 5.0, "knee": 4.0, "lumbar": 13.0, "shoulder": 5.0, "elbow": 15.0}
FULL = {"toe": 0.0, "ankle": 28.0, "knee": 95.0, "lumbar": -14.0, "shoulder": 70.0, "elbow": 10.0}


def draw_repetitions(rng: np.random.Generator, duration_s: float) -> list[Repetition]:
    """Repetitions from `STANDING_S` to shortly before the end, each of its own pace and depth.

    Raises:
        ConfigError: too short for standing and one repetition.
    """
    if not duration_s >= SHORTEST_S:
        raise ConfigError(f"simulated squat: duration_s is {duration_s:g}, expected at least {SHORTEST_S:g} s")
    repetitions: list[Repetition] = []
    start = STANDING_S
    while True:
        down, hold, up = rng.uniform([1.0, 0.0, 0.9], [1.6, 0.3, 1.4])
        depth, arms, rest = rng.uniform([0.6, 0.5, 0.1], [1.0, 1.1, 0.6])
        repetition = Repetition(start, down, hold, up, depth, arms)
        if repetition.end_s > duration_s - 0.3:
            return repetitions
        repetitions.append(repetition)
        start = repetition.end_s + rest


def squat_motion(
    rng: np.random.Generator, tree: Sequence[Segment], time: Array, repetitions: Sequence[Repetition]
) -> Motion:
    """Coordinates, speeds and accelerations: analytic functions of time, so exact derivatives of each other.

    Ankle, knee and trunk follow the depth; the hip is the polynomial of the depth that keeps the centre of
    mass over the foot; the arms rise with their own delay, and a slow sway runs through it all.
    """
    zero = constant(time, 0.0)
    depth, arms = zero, zero
    for r in repetitions:
        turn = r.start_s + r.down_s + r.hold_s
        depth = depth + r.depth * (step(time, r.start_s, r.down_s) - step(time, turn, r.up_s))
        late = 0.10 * r.down_s
        rise = step(time, r.start_s + late, r.down_s) - step(time, turn - late, r.up_s + late)
        arms = arms + r.arms * rise
    frequencies = rng.uniform(0.08, 0.35, (3, 4))
    sway = [sinusoids(time, np.full(4, np.deg2rad(0.06)), f, rng.uniform(0.0, 2.0 * np.pi, 4)) for f in frequencies]
    jets = {name: _follow(name, depth) for name in ("toe", "ankle", "knee", "lumbar")}
    jets |= {name: _follow(name, arms) for name in ("shoulder", "elbow")}
    jets["hip"] = polynomial(depth, balanced_hip(tree))
    for name, wander in zip(("ankle", "hip", "lumbar"), sway, strict=True):
        jets[name] = jets[name] + wander
    ordered = [jets[name] for name in COORDINATES]
    return Motion(
        COORDINATES,
        np.stack([j.value for j in ordered], axis=1),
        np.stack([j.rate for j in ordered], axis=1),
        np.stack([j.second for j in ordered], axis=1),
    )


def _follow(name: str, signal: Jet) -> Jet:
    return float(np.deg2rad(FULL[name])) * signal + float(np.deg2rad(STANDING[name]))


def balanced_hip(tree: Sequence[Segment], degree: int = 4) -> Array:
    """Coefficients (degree + 1,) of the hip angle (rad) as a polynomial of the depth that puts the centre of
    mass over the foot.

    The target lies a third of the way from the ankle to the toe landmark. Solved by bisection at depths from
    0 to 1.
    """
    levels = np.linspace(0.0, 1.0, 9)
    target = 0.65 * next(s for s in tree if s.name == "shank").placement[0]
    low, high = np.deg2rad(np.full_like(levels, -40.0)), np.deg2rad(np.full_like(levels, 150.0))
    for _ in range(60):
        middle = 0.5 * (low + high)
        behind = _com_x(tree, levels, middle) < target  # flexing the hip brings the trunk forward
        low, high = np.where(behind, middle, low), np.where(behind, high, middle)
    return np.asarray(np.polynomial.polynomial.polyfit(levels, 0.5 * (low + high), degree), dtype=float)


def _com_x(tree: Sequence[Segment], levels: Array, hip: Array) -> Array:
    q = np.stack([hip if n == "hip" else np.deg2rad(STANDING[n] + FULL[n] * levels) for n in COORDINATES], axis=1)
    still = np.zeros_like(q)
    moving = kinematics(tree, Motion(COORDINATES, q, still, still))
    weighted = sum(s.mass * moving.segments[s.name].point(s.com)[:, 0] for s in tree)
    return np.asarray(weighted / sum(s.mass for s in tree))
