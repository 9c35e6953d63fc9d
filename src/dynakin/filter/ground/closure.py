"""Do the plates carry the person? Their sum against what the centre of mass needs, by the markers alone.

The filter cannot ask itself: it takes the plates for measurements, and bends accelerations to fit them. The centre of
mass is, within some mm, a fixed mean of the markers, so that Newton's second law can be checked before anything is
estimated: m (g + a) on one side, the plates' forces on the other, both low-passed alike. Beside frames whose load is
not measured the first holds some of that load.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dynakin.arrays import Array, Flags, rms_length, runs, widened
from dynakin.filter.ground.load_ratio import AMPLITUDE, VIGOROUS, load_ratio, window_means
from dynakin.filter.ground.mass_centre import REACH_S, low_passed
from dynakin.filter.ground.needed import Needed, smoothed
from dynakin.recordings.hull import distance_to_hull
from dynakin.recordings.resampling import filled
from dynakin.units import GRAVITY_M_S2

EXCESS = 0.2
"""Part of the weight that must be missing, or too much. Well measured recordings (squats, a walk, a landing, a run at
5 m/s) stay below 0.06, the run below 0.08 beyond what `AMPLITUDE` explains; a chair makes 0.5 to 1."""
EDGE = 0.06
"""Once it is there, it lasts as long as this part is missing, but no longer than `SPREAD_S` more at either end."""
SPREAD_S = 0.3
LASTING, LASTING_S = 0.05, 1.0
"""Less is enough where its mean over a second is: a hand on a rail. Well measured recordings stay below 0.025, a run at
5 m/s below 0.04, simulated ones below 0.01; a rail that bears a tenth makes 0.06 to 0.09."""
UNSEEN = np.array([0.5, 0.3, 0.1])
"""What a body whose parts are not all marked may do more, of `EXCESS`, `EDGE` and `LASTING`, by the part of its mass
that is not: without the upper body's markers (0.38) a walk makes 0.20, for longer than a second 0.03, squats 0.11."""
STATED = 0.03
"""Where a declared contact may bear all the time: the part of the weight that is still taken for a mass which is
somewhat off (clothes, shoes), not for the contact. What the contact bears has deviations of some 7 % of the weight
then (40 N of a force of 30 to 40 N), which such a mass is within."""
_TOO_MUCH, _STEADY, _TOO_MUCH_S = 1.3, 0.3, 0.3
"""A plate whose scale is wrong, or a load that nobody declared: so many times too much, for 80 % of the time within
30 % of that. A cable or a rail that pulls a person down changes by more (a flywheel from 1.0 to 1.9)."""
BEYOND_M, BEYOND_S = 0.25, 0.5
"""How far beyond the markers of both feet, and for how long at least, the motion needs the ground's push to act for
something else to bear the person: a shoe is 0.05 larger, who lies or is on hands and toes has it 0.5 to 0.9 away."""
_UNSEEN_S = 0.2
"""Where too few markers are seen for longer than this, the plates' mean has to be near the weight."""


@dataclass(frozen=True, eq=False)
class Closure:
    """What the plates' sum lacks.

    Attributes:
        excess: (T, 3) N, ground axes: what the motion needs less what the plates carry, smoothed; NaN where it was not
            judged.
        moment: (T, 2) N m of the excess about the ground's origin: about X and about Z, of its vertical part, as far as
            the body does not turn.
        undeclared: (T,) frames in which something bears (or pulls) the person that no plate measures.
        unjudged: number of claimed frames in which too few markers are seen, or which lie at an end.
        load_ratio: the plates' load over that of the declared mass where they carry the person, as near to one as the
            size of accelerations allows (`load_ratio`); None where that is within 15 % too seldom to be said.
        limits: parts of the weight from which on, at once and for longer than a second, something is missing.
        too_much: the plates' load over what the motion needs where that is far too large, and the same all the time.
        steady: what is missing all the time is a declared contact's: its size rests on the mass that was stated.
    """

    excess: Array
    moment: Array
    undeclared: Flags
    unjudged: int
    load_ratio: float | None
    limits: tuple[float, float]
    too_much: float | None
    steady: bool = False

    def place(self, frames: slice) -> Array:
        """Where the excess of a stretch acts, (2,) m: X and Z on the ground."""
        push = np.nan_to_num(self.excess[frames, 1])
        about = np.nan_to_num(self.moment[frames])
        return np.asarray(np.array([push @ about[:, 1], -(push @ about[:, 0])]) / max(float(push @ push), 1e-9))


