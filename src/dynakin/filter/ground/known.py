"""What is known of the ground: when the plates carry all of the person, and which foot's wrench is measured."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from dynakin.arrays import Array
from dynakin.errors import ConfigError
from dynakin.filter.ground.carried import says_carried
from dynakin.filter.ground.delay import IN_STEP, Delay, apart_in_words, drift_in_words, out_of_step_in_words
from dynakin.filter.ground.fine_delay import UNKNOWN_S, clock_delay
from dynakin.filter.ground.ground import Ground
from dynakin.filter.ground.judged import judged
from dynakin.filter.ground.needed import Needed
from dynakin.filter.ground.on_ground import GroundTrial, OnGround
from dynakin.filter.ground.plate_errors import NO_ERRORS, PlateErrors
from dynakin.filter.ground.plate_sum import MASS_APART, Empty, doubtful_mass, mean_load_kg
from dynakin.filter.ground.turn import found_turn
from dynakin.messages import Message, about, note, warning
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.recordings.feet.zero_offset import without_blanks, without_offsets
from dynakin.recordings.recording import Recording
from dynakin.units import GRAVITY_M_S2

SUPPORT = 0.03
"""Part of the weight by which the plates' load would be farther from it without what is read beside the feet: then
that is no zero but a rail or a hand's plate, which bears so much."""
ROUNDS = 3
"""Once single plates are in step, more frames may be known, and others are found not to be; what a body that is not
marked whole shows is drawn towards none, and farther off than the fine search reaches."""
CLOCK_UNKNOWN = (
    "Whether plates and markers are in step within some milliseconds is not known here: it takes half a second of a "
    "movement in which the plates carry all of the person, never more than twice the weight, and no declared contact. "
    "Deviations of moments and of the feet's forces hold a few."
)
CLOCK_OF_LEGS = (
    ", which may be none: not all of the body is marked. Deviations of moments and of the feet's forces hold it."
)


def known_ground(
    recording: Recording,
    initial: CalibratedModel,
    markers: Array,
    assigned: Mapping[str, str] | None = None,
    tolerance: float | None = None,
) -> tuple[Ground, Array]:
    """What is known of the ground, and the total wrench (T, 6) without (NaN) the frames in which the plates do not
    carry all of the person; of plates that are in step, or brought into it.

    Args:
        markers: (T, M, 3) m, of the model, ground frame. assigned: plate -> foot, as for `foot_loads`.
        tolerance: part of the weight by which the plates' mean may differ where `closure` cannot judge; None: nobody
            asks.

    Raises:
        ConfigError: a plate is given to one foot, or contact, and another foot stands on it.
        RecordingError: the plates are refused.
    """
    trial, zeros = _zeroed(GroundTrial(recording, Needed(initial, recording.time, markers), assigned, tolerance))
    trial = trial.with_noise()
    as_it_is = OnGround.of(trial)
    coarse = as_it_is.coarse_delay()
    on_ground = as_it_is if coarse is None else OnGround.of(trial.in_step(coarse))
    ground, known = judged(on_ground)
    clock = _Clock(coarse, 0.0 if coarse is None else coarse.sd_s, ())
    if ground.loads is not None and ground.loads.on.any():
        turn = NO_ERRORS if about(ground.notes, "rate") or says_carried(ground.notes) else _turn(on_ground, known)
        clock, ground, known = _in_step(as_it_is, coarse, on_ground, ground, known, not turn.said)
        ground = ground if ground.loads is None else ground.with_turn(turn)
    if ground.loads is not None and ground.loads.misgiven:  # in step: late plates are pressed where nobody is any more
        raise ConfigError(ground.loads.misgiven)
    moved = () if clock.taken is None else (_taken_in_words(clock.taken, recording, not initial.unseen_kg),)
    behind_s = 0.0 if clock.taken is None else clock.taken.delay_s
    notes = (*zeros, *moved, *ground.notes, *clock.notes)
    load_kg = mean_load_kg(known, least=50) if ground.load_ratio is None else ground.load_ratio * initial.weighed_kg
    doubt = None if load_kg is None else doubtful_mass(initial, load_kg, Empty.of(trial.recording.plates, known))
    return replace(ground, notes=notes, behind_s=behind_s, clock_sd_s=clock.sd_s, doubt=doubt), known


