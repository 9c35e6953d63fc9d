"""What is known of the ground: when the plates carry all of the person, and which foot's wrench is measured."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from dynakin.errors import RecordingError
from dynakin.filter.carried import carried_in_hands, carried_in_words
from dynakin.filter.declared import may_bear, plate_of_its_own
from dynakin.filter.expected import ContactPaths
from dynakin.filter.plate_clock import UNKNOWN_S, Delay, clock_delay
from dynakin.filter.plate_gain import NO_GAINS, found_gains
from dynakin.filter.plate_motion import (
    Needed,
    apart_in_words,
    brought_into_step,
    drift_in_words,
    fitting_rate,
    out_of_step_in_words,
    plates_delay,
    turned_axes,
    wrong_rate_in_words,
)
from dynakin.filter.plate_sum import MASS_APART, judged_by_motion
from dynakin.filter.shear import NO_SHEAR, VERTICAL_ONLY, Shear, found_shear
from dynakin.messages import Message, about, note, warning
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.recordings.checks import check_plates
from dynakin.recordings.feet import loads as on_plates
from dynakin.recordings.feet.assignment import check_assigned, foot_loads
from dynakin.recordings.feet.loads import FootLoads
from dynakin.recordings.feet.zero_offset import without_offsets
from dynakin.recordings.low_passed import found_low_pass
from dynakin.recordings.plates.axes import turned_feet
from dynakin.recordings.plates.pressure import LOADED_N
from dynakin.recordings.plates.stuck import vertical_only
from dynakin.recordings.recording import Recording
from dynakin.units import GRAVITY_M_S2

Array = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]

CLOCK_UNKNOWN = (
    "Whether plates and markers are in step within some milliseconds is not known here: it takes half a second of a "
    "movement in which the plates carry all of the person, never more than twice the weight, and no declared contact. "
    "Deviations of moments hold a few."
)
SUPPORT = 0.03
"""Part of the weight by which the plates' load would be farther from it without what is read beside the feet: then
that is no zero but a rail or a hand's plate, which bears so much."""
ROUNDS = 3
"""Once single plates are in step, more frames may be known, and others are found not to be; what a body that is not
marked whole shows is drawn towards none, and farther off than the fine search reaches."""
CLOCK_OF_LEGS = ", which may be none: not all of the body is marked. Deviations of moments hold it."


@dataclass(frozen=True, eq=False)
class Ground:
    """What is known of the ground reaction over a recording.

    Attributes:
        loads: of each foot; None of a model that stands on its root.
        undeclared: (T,) frames in which something bears or pulls the person that no plate measures (a seat, a rail, a
            cable), wherever it acts: of the moments only those between the plates and the thighs are known.
        bears: (T, C) frames in which each declared contact bears, or may, where no plate measures it.
        usable: whether the plates are used at all.
        load_ratio: what they carry over what the declared mass needs (`Closure`); None where that is not known.
        shear: by how much the plates' horizontal forces are off.
        off_gain: (T, F) part of its load by which the plate under each foot may be off; None: nothing contradicts it.
        notes: what there is to say. reasons: those of them that say why something is not measured.
        behind_s: by how much the plates lagged behind the markers and were brought into step. clock_sd_s: how far they
            may be out of it still; 0: no farther than usual.
    """

    loads: FootLoads | None
    undeclared: Flags
    bears: Flags
    usable: bool
    load_ratio: float | None
    notes: tuple[Message, ...]
    reasons: tuple[Message, ...]
    shear: Shear = NO_SHEAR
    off_gain: Array | None = None
    behind_s: float = 0.0
    clock_sd_s: float = 0.0


