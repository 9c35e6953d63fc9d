"""Adaptation: from when on do the constants stay, and is the misfit no larger than later?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from dynakin.arrays import rms, rms_length
from dynakin.recordings.times import step_of
from dynakin.results.estimate import Estimate
from dynakin.results.measures.sources import needed_wrench
from dynakin.results.records import Parameter
from dynakin.units import COMPONENTS

# A constant has settled once all that it still moves is this share of its size at the start. The filter's own standard
# deviation is no yardstick: where the data teach nothing it is wider than everything that happens.
BAND = 0.01
# A correction of a joint's place starts at 0 and has no size: this share of its prior's standard deviation instead.
CORRECTION_BAND = 0.25
# The misfit is judged as a running RMS over this time: shorter than a squat, longer than a jerk of it.
RUNNING_S = 1.0
# ... and against that of the second half of the recording, times this: misfits grow and shrink with the movement, by
# a factor of two and more from one squat's phase to the next, long after anything adapts.
FACTOR = 3.0
# What is still moving in the last quarter has not settled: nothing would show that it stays.
LATEST = 0.75
WITHIN_SD = 4.0
"""By so many of its deviations, the width of a 95 % interval, a constant may move in the last quarter: a length that
drifts within what is said of it is no finding (`truth3d`'s squats with a lag, seeds 1 to 4: 1.2 to 1.8 at most)."""
# Shorter recordings have no time to adapt and to show it (twice the paper's 2 s).
SHORTEST_S = 4.0


@dataclass(frozen=True)
class Settling:
    """When one thing settled.

    ``after_s`` is s after the first frame, None where it does not settle before the end; ``growth`` of a misfit is its
    RMS in the second half of the recording over that in the first (1 for constants).
    """

    after_s: float | None
    growth: float = 1.0


def constant_settling(time: np.ndarray, path: np.ndarray, band: float) -> Settling:
    """From when on a constant moves by no more than ``band`` in all (largest less smallest).

    Args:
        time: (T,) s. path: (T,) in the constant's unit, as ``band``.
    """
    later = path[::-1]
    spread = (np.maximum.accumulate(later) - np.minimum.accumulate(later))[::-1]
    return Settling(_after(time, spread > band))


def misfit_settling(time: np.ndarray, misfit: np.ndarray) -> Settling:
    """From when on the running RMS of a misfit stays within `FACTOR` of its RMS in the second half of the recording.

    One that is larger in the second half than in the first by as much does not settle.

    Args:
        time: (T,) s, evenly spaced. misfit: (T,) in any unit; NaN where nothing was measured.
    """
    half = len(time) // 2
    early, level = (float(rms(part[np.isfinite(part)])) for part in (misfit[:half], misfit[half:]))
    running = running_rms(misfit, max(1, round(RUNNING_S / step_of(time))))
    growth = level / early if early > 0.0 else 1.0
    if not np.isfinite(level) or growth > FACTOR:
        return Settling(None, growth)
    return Settling(_after(time, running > FACTOR * level), growth)


def running_rms(values: np.ndarray, frames: int) -> np.ndarray:
    """RMS over each frame of (T,) and those that follow it, ``frames`` in all: (T - frames + 1,); NaN left out."""
    seen = np.isfinite(values)
    power = np.cumsum(np.concatenate([[0.0], np.where(seen, values, 0.0) ** 2]))
    count = np.cumsum(np.concatenate([[0], seen]))
    power, number = power[frames:] - power[:-frames], count[frames:] - count[:-frames]
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.sqrt(np.where(number > 0, np.maximum(power, 0.0) / number, np.nan))


def band_of(p: Parameter) -> float:
    """By how much a constant may still move, in its unit; 0 of what is known for sure or has no size."""
    if p.is_correction:
        return CORRECTION_BAND * (p.prior_sd or 0.0)
    return BAND * abs(p.initial)


def constant_groups(parameters: Sequence[Parameter]) -> dict[str, list[Parameter]]:
    """Estimated lengths, masses and moments of inertia; groups without any are left out."""
    free = [p for p in parameters if p.estimated and band_of(p) > 0.0]
    inertial = [p for p in free if p.kind == "inertia"]
    groups = {
        "lengths": [p for p in free if p.kind == "length"],
        "masses": [p for p in inertial if p.name.endswith("/mass")],
        "moments of inertia": [p for p in inertial if p.name.rpartition("/")[2] in ("ixx", "iyy", "izz")],
    }
    return {title: group for title, group in groups.items() if group}


def adaptation(estimate: Estimate) -> dict[str, Any]:
    """The block ``adaptation`` of ``metrics.json``: each constant and misfit, the latest of them, and a sentence.

    Of a smoothed run there is nothing to say: the sentence is empty.
    """
    time = estimate.time
    short = bool(time[-1] - time[0] < SHORTEST_S)
    untimed = short or estimate.smoothed  # all frames then have the constants of the last one
    groups = {} if untimed else constant_groups(estimate.parameters)
    constants = {title: _group(estimate, group) for title, group in groups.items()}
    misfits = {} if untimed else {name: misfit_settling(time, path) for name, path in _misfits(estimate).items()}
    found = {**constants, **{_misfit_title(name): settling.after_s for name, settling in misfits.items()}}
    times = [value["after_s"] if isinstance(value, dict) else value for value in found.values()]
    known = [value for value in times if value is not None]
    nothing = "" if estimate.smoothed else "The recording is too short for an adaptation time."
    return {
        "what": f"s after the first frame from which on constants move by no more than {100.0 * BAND:g} % in all and "
        f"the running RMS misfit ({RUNNING_S:g} s) stays below {FACTOR:g} times that of the second half; null: not "
        "before the last quarter",
        "after_s": max(known) if known and len(known) == len(times) else None,
        "constants": constants,
        "misfits": {name: {"after_s": s.after_s, "growth": s.growth} for name, s in misfits.items()},
        "verdict": _verdict(constants, misfits) if found else nothing,
    }


def _after(time: np.ndarray, outside: np.ndarray) -> float | None:
    """When the last of ``outside`` (K <= T,) is over, s after the first frame; None in the last quarter."""
    wrong = np.flatnonzero(outside)
    after = float(time[min(wrong[-1] + 1, len(time) - 1)] - time[0]) if len(wrong) else 0.0
    return after if after <= LATEST * (time[-1] - time[0]) else None


def _group(estimate: Estimate, group: list[Parameter]) -> dict[str, Any]:
    elements = [str(name) for name in estimate.data["element"].values]
    state = estimate.values("state")
    after = {
        p.name: constant_settling(estimate.time, state[:, elements.index(p.name)], band_of(p)).after_s for p in group
    }
    moving = [name for name, value in after.items() if value is None]
    known = {name: value for name, value in after.items() if value is not None}
    latest = max(known, key=lambda name: known[name]) if known else None
    return {"after_s": None if moving or latest is None else known[latest], "last": latest, "not_settled": moving}


def _misfits(estimate: Estimate) -> dict[str, np.ndarray]:
    """Misfit (T,) of the markers, RMS over them in m, and of each wrench component, N or N m, after the update."""
    axes = estimate.modelled_axes()
    markers = (estimate.data["markers_measured"] - estimate.data["markers_estimated"]).transpose(
        "time", "marker", "axis"
    )
    distance = rms_length(markers.values[:, :, axes], axis=1)
    wrench = estimate.values("wrench_measured") - needed_wrench(estimate.data)
    found = {"markers": distance} | {name: wrench[:, k] for k, name in enumerate(COMPONENTS)}
    return {name: path for name, path in found.items() if np.isfinite(path).any()}


def _misfit_title(name: str) -> str:
    return "misfit of the markers" if name == "markers" else f"misfit of {name}"


def _verdict(constants: dict[str, dict[str, Any]], misfits: dict[str, Settling]) -> str:
    moving = [f"{title} ({len(group['not_settled'])})" for title, group in constants.items() if group["not_settled"]]
    restless = [name for name, settling in misfits.items() if settling.after_s is None]
    text = []
    if moving:
        text.append(f"still moving by more than {100.0 * BAND:g} % in the last quarter: {', '.join(moving)}")
    if restless:
        worst = max(restless, key=lambda name: misfits[name].growth)
        growth = misfits[worst].growth
        how = f"up to {growth:.2g} times larger in the second half" if growth > FACTOR else "largest near the end"
        text.append(
            f"the misfit of {', '.join(restless)} is {how}, so either the movement grew livelier or the estimate is "
            "being lost"
        )
    if text:
        return f"The estimate does not settle before the trial ends: {'; '.join(text)}."
    after = {title: float(group["after_s"]) for title, group in constants.items()}
    after |= {_misfit_title(name): float(s.after_s) for name, s in misfits.items() if s.after_s is not None}
    latest = max(after, key=lambda title: after[title])
    if after[latest] == 0.0:
        return (
            f"Nothing adapts visibly: no constant moves by more than {100.0 * BAND:g} %, and the misfit is never above "
            f"{FACTOR:g} times that of the second half."
        )
    why = (
        f"the {latest} move by more than {100.0 * BAND:g} %"
        if latest in constants
        else f"the {latest} is above {FACTOR:g} times that of the second half"
    )
    return f"The estimate has settled after {after[latest]:.1f} s (the paper allows 2 s): until then {why}."


# A constant that still moves by more than that in the last quarter, and by more than `WITHIN_SD`, has not
# settled. By truth (a walk of `truth3d`, live-like) twenty masses move by 1 to 9 %, all by less than their deviations,
# and those of moments hold 92 to 93 % of their errors: that they move says nothing.
MOVING = BAND
# A standard deviation that shrinks by less than this says that the recording held nothing about the constant.
TAUGHT = 0.05

Verdict = Literal["settled", "moving", "untaught"]


@dataclass(frozen=True)
class Convergence:
    """What became of one kind of constant.

    ``largest_change_percent`` is the largest change from the start, ``sd_left`` the median of the standard deviation at
    the end over that before the first frame, ``moving`` those that had not settled.
    """

    title: str
    count: int
    verdict: Verdict
    largest_change_percent: float
    sd_left: float
    moving: tuple[Parameter, ...]


def convergence(estimate: Estimate) -> list[Convergence]:
    """Lengths, masses, and moments of inertia; a kind that was not estimated is left out."""
    return [_judge(estimate, title, group) for title, group in constant_groups(estimate.parameters).items()]


def _judge(estimate: Estimate, title: str, group: list[Parameter]) -> Convergence:
    moving, left, largest = [], [], 0.0
    at = {str(name): k for k, name in enumerate(estimate.data["element"].values)}
    states, deviations = (estimate.values(name) for name in ("state", "state_sd"))
    for p in group:
        path = states[:, at[p.name]]
        late = path[3 * len(path) // 4 :]
        # smoothed, a constant that moves does so by the drift it was given
        sd = deviations[:, at[p.name]]  # smoothed, its first is the posterior of all
        if not estimate.smoothed and np.ptp(late) > max(band_of(p), WITHIN_SD * float(sd[-1])) and not p.at_bound:
            moving.append(p)
        first = p.prior_sd or float(sd[0])
        left.append(float(sd[-1]) / first if first > 0.0 else 1.0)
        largest = max(largest, abs(p.change_percent() or 0.0))
    sd_left = float(np.median(left))
    still = largest < 100.0 * MOVING
    verdict: Verdict = "moving" if moving else "untaught" if sd_left > 1.0 - TAUGHT and still else "settled"
    return Convergence(title, len(group), verdict, largest, sd_left, tuple(moving))
