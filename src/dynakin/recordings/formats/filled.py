"""Samples that a system filled instead of measuring: frames that repeat, straight lines, places that are held."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from dynakin.arrays import Array, runs

MOVES_M_S = 0.1
"""Speed, median over the markers, from which the person moves."""
_ROUNDED = 4.0
"""Of the file's smallest steps of a marker: by more no line bends that was drawn over a gap. Feet on a moving belt, raw
or low-passed, bend by 28 and more."""
_KINK = 20.0
"""By so many the marker bends at an end of such a line."""
_FINE, _FINEST_M = 50.0, 1e-7
"""By so many it bends half of the time it moves, or the file is too coarse to tell; a smallest step is at least as
large, which is what single precision leaves of 1 m."""
_LINE_FRAMES, _LINE_S, _LINE_M = 8, 0.08, 0.01
"""How long and how far such a line is at least."""
_LEAP, _LEAP_M, _NEXT = 1.6, 0.005, 3
"""A place that was held for one frame leaves a step of twice those beside it (so many frames on either side), for
longer a larger one; of 5 mm at least, by less nothing is off."""
_STOP_M = 0.002
"""From such a step nothing comes to rest, or starts, within one frame."""
_GOES_ON, _BEFORE, _MOVED_M = 0.5, 12, 1e-4
"""Part of the step by which a marker came to its place that all near it still make, where it is held. Frames in which
it usually moved before it was, by more than rounding and what a filter leaves at rest."""
_NEAR, _LEFT_M = 3, 0.05
"""By so much so many nearest markers of a segment, or of the next, do not change their distance to a marker, all of
them, unless it is not on the body any more: by skin 0.02."""


def repeated(markers: Array, rate: float) -> npt.NDArray[np.bool_]:
    """(T,) frames that are the one before to the last bit while the person moves on both sides of them: dropped ones
    that a system filled, or a rate that was doubled by writing each frame twice."""
    seen: npt.NDArray[np.bool_] = np.asarray(np.isfinite(markers).all(axis=2))
    both = seen[1:] & seen[:-1] & (seen.sum(axis=1) > 2)[1:, None]
    steps = np.where(both, np.linalg.norm(np.diff(markers, axis=0), axis=2), np.inf)
    half = np.maximum(both.sum(axis=1) - 1, 0) // 2
    middle = np.take_along_axis(np.sort(steps, axis=1), half[:, None], axis=1)[:, 0]
    step = np.concatenate([[np.inf], middle])  # of half of the markers: of one it may be a rounded digit
    still = both.any(axis=1) & (seen[1:] == seen[:-1]).all(axis=1) & (np.where(both, steps, 0.0) == 0.0).all(axis=1)
    same = np.concatenate([[False], still])
    least = max(MOVES_M_S / rate, _ROUNDED * _smallest_step(markers))
    found = np.zeros(len(markers), dtype=bool)
    for first, end in runs(same):
        found[first:end] = first > 1 and end < len(step) and min(step[first - 1], step[end]) > least
    return found


def straight(markers: Array, rate: float) -> npt.NDArray[np.bool_]:
    """(T, M) samples within straight lines at a steady speed, to the file's last digit: gaps that a system filled."""
    found = np.zeros(markers.shape[:2], dtype=bool)
    if len(markers) < 3 or not np.isfinite(rate):
        return found
    bend = np.linalg.norm(np.diff(markers, n=2, axis=0), axis=2)
    step = np.linalg.norm(np.diff(markers, axis=0), axis=2)
    for m in range(markers.shape[1]):
        moving = bend[(step[1:, m] * rate > MOVES_M_S) & np.isfinite(bend[:, m]), m]
        if len(moving) < _LINE_FRAMES:
            continue
        tick = max(_smallest_step(markers[:, m]), _FINEST_M)
        if not float(np.median(moving)) > _FINE * tick:
            continue
        with np.errstate(invalid="ignore"):
            unbent = bend[:, m] <= _ROUNDED * tick
        for first, end in runs(unbent):
            ends = bend[[k for k in (first - 1, end) if 0 <= k < len(bend)], m]
            kinks = bool(np.nanmax(ends, initial=0.0) > _KINK * tick)
            length = float(np.linalg.norm(markers[end + 1, m] - markers[first, m]))
            if kinks and end - first >= max(_LINE_FRAMES, _LINE_S * rate) and length > _LINE_M:
                found[first + 1 : end + 1, m] = True
    return found


