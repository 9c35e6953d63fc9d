"""By how much plates and markers are out of step, to a millisecond or two: what the motion of the whole body needs,
forces and moments, against what the plates say.

The centre of mass as a mean of markers (`delay`) finds tens of milliseconds; a few are lost in skin that follows
the joints, and a filter takes them up by acceleration. Inverse kinematics frame by frame has neither, and what is not
known of segments' inertia, which looks like a delay as well, is estimated with it ([derivations](derivations.md),
section 11).
"""

from __future__ import annotations

from copy import copy
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.linalg import cho_factor, cho_solve

from dynakin.arrays import Array, Flags, runs, wrench_about
from dynakin.bindings import _core
from dynakin.filter.ground.delay import Delay
from dynakin.filter.ground.needed import Needed
from dynakin.filter.samples import in_step
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.model.calibration.inverse_kinematics import FEWEST_MARKERS, inverse_kinematics
from dynakin.model.calibration.pose_start import bare
from dynakin.model.inertia import INERTIA_NAMES
from dynakin.recordings.plates.pressure import pressed_at
from dynakin.recordings.resampling import low_pass
from dynakin.recordings.times import frame_numbers, on_grid

CUTOFF_HZ = 6.0
"""Low-pass of motion and plates, of one delay: none."""
PRIOR_S = 0.01
"""How far out of step plates are that nobody complained of: a frame at 100 Hz."""
MODEL_S = 0.002
"""What joints, skin and segments that are not rigid do besides: by `truth3d`'s walks 0.3 to 1.3 ms."""
MODEL_LEGS_S = 0.005
"""The same of a body that is not marked whole, of which the vertical force alone is asked (an unseen trunk leans, and
goes up and down with the pelvis). Chosen on `truth3d`'s seeds 1 to 4 without their upper bodies' markers, whose plates
are 2 ms late: 5.2 to 7.9 found in walks, -0.9 to 8.5 in squats, 1.6 deviations at most (`delay.LEGS_SD`). 3.7 to 9.8
and -2.2 to 7.3 in seeds 61 to 64, real ones within 1.6 deviations (`walking1` 12.6 and of the whole body 5)."""
UNKNOWN_S = 0.005
"""How far out of step plates may be where nothing judges it: most are 2 ms, some 20. `truth3d`'s walks over one plate
(seeds 1, 2), 2 ms late, have deviations 1.1 to 1.8 times their errors with 5 and with 8 ms, and an .osim's ankle 3.1
times with 7."""
KNOWN_S = 0.004
"""Where plates have not one clock, one whose delay is known worse keeps the others': it is loaded too shortly."""
FORCE, MOMENT_M = 0.033, 0.017
"""What motion and plates disagree on, parts of the weight (m for moments), at least: 20 N and 10 N m."""
MASS, CENTRE_M, INERTIA, LEAST_INERTIA = 0.1, 0.02, 0.2, 1e-3
"""What is not known of segments: parts of mass and moments of inertia (kg m2 at least), m of the centre of mass."""
OFFSET = 2.0
"""A constant of each component, of ``FORCE`` and ``MOMENT_M``: a plate's zero, a mass."""
WIDE_S = 0.03
"""Prior of a pass, after which the plates are brought into step; the last has `PRIOR_S` about none."""
PASSES = 3
SHORTEST_S, END_S, LONGEST_S = 0.4, 0.1, 5.0
"""Stretches that are judged; their ends are not; so much is, where loads change most."""
BRIDGED_S = 0.1
"""Longest gap of the markers that motion and plates are led across: little of a movement below `CUTOFF_HZ` is lost. Its
frames themselves do not count."""
LOADED, MOST_LOAD = 0.3, 2.0
"""Of the weight: mean of a stretch at least, and of the recording at most, because flesh follows a landing later than
bones do: a drop jump fits its plates worse by the 5 to 8 ms that its calmer parts ask for."""
UPWARDS = 1
"""Of a wrench's components."""
FRAMES_HZ = 100.0
"""Twice as many frames a second show no more."""
WIDE_DRIFT = 0.02
"""Prior of how much faster than the markers' the plates' clock runs, in a pass."""
DRIFT_PASSES = 6
"""More of them, because plates whose clocks drift are far out of step at the ends."""
DRIFT_SD, DRIFT_S = 4.0, 0.003
"""A drift of fewer of its standard deviations is none, nor one that moves the ends of the recording by less (a third of
a frame at 100 Hz). Chosen on `truth3d`'s seeds 1 to 4, squats of 8 s and walks of 3.3 s: up to 0.13 % and 1.3 of its
deviations, which are 0.1 % in walks and 0.15 to 0.19 % in squats; 55 other trials, real and simulated, which did not
choose, stay within 1.9 of them."""
APART_S, APART_SD, APART_COST = 0.006, 4.0, 12.0
"""A plate whose own delay is so much from the others' and so many of its standard deviations has a clock of its own,
where the sum of squares (of the noise's) is so much less than of one clock. Chosen on `truth3d`'s walks of seeds 1 to
4: 95 to 600 less where one plate of seven, two or all of one foot are 20 ms late, at most 6 as they are, as in seeds 61
to 64; and on two real walks, 18 and more so moved; real recordings as they are, which did not choose, at most 3."""
BETTER_COST = 10.0
"""And so much less than of a clock that drifts, which then does not: two plates of eight that are 20 ms late look like
a drift of 2 %, and leave 40 to 65 less; of drifts of 1 and 2 % plates' own delays leave 9 to 70 more."""
DRIFT_LEFT = 1.0
"""And none where motion and plates then disagree by more than the noise: 0.03 to 0.65 of its variance are left in these
trials. Who squats with 10 kg in the hands leaves 0.9 and looks like a drift of 0.8 %, so that nobody asks then."""


