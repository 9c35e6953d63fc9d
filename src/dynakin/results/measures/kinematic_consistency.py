"""Is the estimated speed the derivative of the estimated coordinate? Where not, one of them is wrong."""

from __future__ import annotations

import numpy as np

# A mismatch below half of the coordinate's own speed is left unsaid: differencing measured angles makes noise too.
TOLERATED = 0.5
# Nor one that no one would notice, as of a coordinate that is locked or hardly moves.
UNNOTICED = 0.01  # rad/s or m/s


def speed_mismatch(time: np.ndarray, coordinates: np.ndarray, speeds: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """RMS of speed less differenced coordinate, and RMS of the differenced coordinate itself.

    Args:
        time: (T,) s.
        coordinates, speeds: (T, C), rad and rad/s or m and m/s.

    Returns:
        Two arrays (C,), rad/s or m/s. Differences are central, so both lag by nothing.
    """
    if len(time) < 3:
        return np.full(coordinates.shape[1], np.nan), np.full(coordinates.shape[1], np.nan)
    derivative = np.gradient(coordinates, time, axis=0)
    return _rms(speeds - derivative), _rms(derivative)


def _rms(values: np.ndarray) -> np.ndarray:
    """Of each column, frames without a number left out."""
    known = np.isfinite(values)
    with np.errstate(invalid="ignore"):
        return np.asarray(np.sqrt(np.sum(np.where(known, values, 0.0) ** 2, axis=0) / known.sum(axis=0)))


def mismatch_in_words(names: list[str], rotation: np.ndarray, mismatch: np.ndarray, moving: np.ndarray) -> str:
    """One sentence about the worst coordinate, or an empty text where all speeds fit."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(mismatch > 0.0, mismatch / moving, 0.0)
    wrong = np.flatnonzero((ratio > TOLERATED) & (mismatch > UNNOTICED))
    if not len(wrong):
        return ""
    worst = int(wrong[np.argmax(mismatch[wrong])])
    unit = "rad/s" if rotation[worst] else "m/s"
    return (
        f"The estimated speeds are not the derivatives of the estimated coordinates ({len(wrong)} of {len(names)}; "
        f"worst: {names[worst]}, {mismatch[worst]:.2g} {unit} off where it moves at {moving[worst]:.2g} {unit}), "
        "so the speeds and accelerations of this run are not to be relied on."
    )
