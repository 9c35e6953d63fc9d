"""From a pelvis, two feet and an upper body, each given as smooth functions of time, to all coordinates of the body."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from dynakin.simulation.jets import Jet, constant
from dynakin.simulation.mechanics import Axis, Motion, Segment, SegmentMotion, kinematics
from dynakin.simulation.motions.leg_closure import HELD, close_legs
from dynakin.simulation.motions.movement import in_order

Array = NDArray[np.float64]
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
