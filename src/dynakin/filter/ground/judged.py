"""What feet, plates and the motion say of the ground, of plates that are in step: who stands where, and whether that
carries the person."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from dynakin.errors import RecordingError
from dynakin.filter.ground.axes import turned_axes
from dynakin.filter.ground.beyond_feet import beyond_in_words, beyond_the_feet
from dynakin.filter.ground.carried import (
    carried_in_hands,
    carried_in_words,
    in_hands_in_words,
    more_than_the_mass,
    unseen_in_hands,
)
from dynakin.filter.ground.coarse_delay import plates_delay
from dynakin.filter.ground.declared import (
    AT_PLATE,
    acts_at,
    declared_contacts,
    held_in_words,
    low_beside_feet,
    plates_of_their_own,
    taken_in_words,
)
from dynakin.filter.ground.delay import Delay, brought_into_step
from dynakin.filter.ground.gain import NO_GAINS, PlateGains, found_gains
from dynakin.filter.ground.needed import Needed
from dynakin.filter.ground.plate_sum import Carried, doubtful_mass, judged_by_motion
from dynakin.filter.ground.rate import fitting_rate, wrong_rate_in_words
from dynakin.filter.ground.shear import NO_SHEAR, VERTICAL_ONLY, Shear, found_shear, not_zeroed
from dynakin.messages import Message, about, note, warning
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.recordings.checks import PlateCheck, check_plates
from dynakin.recordings.feet import loads as on_plates
from dynakin.recordings.feet.assignment import check_assigned, foot_loads
from dynakin.recordings.feet.loads import FootLoads
from dynakin.recordings.low_passed import found_low_pass
from dynakin.recordings.plates.axes import turned_feet
from dynakin.recordings.plates.ground_plate import GroundPlate
from dynakin.recordings.plates.pressure import LOADED_N, pressed_at
from dynakin.recordings.plates.stuck import vertical_only
from dynakin.recordings.recording import Recording
from dynakin.settings.contacts import SEAT

Array = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]


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
        in_hands_kg: what the plates carry more than the mass, where that is more than they are usually off by: the
            hands may hold it.
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
    in_hands_kg: float = 0.0


@dataclass(frozen=True, eq=False)
class GroundTrial:
    """What is judged: markers (T, M, 3) m, of the model, ground frame; assigned, tolerance: as for `known_ground`."""

    recording: Recording
    initial: CalibratedModel
    markers: Array
    assigned: Mapping[str, str] | None
    tolerance: float | None

    @cached_property
    def wrench(self) -> Array:
        """(T, 6) N and N m of all plates, ground frame; NaN where one of them is not measured."""
        if not self.recording.plates:
            return np.full((self.recording.n_frames, 6), np.nan)
        total = self.initial.ground.wrench_to_ground(self.recording.total_wrench())
        return np.where(np.isfinite(total).all(axis=1, keepdims=True), total, np.nan)

    @cached_property
    def wrenches(self) -> Array:
        """(P, T, 6) of each plate."""
        return np.stack([self.initial.ground.wrench_to_ground(plate.wrench) for plate in self.recording.plates])

    def in_step(self, delay: Delay) -> GroundTrial:
        """The same of what the plates say so much later."""
        return replace(self, recording=brought_into_step(self.recording, delay))

    def without_plates(self) -> GroundTrial:
        """The same of the markers alone."""
        return replace(self, recording=self.recording.with_plates(()), assigned=None)


@dataclass(frozen=True, eq=False)
class OnGround:
    """Who stands where, by feet and plates.

    Attributes:
        loads: of each foot; None of a model that stands on its root.
        paths: (T, 1 + C, 3) m where the root and the declared contacts are.
        may: (T, C) frames in which each of these may bear. by_plate: (C,) those that a plate measures; taken:
            plates that are theirs though nobody said so.
        check: of the plates; None without any. shear: what is known of their horizontal forces before they are judged.
        needed: what the motion needs; None of a model that stands on its root.
    """

    trial: GroundTrial
    loads: FootLoads | None
    paths: Array
    may: Flags
    by_plate: list[bool]
    taken: Mapping[str, tuple[str, ...]]
    check: PlateCheck | None
    shear: Shear
    needed: Needed | None

    @staticmethod
    def of(trial: GroundTrial) -> OnGround:
        """Of a trial.

        Raises:
            RecordingError: the plates are refused.
        """
        recording, initial = trial.recording, trial.initial
        loads = _loads_of_feet(trial)
        paths, may = declared_contacts(initial, trial.markers)
        taken = dict[str, tuple[str, ...]]()
        if loads is not None and initial.contacts and recording.plates:
            taken = plates_of_their_own(recording, initial, loads, paths, may, trial.assigned or {})
            loads = _loads_of_feet(trial, taken) if taken else loads
        by_plate = [loads is not None and name in loads.others for name in initial.contacts]
        may &= ~np.array(by_plate, dtype=bool)
        found = OnGround(trial, loads, paths, may, by_plate, taken, None, NO_SHEAR, None)
        if not recording.plates:
            return found
        # steps off the plates: their mean load is no mass
        mass = None if initial.feet else initial.weighed_kg
        steps_kg = initial.weighed_kg if initial.feet and not initial.contacts else None
        check = check_plates(recording, initial.ground, mass, initial.markers_on_feet, loads, steps_kg)
        if check.refusal:
            raise RecordingError(
                f"{recording.plates_file}: {check.refusal}{_how_to_give(initial, loads, check.under_no_foot)}"
            )
        if check.unused:
            return replace(found, check=check)
        shear = Shear(unmeasured=True) if vertical_only(recording) else NO_SHEAR
        if shear.unmeasured and loads is None:
            raise RecordingError(
                f"{recording.plates_file}: the plates measure the vertical force only (horizontal forces are 0, or "
                "follow it), and this model takes all of the force: export the horizontal forces as well"
            )
        needed = None if loads is None else Needed(initial, recording.time, trial.markers)
        if needed is not None and loads is not None and not shear.unmeasured:
            wrong = turned_axes(needed, recording.plates, initial, loads.total_known)
            if wrong:
                raise RecordingError(f"{recording.plates_file}: {wrong}")
        return replace(found, check=check, shear=shear, needed=needed)

    def coarse_delay(self) -> Delay | None:
        """By how much the plates lag, to some milliseconds; None where they are in step, or nothing can be said."""
        if self.needed is None or self.loads is None:
            return None
        needed = self.needed.vertically() if self.shear.unmeasured else self.needed
        return plates_delay(needed, self._total(self.loads, self.needed))

    def judged(self) -> tuple[Ground, Array]:
        """Whether that carries the person, by the motion as well; and the total wrench (T, 6), NaN where it does
        not."""
        if self.check is None:
            return self._without_plates()
        if self.check.unused:
            ground, nothing = OnGround.of(self.trial.without_plates()).judged()
            loads = ground.loads
            if loads is not None:  # the recording keeps its plates, with nobody on any
                on = np.zeros((len(nothing), len(loads.feet), len(self.trial.recording.plates)), dtype=bool)
                loads = replace(loads, on=on)
            return replace(ground, loads=loads, notes=(*self.check.messages, *ground.notes)), nothing
        return self._by_motion(self.check)

    def _without_plates(self) -> tuple[Ground, Array]:
        text = (
            "No force plates: the ground reaction follows from the motion where one foot may stand, and where both may "
            "how they divide it is assumed; inertial parameters stay as the table has them."
        )
        said, wrench = note("plates", text), self.trial.wrench
        initial, recording = self.trial.initial, self.trial.recording
        if self.loads is None or initial.contacts:
            return Ground(
                self.loads, np.zeros(len(wrench), dtype=bool), self.may, False, None, (said,), (said,)
            ), wrench
        beyond = beyond_the_feet(initial, recording, self.trial.markers)
        texts = (said, *([beyond_in_words(beyond, recording.time)] if beyond.any() else []))
        loads = self.loads.with_undeclared(beyond)
        return Ground(loads, beyond, self.may, False, None, texts, texts), wrench

    def _by_motion(self, check: PlateCheck) -> tuple[Ground, Array]:
        trial, loads, n = self.trial, self.loads, self.trial.recording.n_frames
        recording, initial = trial.recording, trial.initial
        notes, shear, gains, borne = list[Message](), self.shear, NO_GAINS, np.zeros(self.may.shape[1], dtype=bool)
        notes += [note("plates", taken_in_words(plate, own)) for plate, own in self.taken.items()]
        wrench = trial.wrench
        all_of_it, righted = wrench, None
        if self.needed is not None and loads is not None:
            all_of_it = self._all_of_it(self.needed)
            first = None
            if self._unmeasured:
                first = judged_by_motion(
                    recording, initial, trial.markers, [all_of_it], loads, check, self.may, self.by_plate, None
                )
            said, shear, gains, borne = self._sensors(self.needed, loads, first)
            notes += said
            righted = gains.righted(wrench, trial.wrenches)
        turned = None if loads is not None else turned_feet(recording.plates, initial.ground, recording.rate)
        wrenches = [shear.zeroed(each) for each in (all_of_it, righted) if each is not None]
        judged = judged_by_motion(
            recording, initial, trial.markers, wrenches, loads, check, self.may, self.by_plate, trial.tolerance
        )
        judged = judged._replace(bears=judged.bears | (self.may & borne))
        if loads is not None and self._unmeasured:
            loads, low = low_beside_feet(recording, initial, loads, self._places, judged.bears, self._unmeasured)
            judged = judged._replace(bears=judged.bears | low)
        notes += [*check.messages, *([warning("plates", f"{turned}.")] if turned else []), *judged.notes]
        in_hands_kg = 0.0 if loads is None else more_than_the_mass(initial, judged.load_ratio)
        unseen = [c for c in self._unmeasured if (self.may & ~judged.bears)[:, c].any()]
        held_kg = 0.0 if loads is None else unseen_in_hands(initial, unseen)
        doubted = doubtful_mass(wrench, initial.weighed_kg, judged.load_ratio, initial.unseen_kg)  # which says it, too
        if in_hands_kg and not about(notes, "carried") and doubted is None:
            notes.append(note("carried", in_hands_in_words(in_hands_kg)))
        reasons = [*([VERTICAL_ONLY] if shear.unmeasured else []), *judged.reasons]
        reasons += [] if loads is None else [said for said in loads.reasons if said not in judged.reasons]
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
        found = Ground(loads, undeclared, judged.bears, used > 0, judged.load_ratio, *texts, shear, off_gain)
        return replace(found, in_hands_kg=max(in_hands_kg, held_kg)), wrench

    @property
    def _unmeasured(self) -> list[int]:
        """Declared contacts that no plate measures."""
        return [c for c, measured in enumerate(self.by_plate) if not measured]

    @property
    def _places(self) -> Array:
        """(T, C, 3) m of those."""
        return self.paths[:, [1 + c for c in self._unmeasured]]

    def _sensors(
        self, needed: Needed, loads: FootLoads, first: Carried | None
    ) -> tuple[list[Message], Shear, PlateGains, Flags]:
        """What the motion says of the rate, of what is carried, or else of the plates' horizontal forces and gains,
        where no declared contact may bear that bears at all; and (C,) the contacts that it is laid to.

        Args:
            first: what is known if all that the plates lack is the declared contacts'; None where none is declared.
        """
        initial, recording = self.trial.initial, self.trial.recording
        bears = np.zeros_like(self.may) if first is None else first.bears & loads.total_known[:, None]
        free: Flags = np.asarray(~(self.may & bears.any(axis=0)).any(axis=1))
        touched = np.array([name != SEAT for name in initial.contacts], dtype=bool) & self.may[free].any(axis=0)
        nobody = np.zeros_like(touched)
        total = np.where(free[:, None], self._total(loads, needed), np.nan)
        found = fitting_rate(needed, total)
        if found is not None and not (found[1] > 1.0 and found_low_pass(recording)):  # which takes accelerations too
            return [warning("rate", wrong_rate_in_words(needed.rate, *found))], self.shear, NO_GAINS, nobody
        if (load_kg := carried_in_hands(needed, initial, self.trial.markers, total)) is not None:
            if not touched.any():
                return [warning("carried", carried_in_words(load_kg))], self.shear, NO_GAINS, nobody
            load = f"The plates' force changes as if about {load_kg:.0f} kg were carried in the hands"
            return [note("carried", held_in_words(load, initial, touched))], self.shear, NO_GAINS, touched
        if self.shear.unmeasured:
            return [], self.shear, NO_GAINS, nobody
        shear = found_shear(needed, total)
        if first is not None and first.found is not None:
            whole = found_shear(needed, self._total(loads, needed))
            near = acts_at(first.found, loads.total_known, pressed_at(self.trial.wrench), self._places, mean=True)
            if any(whole.zero) and near < AT_PLATE:
                shear = whole  # the plates', whoever is declared
            elif any(shear.zero) and touched.any():
                said = [note("zero", held_in_words(not_zeroed(*shear.zero, needed.weight), initial, touched))]
                return said, NO_SHEAR if near * AT_PLATE > 1.0 else replace(shear, notes=()), NO_GAINS, touched
        gains = self._gains(needed, loads, free, first)
        return [*shear.notes, *gains.notes], shear, gains, nobody

    def _gains(self, needed: Needed, loads: FootLoads, free: Flags, first: Carried | None) -> PlateGains:
        """What is known of them where the declared contacts may bear, too, as far as it acts at the plates."""
        plates, wrenches = self.trial.recording.plates, self.trial.wrenches
        gains = found_gains(needed, plates, wrenches, loads.total_known)
        if not gains.notes or first is None or first.found is None or free[loads.total_known].all():
            return gains
        off = [GroundPlate.of(plates[p], self.trial.initial.ground) for p in np.flatnonzero(gains.off)]
        during = np.asarray(first.bears.any(axis=1))
        near = max(acts_at(first.found, during & own.loaded, own.cop, self._places) for own in off)
        if near < AT_PLATE:
            return gains
        if near * AT_PLATE < 1.0:  # nobody can tell
            return PlateGains(gains.off, np.ones(len(plates)), tuple(note("gain", each.text) for each in gains.notes))
        return found_gains(needed, plates, wrenches, loads.total_known & free)

    def _all_of_it(self, needed: Needed) -> Array:
        """The total wrench (T, 6), with the motion's horizontal force where plates have none."""
        wrench = self.trial.wrench
        return needed.with_horizontal(wrench) if self.shear.unmeasured else wrench

    def _total(self, loads: FootLoads, needed: Needed) -> Array:
        """(T, 3) N of all plates, where that is all that bears the person; NaN elsewhere."""
        return np.where(loads.total_known[:, None], self._all_of_it(needed)[:, :3], np.nan)


