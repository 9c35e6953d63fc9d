"""Whether the plates carry what the motion of the person needs: judged by `closure`, and in words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from dynakin.arrays import Array, Flags, runs
from dynakin.filter.ground.closure import Closure, closure
from dynakin.filter.ground.declared import bearing
from dynakin.filter.ground.needed import Needed
from dynakin.filter.ground.on_ground import OnGround
from dynakin.filter.ground.shear import not_zeroed
from dynakin.messages import Message, note, warning
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.recordings.feet.contact import NEAR_M, middle_velocity
from dynakin.recordings.feet.loads import FootLoads
from dynakin.recordings.hull import distance_to_hull
from dynakin.recordings.pushes import LOADED_N
from dynakin.recordings.recording import Plate
from dynakin.recordings.standing import SPAN_S, marker_velocities
from dynakin.recordings.times import spans
from dynakin.recordings.weight import likely_unit
from dynakin.results.naming import listed
from dynakin.settings.contacts import SEAT
from dynakin.units import GRAVITY_M_S2

MASS_APART = 0.05
"""Part of the weight by which the plates' mean may differ before the mass is doubted: movement explains 2 or 3 %."""
UNSEEN_APART = 0.15
"""The same, more, by the part of the mass that no marker shows: a trunk that is held does not swing as it does."""

UNJUDGED = (
    "The recording is too short, or shows too few markers, to check by the motion of the centre of mass that the "
    "plates carry the person."
)
MANY = 0.2
"""Part of the frames from which it is said that they could not be checked; the ends of a recording never can."""
RISE_M_S, OPEN = 0.15, 0.5
"""How far the change of a body's upward speed by its markers may be off: over 0.2 s 0.08 of the weight. In 13 stretches
of 0.2 s of a simulated walk plates that carry twice the weight are found to carry 1.9 to 2.2 times it, the first and
the last, where a foot is off the plates, aside. And the part of the weight that this leaves open at most, in a frame or
two: who carries a fifth of it there is borne by something else, or flies."""
_NEARLY_ALL = 0.8
"""Part of the judged frames from which an excess is said of the whole recording: its mass may be wrong."""


class Carried(NamedTuple):
    """As in `Ground`, by the motion of the centre of mass; beyond (T, F): feet whose plate is not to be believed;
    found: what the plates lack, None where nothing can be judged."""

    bears: Flags
    undeclared: Flags
    beyond: Flags
    load_ratio: float | None
    notes: list[Message]
    reasons: list[Message]
    found: Closure | None = None