def closure(
    needed: Needed, wrench: Array, claimed: Flags, may_bear: Flags | None = None, may_pull: Flags | None = None
) -> Closure | None:
    """Compare the plates' sum with the motion of the centre of mass.

    Args:
        wrench: (T, 6), the sum over the plates.
        claimed: (T,) frames in which that sum is thought to be all that bears the person; only they are judged.
        may_bear, may_pull: (T,) frames in which some declared contact without a plate may push the person up, or down;
            not given: none is declared.

    Returns:
        None where nothing can be judged.
    """
    claimed = claimed & np.isfinite(wrench).all(axis=1)
    found = needed.centre if claimed.any() else None
    if found is None:
        return None
    initial, rate, weight = needed.initial, needed.rate, needed.weight
    centre, acceleration, need = found.path, found.acceleration, needed.force
    judged = found.known & ~widened(~claimed, round(REACH_S * rate))
    if not judged.any():
        return None
    have = low_passed(filled(wrench, np.asarray(~np.isfinite(wrench).all(axis=1))), rate)
    axes = np.array(initial.spec.wrench_measured[:3])
    vigorous = bool(need[judged, 1].max() > VIGOROUS * weight)
    weighed = (have[:, 1], judged) if vigorous else (wrench[:, 1], found.known & claimed)
    amplitude = AMPLITUDE if vigorous else 0.0
    ratio = load_ratio(need[:, 1], *weighed, weight, round(LASTING_S * rate), LASTING, amplitude)
    too_much = _too_much(need[:, 1], have[:, 1], judged, weight, rate)
    declared = may_bear if ratio is None or ratio < 1.0 else may_pull
    steady = ratio is not None and declared is not None and _all_the_time(ratio, judged, declared, rate)
    ratio = 1.0 if steady else ratio
    need = need * (1.0 if ratio is None else ratio)  # a mass that is somewhat wrong is no contact
    missing = np.where(axes, need - have[:, :3], 0.0)
    excess = smoothed(missing, judged, rate)
    zmp = centre - centre[:, [1]] * acceleration / (acceleration[:, [1]] + GRAVITY_M_S2).clip(1.0)
    about = np.stack([-need[:, 1] * zmp[:, 2] - have[:, 3], need[:, 1] * zmp[:, 0] - have[:, 5]], axis=1)
    size = np.abs(np.nan_to_num(excess)) / weight
    by_size = AMPLITUDE * np.abs(np.nan_to_num(smoothed(need, judged, rate) / weight - [0.0, 1.0, 0.0]))
    large, edge, lasting = np.array([EXCESS, EDGE, LASTING]) + UNSEEN * initial.unseen_kg / initial.weighed_kg
    core = judged & (size - by_size > large).any(axis=1)
    undeclared = _with_edges(core, (size > edge).any(axis=1), judged, rate) & claimed
    undeclared |= _as_beside(undeclared, judged, claimed)
    undeclared |= _small_but_lasting(excess / weight, judged & ~undeclared, round(LASTING_S * rate), lasting)
    undeclared |= _too_short_to_tell(undeclared, round(0.5 * LASTING_S * rate)) & claimed
    unjudged: Flags = claimed & ~found.known
    for first, end in runs(unjudged):
        load = float(np.median(wrench[first:end, 1]))
        if end - first > _UNSEEN_S * rate and abs(load - weight) > EXCESS * weight:
            undeclared[first:end] = True
    undeclared |= _as_beside(undeclared, judged, claimed)
    if steady and declared is not None:
        undeclared |= claimed & declared
    return Closure(
        excess, smoothed(about, judged, rate), undeclared, int(np.sum(unjudged)), ratio,
        (float(large), float(lasting)), too_much, steady,
    )  # fmt: skip


def _all_the_time(ratio: float, judged: Flags, declared: Flags, rate: float) -> bool:
    """Whether so much of the declared mass is a declared contact's: more than a mass is off, and no second without that
    contact shows the mass itself."""
    return bool(abs(ratio - 1.0) > STATED and np.count_nonzero(judged & ~declared) < LASTING_S * rate)