def _loads_of_feet(trial: GroundTrial, taken: Mapping[str, tuple[str, ...]] | None = None) -> FootLoads | None:
    """What each foot carries by feet and plates, of which some are taken as declared contacts'; None of a model that
    stands on its root."""
    recording, initial, assigned = trial.recording, trial.initial, trial.assigned
    if not initial.feet:  # it takes all plates together, and is told wrong names all the same
        check_assigned(assigned or {}, recording, ("right", "left"))
        return None
    loads = foot_loads(
        recording,
        initial.ground,
        initial.markers_on_feet,
        assigned=assigned,
        others=list(initial.contacts),
        given=taken,
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


def _how_to_give(initial: CalibratedModel, loads: FootLoads | None, plate: str | None) -> str:
    """What to do about a plate that is refused for where it is pressed: something else than a foot may bear on it."""
    names = [name for name in initial.contacts if loads is not None and name not in loads.others]
    if plate is None or not initial.feet:
        return ""
    if not initial.contacts:
        return (
            f". If a chair, a hand or a knee is on {plate}, declare it (--contact seat, hand_right or knee=shank_l), "
            "else the plate's place or its unit is wrong, or the forces are of another trial, or in other axes than "
            "the markers (turned about the vertical, say)"
        )
    if not names:
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
