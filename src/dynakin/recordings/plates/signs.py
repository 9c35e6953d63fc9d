"""Plates that hold the person's action instead of the ground's reaction: a plate cannot pull."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from dynakin.messages import Message, note
from dynakin.recordings.pushes import JUDGED_N
from dynakin.recordings.recording import Array

OWN_PART = 0.3
"""Of the largest push of all plates: one that reaches it bears a foot, not an offset or a drift, and has its own sign;
one that does not has that of the most loaded plate."""
_SAMPLES = 5  # as few are a spike


def pulling(pushes: Sequence[Array]) -> npt.NDArray[np.bool_]:
    """Which of the plates hold the person's action, by the forces (N,) N of each towards the person's side."""
    known = [np.nan_to_num(push) if len(push) else np.zeros(1) for push in pushes]
    largest = np.array([np.sort(np.abs(push))[-_SAMPLES:].min() for push in known])
    pulls = np.array(
        [np.median(push[np.abs(push) >= 0.5 * size]) < 0.0 for push, size in zip(known, largest, strict=True)],
        dtype=bool,
    )  # the upper half, so that a long offset does not outweigh a short step
    if not len(largest) or largest.max() <= JUDGED_N:
        return np.zeros(len(largest), dtype=bool)
    own = largest > max(JUDGED_N, OWN_PART * float(largest.max()))
    return np.where(own, pulls, pulls[np.argmax(largest)])


def turned_in_words(names: Sequence[str], turned: npt.NDArray[np.bool_]) -> list[Message]:
    """A note that names the plates which were turned."""
    if not turned.any():
        return []
    if turned.all():
        return [note("plates", "The file stores the person's action on the plates; turned into the ground's reaction.")]
    those = " and ".join(name for name, turn in zip(names, turned, strict=True) if turn)
    text = (
        f"The file stores the person's action on {those}, unlike its other plates; turned into the ground's reaction."
    )
    return [note("plates", text)]