def judged_by_motion(on: OnGround, wrenches: list[Array], tolerance: float | None) -> Carried:
    """Whether the plates carry what the motion needs, where feet and plates say that they carry the person.

    Args:
        wrenches: (T, 6) of all plates, and, where one is found to have another gain, the same without that.
        tolerance: as of `GroundTrial`; None: nobody asks.
    """
    recording, needed, initial = on.trial.recording, on.trial.needed, on.trial.initial
    loads, may, by_plate, wrench = on.loads, on.may, on.by_plate, wrenches[0]
    n, names, notes, reasons = recording.n_frames, list(initial.contacts), list[Message](), list[Message]()
    measured: Flags = np.asarray(np.isfinite(wrench).all(axis=1))
    claimed = measured if loads is None else loads.total_known
    undeclared = np.zeros(n, dtype=bool) if loads is None else loads.elsewhere.copy()
    beyond = np.zeros((n, len(initial.feet)), dtype=bool)
    if not measured.all():
        reasons.append(
            note("sum of the plates", f"The plates are not measured in {n - int(measured.sum())} of {n} frames.")
        )
    if loads is not None:
        notes += [text for text in loads.messages if text not in loads.reasons]
        reasons += loads.reasons
    unmeasured = None if all(by_plate) else np.asarray(may.any(axis=1))
    pulling = [k for k, name in enumerate(names) if name != SEAT]
    pulls = None if unmeasured is None else np.asarray(may[:, pulling].any(axis=1))
    found, *without = [closure(needed, each, claimed, unmeasured, pulls) for each in wrenches]
    if found is None:
        flies = loads is not None and bool(loads.aloft.all(axis=1).any())  # which weighs nobody
        foreign = None if flies or names else _foreign_load(on, wrench, claimed, tolerance)
        reasons += [foreign] if foreign else []
        return Carried(
            may, undeclared | (foreign is not None), beyond, None, [*notes, note("plates", UNJUDGED)], reasons
        )
    righted = next((each for each in without if each is not None), found)
    as_it_is = found
    bears = bearing(righted, may, names, by_plate, claimed, recording.rate)
    if bears.any():
        if (derived := bears & ~undeclared[:, None]).any():
            reasons.append(note("plates", _declared_in_words(righted, derived, names, recording.time)))
        found = replace(found, undeclared=found.undeclared & ~bears.any(axis=1))
    undeclared |= found.undeclared | _nearly_all(found)
    if found.too_much is not None and loads is not None:  # where the other foot is off the plates, too
        undeclared[:], beyond[:] = True, True
        reasons.append(
            warning(
                "weight",
                f"the plates carry {found.too_much:.2f} times what the motion needs of "
                f"{initial.weighed_kg:.1f} kg, all the time: their scale or the mass is wrong, or a load is not "
                "declared. No moment of the legs is given. Check the plates' units, --mass, and [[loads]].",
            )
        )
    elif found.undeclared.any() and any(each is not None and not each.undeclared.any() for each in without):
        words = (
            f"In {np.count_nonzero(found.undeclared)} of {n} frames the plates' sum is not used, because of the gain "
            "of a plate."
        )
        reasons.append(note("sum of the plates", words))
    elif found.undeclared.any():
        text, beyond = _undeclared_in_words(found, needed, wrench, loads)
        reasons.append(text)
    if found.unjudged > MANY * n:
        notes.append(
            note(
                "plates",
                f"In {found.unjudged} of {n} frames too few markers are seen to check that the plates carry the "
                "person.",
            )
        )
    return Carried(bears, undeclared, beyond, found.load_ratio, notes, reasons, as_it_is)


def _nearly_all(found: Closure) -> bool:
    judged = np.isfinite(found.excess[:, 1])
    return bool(np.count_nonzero(found.undeclared & judged) > _NEARLY_ALL * np.count_nonzero(judged))


def _declared_in_words(found: Closure, bears: Flags, names: list[str], time: Array) -> str:
    """A sentence on when declared contacts bear, and on how much the plates lack there."""
    when = [f"the {name} from {spans(time, runs(bears[:, c]))}" for c, name in enumerate(names) if bears[:, c].any()]
    excess = np.abs(found.excess[bears.any(axis=1)])
    size = f" (up to {np.nanmax(excess):.0f} N by the motion)" if np.isfinite(excess).any() else ""
    rests = " What is lacking all the time rests on the mass (--mass), as do the deviations." if found.steady else ""
    return (
        f"Declared contacts bear what the plates lack{size}: {' and '.join(when)}. The total wrench is not measured "
        f"there; what depends on these contacts is derived from the motion.{rests}"
    )


