"""When each stance takes its load and gives it up, by what the markers at the heel and at the toe do, and how the load
passes from foot to foot."""

from __future__ import annotations

from collections.abc import Sequence
from math import factorial
from typing import NamedTuple

import numpy as np

from dynakin.arrays import Array, Flags, runs
from dynakin.recordings.feet.contact import FootContact

EARLY_S, LATE_S = 0.02, 0.07
"""How long before a foot's markers are slow and low the plates are touched, and how long after they are left, where its
accelerations do not say it. By the plates of the walks at hand it is 0.02 and 0.06 s on average, but -0.03 to 0.05 and
-0.02 to 0.09 s from one to the other: how long a marker stays low depends on where on the foot it is."""
DOWN_S, OFF_S = (-0.06, 0.04), (-0.03, 0.15)
"""Where its touch-down and toe-off are looked for, about the first and the last frame in which it is slow and low."""
PASSING_S = 0.12
"""How long a foot takes to load and to unload where no other one takes or gives the load at that time (the edges of a
run's stance), or one that goes on standing does."""
BOTH_S = (0.06, 0.30)
"""Shortest and longest time in which one foot hands over to the other: double supports of walks."""
_HALF_S = 0.04  # of the cubic that is laid through a path for its derivatives: as sharp as a low-pass at 12 Hz


class Span(NamedTuple):
    """A stance: its frames [first, end), and when the load comes and goes, in frames; -inf, inf: the recording cuts it
    off there, or the foot is not seen before, or after."""

    first: int
    end: int
    on: float
    off: float


def spans_of(foot: FootContact, ends: tuple[int, int] | None, rate: float) -> list[Span]:
    """The stances of a foot, with their touch-down where the marker at its back is braked most on its way down, and
    their toe-off where that at its front gains speed fastest (Hreljac & Marshall 2000, J Biomech 33:783-786, who take
    the forward acceleration; the gain of speed needs no direction and stands for a run's and a jump's toe-off as well).

    By the plates of eight walks these are off by 10 and 23 ms (standard deviation; toe-off by 11 without the one that
    lifts its feet without a push), fixed delays behind the markers by 13 and 34 ms.

    Args:
        ends: its markers at the back and at the front (`FootShape`); None: they do not show it.
    """
    frames, braked, gained = len(foot.stands), None, None
    if ends is not None and frames > 1:
        back, front = ends
        braked = _derivative(foot.rise_m[:, back], rate, 2)
        x, z = (_derivative(foot.outline[:, front, axis], rate, 1) for axis in (0, 1))
        y = _derivative(foot.rise_m[:, front], rate, 1)
        belt = foot.support_velocity
        speed = np.sqrt((x - belt[:, 0]) ** 2 + y**2 + (z - belt[:, 1]) ** 2)
        gained = np.gradient(speed)
    found = []
    for first, end in foot.stances:
        on = _highest(braked, first, DOWN_S, rate, first - EARLY_S * rate)
        off = _highest(gained, end, OFF_S, rate, end - 1 + LATE_S * rate)
        cut_before, cut_after = not foot.seen[:first].any(), not foot.seen[end:].any()
        found.append(Span(first, end, -np.inf if cut_before else on, np.inf if cut_after else off))
    return found


def supported(stood: Flags, spans: Sequence[Sequence[Span]], rate: float) -> list[Span]:
    """The stretches in which some foot stands, as one: stood (T,) and the stances of all feet."""
    found = []
    for first, end in runs(stood):
        own = [span for foot in spans for span in foot if first <= span.first < end]
        on = min((span.on for span in own if span.first == first), default=first - EARLY_S * rate)
        off = max((span.off for span in own if span.end == end), default=end - 1 + LATE_S * rate)
        found.append(Span(first, end, -np.inf if first == 0 else on, np.inf if end == len(stood) else off))
    return found


def stance_weights(spans: Sequence[Sequence[Span]], rate: float, frames: int) -> Array:
    """(T, F) weights of the stances of F feet: each rises from 0 to 1 from its touch-down on and falls to 0 until its
    toe-off, in the time in which the other foot unloads, or loads (`BOTH_S`), else in `PASSING_S`; one that the
    recording cuts off does not rise, or fall, there."""
    found, at = np.zeros((frames, len(spans))), np.arange(frames)
    for k, own in enumerate(spans):
        others = [span for j, foot in enumerate(spans) if j != k for span in foot]
        for span in own:
            if frames < 2:
                found[span.first, k] = 1.0
                continue
            rise = _handed_over([_together(other, span) for other in others], rate)
            fall = _handed_over([_together(span, other) for other in others], rate)
            part = np.minimum((at - span.on) / rise, (span.off - at) / fall)
            found[:, k] = np.maximum(found[:, k], smooth_step(part))
    return found


STEEPEST_STEP = 1.5
"""Of `smooth_step`, in its middle."""


def smooth_step(part: Array) -> Array:
    """From 0 at 0 to 1 at 1, level at both ends."""
    x = np.clip(part, 0.0, 1.0)
    return np.asarray(x * x * (3.0 - 2.0 * x))


def _together(before: Span, after: Span) -> float:
    """Frames for which both stand while the load passes from the one to the other; inf where it does not, because one
    stance lies within the other or both feet land and leave together, as in a hop."""
    both = before.off - after.on
    in_turn = before.on < after.on < before.off < after.off
    return both if in_turn and 2.0 * both < min(before.off - before.on, after.off - after.on) else np.inf


def _handed_over(both: Sequence[float], rate: float) -> float:
    """Frames in which the load passes, of those for which both feet stand (`_together`)."""
    fewest, most = (seconds * rate for seconds in BOTH_S)
    shortest = min(both, default=np.inf)
    return max(shortest, fewest) if shortest <= most else PASSING_S * rate


def _highest(of: Array | None, frame: int, around_s: tuple[float, float], rate: float, otherwise: float) -> float:
    """The frame of the highest peak of a curve (T,) about a frame; ``otherwise`` where there is none."""
    if of is None:
        return otherwise
    low, high = max(1, frame + round(around_s[0] * rate)), min(len(of) - 1, frame + round(around_s[1] * rate) + 1)
    at = np.arange(low, high)
    peaks = at[(of[at] >= of[at - 1]) & (of[at] > of[at + 1])] if len(at) else at
    return float(peaks[np.argmax(of[peaks])]) if len(peaks) else otherwise


def _derivative(path: Array, rate: float, order: int) -> Array:
    """(T,) derivative of a path (T,) by a cubic through its neighbours (Savitzky & Golay 1964); NaN at the ends and
    where one is missing."""
    half = max(2, round(_HALF_S * rate))
    found = np.full(len(path), np.nan)
    if len(path) > 2 * half:
        cubic = np.vander(np.arange(-half, half + 1) / rate, 4, increasing=True)
        weights = factorial(order) * np.linalg.pinv(cubic)[order]
        found[half:-half] = np.correlate(path, weights, mode="valid")
    return found
