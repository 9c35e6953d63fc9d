"""Over flat feet in balance: squats, repetitions of varying depth and pace, arms moving; and standing and swaying, more
than quiet standing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dynakin.arrays import Array
from dynakin.errors import ConfigError
from dynakin.simulation.bodies.body import SimulatedBody
from dynakin.simulation.bodies.posture import balance, posture_jets
from dynakin.simulation.jets import Jet, constant, sinusoids, step
from dynakin.simulation.mechanics import Motion
from dynakin.simulation.motions.movement import STANDING_S, Movement, Repetition, in_order

SHORTEST_S = 5.0
SWAYING = ("ankle", "hip", "lumbar")
SWAY_DEG = 0.06  # amplitude of each of the tones that run through the motion
_TONES = 4


@dataclass(frozen=True)
class Squat:
    """One squat: start (s), durations of descent, hold and ascent (s), depth (1 = full), lift of the arms
    (1 = full)."""

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


def draw_squats(rng: np.random.Generator, duration_s: float) -> list[Squat]:
    """Repetitions from `STANDING_S` to shortly before the end, each of its own pace and depth.

    Raises:
        ConfigError: too short for standing and one repetition.
    """
    if not duration_s >= SHORTEST_S:
        raise ConfigError(f"simulated squat: duration_s is {duration_s:g}, expected at least {SHORTEST_S:g} s")
    squats: list[Squat] = []
    start = STANDING_S
    while True:
        down, hold, up = rng.uniform([1.0, 0.0, 0.9], [1.6, 0.3, 1.4])
        depth, arms, rest = rng.uniform([0.6, 0.5, 0.1], [1.0, 1.1, 0.6])
        squat = Squat(start, down, hold, up, depth, arms)
        if squat.end_s > duration_s - 0.3:
            return squats
        squats.append(squat)
        start = squat.end_s + rest


def squat_movement(rng: np.random.Generator, body: SimulatedBody, duration_s: float) -> Movement:
    """Squats as an analytic function of time, so speeds and accelerations are exact derivatives.

    Ankle, knee and trunk follow the depth; the hip is the polynomial of the depth that keeps the centre of
    mass over the foot; the arms rise with their own delay, and a slow sway runs through it all.
    """
    squats = draw_squats(rng, duration_s)
    wander = draw_wander(rng)
    path = body.paths["squat"]
    balanced = balance(body.tree, path)

    def at(time: Array) -> Motion:
        depth, arms = squat_signals(time, squats)
        jets = posture_jets(path, balanced, depth, arms)
        return in_order(body.coordinates, add_wander(jets, wander, time))

    return Movement(
        "squat",
        at,
        f"{len(squats)} repetitions of varying depth and pace",
        tuple(Repetition(s.start_s, s.end_s, s.depth) for s in squats),
    )


def squat_signals(time: Array, squats: Sequence[Squat]) -> tuple[Jet, Jet]:
    """Depth and lift of the arms over time."""
    depth = arms = constant(time, 0.0)
    for r in squats:
        turn = r.start_s + r.down_s + r.hold_s
        depth = depth + r.depth * (step(time, r.start_s, r.down_s) - step(time, turn, r.up_s))
        late = 0.10 * r.down_s
        rise = step(time, r.start_s + late, r.down_s) - step(time, turn - late, r.up_s + late)
        arms = arms + r.arms * rise
    return depth, arms


def draw_wander(rng: np.random.Generator) -> list[tuple[Array, Array]]:
    """Frequencies (Hz) and phases of a slow sway of `SWAYING`."""
    frequencies = rng.uniform(0.08, 0.35, (len(SWAYING), _TONES))
    return [(f, rng.uniform(0.0, 2.0 * np.pi, _TONES)) for f in frequencies]


def add_wander(jets: dict[str, Jet], wander: Sequence[tuple[Array, Array]], time: Array) -> dict[str, Jet]:
    """The coordinates with the sway."""
    amplitudes = np.full(_TONES, np.deg2rad(SWAY_DEG))
    swayed = {
        name: jets[name] + sinusoids(time, amplitudes, f, phases)
        for name, (f, phases) in zip(SWAYING, wander, strict=True)
    }
    return jets | swayed


SHORTEST_SWAY_S = 3.0
# Root mean square of each coordinate's sway, deg: ankle and hip strategies together, the arms hanging loosely.
SWAY_SIZE_DEG = {"ankle": 0.7, "knee": 0.6, "hip": 1.5, "lumbar": 1.2, "shoulder": 2.0, "elbow": 2.0}
SWAY_BAND_HZ = (0.05, 0.6)
SWAY_QUIET = 0.1  # part of it during the quiet standing before
_SWAY_TONES = 6


def sway_movement(rng: np.random.Generator, body: SimulatedBody, duration_s: float) -> Movement:
    """Sway about standing in balance, each coordinate on its own, an analytic function of time.

    Raises:
        ConfigError: too short.
    """
    if not duration_s >= SHORTEST_SWAY_S:
        raise ConfigError(f"simulated sway: duration_s is {duration_s:g}, expected at least {SHORTEST_SWAY_S:g} s")
    path = body.paths["sway"]
    balanced = balance(body.tree, path)
    names = [name for name in body.coordinates if name in SWAY_SIZE_DEG]
    frequencies = rng.uniform(*SWAY_BAND_HZ, (len(names), _SWAY_TONES))
    phases = rng.uniform(0.0, 2.0 * np.pi, (len(names), _SWAY_TONES))

    def at(time: Array) -> Motion:
        rest = constant(time, 0.0)
        jets = posture_jets(path, balanced, rest, rest)
        envelope = (1.0 - SWAY_QUIET) * step(time, STANDING_S, 1.0) + SWAY_QUIET
        for k, name in enumerate(names):
            jets[name] = jets[name] + envelope * _sway_tones(time, SWAY_SIZE_DEG[name], frequencies[k], phases[k])
        return in_order(body.coordinates, jets)

    return Movement("sway", at, "standing and swaying")


def _sway_tones(time: Array, size_deg: float, frequencies: Array, phases: Array) -> Jet:
    amplitude = np.deg2rad(size_deg) * np.sqrt(2.0 / _SWAY_TONES)
    return sinusoids(time, np.full(_SWAY_TONES, amplitude), frequencies, phases)