def clock_delay(needed: Needed, wrench: Array, drifts: bool = True, plates: Array | None = None) -> Delay | None:
    """The plates' delay; None where nothing can be said. Of a body that is not marked whole by the vertical force.

    Args:
        wrench: (T, 6) N and N m of all plates, about the ground's origin, where that is all that bears the person; NaN
            elsewhere.
        drifts: whether the clock may be faster or slower than the markers', or each plate (P, T, 6) may have its own.
    """
    initial, rate, weight = needed.initial, needed.rate, needed.weight
    if initial.contacts or not rate >= 4.0 * CUTOFF_HZ:
        return None
    if (wrench[:, 1] > MOST_LOAD * weight).any():
        return None
    numbers = frame_numbers(needed.time)  # rows that the file lacks are frames without markers
    time, markers = _even_time(needed.time, numbers), on_grid(numbers, needed.markers)
    wrench = on_grid(numbers, wrench)
    seen = np.isfinite(markers).all(axis=2).sum(axis=1) >= FEWEST_MARKERS
    wrench, led = _led_across(wrench, seen, round(BRIDGED_S * rate))
    shown = np.where((seen | led)[:, None], wrench, np.nan)
    stretches, ends = (find(shown, rate, LOADED * weight) for find in (_stretches, _at_the_ends))
    if not stretches:
        return None
    body, asked = _Body(initial), [UPWARDS] if initial.unseen_kg else list(range(6))

    def moved(parts: list[slice]) -> list[tuple[slice, _Stretch]]:
        return [(part, body.needed(markers[part], seen[part], rate / part.step, asked)) for part in parts]

    judged = moved(stretches)
    noise = weight * np.repeat([FORCE, MOMENT_M], 3)[asked]
    prior_sd = np.concatenate([body.inertia_sd, OFFSET * noise])
    delay, variance, drifting, several = 0.0, np.inf, None, None
    for _ in range(PASSES):
        there = in_step(time, wrench, delay)
        found = _step(judged, there, noise, prior_sd, [_Lag(there, WIDE_S)])
        delay, variance = float(np.clip(delay + found.step[0], -WIDE_S, WIDE_S)), float(found.variance[0])
    if drifts and not initial.unseen_kg:
        judged = moved(ends) if ends else judged
        drifting, cost = _drift(time, wrench, judged, noise, prior_sd)
        each = [on_grid(numbers, np.nan_to_num(plate)) for plate in ([] if plates is None else plates)]
        several = _apart(time, each, judged, noise, prior_sd, cost) if len(each) > 1 else None
    if several is not None:
        drifting, delay, variance = None, several.delay_s, several.sd_s**2
    variance += (MODEL_LEGS_S if initial.unseen_kg else MODEL_S) ** 2
    trust = PRIOR_S**2 / (PRIOR_S**2 + variance)
    if drifting is not None:
        return drifting._replace(sd_s=float(np.sqrt(trust * variance)))
    return Delay(trust * delay, float(np.sqrt(trust * variance)), apart=several.apart if several else ())


