"""FORCE_PLATFORM:ZERO of a C3D: the frames whose mean is the zero of its plates' channels (C3D user guide)."""

from __future__ import annotations

import numpy as np

from dynakin.messages import Message, note
from dynakin.recordings.formats.c3d_parameters import Parameters
from dynakin.recordings.hull import distance_to_hull
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
    name: str, channels: Array, frames: slice | None, markers: Array, corners: Array, normal: Array
) -> tuple[Array, list[Message]]:
    """Channels (C, N) of a plate with their mean over these frames taken off, unless a marker is over the plate then;
    and what there is to say of it.

    Args:
        markers: (T, M, 3) m. corners: (4, 3) m, of the plate. normal: (3,) of its surface, upwards.
    """
    if frames is None:
        return channels, []
    which = f"frames {frames.start + 1} to {frames.stop} (FORCE_PLATFORM:ZERO in the file)"
    if _somebody_over(markers[frames], corners, normal):
        text = f"{name}: a foot is over it in {which}: they are not taken for its zero."
        return channels, [note("plates", text)]
    per_frame = channels.shape[1] // len(markers)
    mean = channels[:, frames.start * per_frame : frames.stop * per_frame].mean(axis=1, keepdims=True)
    return channels - mean, [note("plates", f"{name}: its mean in {which} was taken off as its zero.")]


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
