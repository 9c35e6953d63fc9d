"""What a low-pass of the laboratory took of the movement, in the deviations that are reported."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from dynakin.arrays import Array, rms
from dynakin.bindings import _core
from dynakin.filter.uncertainty.frames import wrenches_of
from dynakin.filter.uncertainty.geometry import BLOCKS, Geometry
from dynakin.filter.uncertainty.systematic import Systematic
from dynakin.messages import Message, note, warning
from dynakin.recordings.low_passed import LowPass
from dynakin.results.estimate import values_of
from dynakin.results.naming import sentence, words

if TYPE_CHECKING:
    import xarray as xr


MATTERS = 0.75
"""Speeds that were taken, over the deviation that is reported without them (RMS, worst rotation), from which on it is a
warning: by `truth3d` (walks, seeds 1 and 2) 1.7 to 3.4 at 6 Hz, where errors of speeds are one and a half to two times
as large, 0.5 at 8 Hz and 0.4 at 10 Hz, where they are not; squats below 0.3 from 3 Hz on."""
HIGH_HZ = 12.0
"""Cut-off found above which nothing is widened: it took what only landings and runs have, and noise, by which it cannot
be told."""
TOO_LOW_HZ = 4.5
"""Cut-off found below which so much of a movement that it matters to is gone that deviations no longer hold: of a walk
(`truth3d`) at 3 Hz 60 % of speeds, at 4 Hz 77 to 88 %, at 6 Hz 92 to 100 %."""


def with_taken(data: xr.Dataset, low_pass: LowPass, systematic: Systematic | None) -> tuple[xr.Dataset, Message]:
    """``data`` with deviations that hold what the filter took of each coordinate, and a sentence.

    Args:
        systematic: gives what moments change by; those of a model that is fixed in the ground stay.
    """
    cutoff = f"{low_pass.cutoff_hz:.0f} Hz"
    text = (
        f"the markers look low-passed at about {cutoff}, or were computed by a model: nothing of the cameras' noise is "
        "left above"
    )
    if low_pass.cutoff_hz > HIGH_HZ:
        return data, note("low-passed", f"{sentence(text)}. That takes little but of impacts.")
    lost = _taken(values_of(data, "coordinates"), low_pass)
    if systematic is not None:
        lost.append(np.nan_to_num(_moments_moved(systematic.geometry, data, lost)))
    sizes = [low_pass.size(values) for values in lost]
    said = [values_of(data, f"{block}_sd") for block in BLOCKS]
    turns = np.asarray(data["coordinate_type"].values == "rotation")
    speed, speed_sd = rms(sizes[1], axis=0), rms(said[1], axis=0)
    judged = turns & (speed_sd > 0.0)  # what is held still has none
    share = np.divide(speed, speed_sd, out=np.zeros_like(speed), where=judged)
    k = int(np.argmax(share))
    if share[k] > MATTERS:
        hold = "and deviations were widened by as much"
        if low_pass.cutoff_hz < TOO_LOW_HZ:
            hold = (
                "and more than can be told from what is left: deviations of speeds, accelerations and of the moments "
                "that rest on these are too small, whatever else is said of them"
            )
        name = words(str(data["coordinate"].values[k]))
        message = warning(
            "low-passed",
            f"{text}. The filter took some {np.degrees(speed[k]):.0f} deg/s of the speed of {name}, {hold}.",
        )
    else:
        message = note("low-passed", f"{sentence(text)}. The filter took little of this movement.")
    wider = {
        f"{block}_sd": (("time", "coordinate"), np.where(sd > 0.0, np.hypot(sd, size), sd))
        for block, sd, size in zip(BLOCKS, said, sizes, strict=False)
    }
    return data.assign(wider), message


def _taken(q: Array, low_pass: LowPass) -> list[Array]:
    """Of coordinates (T, C), their speeds and accelerations; lost frames are led through."""
    known, at = np.isfinite(q).all(axis=1), np.arange(len(q))
    if np.count_nonzero(known) < 2:
        return [np.zeros_like(q)] * 3
    whole = np.column_stack([np.interp(at, at[known], column[known]) for column in q.T])
    return [low_pass.taken(whole, derivative) for derivative in range(3)]


def _moments_moved(geometry: Geometry, data: xr.Dataset, moved: Sequence[Array]) -> Array:
    """(T, C): what moments change by where coordinates, speeds and accelerations (T, C) are others by ``moved`` and
    the contacts' wrenches stay; NaN where the state is not a number."""
    states, (wrench, segments) = values_of(data, "state"), wrenches_of(data)
    change = np.hstack([values[:, geometry.free] for values in moved])
    K = change.shape[1]
    found = np.full((len(states), geometry.count), np.nan)
    for k in np.flatnonzero(np.isfinite(states[:, :K]).all(axis=1)):
        T = _core.moment_jacobian(geometry.model, states[k], geometry.external(wrench[k], segments))
        found[k] = T[: geometry.count, :K] @ change[k]
    return found