def _drift(
    time: Array, wrench: Array, judged: list[tuple[slice, _Stretch]], noise: Array, prior_sd: Array
) -> tuple[Delay | None, float]:
    """A delay that changes evenly with time, None where that is not to be told from one that does not; and its cost.

    Args:
        wrench: (T, 6). prior_sd: of what `_Stretch.equations` ask for beside delays.
    """
    known = np.flatnonzero(np.isfinite(wrench).all(axis=1))
    led = np.stack([np.interp(time, time[known], column[known]) for column in wrench.T], axis=1)
    middle, half = 0.5 * (time[0] + time[-1]), 0.5 * (time[-1] - time[0])
    delay = drift = 0.0
    for _ in range(DRIFT_PASSES):
        there = in_step(time, led, Delay(delay, 0.0, drift).lags(time))
        lags = [_Lag(there, WIDE_S), _Lag(there, WIDE_DRIFT, time - middle)]
        found = _step(judged, there, noise, prior_sd, lags)
        delay, drift = delay + float(found.step[0]), drift + float(found.step[1])
    sd = float(np.sqrt(found.variance[1]))
    evident = found.left <= DRIFT_LEFT and abs(drift) >= max(DRIFT_S / half, DRIFT_SD * sd)
    return (Delay(delay, 0.0, drift, sd) if evident else None), found.cost


def _apart(
    time: Array,
    plates: list[Array],
    judged: list[tuple[slice, _Stretch]],
    noise: Array,
    prior_sd: Array,
    drifting: float,
) -> Delay | None:
    """The delay of most plates (T, 6), and how much more others lag; None where one clock, or one that drifts (which
    costs so much), explains them."""

    def found(groups: list[Array], passes: int) -> tuple[Array, _Step]:
        lag = np.zeros(len(groups))
        for _ in range(passes):
            there = [in_step(time, group, by) for group, by in zip(groups, lag, strict=True)]
            step = _step(judged, np.sum(there, axis=0), noise, prior_sd, [_Lag(group, WIDE_S) for group in there])
            lag = lag + step.step
        return lag, step

    ways = [np.sum(plates, axis=0)], plates
    (_, together), (_, each) = (found(way, 1) for way in ways)
    if each.cost > together.cost - 0.5 * APART_COST:  # a first pass takes most of it: no need to look closer
        return None
    (_, together), (lag, each) = (found(way, DRIFT_PASSES) for way in ways)
    spread = max(1.0, each.left)
    if each.cost > min(together.cost - APART_COST * spread, drifting - BETTER_COST * spread):
        return None
    order, known = np.argsort(lag), 1.0 / each.variance
    usual = lag[order[np.searchsorted(np.cumsum(known[order]), 0.5 * known.sum())]]
    sd = np.sqrt(each.variance)
    own = (np.abs(lag - usual) > np.maximum(APART_S, APART_SD * sd)) & (sd < KNOWN_S)
    if not own.any():
        return None
    known[own] = 0.0
    delay = float(known @ lag / known.sum())
    unsure = UNKNOWN_S if (sd >= KNOWN_S).any() else 0.0
    return Delay(delay, max(float(known.sum() ** -0.5), unsure), apart=tuple(np.where(own, lag - delay, 0.0).tolist()))


class _Lag(NamedTuple):
    """What of the plates (T, 6) lags, how far at most (s, or a part of time), and how many times so at times (T,)."""

    of: Array
    wide: float
    times: Array | float = 1.0


class _Step(NamedTuple):
    """By how much more each of n lags (n,), the variance of that, the mean square of what is left over, of the noise's,
    and the cost: the sum of squares that is least."""

    step: Array
    variance: Array
    left: float
    cost: float


