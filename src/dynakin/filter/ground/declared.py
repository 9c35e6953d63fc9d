"""When declared contacts bear or pull the person: where the plates lack something, or nobody can say."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import scipy

from dynakin.arrays import runs, widened
from dynakin.filter.ground.closure import Closure
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.recordings.feet.loads import FootLoads
from dynakin.recordings.plates.ground_plate import GroundPlate
from dynakin.recordings.plates.pressure import JUDGED_N
from dynakin.recordings.recording import Recording
from dynakin.settings.contacts import SEAT

Array = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]

LOW = 0.85
"""Part of its greatest height over the floor below which a pelvis may be on a seat: standing on one's toes is above, a
bar stool below."""
STANDING = 0.53
"""Height of the middle of the pelvis' markers over that of the person, of who is seen seated only."""
MARGIN_S = 0.15
"""How long before and after the excess is seen the contact comes and goes: it is smoothed over that."""

UNDER_M, ALWAYS = 0.3, 0.95
"""A plate is a contact's of its own where it presses within so much of it, horizontally, by the median: a seat is as
large as that. And where the contact may bear for that part of its load: a foot's plate is loaded while somebody stands,
too."""


def plate_of_its_own(
    recording: Recording, initial: CalibratedModel, loads: FootLoads, paths: Array, may: Flags
) -> str | None:
    """The plate of the one contact that is declared: the only one on which no foot ever stands and that presses at it;
    None where there is no such plate, or more than one of either.

    Args:
        loads: of the feet, by all plates. paths: (T, 2, 3) m, of `ContactPaths`. may: (T, 1) of `may_bear`.
    """
    if len(initial.contacts) != 1 or loads.given:
        return None
    found = []
    for p, plate in enumerate(recording.plates):
        own = GroundPlate.of(plate, initial.ground)
        judged = own.push > JUDGED_N
        if not judged.any() or loads.on[judged, :, p].any():
            continue
        away = np.linalg.norm(own.cop[judged] - paths[judged, 1][:, [0, 2]], axis=1)
        if float(np.median(away)) < UNDER_M and may[judged, 0].mean() > ALWAYS:
            found.append(plate.name)
    return found[0] if len(found) == 1 else None


def may_bear(initial: CalibratedModel, paths: Array, floor_m: float, tallest_m: float) -> Flags:
    """(T, C) frames in which each declared contact may bear, by the markers alone: a seat where the pelvis is low.

    Args:
        paths: (T, 1 + C, 3) m, of `ContactPaths`. floor_m: height of the floor. tallest_m: greatest height of the
            root over it.
    """
    tallest = max(tallest_m, STANDING * (initial.height_m or 0.0))
    low = paths[:, 0, 1] - floor_m < LOW * tallest
    every = np.ones(len(paths), dtype=bool)
    return (
        np.stack([low if name == SEAT else every for name in initial.contacts], axis=1)
        if initial.contacts
        else (np.zeros((len(paths), 0), dtype=bool))
    )


def bearing(found: Closure, may: Flags, names: list[str], measured: list[bool], claimed: Flags, rate: float) -> Flags:
    """(T, C) frames in which each declared contact bears, of those (``measured``) that no plate measures.

    What the plates lack is taken for theirs, as far as they can: a seat pushes upwards, where the pelvis is low. Where
    nobody can judge, they bear where they may.

    Args:
        may: (T, C) of `may_bear`. claimed: (T,) frames in which the plates' sum was compared with the motion.
    """
    bears = np.zeros_like(may)
    if all(measured):
        return bears
    judged = np.isfinite(found.excess[:, 1])
    nearest = scipy.ndimage.distance_transform_edt(~judged, return_distances=False, return_indices=True)[0]
    for c, name in enumerate(names):
        if measured[c]:
            continue
        for first, end in runs(found.undeclared):
            excess = found.excess[first:end, 1]
            upwards = not np.isfinite(excess).any() or float(np.nanmean(excess)) > 0.0
            if name != SEAT or (upwards and may[first:end, c].mean() > 0.5):
                bears[first:end, c] = True
        bears[:, c] = widened(bears[:, c], round(MARGIN_S * rate)) & (may[:, c] | bears[:, c])
        bears[:, c] = np.where(judged, bears[:, c], np.where(claimed, bears[nearest, c], may[:, c]))
    return bears
