"""By how much plates and markers are out of step, to a millisecond or two: what the motion of the whole body needs,
forces and moments, against what the plates say.

The centre of mass as a mean of markers (`delay`) finds tens of milliseconds; a few are lost in skin that follows
the joints, and a filter takes them up by acceleration. Inverse kinematics frame by frame has neither, and what is not
known of segments' inertia, which looks like a delay as well, is estimated with it ([derivations](derivations.md),
section 11).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from dynakin.arrays import Array, wrench_about
from dynakin.filter.ground.delay import Delay
from dynakin.filter.ground.needed import Needed
from dynakin.filter.ground.stretches import CUTOFF_HZ, Stretch
from dynakin.filter.samples import in_step
from dynakin.recordings.plates.pressure import pressed_at
from dynakin.recordings.resampling import low_pass

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
OFFSET = 2.0
"""A constant of each component, of ``FORCE`` and ``MOMENT_M``: a plate's zero, a mass."""
WIDE_S = 0.03
"""Prior of a pass, after which the plates are brought into step; the last has `PRIOR_S` about none."""
PASSES = 3
UPWARDS, TURNING = 1, 4
"""Of a wrench's components."""
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


def clock_delay(
    needed: Needed, wrench: Array, drifts: bool = True, plates: Array | None = None, turns: bool = True
) -> Delay | None:
    """The plates' delay; None where nothing can be said. Of a body that is not marked whole by the vertical force.

    Args:
        wrench: (T, 6) N and N m of all plates, about the ground's origin, where that is all that bears the person; NaN
            elsewhere.
        drifts: whether the clock may be faster or slower than the markers', or each plate (P, T, 6) may have its own.
        turns: whether the moment about the vertical is asked, too.
    """
    initial, moving, borne = needed.initial, needed.moving, needed.moving.borne(wrench)
    if borne is None:
        return None
    time, wrench = moving.time, borne.wrench
    asked = [UPWARDS] if initial.unseen_kg else [k for k in range(6) if turns or k != TURNING]
    noise = needed.weight * np.repeat([FORCE, MOMENT_M], 3)[asked]
    judged = _Judged(borne.stretches, asked, noise, np.concatenate([moving.body.inertia_sd, OFFSET * noise]))
    delay, variance, drifting, several = 0.0, np.inf, None, None
    for _ in range(PASSES):
        there = in_step(time, wrench, delay)
        found = _step(judged, there, [_Lag(there, WIDE_S)])
        delay, variance = float(np.clip(delay + found.step[0], -WIDE_S, WIDE_S)), float(found.variance[0])
    if drifts and not initial.unseen_kg:
        judged = judged._replace(stretches=moving.at_the_ends(borne) or judged.stretches)
        drifting, cost = _drift(time, wrench, judged)
        each = [moving.laid(np.nan_to_num(plate)) for plate in ([] if plates is None else plates)]
        several = _apart(time, each, judged, cost) if len(each) > 1 else None
    if several is not None:
        drifting, delay, variance = None, several.delay_s, several.sd_s**2
    variance += (MODEL_LEGS_S if initial.unseen_kg else MODEL_S) ** 2
    trust = PRIOR_S**2 / (PRIOR_S**2 + variance)
    if drifting is not None:
        return drifting._replace(sd_s=float(np.sqrt(trust * variance)))
    return Delay(trust * delay, float(np.sqrt(trust * variance)), apart=several.apart if several else ())


def _drift(time: Array, wrench: Array, judged: _Judged) -> tuple[Delay | None, float]:
    """A delay of the wrench (T, 6) that changes evenly with time, None where that is not to be told from one that does
    not; and its cost."""
    known = np.flatnonzero(np.isfinite(wrench).all(axis=1))
    led = np.stack([np.interp(time, time[known], column[known]) for column in wrench.T], axis=1)
    middle, half = 0.5 * (time[0] + time[-1]), 0.5 * (time[-1] - time[0])
    delay = drift = 0.0
    for _ in range(DRIFT_PASSES):
        there = in_step(time, led, Delay(delay, 0.0, drift).lags(time))
        lags = [_Lag(there, WIDE_S), _Lag(there, WIDE_DRIFT, time - middle)]
        found = _step(judged, there, lags)
        delay, drift = delay + float(found.step[0]), drift + float(found.step[1])
    sd = float(np.sqrt(found.variance[1]))
    evident = found.left <= DRIFT_LEFT and abs(drift) >= max(DRIFT_S / half, DRIFT_SD * sd)
    return (Delay(delay, 0.0, drift, sd) if evident else None), found.cost