def _too_much(need: Array, have: Array, judged: Flags, weight: float, rate: float) -> float | None:
    loaded = judged & (need > 0.5 * weight)
    if np.count_nonzero(loaded) < _TOO_MUCH_S * rate:
        return None
    low, middle, high = np.percentile(have[loaded] / need[loaded], (10.0, 50.0, 90.0))
    return float(middle) if middle > _TOO_MUCH and high - low < _STEADY * middle else None


def plates_misfit(needed: Needed, wrench: Array) -> float | None:
    """RMS of the excess, N, over all frames in which the wrench (T, 6) is known; None where nothing can be judged."""
    found = closure(needed, wrench, np.ones(len(wrench), dtype=bool))
    return None if found is None else float(rms_length(found.excess))


def beyond_the_feet(needed: Needed) -> Flags:
    """(T,) frames in which, by the motion of the centre of mass, the ground would have to push beyond the markers of
    both feet: a person without plates is borne there by a hand, a knee or a seat that nobody declared. None of a body
    with a foot that nobody sees."""
    initial, markers = needed.initial, needed.markers
    beyond = np.zeros(len(markers), dtype=bool)
    feet = [[m for m, n in enumerate(initial.recorded_markers) if n in own] for own in initial.foot_markers.values()]
    found = needed.centre if len(feet) > 1 and all(feet) else None
    if found is None:
        return beyond
    soles = markers[:, [m for own in feet for m in own]]
    upward = found.acceleration[:, 1] + GRAVITY_M_S2
    floor = float(np.nanmin(soles[..., 1]))
    lever = (found.path[:, 1] - floor) / upward.clip(1.0)
    at = found.path[:, [0, 2]] - lever[:, None] * found.acceleration[:, [0, 2]]
    with np.errstate(invalid="ignore"):
        far = distance_to_hull(at, soles[:, :, [0, 2]]) > BEYOND_M
    far &= found.known & (upward > 0.5 * GRAVITY_M_S2) & np.isfinite(soles).all(axis=(1, 2))
    for first, end in runs(far):
        beyond[first:end] = end - first >= BEYOND_S * needed.rate
    return beyond | _as_beside(beyond, found.known, np.ones_like(beyond))


def _small_but_lasting(excess: Array, judged: Flags, window: int, least: float) -> Flags:
    """Frames (T,) within a window that is judged throughout over which a component's mean, parts of the weight (T, 3),
    is larger than ``least``, and in which it has at least half of that."""
    filled = np.where(judged[:, None], excess, 0.0)
    means = window_means(filled, window)
    whole = window_means(judged.astype(float), window) > 1.0 - 1e-9
    found = np.zeros(len(judged), dtype=bool)
    for axis in range(3):
        for sign in (1.0, -1.0):
            large = whole & (sign * means[:, axis] > least)
            found |= widened(large, window // 2) & (sign * filled[:, axis] > 0.5 * least)
    return found


def _too_short_to_tell(found: Flags, window: int) -> Flags:
    """Shorter breaks (T,) between two stretches: a mean over twice as long, of which it needs one half, does not show
    that nothing is missing there."""
    breaks = np.zeros_like(found)
    for first, end in runs(~found):
        breaks[first:end] = first > 0 and end < len(found) and end - first < window
    return breaks


def _with_edges(core: Flags, some: Flags, judged: Flags, rate: float) -> Flags:
    """Frames in which the excess is large, with those before and after in which it comes and goes."""
    near = widened(core, round(SPREAD_S * rate)) & (~judged | some)
    found = core.copy()
    for first, end in runs(near):
        found[first:end] |= core[first:end].any()
    return found


def _as_beside(undeclared: Flags, judged: Flags, claimed: Flags) -> Flags:
    """Claimed frames (T,) that are not judged and whose neighbours that are, are undeclared."""
    found = np.zeros_like(undeclared)
    for first, end in runs(~judged & claimed):
        sides = [bool(undeclared[k]) for k in (first - 1, end) if 0 <= k < len(judged) and judged[k]]
        found[first:end] = bool(sides) and all(sides)
    return found
