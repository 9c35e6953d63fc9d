"""White noise of each plate, as its own signals show it.

A movement changes slowly from frame to frame, noise does not: what is left of a signal by differences of a high order
is nearly noise alone, and its median over loaded frames passes over heel strikes. Plates that were low-passed show less
of theirs than they have below the cut-off.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from math import comb
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from dynakin.arrays import Array, Flags, wrench_about
from dynakin.filter.contacts import carry
from dynakin.filter.ground.plate_errors import NO_ERRORS, NOISE_N, NOISE_NM, PlateErrors
from dynakin.messages import Message, warning
from dynakin.recordings.plates.pressure import pressed_at

ORDER = 6
"""Of the differences: at 100 Hz they keep 0.2 % of what changes at 10 Hz, 9 % at 20 Hz."""
LEAST = 20
"""Differences, of frames that are loaded throughout, from which on a plate's noise is known."""
SIGMAS = 2.0
"""By how many of its own deviations a plate's noise must be more than usual to count: `truth3d`'s plates, whose noise
is 0.5 to 2 N, are found to have up to 2.6 N in a single stance."""
USUAL = np.array([NOISE_N] * 3 + [NOISE_NM] * 3)
LOUD = 4.0
"""Times the usual noise from which it is said."""
LAST, EVERY = 256, 32
"""Live, so many samples are looked at, so often: it takes 0.3 ms a plate."""
_WEIGHTS = np.array([(-1.0) ** k * comb(ORDER, k) for k in range(ORDER + 1)])
_WEIGHTS /= np.linalg.norm(_WEIGHTS)  # white noise keeps its deviation
_MAD = 0.6745  # median of the size of normal numbers, over their deviation
_UNSURE = 1.47  # 1.17 / sqrt(2) of independent ones (Rousseeuw & Croux 1993); differences are alike: sqrt(3.17) times


class PlateNoise(NamedTuple):
    """Of a plate: standard deviations (6,) N and N m of its white noise in each frame, the point (3,) m about which the
    moment is meant, the middle of where it is pressed, and the part by which the deviations may be off (one of
    theirs)."""

    sd: Array
    at: Array
    unsure: float


def plate_noise(wrench: Array) -> PlateNoise | None:
    """White noise of a plate's wrench (T, 6) about the ground's origin, ground frame, NaN where it is not measured;
    None where too few frames are loaded."""
    pressed = pressed_at(wrench)
    loaded: Flags = np.asarray(np.isfinite(wrench).all(axis=1) & np.isfinite(pressed).all(axis=1))
    count = len(wrench) - ORDER
    if count < LEAST:
        return None
    throughout: Flags = np.asarray(sliding_window_view(loaded, ORDER + 1).all(axis=1))
    if np.count_nonzero(throughout) < LEAST:
        return None
    x, z = np.median(pressed[loaded], axis=0)
    at = np.array([x, 0.0, z])
    about = wrench_about(wrench, at)
    left = np.tensordot(sliding_window_view(about, ORDER + 1, axis=0), _WEIGHTS, axes=1)
    sd = np.median(np.abs(left[throughout]), axis=0) / _MAD
    return PlateNoise(np.asarray(sd), at, _UNSURE / float(np.sqrt(np.count_nonzero(throughout))))


def found_noise(wrenches: Array, names: Sequence[str]) -> PlateErrors:
    """White noise beyond the usual of plates with these wrenches (P, T, 6), as in `plate_noise`."""
    noise, said = np.zeros((len(wrenches), 6, 6)), list[Message]()
    for p, (name, wrench) in enumerate(zip(names, wrenches, strict=True)):
        if (found := plate_noise(wrench)) is None:
            continue
        more = found.sd > (1.0 + SIGMAS * found.unsure) * USUAL
        X = carry(found.at)
        noise[p] = (X * np.where(more, found.sd**2 - USUAL**2, 0.0)) @ X.T
        if (more & (found.sd > LOUD * USUAL)).any():
            said.append(warning("plate noise", _in_words(name, found.sd)))
    return PlateErrors(noise=noise if noise.any() else None, said=tuple(said))


def _in_words(name: str, sd: Array) -> str:
    return (
        f"{name} has white noise of up to {sd[:3].max():.2g} N and {sd[3:].max():.2g} N m in each frame (standard "
        f"deviation; usual plates {NOISE_N:g} N, {NOISE_NM:g} N m): moments of the legs and the feet's forces follow "
        "most of it, and their deviations hold it as long as one foot alone stands there."
    )


class LiveNoise:
    """The same of plates live, by their last samples.

    Args:
        names: of the P plates.
    """

    def __init__(self, names: Sequence[str]) -> None:
        self._names, self._found = names, NO_ERRORS
        self._last: deque[Array] = deque(maxlen=LAST)
        self._samples = 0

    def look(self, wrenches: Array) -> PlateErrors:
        """With these wrenches (P, 6), ground frame, NaN where one is not measured."""
        self._last.append(wrenches)
        self._samples += 1
        if self._samples % EVERY == 0:
            self._found = found_noise(np.stack(self._last, axis=1), self._names)
        return self._found