class _Stretch(NamedTuple):
    """What a stretch of the motion needs: wrench (T, 6) about the ground's origin, and its derivatives (T, 6, I) by
    inertia; both low-passed; the frames (T,) that count, and which C components are asked."""

    wrench: Array
    by_inertia: Array
    seen: Flags
    rate: float
    asked: list[int]

    def equations(self, part: slice, plates: Array, noise: Array, lags: list[_Lag]) -> tuple[Array, Array]:
        """Rows H (C N, n + I + C) and values (C N,), over their noise (C,), of how plates (T, 6) differ from it in its
        ``part`` of the recording by n lags, inertia and a constant; moments about the mean centre of pressure."""
        measured = low_pass(plates[part], self.rate, CUTOFF_HZ)
        x, z = pressed_at(measured.mean(axis=0), least_n=-np.inf)
        centre = np.array([x, 0.0, z])
        end = round(END_S * self.rate)
        inner = self.seen.copy()
        inner[:end] = inner[len(inner) - end :] = False

        def of(wrenches: Array) -> Array:
            return wrench_about(wrenches, centre)[inner][..., self.asked] / noise

        def later(lag: _Lag) -> Array:
            change = np.gradient(low_pass(lag.of[part], self.rate, CUTOFF_HZ), 1.0 / self.rate, axis=0)
            times = lag.times if isinstance(lag.times, float) else lag.times[part, None]
            return of(-change * times)

        differs, delayed = of(measured - self.wrench), np.stack([later(lag) for lag in lags], axis=2)
        bodies = of(self.by_inertia.swapaxes(1, 2))  # (N, I, C)
        constant = np.broadcast_to(np.diag(1.0 / noise), (len(differs), len(noise), len(noise)))
        H = np.concatenate([delayed, bodies.swapaxes(1, 2), constant], axis=2)
        return H.reshape(-1, H.shape[2]), differs.reshape(-1)


class _Body:
    """The calibrated person as a rigid model whose inertia may be somewhat other than it is said to be."""

    def __init__(self, initial: CalibratedModel) -> None:
        self._initial = initial
        spec = bare(copy(initial.spec))
        segments = spec.segments
        for segment in segments:
            segment.inertia_estimated = [bool(segment.inertia[0] > 0.0)] * len(INERTIA_NAMES)
        spec.segments = segments
        self._model = _core.Model(spec)
        self._state = np.array(self._model.initial_state())
        self._inertia = [k for k, name in enumerate(self._model.layout.names) if name.startswith("inertia/")]
        known = [_unsure(np.array(segment.inertia)) for segment in segments if segment.inertia[0] > 0.0]
        self.inertia_sd = np.concatenate(known)

    def needed(self, markers: Array, seen: Flags, rate: float, asked: list[int]) -> _Stretch:
        """Of a stretch of markers (T, M, 3), which show enough in most of its frames (T,)."""
        posed = inverse_kinematics(self._initial, markers[seen])
        q = _through(np.flatnonzero(seen), posed, np.arange(len(markers))) if not seen.all() else posed
        q = low_pass(q, rate, CUTOFF_HZ)
        qd = np.gradient(q, 1.0 / rate, axis=0)
        motion = np.hstack([q, qd, np.gradient(qd, 1.0 / rate, axis=0)])
        wrench, by_inertia = np.empty((len(q), 6)), np.empty((len(q), 6, len(self._inertia)))
        x = self._state.copy()
        for k, moving in enumerate(motion):
            x[: len(moving)] = moving
            wrench[k] = _core.wrench(self._model, x)
            by_inertia[k] = _core.wrench_jacobian(self._model, x)[:, self._inertia]
        return _Stretch(wrench, by_inertia, seen, rate, asked)


def _even_time(time: Array, numbers: npt.NDArray[np.intp]) -> Array:
    """Times (N,) s of all frames of the grid on which those (T,) of these numbers lie."""
    return np.interp(np.arange(int(numbers[-1]) + 1), numbers, time)


