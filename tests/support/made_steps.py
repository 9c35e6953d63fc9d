"""Two feet that step where they are to, over plates that carry what they are to: all is known."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from dynakin.recordings.frame import GroundFrame
from dynakin.recordings.plates.pressure import Surface, plate_from_wrench
from dynakin.recordings.recording import Plate, Recording

LABORATORY = GroundFrame(np.eye(3), np.zeros(3), "+Y", np.array([1.0, 0.0, 0.0]))
FOOT_MARKERS = {side: [f"{side[0].upper()}{name}" for name in ("HEE", "TOE", "MT5")] for side in ("right", "left")}
WEIGHT_N = 700.0
RATE_HZ = 100.0
OVER_SOLE = {"HEE": (-0.10, 0.05), "TOE": (0.09, 0.05), "MT5": (0.06, 0.03)}  # forward of the middle, and up, m
_PASSES_S = 0.1


@dataclass(frozen=True)
class Stance:
    """A foot that stands from ``start`` to ``end`` s with its sole's middle at (x, height, z) m when it sets down, on a
    plate, on two (the load goes from the one to the other), or on none."""

    start: float
    end: float
    x: float
    z: float
    height: float = 0.0
    plates: tuple[str, ...] = ()


@dataclass(frozen=True)
class MadePlate:
    """A plate from x0 to x1 and z0 to z1 m; ``drift_n`` at the end, from none at the beginning."""

    name: str
    x: tuple[float, float] = (-0.3, 0.3)
    z: tuple[float, float] = (-0.3, 0.3)
    height: float = 0.0
    drift_n: float = 0.0
    moved: tuple[float, float] = (0.0, 0.0)  # how far off it is said to be
    edges: bool = True


@dataclass(frozen=True, eq=False)
class Made:
    """A recording and the truth: vertical forces (T, 2) N of the right and the left foot, centres of the soles."""

    recording: Recording
    push: np.ndarray
    sole: np.ndarray


def steps(
    duration_s: float,
    feet: Mapping[str, Sequence[Stance]],
    plates: Sequence[MadePlate] = (),
    belt_m_s: Mapping[str, float] | float = 0.0,
) -> Made:
    """Two feet that step; between two stances a foot swings in an arc 0.12 m over the higher one, and before the first
    and after the last it is held as high in the air.

    Args:
        feet: "right" and "left" -> stances, in order. belt_m_s: how fast what they stand on moves backwards.
    """
    time = np.arange(round(duration_s * RATE_HZ)) / RATE_HZ
    names, paths, soles, weights, pressures = [], [], [], [], []
    for side in ("right", "left"):
        speed = belt_m_s if isinstance(belt_m_s, float) else belt_m_s[side]
        sole = _path(time, feet[side], speed)
        soles.append(sole)
        weights.append(np.array([_weight(time, stance) for stance in feet[side]]))
        phases = [np.clip((time - s.start) / (s.end - s.start), 0.0, 1.0) for s in feet[side]]
        pressures.append([sole + np.outer(0.14 * phase - 0.07, [1.0, 0.0, 0.0]) for phase in phases])
        aside = 0.05 if side == "right" else -0.05
        for marker, (ahead, up) in OVER_SOLE.items():
            names.append(side[0].upper() + marker)
            paths.append(sole + np.array([ahead, up, aside if marker == "MT5" else 0.0]))
    total = sum(weight.sum(axis=0) for weight in weights)
    middle = _calm(0.5 * (soles[0] + soles[1]))
    for k in range(9):
        names.append(f"BODY{k}")
        paths.append(middle + np.array([0.02 * k, 0.9 + 0.05 * k, 0.03 * k]))
    made, push = {plate.name: np.zeros((len(time), 6)) for plate in plates}, np.zeros((len(time), 2))
    for k, side in enumerate(("right", "left")):
        for stance, weight, point in zip(feet[side], weights[k], pressures[k], strict=True):
            force = np.outer(WEIGHT_N * weight / np.maximum(total, 1.0), [0.0, 1.0, 0.0])
            force[:, 0] = 0.1 * force[:, 1] * np.sin(7.0 * time)  # so that the plates' heights matter
            push[:, k] += force[:, 1]
            phase = np.clip((time - stance.start) / (stance.end - stance.start), 0.0, 1.0)
            shares = {1: [np.ones_like(phase)], 2: [1.0 - phase, phase], 0: []}[len(stance.plates)]
            for name, share in zip(stance.plates, shares, strict=True):
                part = share[:, None] * force
                made[name] += np.hstack([part, np.cross(point, part)])
    read = tuple(_plate(plate, made[plate.name], time) for plate in plates)
    recording = Recording("steps", None, time, tuple(names), np.stack(paths, axis=1), read)
    return Made(recording, push, np.stack(soles, axis=1))


def _path(time: np.ndarray, stances: Sequence[Stance], belt_m_s: float) -> np.ndarray:
    found = np.zeros((len(time), 3))
    for k, stance in enumerate(stances):
        place = np.array([stance.x, stance.height, stance.z])
        inside = (time >= stance.start) & (time <= stance.end)
        carried = np.outer(-belt_m_s * (time - stance.start), [1.0, 0.0, 0.0])
        found[inside] = (place + carried)[inside]
        if k == 0:
            found[time < stance.start] = place
            found[:, 1] += 0.12 * np.clip((stance.start - time) / 0.2, 0.0, 1.0)
        after = time > stance.end
        leaves = place - [belt_m_s * (stance.end - stance.start), 0.0, 0.0]
        found[after] = leaves
        found[after, 1] += 0.12 * np.clip((time[after] - stance.end) / 0.2, 0.0, 1.0)
        if k + 1 < len(stances):
            to = stances[k + 1]
            swing = after & (time < to.start)
            part = (time[swing] - stance.end) / (to.start - stance.end)
            smooth = part**3 * (10.0 - 15.0 * part + 6.0 * part**2)
            lands = np.array([to.x, to.height, to.z])
            found[swing] = leaves + smooth[:, None] * (lands - leaves)
            highest = max(stance.height, to.height) + 0.12
            found[swing, 1] += 4.0 * part * (1.0 - part) * (highest - 0.5 * (stance.height + to.height))
    return found


def _calm(path: np.ndarray) -> np.ndarray:
    """Mean over a second: a body does not go to and fro as its feet do."""
    window = np.ones(round(RATE_HZ)) / round(RATE_HZ)
    padded = np.pad(path, ((len(window), len(window)), (0, 0)), mode="edge")
    return np.stack([np.convolve(padded[:, c], window, "same")[len(window) : -len(window)] for c in range(3)], axis=1)


def _weight(time: np.ndarray, stance: Stance) -> np.ndarray:
    up = np.ones_like(time) if stance.start <= 0.0 else (time - stance.start) / _PASSES_S
    down = np.ones_like(time) if stance.end >= time[-1] else (stance.end - time) / _PASSES_S
    return np.clip(np.minimum(up, down), 0.0, 1.0)


def _plate(plate: MadePlate, wrench: np.ndarray, time: np.ndarray) -> Plate:
    wrench = wrench.copy()
    rng = np.random.default_rng(len(plate.name))
    middle = np.array([np.mean(plate.x), plate.height, np.mean(plate.z)])
    noise = np.zeros_like(wrench)
    noise[:, :3] = rng.normal(0.0, 1.0, (len(time), 3))
    noise[:, 1] += plate.drift_n * time / time[-1]
    noise[:, 3:] = np.cross(middle, noise[:, :3])
    wrench += noise
    off = np.array([plate.moved[0], 0.0, plate.moved[1]])
    wrench[:, 3:] += np.cross(off, wrench[:, :3])
    (x0, x1), (z0, z1) = plate.x, plate.z
    y = plate.height
    corners = np.array([[x1, y, z1], [x0, y, z1], [x0, y, z0], [x1, y, z0]]) + off
    return plate_from_wrench(
        plate.name,
        wrench[:, :3],
        wrench[:, 3:],
        Surface(middle + off, np.array([0.0, 1.0, 0.0])),
        corners=corners if plate.edges else None,
        threshold_n=10.0,
        zero_unloaded=False,
    )


def walk(count: int, length: float, stance_s: float = 0.7, every_s: float = 0.55, rise: float = 0.0) -> dict:
    """Feet in turn, the right one first, each a step ahead and ``rise`` higher, from x = 0 on; plates "p0", "p1", ...,
    one a stance; begins with the first stance."""
    feet: dict[str, list[Stance]] = {"right": [], "left": []}
    for k in range(count):
        side = "right" if k % 2 == 0 else "left"
        start = k * every_s
        z = 0.1 if side == "right" else -0.1
        feet[side].append(Stance(start, start + stance_s, k * length, z, k * rise, (f"p{k}",)))
    return feet


def lasting(count: int, stance_s: float = 0.7, every_s: float = 0.55) -> float:
    """Seconds until the last stance of a `walk` ends: somebody stands throughout, unless it is a run."""
    return (count - 1) * every_s + stance_s


def sliding_in(made: Made, feet: Mapping[str, Sequence[Stance]], late_s: float, speed_m_s: float = 0.8) -> Made:
    """The same with the markers of each foot that sets down going on forwards until ``late_s`` after that, with all
    forces and centres of pressure as they were: a tall person's heel does on its way down."""
    time, markers = made.recording.time, made.recording.markers.copy()
    for side, names in FOOT_MARKERS.items():
        for stance in feet[side]:
            left = np.where(time > stance.start - 0.2, np.clip(stance.start + late_s - time, 0.0, late_s + 0.2), 0.0)
            if stance.start > 0.0:
                markers[:, [made.recording.marker_names.index(name) for name in names], 0] -= speed_m_s * left[:, None]
    return replace(made, recording=replace(made.recording, markers=markers))


