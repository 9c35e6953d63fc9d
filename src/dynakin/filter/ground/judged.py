"""Whether what feet and plates say carries the person, by the motion as well."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dynakin.arrays import Array, Flags, runs
from dynakin.filter.ground.carried import (
    carried_in_hands,
    carried_in_words,
    in_hands_in_words,
    more_than_the_mass,
    unseen_in_hands,
)
from dynakin.filter.ground.closure import beyond_the_feet
from dynakin.filter.ground.declared import (
    AT_PLATE,
    acts_at,
    held_in_words,
    low_beside_feet,
    taken_in_words,
)
from dynakin.filter.ground.gain import fitting_rate, found_gains, wrong_rate_in_words
from dynakin.filter.ground.ground import Ground
from dynakin.filter.ground.on_ground import OnGround
from dynakin.filter.ground.plate_errors import NO_ERRORS, VERTICAL_ONLY, PlateErrors
from dynakin.filter.ground.plate_sum import Carried, doubtful_mass, judged_by_motion
from dynakin.filter.ground.shear import found_shear, not_zeroed
from dynakin.messages import Message, about, note, warning
from dynakin.recordings.checks import PlateCheck
from dynakin.recordings.feet import loads as on_plates
from dynakin.recordings.feet.loads import FootLoads
from dynakin.recordings.low_passed import found_low_pass
from dynakin.recordings.plates.axes import turned_feet
from dynakin.recordings.plates.pressure import pressed_at
from dynakin.recordings.pushes import LOADED_N
from dynakin.recordings.times import spans
from dynakin.settings.contacts import SEAT


def judged(on: OnGround) -> tuple[Ground, Array]:
    """Whether who stands where carries the person, by the motion as well; and the total wrench (T, 6), NaN where it
    does not."""
    if on.check is None:
        return _without_plates(on)
    if on.check.unused:
        ground, nothing = judged(OnGround.of(on.trial.without_plates()))
        loads = ground.loads
        if loads is not None and on.loads is not None:  # the recording keeps its plates, with nobody on any
            loads = replace(loads, on=np.zeros_like(on.loads.on), plates=on.loads.plates)
        return replace(ground, loads=loads, notes=(*on.check.messages, *ground.notes)), nothing
    return _by_motion(on, on.check)


def _without_plates(on: OnGround) -> tuple[Ground, Array]:
    text = (
        "No force plates: the ground reaction follows from the motion where one foot may stand, and where both may "
        "how they divide it is assumed; inertial parameters stay as the table has them."
    )
    said, wrench = note("plates", text), on.trial.wrench
    initial, recording = on.trial.initial, on.trial.recording
    if on.loads is None or initial.contacts:
        none = np.zeros(len(wrench), dtype=bool)
        return Ground(on.loads, none, on.may, usable=False, notes=(said,), reasons=(said,)), wrench
    beyond = beyond_the_feet(on.trial.needed)
    texts = [said]
    if beyond.any():
        text = (
            "something that nobody measures bears the person beyond both feet, by the motion, from "
            f"{spans(recording.time, runs(beyond))} (a hand, a knee, a seat): what it can reach has no moments there. "
            "Declare it (--contact hand_right, seat or knee=shank_l), or give the forces of all that bears."
        )
        texts.append(warning("plates", text))
    loads, reasons = on.loads.with_undeclared(beyond), tuple(texts)
    return Ground(loads, beyond, on.may, usable=False, notes=reasons, reasons=reasons), wrench


def _by_motion(on: OnGround, check: PlateCheck) -> tuple[Ground, Array]:
    trial, loads, n = on.trial, on.loads, on.trial.recording.n_frames
    recording, initial = trial.recording, trial.initial
    notes = [note("plates", taken_in_words(plate, own)) for plate, own in on.taken.items()]
    wrench = trial.wrench
    all_of_it, righted, errors = wrench, None, on.errors
    if loads is not None:
        all_of_it = on.all_of_it
        first = judged_by_motion(on, [all_of_it], None) if on.unmeasured else None
        errors = _plate_errors(on, loads, first)
        errors = replace(errors, noise=trial.noise.noise, said=(*errors.said, *trial.noise.said))
        notes += errors.said
        righted = errors.righted(wrench, trial.wrenches)
    turned = None if loads is not None else turned_feet(recording.plates, initial.ground, recording.rate)
    wrenches = [errors.zeroed(each) for each in (all_of_it, righted) if each is not None]
    carries = judged_by_motion(on, wrenches, trial.tolerance)
    carries = carries._replace(bears=carries.bears | (on.may & errors.borne))
    if loads is not None and on.unmeasured:
        loads, low = low_beside_feet(initial, recording.time, loads, on.places, carries.bears, on.unmeasured)
        carries = carries._replace(bears=carries.bears | low)
    notes += [*check.messages, *([warning("plates", f"{turned}.")] if turned else []), *carries.notes]
    in_hands_kg = 0.0 if loads is None else more_than_the_mass(initial, carries.load_ratio)
    unseen = [c for c in on.unmeasured if (on.may & ~carries.bears)[:, c].any()]
    held_kg = 0.0 if loads is None else unseen_in_hands(initial, unseen)
    doubted = doubtful_mass(initial, initial.weighed_kg + in_hands_kg)  # which says it, too
    if in_hands_kg and not about(notes, "carried") and doubted is None:
        notes.append(note("carried", in_hands_in_words(in_hands_kg)))
    reasons = [*([VERTICAL_ONLY] if errors.unmeasured else []), *carries.reasons]
    reasons += [] if loads is None else [said for said in loads.reasons if said not in carries.reasons]
    undeclared = carries.undeclared
    if loads is not None:
        before = loads
        loads = loads.with_borne(np.asarray(carries.bears.any(axis=1))).with_undeclared(undeclared)
        loads = loads.without(carries.beyond)
        reasons += _light_feet(before, loads, carries.beyond)
    partly = undeclared if loads is None else ~loads.total_known | errors.unmeasured
    wrench = np.where(partly[:, None], np.nan, wrench)
    used = int(np.count_nonzero(np.isfinite(wrench).all(axis=1)))
    if loads is not None or used < n:
        notes.append(note("plates", f"The total wrench is measured in {used} of {n} frames."))
    notes += reasons
    found = Ground(
        loads, undeclared, carries.bears, used > 0, errors, carries.load_ratio, tuple(notes),
        tuple(reasons), in_hands_kg=max(in_hands_kg, held_kg),
    )  # fmt: skip
    return found, wrench


def _plate_errors(on: OnGround, loads: FootLoads, first: Carried | None) -> PlateErrors:
    """Where no declared contact may bear that bears at all.

    Args:
        first: what is known if all that the plates lack is the declared contacts'; None where none is declared.
    """
    bears = np.zeros_like(on.may) if first is None else first.bears & loads.total_known[:, None]
    free: Flags = np.asarray(~(on.may & bears.any(axis=0)).any(axis=1))
    touched = np.array([name != SEAT for name in on.trial.initial.contacts], dtype=bool) & on.may[free].any(axis=0)
    total = np.where(free[:, None], on.total(loads), np.nan)
    if (found := _rate_or_load(on, total, touched)) is not None:
        return found
    if on.errors.unmeasured:
        return on.errors
    found = _shear(on, loads, first, total, touched)
    if np.any(found.borne):
        return found
    gains = _gains(on, loads, free, first)
    return replace(found, gain_error=gains.gain_error, gain=gains.gain, said=(*found.said, *gains.said))


def _rate_or_load(on: OnGround, total: Array, touched: Flags) -> PlateErrors | None:
    """Where the force (T, 3) changes as with another rate of the markers, or a load in the hands, or as what the
    declared contacts ``touched`` (C,) bear: then no more can be said of the plates. None where it does not."""
    needed, initial = on.trial.needed, on.trial.initial
    found = fitting_rate(needed, total)
    # a low-pass takes accelerations, too
    if found is not None and not (found[1] > 1.0 and found_low_pass(on.trial.recording)):
        return replace(on.errors, said=(warning("rate", wrong_rate_in_words(needed.rate, *found)),))
    if (load_kg := carried_in_hands(needed, total, pressed_at(on.trial.wrench))) is None:
        return None
    if not touched.any():
        return replace(on.errors, said=(warning("carried", carried_in_words(load_kg)),))
    load = f"The plates' force changes as if about {load_kg:.0f} kg were carried in the hands"
    return replace(on.errors, said=(note("carried", held_in_words(load, initial, touched)),), borne=touched)


def _shear(on: OnGround, loads: FootLoads, first: Carried | None, total: Array, touched: Flags) -> PlateErrors:
    """By how much the horizontal forces of the total (T, 3) are off, or the contacts ``touched`` (C,) that it is laid
    to."""
    needed = on.trial.needed
    shear = found_shear(needed, total)
    if first is None or first.found is None:
        return shear
    whole = found_shear(needed, on.total(loads))
    near = acts_at(first.found, loads.total_known, pressed_at(on.trial.wrench), on.places, mean=True)
    if any(whole.shear_zero_n) and near < AT_PLATE:
        return whole  # the plates', whoever is declared
    if not (any(shear.shear_zero_n) and touched.any()):
        return shear
    said = note("zero", held_in_words(not_zeroed(*shear.shear_zero_n, needed.weight), on.trial.initial, touched))
    return replace(NO_ERRORS if near * AT_PLATE > 1.0 else shear, said=(said,), borne=touched)


def _gains(on: OnGround, loads: FootLoads, free: Flags, first: Carried | None) -> PlateErrors:
    """What is known of them where the declared contacts may bear, too, as far as it acts at the plates."""
    needed, plates, wrenches = on.trial.needed, on.trial.recording.plates, on.trial.wrenches
    gains = found_gains(needed, plates, wrenches, loads.total_known)
    if not gains.said or first is None or first.found is None or free[loads.total_known].all():
        return gains
    off = [loads.plates[p] for p in np.flatnonzero(gains.gain_error)]
    during = np.asarray(first.bears.any(axis=1))
    near = max(acts_at(first.found, during & own.loaded, own.cop, on.places) for own in off)
    if near < AT_PLATE:
        return gains
    if near * AT_PLATE < 1.0:  # nobody can tell
        return replace(gains, gain=1.0, said=tuple(note("gain", each.text) for each in gains.said))
    return found_gains(needed, plates, wrenches, loads.total_known & free)


def _light_feet(before: FootLoads, loads: FootLoads, beyond: Flags) -> list[Message]:
    """Sentences on feet whose plate was measured and reads next to nothing where something undeclared bears."""
    found = list[Message]()
    for k, foot in enumerate(loads.feet):
        light = (loads.reason[:, k] != before.reason[:, k]) & (before.reason[:, k] == on_plates.MEASURED)
        if (light & ~beyond[:, k]).any():
            text = (
                f"In {np.count_nonzero(light & ~beyond[:, k])} of these frames the {foot} foot's plate reads less "
                f"than {LOADED_N:g} N: what the foot carries there is not known."
            )
            found.append(note("plates", text))
    return found
