"""What every reader does with marker trajectories before they become a Recording."""

from __future__ import annotations

import numpy as np

from dynakin.recordings.recording import Array, rate_of


def clean_markers(names: tuple[str, ...], markers: Array) -> tuple[Array, list[str]]:
    """Markers (T, M, 3) with a point that has any coordinate missing, or is exactly 0, 0, 0, made NaN as a
    whole.

    Several systems export an occluded marker as the laboratory's origin; no marker is ever there to the last
    bit.
    """
    markers = markers.copy()  # infinite stays: `Recording` refuses it
    notes: list[str] = []
    origin = (markers == 0.0).all(axis=2)
    if origin.any():
        who = ", ".join(name for name, hit in zip(names, origin.any(axis=0), strict=True) if hit)
        notes.append(f"Markers at exactly 0, 0, 0 taken as missing ({int(origin.sum())} samples: {who}).")
    partial = np.isnan(markers).any(axis=2)
    markers[origin | partial] = np.nan
    missing = np.isnan(markers[:, :, 0]) if markers.size else np.zeros(markers.shape[:2], dtype=bool)
    if missing.any():
        share = ", ".join(
            f"{name} {100 * part:.3g} %" for name, part in zip(names, missing.mean(axis=0), strict=True) if part
        )
        notes.append(f"Missing for part of the recording: {share}.")
    if len(names) and missing.all(axis=1).any():
        empty = np.flatnonzero(missing.all(axis=1))
        notes.append(f"{len(empty)} frames have no marker at all, the first is frame {empty[0] + 1}.")
    return markers, notes


def timing_notes(time: Array, rate_in_header: float | None = None) -> list[str]:
    """Sentences on a rate that contradicts the header and on uneven time steps."""
    if len(time) < 3:
        return []
    notes: list[str] = []
    step = np.diff(time)
    median = float(np.median(step))
    rate = rate_of(time)
    if rate_in_header and abs(rate_in_header / rate - 1) > 0.01:
        notes.append(f"The header says {rate_in_header:g} Hz, the time column {rate:.4g} Hz: the latter is used.")
    if np.abs(step / median - 1).max() > 0.5:
        k = int(np.argmax(np.abs(step / median - 1)))
        notes.append(f"Time steps are uneven: {step[k]:.4g} s after {time[k]:.6g} s, {median:.4g} s elsewhere.")
    return notes
