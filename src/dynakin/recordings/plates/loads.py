"""Known loads on a plate that are not the person's (a rail, a box): taken off its wrench."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from dynakin.arrays import Array
from dynakin.errors import RecordingError
from dynakin.messages import note
from dynakin.recordings.landmarks import DEFAULT_PAIRS
from dynakin.recordings.orientation import axis_vector
from dynakin.recordings.plates.pressure import Surface, centre_of_pressure
from dynakin.recordings.pushes import UNLOADED_N
from dynakin.recordings.recording import Plate, Recording
from dynakin.recordings.vertical import find_vertical
from dynakin.settings.subject import PlateLoad


def without_plate_loads(recording: Recording, loads: Sequence[PlateLoad], vertical: str = "auto") -> Recording:
    """The recording with these wrenches taken off its plates, at all frames; centres of pressure are made anew.

    Args:
        vertical: laboratory axis that points up, the plates' normal; "auto": found.

    Raises:
        RecordingError: a plate that the recording does not have.
    """
    if not loads:
        return recording
    names = [plate.name for plate in recording.plates]
    for load in loads:
        if load.plate not in names:
            raise RecordingError(
                f"{recording.path or recording.name}: plate_loads: no plate {load.plate!r}, expected one of "
                f"{', '.join(names) or 'none (there are no plates)'}"
            )
    axis = find_vertical(recording, DEFAULT_PAIRS)[0] if vertical.casefold() == "auto" else vertical
    up = axis_vector(axis)
    plates = tuple(
        _relieved(plate, [load for load in loads if load.plate == plate.name], up) for plate in recording.plates
    )
    notes = tuple(
        note(
            "plates",
            f"{load.plate}: a known load of {np.linalg.norm(load.force_n):.1f} N that is not the person's is taken "
            "off.",
        )
        for load in loads
    )
    return recording.with_plates(plates, notes)


def _relieved(plate: Plate, loads: Sequence[PlateLoad], up: Array) -> Plate:
    if not loads:
        return plate
    force = np.sum([load.force_n for load in loads], axis=0)
    moment = np.sum([np.cross(load.point_m, load.force_n) + load.moment_nm for load in loads], axis=0)
    return without_wrench(plate, np.concatenate([force, moment]), up)


def without_wrench(plate: Plate, wrench: Array, up: Array) -> Plate:
    """The plate without a wrench (6,) or (T, 6) N and N m about the laboratory's origin; its normal is ``up`` (3,)."""
    force, moment = plate.force - wrench[..., :3], plate.moment - wrench[..., 3:]
    points = plate.cop if plate.corners is None else plate.corners
    seen = points[np.isfinite(points).all(axis=1)]
    surface = Surface(np.median(seen, axis=0) if len(seen) else np.zeros(3), up)
    cop, free = centre_of_pressure(force, moment, surface, UNLOADED_N)
    return replace(plate, force=force, moment=moment, cop=cop, free_moment=free, empty_n=0.0)
