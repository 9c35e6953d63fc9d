"""Legs between a pelvis and feet whose motions are given: angles, and their exact speeds and accelerations.

Six axes a leg and six numbers of the foot's pose leave nothing free. Angles follow by Newton's method; speeds and
accelerations from the loop differentiated once and twice, J qd = v and J qdd = a - (what a is at qdd = 0), so they are
exact derivatives of the angles and not differences.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from dynakin.errors import ConfigError
from dynakin.simulation.jets import Jet
from dynakin.simulation.mechanics import Motion, Segment, SegmentMotion, TreeMotion, kinematics

Array = NDArray[np.float64]
HELD = ("knee_adduction", "tibial_torsion")
_CLOSED = 1e-12  # m and rad
_MOST_STEPS = 40
_LONGEST_STEP = 0.4  # rad


def close_legs(tree: Sequence[Segment], given: Mapping[str, Jet], feet: Mapping[str, SegmentMotion]) -> dict[str, Jet]:
    """Coordinates of both legs, that the feet are where they are to be.

    Args:
        tree: of `dynakin.simulation.bodies.whole_body.build_tree`.
        given: coordinates of the pelvis and those of the legs that are held (`HELD`).
        feet: segment -> its motion in the ground frame.

    Raises:
        ConfigError: a leg does not reach, with the side.
    """
    return {name: jets for side in "rl" for name, jets in _close(tree, given, feet[f"foot_{side}"], side).items()}


def knee_flexion(tree: Sequence[Segment], hip: Array, ankle: Array, side: str) -> Array:
    """The knee's angle (T,) rad between a hip and an ankle (T, 3) m; 0 where they lie too far apart."""
    thigh, shank = _lengths(tree, side)
    apart = np.sum((hip - ankle) ** 2, axis=1)
    cosine = (apart - thigh**2 - shank**2) / (2.0 * thigh * shank)
    return np.asarray(np.arccos(np.clip(cosine, -1.0, 1.0)))


def _lengths(tree: Sequence[Segment], side: str) -> tuple[float, float]:
    place = {segment.name: segment.placement for segment in tree}
    return float(np.linalg.norm(place[f"shank_{side}"])), float(np.linalg.norm(place[f"foot_{side}"]))


def _close(tree: Sequence[Segment], given: Mapping[str, Jet], foot: SegmentMotion, side: str) -> dict[str, Jet]:
    branch = [s for s in tree if s.name in ("pelvis", f"thigh_{side}", f"shank_{side}", f"foot_{side}")]
    axes = [(s.name, k, axis.coordinate) for s in branch for k, axis in enumerate(s.axes)]
    names = tuple(name for _, _, name in axes)
    free = [names.index(name) for segment, _, name in axes if segment != "pelvis" and name[:-2] not in HELD]
    keys = [(axes[j][0], axes[j][1]) for j in free]
    frames = len(foot.origin)
    q, qd, qdd = np.zeros((3, frames, len(names)))
    for j, name in enumerate(names):
        if j not in free:
            q[:, j], qd[:, j], qdd[:, j] = given[name].value, given[name].rate, given[name].second
    rest = np.zeros_like(q)

    def moving(q: Array, qd: Array = rest, qdd: Array = rest) -> TreeMotion:
        return kinematics(branch, Motion(names, q, qd, qdd))

    q[:, free] = _first_guess(tree, moving(q), foot, side, [names[j] for j in free])
    for _ in range(_MOST_STEPS):
        found = moving(q)
        error = _apart(found.segments[f"foot_{side}"], foot)
        if np.abs(error).max() < _CLOSED:
            break
        step = _solve(found, keys, found.segments[f"foot_{side}"].origin, error)
        q[:, free] += np.clip(step, -_LONGEST_STEP, _LONGEST_STEP)
    else:
        frame = int(np.argmax(np.abs(error).max(axis=1)))
        word = {"r": "right", "l": "left"}[side]
        raise ConfigError(
            f"simulation: the {word} leg does not reach from hip to foot in frame {frame} of {frames}; expected a "
            "subject nearer to the table (a smaller spread, or another seed)"
        )
    for order in (1, 2):  # first the speeds, then with them the accelerations
        found = moving(q, qd, qdd)
        own = found.segments[f"foot_{side}"]
        wanted = (foot.velocity, foot.omega) if order == 1 else (foot.acceleration, foot.alpha)
        already = (own.velocity, own.omega) if order == 1 else (own.acceleration, own.alpha)
        gap = np.hstack([w - a for w, a in zip(wanted, already, strict=True)])
        (qd if order == 1 else qdd)[:, free] = _solve(found, keys, own.origin, gap)
    return {names[j]: Jet(q[:, j], qd[:, j], qdd[:, j]) for j in free}


def _first_guess(
    tree: Sequence[Segment], moving: TreeMotion, foot: SegmentMotion, side: str, names: list[str]
) -> Array:
    """The knee from the distance that it must span, and the rest as in the plane."""
    thigh, shank = _lengths(tree, side)
    pelvis, hip = moving.segments["pelvis"], moving.segments[f"thigh_{side}"].origin
    knee = np.maximum(knee_flexion(tree, hip, foot.origin, side), 0.02)
    down = np.swapaxes(pelvis.rotation, 1, 2) @ (foot.origin - hip)[:, :, None]
    between = np.arctan2(shank * np.sin(knee), thigh + shank * np.cos(knee))  # thigh and the line from hip to ankle
    flexion = np.arctan2(down[:, 0, 0], -down[:, 1, 0]) + between
    pitch = np.arcsin(np.clip(foot.rotation[:, 1, 0], -1.0, 1.0))
    lean = np.arcsin(np.clip(pelvis.rotation[:, 1, 0], -1.0, 1.0)) + flexion - knee
    guess = {"hip_flexion": flexion, "knee_angle": knee, "ankle_angle": pitch - lean}
    return np.stack([guess.get(name[:-2], np.zeros_like(knee)) for name in names], axis=1)


def _apart(own: SegmentMotion, wanted: SegmentMotion) -> Array:
    """What is lacking (T, 6): place, and turn as a rotation vector in the ground frame."""
    R = wanted.rotation @ np.swapaxes(own.rotation, 1, 2)
    twice_sine = np.stack([R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]], axis=1)
    return np.hstack([wanted.origin - own.origin, 0.5 * twice_sine])


def _solve(moving: TreeMotion, keys: Sequence[tuple[str, int]], point: Array, gap: Array) -> Array:
    """Rates (T, 6) of the leg's axes that give its foot the velocity and angular velocity ``gap`` (T, 6)."""
    columns = [np.hstack([np.cross(u, point - on_axis), u]) for u, on_axis in (moving.axes[key] for key in keys)]
    return np.asarray(np.linalg.solve(np.stack(columns, axis=2), gap[:, :, None])[:, :, 0])