def _apart(time: Array, plates: list[Array], judged: _Judged, drifting: float) -> Delay | None:
    """The delay of most plates (T, 6), and how much more others lag; None where one clock, or one that drifts (which
    costs so much), explains them."""

    def found(groups: list[Array], passes: int) -> tuple[Array, _Step]:
        lag = np.zeros(len(groups))
        for _ in range(passes):
            there = [in_step(time, group, by) for group, by in zip(groups, lag, strict=True)]
            step = _step(judged, np.sum(there, axis=0), [_Lag(group, WIDE_S) for group in there])
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


class _Judged(NamedTuple):
    """Stretches of the motion, which C components of the wrench are asked of them, the noise (C,) of these, N and N m,
    and the deviations (I + C,) of what is estimated beside lags: inertia, and a constant of each component."""

    stretches: list[Stretch]
    asked: list[int]
    noise: Array
    prior_sd: Array

    def equations(self, stretch: Stretch, plates: Array, lags: list[_Lag]) -> tuple[Array, Array]:
        """Rows H (C N, n + I + C) and values (C N,), over their noise (C,), of how plates (T, 6) differ from what a
        stretch needs by n lags, inertia and a constant; moments about the mean centre of pressure."""
        part, rate, noise = stretch.part, stretch.rate, self.noise
        measured = low_pass(plates[part], rate, CUTOFF_HZ)
        x, z = pressed_at(measured.mean(axis=0), least_n=-np.inf)
        centre = np.array([x, 0.0, z])

        def of(wrenches: Array) -> Array:
            return wrench_about(wrenches, centre)[stretch.inner][..., self.asked] / noise

        def later(lag: _Lag) -> Array:
            change = np.gradient(low_pass(lag.of[part], rate, CUTOFF_HZ), 1.0 / rate, axis=0)
            times = lag.times if isinstance(lag.times, float) else lag.times[part, None]
            return of(-change * times)

        differs, delayed = of(measured - stretch.wrench), np.stack([later(lag) for lag in lags], axis=2)
        bodies = of(stretch.by_inertia.swapaxes(1, 2))  # (N, I, C)
        constant = np.broadcast_to(np.diag(1.0 / noise), (len(differs), len(noise), len(noise)))
        H = np.concatenate([delayed, bodies.swapaxes(1, 2), constant], axis=2)
        return H.reshape(-1, H.shape[2]), differs.reshape(-1)


def _step(judged: _Judged, plates: Array, lags: list[_Lag]) -> _Step:
    """How much more plates (T, 6) are off. By least squares with priors over stretches of the recording, each row of
    which counts as so much of one as its low-pass leaves; what is left that is more than the noise counts as noise."""
    equations = [judged.equations(stretch, plates, lags) for stretch in judged.stretches]
    H, values = (np.concatenate(each) for each in zip(*equations, strict=True))
    counts, n = min(2.0 * CUTOFF_HZ / judged.stretches[0].rate, 1.0), len(lags)
    prior_sd = np.r_[[lag.wide for lag in lags], judged.prior_sd]
    scaled = H * prior_sd
    factor = cho_factor(counts * scaled.T @ scaled + np.eye(len(prior_sd)))
    z = cho_solve(factor, counts * scaled.T @ values)
    squares = np.square(values - scaled @ z)
    left = float(squares.mean())
    variances = np.diag(cho_solve(factor, np.eye(len(z))[:, :n])) * max(1.0, left)
    cost = float(counts * squares.sum() + np.square(z[n:]).sum())
    return _Step(prior_sd[:n] * z[:n], prior_sd[:n] ** 2 * variances, left, cost)
