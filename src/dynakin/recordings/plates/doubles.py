"""One and the same load in two plates: no two plates measure the same number to the last digit, row by row."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from dynakin.messages import Message, warning
from dynakin.recordings.plates.stuck import without_frames
from dynakin.recordings.pushes import JUDGED_N
from dynakin.recordings.recording import Plate, Recording

SAME, SAME_M = 1e-6, 1e-3
"""Part of the largest force within which two are the same, and m, within which their places are: noise alone is
0.1 N, and plates lie side by side."""


def without_doubles(recording: Recording) -> Recording:
    """The recording with a plate that is listed twice once, and without (NaN) what two plates at different places hold
    alike; with a warning of each pair."""
    plates, notes = {plate.name: plate for plate in recording.plates}, list[Message]()
    if len(plates) < len(recording.plates):  # names are all that tells them apart here
        return recording
    for first, second in combinations(recording.plates, 2):
        if first.name not in plates or second.name not in plates or not _same_load(first, second):
            continue
        both = f"{first.name} and {second.name} hold the same forces in every row"
        if _same_place(first, second):
            del plates[second.name]
            text = f"{both}, at the same place: one plate that is listed twice. {second.name} is left out"
        elif _in_a_plane(first):
            continue
        else:
            for plate in (first, second):
                plates[plate.name] = without_frames(plate, np.ones(recording.n_frames, dtype=bool))
            text = f"{both}, at different places: one of them at most bore them. Neither is measured"
        notes.append(warning("plates", f"{text}. Export each plate once, with its own channels."))
    return recording.with_plates(tuple(plates.values()), tuple(notes)) if notes else recording


def _same_load(first: Plate, second: Plate) -> bool:
    """By the size of the force, whichever way the plates are turned."""
    own, other = (np.linalg.norm(plate.force, axis=1) for plate in (first, second))
    largest = float(np.max(own, initial=0.0, where=np.isfinite(own)))
    return largest > JUDGED_N and np.allclose(own, other, rtol=0.0, atol=SAME * largest, equal_nan=True)


def _same_place(first: Plate, second: Plate) -> bool:
    if first.corners is not None and second.corners is not None:
        return bool(np.abs(first.corners.mean(axis=0) - second.corners.mean(axis=0)).max() < SAME_M)
    away = np.abs(first.cop - second.cop)
    return bool(np.isfinite(away).any() and np.nanmax(away) < SAME_M)


def _in_a_plane(plate: Plate) -> bool:
    """Whether a plate's centre of pressure moves along one axis alone: of a movement that was made in a plane, each
    foot bears just half."""
    pressed = plate.cop[np.isfinite(plate.cop).all(axis=1)]
    return bool(len(pressed) and np.count_nonzero(np.ptp(pressed, axis=0) < SAME_M) >= 2)
