"""From a pelvis, two feet and an upper body, each given as smooth functions of time, to all coordinates of the body."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from dynakin.arrays import Array, cross
from dynakin.errors import ConfigError
from dynakin.simulation.jets import Jet, constant
from dynakin.simulation.mechanics import Axis, Motion, Segment, SegmentMotion, TreeMotion, at_rest, kinematics
from dynakin.simulation.motions.movement import in_order

Point = tuple[Jet, Jet, Jet]
"""Ground coordinates x, y, z over time, m."""

LOCKED = ("wrist_flex", "wrist_dev")


def carried_frame(jets: Mapping[str, Jet], axes: Sequence[Axis], place: Array) -> SegmentMotion:
    """The frame that a chain of axes carries at ``place`` (3,) m beyond its last one."""
    nothing = np.zeros(3)
    chain = Segment("carrier", None, nothing, tuple(axes), 1.0, nothing, np.eye(3))
    frame = kinematics([chain], in_order([axis.coordinate for axis in axes], jets)).segments["carrier"]
    return SegmentMotion(
        frame.rotation, frame.point(place), frame.point_velocity(place), frame.point_acceleration(place),
        frame.omega, frame.alpha,
    )  # fmt: skip


def foot_about(pivot: Point, yaw: Jet, pitch: Jet, place: Array) -> SegmentMotion:
    """A foot whose point ``place`` (3,) m, in its own frame, is at ``pivot``; yaw to the left and pitch (toes up) in
    rad."""
    axes = [Axis(f"t{name}", tuple(row), translation=True) for name, row in zip("xyz", np.eye(3), strict=True)]
    axes += [Axis("yaw", (0.0, 1.0, 0.0)), Axis("pitch", (0.0, 0.0, 1.0))]
    jets = dict(zip(("tx", "ty", "tz"), pivot, strict=True)) | {"yaw": yaw, "pitch": pitch}
    return carried_frame(jets, axes, -place)


def point_of(frame: SegmentMotion) -> Point:
    """The frame's origin as functions of time."""
    values = (frame.origin, frame.velocity, frame.acceleration)
    x, y, z = (Jet(*(v[:, k] for v in values)) for k in range(3))
    return x, y, z


def whole_motion(
    tree: Sequence[Segment],
    jets: Mapping[str, Jet],
    mid_hip: Point,
    hips_P: Array,
    feet: Mapping[str, SegmentMotion],
) -> Motion:
    """All coordinates, from those of pelvis angles and upper body, the middle of the hip centres (``hips_P``: (3,) m
    in the pelvis' frame) and the feet.

    Raises:
        ConfigError: a leg does not reach its foot.
    """
    names = tuple(dict.fromkeys(axis.coordinate for segment in tree for axis in segment.axes))
    at_hips = dict(zip(("pelvis_tx", "pelvis_ty", "pelvis_tz"), mid_hip, strict=True))
    full = dict(jets) | dict(
        zip(at_hips, point_of(carried_frame({**jets, **at_hips}, tree[0].axes, -hips_P)), strict=True)
    )
    rest = constant(mid_hip[0].value, 0.0)
    for name in names:
        if name[:-2] in (*LOCKED, *HELD):
            full.setdefault(name, rest)
    return in_order(names, full | close_legs(tree, full, feet))


# Legs between a pelvis and feet whose motions are given: angles, and their exact speeds and accelerations.
#
# Six axes a leg and six numbers of the foot's pose leave nothing free. Angles follow by Newton's method; speeds and
# accelerations from the loop differentiated once and twice, J qd = v and J qdd = a - (what a is at qdd = 0), so they
# are exact derivatives of the angles and not differences.
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
    """The knee's angle (T,) rad between a hip and an ankle (T, 3) m, of legs whose joints lie along their segments; 0
    where they are too far apart."""
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
    q[:, free] = _first_guess(tree, at_rest(branch, names, q), foot, side, [names[j] for j in free])
    for _ in range(_MOST_STEPS):
        found = at_rest(branch, names, q)
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
        found = kinematics(branch, Motion(names, q, qd, qdd))
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
    columns = [np.hstack([cross(u, point - on_axis), u]) for u, on_axis in (moving.axes[key] for key in keys)]
    return np.asarray(np.linalg.solve(np.stack(columns, axis=2), gap[:, :, None])[:, :, 0])
