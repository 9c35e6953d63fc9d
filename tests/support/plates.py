"""One walk and one squat of the simulated whole body, and what can be wrong with the plates that they were on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np

from dynakin import Estimate, Estimator, Subject, load_model
from dynakin.arrays import Array
from dynakin.filter.prepared import Prepared
from dynakin.recordings.recording import Plate, Recording
from support.simulated import simulate

LENGTH_S = {"gait": 4.0, "squat": 8.0}


def person(*contacts: str, mass_kg: float = 70.0) -> Estimator:
    return Estimator(load_model("fullbody", Subject(mass_kg=mass_kg, height_m=1.75, sex="male")), contacts=contacts)


@cache
def trial(motion: str) -> Recording:
    return simulate("fullbody", motion, 7, LENGTH_S[motion]).recording


@cache
def prepared(motion: str, *contacts: str, mass_kg: float = 70.0) -> Prepared:
    """The trial as it is, prepared: nothing that follows it changes it."""
    return person(*contacts, mass_kg=mass_kg).prepare(trial(motion))


@cache
def estimated(motion: str) -> Estimate:
    """The trial as it is, estimated."""
    return person().follow(prepared(motion)).estimate


def with_plate(recording: Recording, which: int | None, change: Callable[[Plate], Plate]) -> Recording:
    """One of the plates changed, or (None) each."""
    return recording.with_plates(tuple(change(p) if which in (None, k) else p for k, p in enumerate(recording.plates)))


def with_forces(recording: Recording, change: Callable[[Array], Array], which: int | None = None) -> Recording:
    """Plates (one of them) with other forces; centres of pressure stay."""

    def of(plate: Plate) -> Plate:
        force = change(plate.force)
        moment = np.cross(np.nan_to_num(plate.cop), force) + plate.free_moment
        return replace(plate, force=force, moment=np.where(np.isfinite(plate.cop), moment, 0.0))

    return with_plate(recording, which, of)


def scaled(part: float | Array) -> Callable[[Plate], Plate]:
    """A plate with so much of all it says, where it presses as before."""
    factor = np.reshape(part, (-1, 1))

    def of(plate: Plate) -> Plate:
        return replace(
            plate, force=plate.force * factor, moment=plate.moment * factor, free_moment=plate.free_moment * factor
        )

    return of


def shifted(recording: Recording, along: int, by_m: float, which: int | None = None) -> Recording:
    """Plates (one of them) that lie so far along an axis of the laboratory, in the file but not in truth."""
    offset = by_m * np.eye(3)[along]

    def of(plate: Plate) -> Plate:
        corners = None if plate.corners is None else plate.corners + offset
        moment = plate.moment + np.cross(offset, plate.force)
        return replace(plate, cop=plate.cop + offset, moment=moment, corners=corners)

    return with_plate(recording, which, of)