def _led_across(wrench: Array, seen: Flags, most: int) -> tuple[Array, Flags]:
    """The wrench (T, 6) led across gaps of the markers (T,) of at most so many frames, and which (T,) those are:
    without the feet it is not known who stands on which plate. Frames that are seen without it are left as they are."""
    known: Flags = np.asarray(np.isfinite(wrench).all(axis=1))
    led = np.zeros(len(seen), dtype=bool)
    for first, end in runs(~seen):
        if first > 0 and end < len(seen) and end - first <= most and known[first - 1] and known[end]:
            led[first:end] = True
    if not led.any():
        return wrench, led
    found = wrench.copy()
    found[led] = _through(np.flatnonzero(known), wrench[known], np.flatnonzero(led))
    return found, led


def _unsure(inertia: Array) -> Array:
    """Standard deviations of the ten numbers of a segment, in the order of ``INERTIA_NAMES``."""
    mass = inertia[0]
    return np.concatenate(
        [[MASS * mass], np.full(3, CENTRE_M * mass), np.maximum(INERTIA * np.abs(inertia[4:]), LEAST_INERTIA)]
    )


def _at_the_ends(wrench: Array, rate: float, least_n: float) -> list[slice]:
    """`_stretches` of the first and the last third of a long recording, where a drift shows; none of a short one, or
    where one of them has none."""
    third = len(wrench) // 3
    if not len(wrench) > 1.5 * LONGEST_S * rate:
        return []
    first, last = wrench.copy(), wrench.copy()
    first[third:] = last[:-third] = np.nan
    found = [_stretches(each, rate, least_n, 0.5 * LONGEST_S) for each in (first, last)]
    return [*found[0], *found[1]] if all(found) else []


def _stretches(wrench: Array, rate: float, least_n: float, longest_s: float = LONGEST_S) -> list[slice]:
    """Stretches of known frames that bear so much, so long in all: those in which loads change most; with room for a
    delay."""
    known = np.asarray(np.isfinite(wrench).all(axis=1))
    room, most = round(WIDE_S * rate) + 1, round(longest_s * rate)
    found = [(a + room, b - room) for a, b in runs(known) if b - a - 2 * room >= (SHORTEST_S + 2.0 * END_S) * rate]
    parts = [slice(a, min(a + most, b)) for first, b in found for a in range(first, b, most)]
    stride = max(int(rate / FRAMES_HZ + 1e-6), 1)
    parts = [
        slice(part.start, part.stop, stride)
        for part in parts
        if part.stop - part.start >= (SHORTEST_S + 2.0 * END_S) * rate and wrench[part, 1].mean() > least_n
    ]
    change = [float(np.square(np.diff(wrench[part, :3], axis=0)).mean()) for part in parts]
    chosen, left = list[slice](), most
    for k in np.argsort(change)[::-1]:
        if left >= parts[k].stop - parts[k].start or not chosen:
            chosen.append(parts[k])
            left -= parts[k].stop - parts[k].start
    return chosen


def _step(
    judged: list[tuple[slice, _Stretch]], plates: Array, noise: Array, prior_sd: Array, lags: list[_Lag]
) -> _Step:
    """How much more plates (T, 6) are off. By least squares with priors over stretches of the recording, each row of
    which counts as so much of one as its low-pass leaves; what is left that is more than the noise counts as noise."""
    equations = [need.equations(part, plates, noise, lags) for part, need in judged]
    H, values = (np.concatenate(each) for each in zip(*equations, strict=True))
    counts, n = min(2.0 * CUTOFF_HZ / judged[0][1].rate, 1.0), len(lags)
    prior_sd = np.r_[[lag.wide for lag in lags], prior_sd]
    scaled = H * prior_sd
    factor = cho_factor(counts * scaled.T @ scaled + np.eye(len(prior_sd)))
    z = cho_solve(factor, counts * scaled.T @ values)
    squares = np.square(values - scaled @ z)
    left = float(squares.mean())
    variances = np.diag(cho_solve(factor, np.eye(len(z))[:, :n])) * max(1.0, left)
    cost = float(counts * squares.sum() + np.square(z[n:]).sum())
    return _Step(prior_sd[:n] * z[:n], prior_sd[:n] ** 2 * variances, left, cost)


def _through(at: npt.NDArray[np.intp], values: Array, wanted: npt.NDArray[np.intp]) -> Array:
    """Values at wanted frames of the spline through others at theirs."""
    from scipy.interpolate import CubicSpline  # loads scipy.optimize, slowly

    return np.asarray(CubicSpline(at, values)(wanted))
