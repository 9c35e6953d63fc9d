"""Channels of a C3D file at the analog rate: their values as its words and offsets are meant; and of its force plates
their zero (FORCE_PLATFORM:ZERO, the frames whose mean it is), and where they rest at the end of their range, whose flat
top a filter makes uneven.

ezc3d reads all words as signed, and takes the size of an offset without its sign. By the C3D user guide a value is
(word - OFFSET) SCALE GEN_SCALE, where both are signed numbers of 16 bits, or unsigned ones where ANALOG:FORMAT says so
(an offset of 32768 is then written like -32768).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from dynakin.arrays import Array, Flags, runs
from dynakin.messages import Message, note
from dynakin.recordings.formats.c3d_parameters import Parameters
from dynakin.recordings.hull import distance_to_hull
from dynakin.recordings.pushes import JUDGED_N

_WORDS, _HALF = 65536.0, 32768.0


def analog_values(data: Any, parameters: Parameters) -> Array:
    """(channels, samples) of what ezc3d read, scaled as the file says."""
    read: Array = np.asarray(data["data"]["analogs"], dtype=float)[0]
    offset = parameters.continued("ANALOG", "OFFSET")[: len(read)]
    scale = parameters.continued("ANALOG", "SCALE")[: len(read)] * (parameters.number("ANALOG", "GEN_SCALE") or 0.0)
    unsigned = _unsigned(parameters, offset)
    if len(offset) != len(read) or len(scale) != len(read) or not (unsigned or (offset < 0.0).any()):
        return read
    scale, offset = scale[:, None], offset[:, None]
    stored = np.divide(read, scale, out=np.zeros_like(read), where=scale != 0.0) + np.abs(offset)
    if unsigned and (parameters.number("POINT", "SCALE") or 0.0) > 0.0:  # words, not floating-point numbers
        stored = np.rint(stored) % _WORDS
    if unsigned:  # of a number below 0, which floats can be, the offset is no unsigned one
        offset = np.where(stored.min(axis=1, keepdims=True, initial=0.0) < 0.0, offset, offset % _WORDS)
    return np.asarray((stored - offset) * scale)


def _unsigned(parameters: Parameters, offset: Array) -> bool:
    """Where the file does not say it, by an offset that no signed word lies below."""
    said = parameters.text("ANALOG", "FORMAT").upper()
    return said == "UNSIGNED" or (not said and bool((offset == -_HALF).any()))


FLAT = 5
"""So many samples exactly at a channel's extreme, and so many times as many as it holds any other value for while it
changes (a signal that was held when it was brought to a higher rate). Its counterpart at the rate of the markers, for
plates of any file, is `ground_plate.FLAT_FRAMES` (`GroundPlate`)."""
STEPS = 20
"""A peak that is only written in steps is as flat: but half its width beyond its edges it has fallen by 3 to 4 steps, a
signal that was cut off by three times the depth of the cut."""
SLOPE = 0.5
"""The last step up to the extreme is less than this part of the way there: else it is a switch, or made up."""
_ONE, _COMPUTED = 1e-9, 1e-5
"""Part of the range within which values of a channel are one, and of a force that is computed of several, in single
precision."""


def at_end_of_range(channels: Array, push: Array) -> Flags:
    """(N,) samples in which a channel (C, N) of a plate rests at its largest or smallest value, or the plate's force
    along its normal (N,) N does, while somebody stands on it."""
    found = np.zeros(len(push), dtype=bool)
    loaded = np.abs(push) > JUDGED_N
    if not loaded.any():
        return found
    for values, same in (*((channel, _ONE) for channel in channels), (push, _COMPUTED)):
        found |= _at_end(values, loaded, same) | _at_end(-values, loaded, same)
    return np.asarray(found & loaded)


def _at_end(values: Array, loaded: Flags, same: float) -> Flags:
    """(N,) where values (N,), the same within a part of their range, rest at their largest one."""
    found = np.zeros(len(values), dtype=bool)
    known = values[np.isfinite(values)]
    top, size = float(np.max(known, initial=-np.inf)), float(np.ptp(known)) if len(known) else 0.0
    if not size > 0.0:
        return found
    at_top: Flags = np.asarray(values >= top - same * size)
    flat = [(first, end) for first, end in runs(at_top) if end - first >= FLAT and first > 0 and end < len(values)]
    if not flat:
        return found
    change = np.abs(np.diff(values))
    moves = change > same * size
    if not moves.any():  # so slow, and without noise, that nothing tells a rest
        return found
    step = float(change[moves].min())
    for first, end in flat:
        half = (end - first) // 2
        before, after = values[max(first - 1 - half, 0) : first].min(), values[end : end + half + 1].min()
        near = slice(max(first - 4 * half, 0), end + 4 * half)
        still = ~moves[near] & loaded[1:][near] & ~at_top[1:][near]
        held = max((b - a + 1 for a, b in runs(still)), default=1)
        slope = max(top - values[first - 1], top - values[end]) < SLOPE * size
        found[first:end] = slope and top - max(before, after) > STEPS * step and end - first >= FLAT * held
    return found


OVER_M = (-0.1, 0.3)
"""Heights over a plate, m, between which a marker over it is that of who stands on it, or steps over it."""


def zero_frames(parameters: Parameters, frames: int) -> slice | None:
    """Of so many in the file, counted from 1; None where it has none ("1 0" and "0 0" mean that), or others."""
    values = parameters.array("FORCE_PLATFORM", "ZERO").ravel()
    if len(values) < 2 or not (1 <= values[0] <= values[1] <= frames and (values % 1 == 0).all()):
        return None
    return slice(int(values[0]) - 1, int(values[1]))


def zeroed(
    name: str,
    channels: Array,
    force: Array,
    frames: slice,
    markers: Array,
    corners: Array,
    normal: Array,
    *,
    points: bool,
) -> tuple[Array, list[Message]]:
    """Channels (C, N) of a plate with their mean over these frames taken off, unless something may press on it then;
    and what there is to say of it.

    Args:
        force: (N, 3) N, of the plate as it is. markers: (T, M, 3) m. corners: (4, 3) m, of the plate. normal: (3,) of
            its surface, upwards. points: the channels hold centres of pressure (type 1), which have no zero, and were
            computed with that of the forces, or without it.
    """
    which = f"frames {frames.start + 1} to {frames.stop} (FORCE_PLATFORM:ZERO in the file)"
    if points:
        text = f"{name}: its mean in {which} was not taken off: its channels hold centres of pressure (type 1)."
        return channels, [note("plates", text)]
    per_frame = channels.shape[1] // len(markers)
    samples = slice(frames.start * per_frame, frames.stop * per_frame)
    if why := _in_use(force[samples], markers[frames], corners, normal):
        return channels, [note("plates", f"{name}: {why} in {which}: they are not taken for its zero.")]
    mean = np.nanmean(channels[:, samples], axis=1, keepdims=True)
    return channels - mean, [note("plates", f"{name}: its mean in {which} was taken off as its zero.")]


def _in_use(force: Array, markers: Array, corners: Array, normal: Array) -> str | None:
    """Why forces (N, 3) N may not be those of an empty plate while the markers (T, M, 3) are so: None where they are. A
    seat bears somebody of whom no marker is low over it, so the load is looked at, too."""
    if not np.isfinite(markers).all(axis=2).any():
        return "no marker is seen"
    if _somebody_over(markers, corners, normal):
        return "a foot is over it"
    force = force[np.isfinite(force).all(axis=1)]
    if not len(force):
        return "it is not measured"
    load, spread = float(np.linalg.norm(force.mean(axis=0))), float(np.ptp(force, axis=0).max())
    if load <= JUDGED_N and spread <= JUDGED_N:
        return None
    return f"it reads {load:.0f} N on average, and {spread:.0f} N between its least and most,"


def _somebody_over(markers: Array, corners: Array, normal: Array) -> bool:
    """Whether one of the markers (T, M, 3) is low over a plate."""
    points = (markers - corners.mean(axis=0)).reshape(-1, 3)
    points = points[np.isfinite(points).all(axis=1)]
    height = points @ normal
    points = points[(height > OVER_M[0]) & (height < OVER_M[1])]
    side = corners[0] - corners[1]
    rows = np.array([side, np.cross(normal, side)]) / np.linalg.norm(side)
    place = (corners - corners.mean(axis=0)) @ rows.T
    return bool((distance_to_hull(points @ rows.T, place) <= 0.0).any())
