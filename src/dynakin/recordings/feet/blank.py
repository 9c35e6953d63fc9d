"""Plates that have no numbers while nobody is on them, as some programs write an empty one: they are empty.

What a plate without numbers carries while a foot may be on it is not known.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from dynakin.messages import Message, note
from dynakin.recordings.feet.assignment import foot_loads
from dynakin.recordings.feet.loads import MEASURED, SHARED, SWING
from dynakin.recordings.frame import GroundFrame
from dynakin.recordings.recording import Recording


def without_blanks(
    recording: Recording, ground: GroundFrame, foot_markers: Mapping[str, Sequence[str]]
) -> tuple[Recording, list[Message]]:
    """The recording, itself where nothing is blank, with 0 where a plate has no numbers, and each foot is seen in the
    air or on another plate."""
    blank = [~np.isfinite(plate.wrench).all(axis=1) for plate in recording.plates]
    if not np.any(blank) or not all(foot_markers.values()):
        return recording, []
    loads = foot_loads(recording, ground, foot_markers)
    owned = np.asarray(loads.on.any(axis=1))
    elsewhere = np.isin(loads.reason, (SWING, MEASURED, SHARED)) | loads.on.any(axis=2)
    plates, emptied = list(recording.plates), []
    for p, plate in enumerate(plates):
        empty = blank[p] & ~owned[:, p] & elsewhere.all(axis=1)
        if empty.any():
            given = (plate.force, plate.moment, plate.free_moment)
            force, moment, free = (np.where(empty[:, None], 0.0, values) for values in given)
            plates[p] = replace(plate, force=force, moment=moment, free_moment=free)
            emptied.append(plate.name)
    if not emptied:
        return recording, []
    text = f"{', '.join(emptied)}: no numbers while no foot is near, taken as empty there."
    return recording.with_plates(tuple(plates)), [note("plates", text)]