def _turn(on_ground: OnGround, known: Array) -> PlateErrors:
    """What is wrong with the plates' moment about the vertical, which looks like a delay as well."""
    trial = on_ground.trial
    return found_turn(trial.needed, known, trial.wrenches, [plate.name for plate in trial.recording.plates])


class _Clock(NamedTuple):
    """What delay is taken off the plates (None: none), how far they may be out of step still, and what there is to say
    of it."""

    taken: Delay | None
    sd_s: float
    notes: tuple[Message, ...]


def _in_step(
    as_it_is: OnGround, coarse: Delay | None, on_ground: OnGround, ground: Ground, known: Array, turns: bool
) -> tuple[_Clock, Ground, Array]:
    """How far the plates are out of step, to a millisecond or two where the movement shows it, and what is known of
    the ground once they are not.

    Args:
        coarse: the delay that ``on_ground``, and what was judged of it (``ground``, ``known`` (T, 6)), are without.
        turns: whether the plates' moment about the vertical is to be believed.
    """
    trial, initial = as_it_is.trial, as_it_is.trial.initial
    whole, fine, left = not initial.unseen_kg, None, None
    for _ in range(ROUNDS):
        plates = on_ground.trial.wrenches
        left = clock_delay(trial.needed, known, not says_carried(ground.notes), plates, turns)
        if left is None or not left.worth_it(whole or coarse is not None or fine is not None):
            break
        fine = left.after(fine or coarse or IN_STEP)
        on_ground = OnGround.of(trial.in_step(fine))
        ground, known = judged(on_ground)
        if whole and not left.apart:
            break
    if fine is not None and fine.worth_it(whole):
        return _Clock(fine, fine.sd_s, ()), ground, known
    if fine is not None:  # the coarse search had them out of step
        left, coarse = fine, None
        ground, known = judged(as_it_is)
    if left is None:
        said = () if coarse else (note("sum of the plates", CLOCK_UNKNOWN),)
        return _Clock(coarse, coarse.sd_s if coarse else UNKNOWN_S, said), ground, known
    if whole:  # the coarse search's deviation gives way to the finer one's
        return _Clock(coarse, left.sd_s if coarse else 0.0, ()), ground, known
    said = () if coarse else (note("sum of the plates", f"{out_of_step_in_words(left)}{CLOCK_OF_LEGS}"),)
    return _Clock(coarse, float(np.hypot(left.delay_s, left.sd_s)), said), ground, known


def _taken_in_words(delay: Delay, recording: Recording, whole: bool) -> Message:
    """That the plates were brought into step."""
    if delay.drift:
        found = drift_in_words(delay, recording.time)
        text = f"{found}; they were brought into step. Correct the rate, or the times, in the file that is wrong."
        return warning("rate", text)
    if delay.apart:
        found = apart_in_words(delay, [plate.name for plate in recording.plates])
        return warning("in step", f"{found}; they were brought into step.")
    text = f"{out_of_step_in_words(delay)}; they were brought into step."
    if whole:
        return note("in step", text)
    return warning("in step", f"{text} Not all of the body is marked, so that no better is known.")


def _zeroed(trial: GroundTrial) -> tuple[GroundTrial, list[Message]]:
    """The trial without what its plates read, or do not, while nobody is on them, with sentences on it; as it is where
    a contact is declared, which may bear on any plate, or where the person weighs no less than all of it."""
    initial = trial.initial
    if not initial.feet or initial.contacts:
        return trial, []
    recording, blanks = without_blanks(trial.recording, initial.ground, initial.foot_markers)
    trial = replace(trial, recording=recording)
    recording, said = without_offsets(recording, initial.ground, initial.foot_markers)
    said = [*blanks, *said]
    if recording is trial.recording:
        return trial, said
    zeroed = replace(trial, recording=recording)
    before, after = (abs(_median_load(each) / (initial.weighed_kg * GRAVITY_M_S2) - 1.0) for each in (trial, zeroed))
    bears = before < MASS_APART and after - before > SUPPORT
    return (trial, blanks) if bears else (zeroed, said)


def _median_load(trial: GroundTrial) -> float:
    """N, of all plates."""
    load = trial.wrench[:, 1]
    return float(np.median(load[np.isfinite(load)])) if np.isfinite(load).any() else 0.0