def held(markers: Array, rate: float) -> npt.NDArray[np.bool_]:
    """(T, M) samples at which a marker stays where it was to the last bit and then leaps to where it went meanwhile, or
    is at the trial's start or end while all that is near goes away: gaps that a system filled by the last place.

    A marker at rest, in a file of few digits too, goes on from where it was.
    """
    found = np.zeros(markers.shape[:2], dtype=bool)
    if len(markers) < 3 or not np.isfinite(rate):
        return found
    step = np.linalg.norm(np.diff(markers, axis=0), axis=2)
    for m in np.flatnonzero((step == 0.0).any(axis=0)):
        tick = max(_smallest_step(markers[:, m]), _FINEST_M)
        for first, end in runs(step[:, m] == 0.0):  # frames first to end are one place
            before, after = step[max(first - _NEXT, 0) : first, m], step[end : end + 1 + _NEXT, m]
            if len(before) and len(after):
                usual = max(np.nanmax(before, initial=0.0), np.nanmax(after[1:], initial=0.0))
                leap = float(after[0])
                found[first + 1 : end + 1, m] = leap > max(_LEAP_M, _KINK * tick, _LEAP * usual)
            elif (before if len(before) else after[::-1])[-1:].sum() > max(_STOP_M, _KINK * tick) and _left_alone(
                markers[[first, end]], int(m)
            ):
                found[first + (first > 0) : end + (end == len(step)), m] = True
    return found


def repeated_so_far(markers: Array, rate: float, first: int) -> bool:
    """`repeated`, of frames that are one from ``first`` on to the last, by what was before."""
    step = np.linalg.norm(np.diff(markers[max(first - 1, 0) : first + 1], axis=0), axis=2)
    step = step[np.isfinite(step)]
    least = max(MOVES_M_S / rate, _ROUNDED * _smallest_step(markers))
    return len(step) > 2 and float(np.median(step)) > least


def held_so_far(markers: Array, m: int, first: int) -> bool:
    """`held`, of a marker that is at one place from frame ``first`` on to the last: by how it moved before (one step of
    speed, or several of noise alone, that stop to the last digit), while those near it go on as they did, or by all
    that is near having gone away."""
    goes = np.linalg.norm(markers[-1] - markers[-2], axis=1)
    others = np.flatnonzero(goes > 0.0)  # what is held with it shows nothing
    ends = np.concatenate([markers[[first, -1]][:, [m]], markers[[first, -1]][:, others]], axis=1)
    if _left_alone(ends, 0):
        return True
    near = others[np.argsort(np.linalg.norm(ends[0, 1:] - ends[0, 0], axis=1))[:_NEAR]]
    steps = np.linalg.norm(np.diff(markers[max(first - _BEFORE, 0) :], axis=0), axis=2)
    own, after = steps[: -(len(markers) - 1 - first), m], steps[-(len(markers) - 1 - first) :, near]
    own = own[np.isfinite(own)]
    if len(near) < _NEAR or len(own) < _NEXT:
        return False
    tick = _KINK * max(_smallest_step(markers[:, m]), _FINEST_M)
    if len(after) >= _NEXT:
        moves = max(tick, _MOVED_M)
        return bool(min(np.median(own), own[-1]) > moves and (np.median(after, axis=0) > moves).all())
    return bool(own[-1] > max(_STOP_M, tick) and (after[-1] > _GOES_ON * own[-1]).all())


def _left_alone(ends: Array, m: int) -> bool:
    """Whether of the markers near a marker every one is elsewhere against it at the end (2, M, 3) of a stretch."""
    apart = np.linalg.norm(ends - ends[:, m : m + 1], axis=2)
    apart = apart[:, np.isfinite(apart).all(axis=0) & (np.arange(ends.shape[1]) != m)]
    near = np.argsort(apart.min(axis=0))[:_NEAR]
    return len(near) == _NEAR and bool((np.abs(apart[1] - apart[0])[near] > _LEFT_M).all())


def _smallest_step(places: Array) -> float:
    """Of any coordinate (T, ...) from frame to frame, m: what the file rounds to; inf where nothing moves."""
    steps = np.abs(np.diff(places, axis=0))
    return float(np.min(steps, where=steps > 1e-9, initial=np.inf))
