"""What a plate reads steadily below 0 while nobody is on it, which no load does: its zero, missing under a foot too."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from dynakin.arrays import Array, mean_seen
from dynakin.messages import Message, note, warning
from dynakin.recordings.plates.pressure import part_pulling, read_while_empty
from dynakin.recordings.pushes import JUDGED_N, LASTING_PULL, UNLOADED_N

_OFFSET_WORTH_A_NOTE_N = 5.0
_STEADY = 0.8
"""Part of what is read without a load that must be the same to `UNLOADED_N` for it to be the plate's zero."""
_CALM_S = 0.05
"""Time over which samples are averaged for it: noise of 7 N at 1000 Hz leaves 1 N (of single samples, in two
dimensions, 36 % lie beyond `UNLOADED_N`), 50 and 60 Hz hum nothing or a tenth, and nobody pulls a handle so briefly."""


class Zero(NamedTuple):
    """wrench: (6,) N and N m, to be taken off the plate; 0 where nothing is. reads_n: what it then still reads while it
    is empty, N (0: noise; above 0 markers say whether that is somebody's load). pulls: whether it does for long by more
    than an offset does. said: what there is to say of it."""

    wrench: Array
    reads_n: float
    pulls: bool
    said: list[Message]


def zero_of(name: str, wrench: Array, normal: Array, rate: float, *, emptied: bool = True) -> Zero:
    """Of a plate with this wrench (N, 6) N and N m, whose normal (3,) points towards the person.

    Args:
        rate: Hz, of its samples. emptied: the reader leaves nothing of what pulls.
    """
    push = wrench[:, :3] @ normal
    reads = read_while_empty(push)
    pulls = part_pulling(push)
    if pulls > LASTING_PULL:
        text = (
            f"{name} pulls by up to {-np.nanmin(push):.0f} N, which no plate can, in {100.0 * pulls:.0f} % "
            f"of the recording{': taken as empty there' if emptied else ''}. Zero it before the trial."
        )
        return Zero(np.zeros(6), min(reads, 0.0), True, [warning("plates", text)])
    each = max(round(_CALM_S * rate), 1) if np.isfinite(rate) else 1
    calm = _averaged(wrench, each)
    along = calm[:, :3] @ normal
    known = np.nan_to_num(along, nan=np.inf)
    own = np.abs(known - reads) < UNLOADED_N
    steadily = np.count_nonzero(own) >= _STEADY * np.count_nonzero(known < JUDGED_N)
    if reads < 0.0 and steadily and _of_nobody(calm[own, :3] - np.outer(along[own], normal)):
        text = f"{name} reads {reads:.3g} N where nobody stands on it: it is taken off over the whole trial."
        said = (warning if -reads > UNLOADED_N else note)("zero", text)
        samples = np.repeat(own, each)[: len(wrench)]
        return Zero(np.nanmedian(wrench[samples], axis=0), 0.0, False, [said])
    if abs(reads) < _OFFSET_WORTH_A_NOTE_N:
        return Zero(np.zeros(6), reads, False, [])
    why = "with a load across it" if steadily else "not steadily"
    left = f", but {why} (not taken off as it is read)" if reads < 0.0 else ", or by a light load"
    return Zero(
        np.zeros(6), reads, False, [note("plates", f"{name} reads {reads:.3g} N where nobody stands on it{left}.")]
    )


def _averaged(values: Array, each: int) -> Array:
    """Means (K, C) of so many values (N, C) each, of what is known of them."""
    lacking = -len(values) % each
    parts = np.concatenate([values, np.full((lacking, values.shape[1]), np.nan)])
    return mean_seen(parts.reshape(-1, each, values.shape[1], 1), axis=1)[..., 0]


def _of_nobody(across: Array) -> bool:
    """Whether forces (M, 3) N across the normal are a zero as well, and no handle that is pulled: steady and small."""
    middle = np.nanmedian(across, axis=0)
    steady = np.mean(np.linalg.norm(across - middle, axis=1) < UNLOADED_N)
    return bool(np.linalg.norm(middle) < JUDGED_N and steady >= _STEADY)