def known_ground(
    recording: Recording,
    initial: CalibratedModel,
    markers: Array,
    wrench: Array,
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
        RecordingError: the plates are refused.
    """
    zeroed, said = _zeroed(recording, initial)
    if zeroed is not recording:
        recording, wrench = zeroed, initial.ground.wrench_to_ground(zeroed.total_wrench())
    ground, known = _in_step(recording, initial, markers, wrench, assigned, tolerance)
    return replace(ground, notes=(*said, *ground.notes)), known


def _zeroed(recording: Recording, initial: CalibratedModel) -> tuple[Recording, list[Message]]:
    """The recording without what its plates read while nobody is on them, with sentences on it; as it is where a
    contact is declared, which may bear on any plate, or where the person weighs no less than all of it."""
    if not initial.feet or initial.contacts:
        return recording, []
    zeroed, said = without_offsets(recording, initial.ground, initial.markers_on_feet)
    if zeroed is recording:
        return recording, said
    loads = [initial.ground.wrench_to_ground(each.total_wrench())[:, 1] for each in (recording, zeroed)]
    before, after = (abs(_median(load) / (initial.weighed_kg * GRAVITY_M_S2) - 1.0) for load in loads)
    bears = before < MASS_APART and after - before > SUPPORT
    return (recording, []) if bears else (zeroed, said)


def _median(load: Array) -> float:
    return float(np.median(load[np.isfinite(load)])) if np.isfinite(load).any() else 0.0


def _in_step(
    recording: Recording,
    initial: CalibratedModel,
    markers: Array,
    wrench: Array,
    assigned: Mapping[str, str] | None,
    tolerance: float | None,
) -> tuple[Ground, Array]:
    """`known_ground` of plates that are at zero while nobody is on them."""
    ground, known = _known_ground(recording, initial, markers, wrench, assigned, tolerance)
    if ground.loads is None or not ground.loads.on.any():
        return ground, known
    whole, moved = not initial.unseen_kg, Delay(ground.behind_s, 0.0)
    for _ in range(ROUNDS):
        plates = _moved(recording, moved).plates
        each = np.stack([initial.ground.wrench_to_ground(plate.wrench) for plate in plates])
        left = clock_delay(initial, recording.time, markers, known, not about(ground.notes, "carried"), each)
        if left is None or not left.worth_it(whole or bool(moved.delay_s)):  # what was found coarsely is known worse
            break
        moved = left.after(moved)
        ground, known = _brought_into_step(recording, initial, markers, moved, assigned, tolerance)
        if whole and not left.apart:
            return ground, known
    if moved.sd_s and moved.worth_it(whole):
        return ground, known
    if moved.sd_s:  # the coarse search had it out of step
        left = moved
        ground, known = _known_ground(recording, initial, markers, wrench, assigned, tolerance, in_step=True)
    if left is None:
        said = () if ground.behind_s else (note("sum of the plates", CLOCK_UNKNOWN),)
        return replace(ground, notes=(*ground.notes, *said), clock_sd_s=ground.clock_sd_s or UNKNOWN_S), known
    if whole:  # the coarse search's deviation gives way to the finer one's
        return (replace(ground, clock_sd_s=left.sd_s) if ground.behind_s else ground), known
    said = () if ground.behind_s else (note("sum of the plates", f"{out_of_step_in_words(left)}{CLOCK_OF_LEGS}"),)
    may_be = float(np.hypot(left.delay_s, left.sd_s))
    return replace(ground, notes=(*ground.notes, *said), clock_sd_s=may_be), known


def _known_ground(
    recording: Recording,
    initial: CalibratedModel,
    markers: Array,
    wrench: Array,
    assigned: Mapping[str, str] | None = None,
    tolerance: float | None = None,
    in_step: bool = False,
) -> tuple[Ground, Array]:
    """`known_ground` of plates that are in step within some milliseconds, or (not ``in_step``) are brought into it."""
    n = recording.n_frames
    loads = _loads_of_feet(recording, initial, assigned)
    paths, may = _declared_contacts(initial, markers)
    taken = None if loads is None else plate_of_its_own(recording, initial, loads, paths, may)
    if taken is not None:
        loads = _loads_of_feet(recording, initial, {**(assigned or {}), taken: next(iter(initial.contacts))})
    by_plate = [loads is not None and name in loads.others for name in initial.contacts]
    may &= ~np.array(by_plate, dtype=bool)
    if not recording.plates:
        text = (
            "No force plates: the ground reaction follows from the motion where one foot may stand, and where both may "
            "how they divide it is assumed; inertial parameters stay as the table has them."
        )
        said = note("plates", text)
        return Ground(loads, np.zeros(n, dtype=bool), may, False, None, (said,), (said,)), wrench
    # steps off the plates: their mean load is no mass
    mass = None if initial.feet else initial.weighed_kg
    steps_kg = initial.weighed_kg if initial.feet and not initial.contacts else None
    check = check_plates(recording, initial.ground, mass, initial.markers_on_feet, loads, steps_kg)
    if check.refusal:
        raise RecordingError(
            f"{recording.plates_file}: {check.refusal}{_how_to_give(initial, loads, check.under_no_foot)}"
        )
    if check.unused:
        ground, nothing = _known_ground(recording.with_plates(()), initial, markers, np.full_like(wrench, np.nan))
        loads = ground.loads
        if loads is not None:  # the recording keeps its plates, with nobody on any
            loads = replace(loads, on=np.zeros((n, len(loads.feet), len(recording.plates)), dtype=bool))
        return replace(ground, loads=loads, notes=(*check.messages, *ground.notes)), nothing
    by_motion, gains, righted = list[Message](), NO_GAINS, None
    shear = Shear(unmeasured=True) if vertical_only(recording) else NO_SHEAR
    if shear.unmeasured and loads is None:
        raise RecordingError(
            f"{recording.plates_file}: the plates measure the vertical force only (horizontal forces are 0, or follow "
            "it), and this model takes all of the force: export the horizontal forces as well"
        )
    if taken is not None:
        by_motion.append(note("plates", _taken_in_words(taken, next(iter(initial.contacts)))))
    all_of_it = wrench
    if loads is not None:
        needed = Needed(initial, recording.time, markers)
        all_of_it = needed.with_horizontal(wrench) if shear.unmeasured else wrench
        if not shear.unmeasured and (wrong := turned_axes(needed, recording.plates, initial, loads.total_known)):
            raise RecordingError(f"{recording.plates_file}: {wrong}")
        total = np.where(loads.total_known[:, None], all_of_it[:, :3], np.nan)
        delay = None if in_step else plates_delay(needed.vertically() if shear.unmeasured else needed, total)
        if delay is not None:
            return _brought_into_step(recording, initial, markers, delay, assigned, tolerance)
        found = None if initial.contacts else fitting_rate(needed, total)
        if found is not None and not (found[1] > 1.0 and found_low_pass(recording)):  # which takes accelerations too
            by_motion.append(warning("rate", wrong_rate_in_words(needed.rate, *found)))
        elif not initial.contacts and (load_kg := carried_in_hands(needed, initial, markers, total)) is not None:
            by_motion.append(warning("carried", carried_in_words(load_kg)))
        elif not initial.contacts and not shear.unmeasured:
            shear = found_shear(needed, total)
            each = np.stack([initial.ground.wrench_to_ground(p.wrench) for p in recording.plates])
            gains = found_gains(needed, recording.plates, each, loads.total_known)
            righted = gains.righted(wrench, each)
            by_motion += [*shear.notes, *gains.notes]
    turned = None if loads is not None else turned_feet(recording.plates, initial.ground, recording.rate)
    wrenches = [shear.zeroed(each) for each in (all_of_it, righted) if each is not None]
    judged = judged_by_motion(recording, initial, markers, wrenches, loads, check, may, by_plate, tolerance)
    notes = [*by_motion, *check.messages, *([warning("plates", f"{turned}.")] if turned else []), *judged.notes]
    reasons = [*([VERTICAL_ONLY] if shear.unmeasured else []), *judged.reasons]
    undeclared = judged.undeclared
    if loads is not None:
        before = loads
        loads = loads.with_borne(np.asarray(judged.bears.any(axis=1))).with_undeclared(undeclared)
        loads = loads.without(judged.beyond)
        reasons += _light_feet(before, loads, judged.beyond)
    partly = undeclared if loads is None else ~loads.total_known | shear.unmeasured
    wrench = np.where(partly[:, None], np.nan, wrench)
    used = int(np.count_nonzero(np.isfinite(wrench).all(axis=1)))
    if loads is not None or used < n:
        notes.append(note("plates", f"The total wrench is measured in {used} of {n} frames."))
    notes += reasons
    texts = tuple(notes), tuple(reasons)
    off_gain = None if loads is None or not gains.notes else gains.of_feet(loads)
    return Ground(loads, undeclared, judged.bears, used > 0, judged.load_ratio, *texts, shear, off_gain), wrench


def _loads_of_feet(
    recording: Recording, initial: CalibratedModel, assigned: Mapping[str, str] | None
) -> FootLoads | None:
    """What each foot carries by feet and plates; None of a model that stands on its root."""
    if not initial.feet:  # it takes all plates together, and is told wrong names all the same
        check_assigned(assigned or {}, recording, ("right", "left"))
        return None
    loads = foot_loads(
        recording, initial.ground, initial.markers_on_feet, assigned=assigned, others=list(initial.contacts)
    )
    if not initial.unmarked_feet:
        return loads
    hidden = np.isin(loads.feet, list(initial.unmarked_feet))
    loads = loads.without(np.tile(hidden, (recording.n_frames, 1)))
    text = (
        f"No markers of the {' and the '.join(initial.unmarked_feet)} foot that show where it stands: what it carries "
        "is not known. Moments are those of a leg whose own foot is on a plate, or in the air."
    )
    return replace(loads, reasons=(*loads.reasons, note("plates", text)))


def _declared_contacts(initial: CalibratedModel, markers: Array) -> tuple[Array, Flags]:
    """(T, 1 + C, 3) m where the root and the declared contacts are, NaN where none is declared; (T, C) frames in which
    each of these may bear."""
    if not initial.contacts:
        return np.full((len(markers), 1, 3), np.nan), np.zeros((len(markers), 0), dtype=bool)
    paths = ContactPaths.of(initial).at(markers)
    floor = float(np.nanmin(markers[..., 1]))
    return paths, may_bear(initial, paths, floor, float(paths[:, 0, 1].max()) - floor)


def _taken_in_words(plate: str, contact: str) -> str:
    return (
        f"{plate} is taken as the {contact}'s: no foot stands on it, and it presses where the {contact} is. If it is "
        f'not, name whose it is in a configuration: plates = {{ "{plate}" = "right" }}.'
    )


def _how_to_give(initial: CalibratedModel, loads: FootLoads | None, plate: str | None) -> str:
    """What to do about a plate that is refused for where it is pressed while a declared contact has none."""
    names = [name for name in initial.contacts if loads is not None and name not in loads.others]
    if not names or plate is None:
        return ""
    return f'. If {plate} bears the {names[0]}, say so in a configuration: plates = {{ "{plate}" = "{names[0]}" }}'


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


def _moved(recording: Recording, delay: Delay) -> Recording:
    lags = delay.lags(recording.time) if delay.drift else delay.delay_s
    return brought_into_step(recording, lags, delay.apart) if delay.worth_it(True) else recording


def _brought_into_step(
    recording: Recording,
    initial: CalibratedModel,
    markers: Array,
    delay: Delay,
    assigned: Mapping[str, str] | None,
    tolerance: float | None,
) -> tuple[Ground, Array]:
    """`known_ground` of what the plates say so much later, with a sentence on it."""
    there = _moved(recording, delay)
    wrench = initial.ground.wrench_to_ground(there.total_wrench())
    ground, known = _known_ground(there, initial, markers, wrench, assigned, tolerance, in_step=True)
    found = drift_in_words(delay, recording.time) if delay.drift else out_of_step_in_words(delay)
    if delay.apart:
        found = apart_in_words(delay, [plate.name for plate in recording.plates])
    words = f"{found}; they were brought into step."
    said = note("in step", words)
    if delay.drift:
        said = warning("rate", f"{words} Correct the rate, or the times, in the file that is wrong.")
    elif delay.apart:
        said = warning("in step", words)
    elif initial.unseen_kg:
        said = warning("in step", f"{words} Not all of the body is marked, so that no better is known.")
    return replace(ground, notes=(said, *ground.notes), behind_s=delay.delay_s, clock_sd_s=delay.sd_s), known