ON_ONE_LEG = {
    "right": [Stance(0.0, 1.0, 0.0, 0.1, 0.0, ("p0",))],
    "left": [Stance(0.0, 4.0, 0.0, -0.1, 0.0, ("p1",))],
}
TWO_PLATES = [MadePlate("p0", z=(0.0, 0.3)), MadePlate("p1", z=(-0.3, 0.0))]


def moved(made: Made, side: str, to: np.ndarray) -> Made:
    """The same with a foot's markers where its sole's middle is to be, (T, 3) m; NaN: where they were."""
    markers = made.recording.markers.copy()
    columns = [made.recording.marker_names.index(name) for name in FOOT_MARKERS[side]]
    markers[:, columns] += np.nan_to_num(to - made.sole[:, list(FOOT_MARKERS).index(side)])[:, None]
    return replace(made, recording=replace(made.recording, markers=markers))


def turning(made: Made, about: float) -> Made:
    """The same with the left foot, its heel 60 mm up, turning once round from 1.6 to 2.4 s about a point so far (m)
    ahead of its sole's middle: its toe moves at 0.9 to 2 m/s."""
    time, markers = made.recording.time, made.recording.markers.copy()
    angle = np.pi * (1.0 - np.cos(np.pi * np.clip((time - 1.6) / 0.8, 0.0, 1.0)))
    middle = made.sole[:, 1] + [about, 0.0, 0.0]
    for name in FOOT_MARKERS["left"]:
        place = markers[:, made.recording.marker_names.index(name)]
        x, z = (place - middle)[:, [0, 2]].T
        place[:, 0] = middle[:, 0] + x * np.cos(angle) + z * np.sin(angle)
        place[:, 2] = middle[:, 2] - x * np.sin(angle) + z * np.cos(angle)
        if name.endswith("HEE"):
            place[:, 1] += np.interp(time, [1.3, 1.5, 2.5, 2.7], [0.0, 0.06, 0.06, 0.0])
    return replace(made, recording=replace(made.recording, markers=markers))
