"""FORCE_PLATFORM:ZERO of a C3D: the frames whose mean is the zero of its plates' channels (C3D user guide)."""

from __future__ import annotations

import numpy as np

from dynakin.messages import Message, note
from dynakin.recordings.formats.c3d_parameters import Parameters
from dynakin.recordings.hull import distance_to_hull
from dynakin.recordings.plates.pressure import JUDGED_N
from dynakin.recordings.recording import Array

OVER_M = (-0.1, 0.3)
"""Heights over a plate, m, between which a marker over it is that of who stands on it, or steps over it."""


def zero_frames(parameters: Parameters, frames: int) -> slice | None:
    """Of so many in the file, counted from 1; None where it has none ("1 0" and "0 0" mean that), or others."""
    values = parameters.array("FORCE_PLATFORM", "ZERO").ravel()
    if len(values) < 2 or not (1 <= values[0] <= values[1] <= frames and (values % 1 == 0).all()):
        return None
    return slice(int(values[0]) - 1, int(values[1]))


def zeroed(
    name: str,
    channels: Array,
    force: Array,
    frames: slice,
    markers: Array,
    corners: Array,
    normal: Array,
    *,
    points: bool,
) -> tuple[Array, list[Message]]:
    """Channels (C, N) of a plate with their mean over these frames taken off, unless something may press on it then;
    and what there is to say of it.

    Args:
        force: (N, 3) N, of the plate as it is. markers: (T, M, 3) m. corners: (4, 3) m, of the plate. normal: (3,) of
            its surface, upwards. points: the channels hold centres of pressure (type 1), which have no zero, and were
            computed with that of the forces, or without it.
    """
    which = f"frames {frames.start + 1} to {frames.stop} (FORCE_PLATFORM:ZERO in the file)"
    if points:
        text = f"{name}: its mean in {which} was not taken off: its channels hold centres of pressure (type 1)."
        return channels, [note("plates", text)]
    per_frame = channels.shape[1] // len(markers)
    samples = slice(frames.start * per_frame, frames.stop * per_frame)
    if why := _in_use(force[samples], markers[frames], corners, normal):
        return channels, [note("plates", f"{name}: {why} in {which}: they are not taken for its zero.")]
    mean = channels[:, samples].mean(axis=1, keepdims=True)
    return channels - mean, [note("plates", f"{name}: its mean in {which} was taken off as its zero.")]


def _in_use(force: Array, markers: Array, corners: Array, normal: Array) -> str | None:
    """Why forces (N, 3) N may not be those of an empty plate while the markers (T, M, 3) are so: None where they are. A
    seat bears somebody of whom no marker is low over it, so the load is looked at, too."""
    if not np.isfinite(markers).all(axis=2).any():
        return "no marker is seen"
    if _somebody_over(markers, corners, normal):
        return "a foot is over it"
    load, spread = float(np.linalg.norm(force.mean(axis=0))), float(np.ptp(force, axis=0).max())
    if load <= JUDGED_N and spread <= JUDGED_N:
        return None
    return f"it reads {load:.0f} N on average, and {spread:.0f} N between its least and most,"


def _somebody_over(markers: Array, corners: Array, normal: Array) -> bool:
    """Whether one of the markers (T, M, 3) is low over a plate."""
    points = (markers - corners.mean(axis=0)).reshape(-1, 3)
    points = points[np.isfinite(points).all(axis=1)]
    height = points @ normal
    points = points[(height > OVER_M[0]) & (height < OVER_M[1])]
    side = corners[0] - corners[1]
    rows = np.array([side, np.cross(normal, side)]) / np.linalg.norm(side)
    place = (corners - corners.mean(axis=0)) @ rows.T
    away = distance_to_hull(points @ rows.T, np.broadcast_to(place, (len(points), 4, 2)))
    return bool((away <= 0.0).any())