def _undeclared_in_words(
    found: Closure, needed: Needed, wrench: Array, loads: FootLoads | None
) -> tuple[Message, Flags]:
    """A sentence on what the plates lack, with times, and the feet (T, F) under whose plates it acts: what they have
    too much is under a foot that stands alone (a load that somebody carries is between two)."""
    time, initial, weight, feet = needed.time, needed.initial, needed.weight, needed.initial.foot_markers
    beyond = np.zeros((len(time), len(feet)), dtype=bool)
    judged = np.isfinite(found.excess[:, 1])
    if _nearly_all(found):
        load = float(np.nanmean(wrench[judged, 1])) / GRAVITY_M_S2
        x, up, z = (float(np.nanmean(found.excess[judged, axis])) for axis in range(3))
        if np.hypot(x, z) > abs(up):
            text = (
                f"{not_zeroed(-x, -z, weight)}: they were not zeroed, or something that no plate measures pulls the "
                "person all the time. Their sum is not used."
            )
            return warning("zero", text), beyond
        named = likely_unit(load * GRAVITY_M_S2, initial.weighed_kg)
        unit = f", or the forces are in {named}, not N" if named else ""
        return (
            warning(
                "weight",
                f"the plates carry {load:.1f} kg on average where the person weighs {initial.weighed_kg:.1f} kg "
                f"(by the motion {load + up / GRAVITY_M_S2:.1f} kg): the mass "
                "is wrong, a plate is missing, plates and markers are out of step, or something "
                f"that no plate measures bears or pulls the person (a seat, a weight, a cable, a rail){unit}. The "
                "plates are not used for the total.",
            )
        ), beyond
    sizes, away = list[tuple[float, int]](), list[float]()
    for first, end in runs(found.undeclared):
        excess = found.excess[first:end]
        if not np.isfinite(excess).any():  # not judged, but far from the weight
            sizes.append((weight - float(np.median(wrench[first:end, 1])), 1))
            continue
        worst = np.unravel_index(int(np.nanargmax(np.abs(excess))), excess.shape)
        sizes.append((float(excess[worst]), int(worst[1])))
        if sizes[-1][1] != 1:
            continue
        place = np.broadcast_to(found.place(slice(first, end)), (end - first, 2))
        for k, names in enumerate(feet.values()):
            own = [m for m, name in enumerate(initial.recorded_markers) if name in names]
            if not own:
                continue
            distance = distance_to_hull(place, needed.markers[first:end][:, own][:, :, [0, 2]])
            if np.isfinite(distance).any():
                away.append(float(np.nanmedian(distance)))
                under = sizes[-1][0] > 0.0 or (loads is not None and _stands_alone(loads, k, slice(first, end)))
                beyond[first:end, k] = under and away[-1] < NEAR_M
    size, axis = max(sizes, key=lambda pair: abs(pair[0]))
    near = f", {min(away):.2f} m or more from the feet" if away and not beyond.any() else ""
    return (
        warning(
            "plates",
            f"the plates carry up to {abs(size):.0f} N {'less' if size > 0.0 else 'more'} "
            f"{'upwards' if axis == 1 else 'sideways'} than the motion needs ({100.0 * abs(size) / weight:.0f} % of "
            f"the weight, expected within {100.0 * found.limits[0]:.0f} %, and {100.0 * found.limits[1]:.0f} % for "
            "longer than a second): something that no plate measures bears or pulls the person there (a seat, a "
            f"rail, a box, a foot off its plate){near}, from {spans(time, runs(found.undeclared))}. The plates' "
            "sum is not used there.",
        )
    ), beyond


def _stands_alone(loads: FootLoads, k: int, frames: slice) -> bool:
    """Whether foot number k is the only one on a plate in most of the frames."""
    standing: Flags = np.asarray(loads.on[frames].any(axis=2))
    return bool((standing[:, k] & (standing.sum(axis=1) == 1)).mean() > 0.5)


class Empty(NamedTuple):
    """What plates read below 0 with nobody on them: which, how much, and by how much the mean load is too small."""

    names: str
    reads: str
    kg: float

    @staticmethod
    def of(plates: Sequence[Plate], measured: Array) -> Empty:
        """Of the frames in which the total wrench (T, 6) is known."""
        known = np.isfinite(measured).all(axis=1)
        read = {plate.name: plate.empty_n for plate in plates if plate.empty_n < 0.0}
        if not read or not known.any():
            return EMPTY
        bears = [np.linalg.norm(plate.force[known], axis=1) > LOADED_N for plate in plates]
        short = sum(plate.empty_n * float(own.mean()) for plate, own in zip(plates, bears, strict=True))
        low, high = (f"{most:.0f} N" for most in (min(read.values()), max(read.values())))
        return Empty(listed(list(read)), low if low == high else f"{low} to {high}", short / GRAVITY_M_S2)


EMPTY = Empty("", "", 0.0)


