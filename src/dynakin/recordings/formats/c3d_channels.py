"""What the channels of the four usual types of force plate mean (C3D user guide, FORCE_PLATFORM:TYPE)."""

from __future__ import annotations

import numpy as np

from dynakin.recordings.recording import Array


def plate_wrench(
    kind: int, channels: Array, *, origin: Array, calibration: Array | None, units: Array
) -> tuple[Array, Array]:
    """Force (N, 3) N and moment (N, 3) N m about the centre of the surface, in the plate's frame (z into the
    floor).

    Args:
        kind: 1 force, centre of pressure and free moment; 2 force and moment about the transducers' origin; 3
            eight piezo-electric forces; 4 as 2, through a calibration matrix.
        channels: (6 or 8, N) as the file scales them.
        origin: (3,) m. Types 2 and 4: between the transducers' origin and the surface's centre; type 3:
            distances a, b of the sensors from the axes, and their depth. Files differ in the sign of its
            depth: the transducers lie below the surface, that is settled here.
        calibration: (6, 6), type 4 only.
        units: (6 or 8,) factor from each channel (type 4: each calibrated channel) to N, N m or m.
    """
    if calibration is not None:
        channels = calibration @ channels
    values = channels * units[:, None]
    if kind == 1:
        force = values[:3].T
        arm = np.column_stack([values[3], values[4], np.zeros(values.shape[1])])
        return force, np.cross(arm, force) + np.outer(values[5], [0.0, 0.0, 1.0])
    if kind == 3:
        return _eight_forces(values, a=abs(origin[0]), b=abs(origin[1]), depth=abs(origin[2]))
    # From the transducers' origin T to the surface's centre S, which lies above it, at negative z: a file
    # with a positive depth holds the opposite vector. M_S = M_T + F x (S - T).
    to_surface = -origin if origin[2] > 0 else origin
    force = values[:3].T
    return force, values[3:].T + np.cross(force, to_surface)


def _eight_forces(values: Array, a: float, b: float, depth: float) -> tuple[Array, Array]:
    """Kistler: f_x12, f_x34, f_y14, f_y23, f_z1 to f_z4; sensors at (+-a, +-b), ``depth`` below the
    surface."""
    x12, x34, y14, y23, z1, z2, z3, z4 = values
    force = np.column_stack([x12 + x34, y14 + y23, z1 + z2 + z3 + z4])
    moment = np.column_stack(
        [
            b * (z1 + z2 - z3 - z4),
            a * (z2 + z3 - z1 - z4),
            b * (x34 - x12) + a * (y14 - y23),
        ]
    )
    return force, moment + np.cross(force, [0.0, 0.0, -depth])
