"""White noise of each plate, as its own signals show it.

A movement changes slowly from frame to frame, noise does not: what is left of a signal by differences of a high order
is nearly noise alone, and its median over loaded frames passes over heel strikes. Plates that were low-passed show less
of theirs than they have below the cut-off.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import comb

import numpy as np

from dynakin.arrays import Array, wrench_about
from dynakin.filter.contacts import carry
from dynakin.filter.ground.plate_errors import NOISE_N, NOISE_NM, PlateErrors
from dynakin.recordings.plates.pressure import pressed_at
from dynakin.recordings.recording import Plate

ORDER = 6
"""Of the differences: at 100 Hz they keep 0.2 % of what changes at 10 Hz, 9 % at 20 Hz."""
LEAST = 20
"""Differences, of frames that are loaded throughout, from which on a plate's noise is known."""
_WEIGHTS = np.array([(-1.0) ** k * comb(ORDER, k) for k in range(ORDER + 1)])
_WEIGHTS /= np.linalg.norm(_WEIGHTS)  # white noise keeps its deviation
_MAD = 0.6745  # median of the size of normal numbers, over their deviation


def noise_sd(wrench: Array) -> tuple[Array, Array] | None:
    """Deviations (6,) N and N m of a plate's white noise in each frame, and the point (3,) m about which the moment is
    meant, the middle of where it is pressed; None where too few frames are loaded.

    Args:
        wrench: (T, 6) about the ground's origin, ground frame; NaN where it is not measured.
    """
    pressed = pressed_at(wrench)
    loaded = np.isfinite(wrench).all(axis=1) & np.isfinite(pressed).all(axis=1)
    count = len(wrench) - ORDER
    if count < LEAST:
        return None
    throughout = np.all([loaded[k : k + count] for k in range(ORDER + 1)], axis=0)
    if np.count_nonzero(throughout) < LEAST:
        return None
    x, z = np.median(pressed[loaded], axis=0)
    at = np.array([x, 0.0, z])
    about = wrench_about(wrench, at)
    left = sum(weight * about[k : k + count] for k, weight in enumerate(_WEIGHTS))
    return np.asarray(np.median(np.abs(left[throughout]), axis=0) / _MAD), at


def with_noise(errors: PlateErrors, plates: Sequence[Plate], wrenches: Array) -> PlateErrors:
    """The same with the white noise of plates whose wrenches (P, T, 6) show more of it than the usual ones have."""
    usual = np.array([NOISE_N] * 3 + [NOISE_NM] * 3)
    noise = np.zeros((len(plates), 6, 6))
    for p, wrench in enumerate(wrenches):
        if (found := noise_sd(wrench)) is None:
            continue
        sd, at = found
        X = carry(at)
        noise[p] = (X * np.maximum(sd**2 - usual**2, 0.0)) @ X.T
    return replace(errors, noise=noise) if noise.any() else errors