def doubtful_mass(initial: CalibratedModel, load_kg: float, empty: Empty = EMPTY) -> Message | None:
    """Sentences where what the plates carry contradicts the mass; of their zero where it is that which does."""
    mass_kg = initial.weighed_kg
    within = MASS_APART + UNSEEN_APART * initial.unseen_kg / mass_kg
    if abs(load_kg - mass_kg) <= within * mass_kg:
        return None
    if empty.names and abs(load_kg - empty.kg - mass_kg) <= within * mass_kg:
        return warning(
            "zero",
            f"with nobody on them {empty.names} read {empty.reads}, which was not taken off, and as much too little "
            f"under a foot: with it the plates carry {load_kg - empty.kg:.1f} kg on average, as it is {load_kg:.1f} kg "
            f"where the person weighs {mass_kg:.1f} kg. Forces, moments and inertia take the error on.",
        )
    carried = ", or a load is carried (moments of back and arms are wrong by it)" if load_kg > mass_kg else ""
    return warning(
        "weight",
        f"the plates carry {load_kg:.1f} kg on average where the person weighs {mass_kg:.1f} kg "
        f"({100.0 * abs(load_kg - mass_kg) / mass_kg:.1f} % apart, expected within {100.0 * within:.0f} %): check the "
        f"mass{carried}. Forces, moments and inertia take the error on.",
    )


def _foreign_load(on: OnGround, wrench: Array, claimed: Flags, tolerance: float | None) -> Message | None:
    """A sentence where the plates' mean load is not the person's weight, for recordings that `closure` cannot judge.

    Args:
        tolerance: part of the weight by which they may differ; None: nobody asks.
    """
    mass_kg, check, load, mean = on.trial.initial.weighed_kg, on.check, None, ""
    if on.trial.initial.feet and tolerance is not None:
        load, mean = mean_load_kg(wrench[claimed], least=1), " on average, less what lifts the body,"
        lifts, open_ = _lifts_on_average(on, claimed)
        load, tolerance = None if load is None else load / (1.0 + lifts), tolerance + open_
    elif check is not None:
        load = check.mass_kg_from_plates if check.mass_kg_from_plates is not None else check.mean_mass_kg
    if tolerance is None or load is None or abs(load - mass_kg) <= tolerance * mass_kg:
        return None
    return warning(
        "weight",
        f"the plates carry {load:.1f} kg{mean} where the person weighs {mass_kg:.1f} kg (more than "
        f"{100.0 * tolerance:.0f} % apart): the mass is wrong, or something that the model does not have bears on them "
        "(a weight, a cable, a rail, a foot off the plates). The plates are not used for the total.",
    )


def _lifts_on_average(on: OnGround, claimed: Flags) -> tuple[float, float]:
    """What the body gains of upward speed over the stretches of frames (T,), by the middle of its markers, as a part
    of the weight on average, and how far that may be off."""
    trial, rate = on.trial, on.trial.needed.rate
    rises = middle_velocity(trial.initial.ground.vectors_to_ground(marker_velocities(trial.recording)))[:, 1]
    lifts, open_, frames = 0.0, 0.0, 0
    for first, end in runs(claimed & np.isfinite(rises)):
        lasts = max((end - first) / rate - 0.5 * SPAN_S, 0.5 * (end - first) / rate)  # speeds are known over that
        part = (end - first) / (GRAVITY_M_S2 * lasts)
        lifts, open_, frames = (
            lifts + part * (rises[end - 1] - rises[first]),
            open_ + part * RISE_M_S,
            frames + end - first,
        )
    return (lifts / frames, min(open_ / frames, OPEN)) if frames else (0.0, OPEN)


def mean_load_kg(wrench: Array, least: int) -> float | None:
    """Mean vertical force of the known frames of a wrench (T, 6) as a mass; None of fewer than ``least``."""
    push = wrench[np.isfinite(wrench).all(axis=1), 1]
    return float(push.mean()) / GRAVITY_M_S2 if len(push) >= least else None
