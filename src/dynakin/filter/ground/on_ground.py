"""Who stands where, by feet and plates, as the recording has them or in step."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from dynakin.arrays import Array, Flags
from dynakin.errors import RecordingError
from dynakin.filter.ground.axes import turned_axes
from dynakin.filter.ground.declared import declared_contacts, plates_of_their_own
from dynakin.filter.ground.delay import Delay, brought_into_step, noise_in_step, plates_delay
from dynakin.filter.ground.needed import Needed
from dynakin.filter.ground.plate_errors import NO_ERRORS, PlateErrors
from dynakin.filter.ground.plate_noise import found_noise
from dynakin.filter.samples import total_wrench
from dynakin.messages import note
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.recordings.checks import PlateCheck, check_plates
from dynakin.recordings.feet.assignment import check_assigned, foot_loads
from dynakin.recordings.feet.loads import FootLoads
from dynakin.recordings.plates.stuck import vertical_only
from dynakin.recordings.recording import Recording
from dynakin.results.naming import sentence

_CORRECT_MOMENTS = (
    "Correct the signs or the order of the plates' channels, or of their corners, in this file; if something else "
    "presses the plate, declare it (--contact)"
)


@dataclass(frozen=True, eq=False)
class GroundTrial:
    """What is judged: a recording's plates by its motion; assigned, tolerance: as for `known_ground`; noise: of the
    plates, as it was before they were brought into step, which hides it (`found_noise`)."""

    recording: Recording
    needed: Needed
    assigned: Mapping[str, str] | None
    tolerance: float | None
    noise: PlateErrors = NO_ERRORS

    @property
    def initial(self) -> CalibratedModel:
        """The person."""
        return self.needed.initial

    @cached_property
    def wrench(self) -> Array:
        """(T, 6) N and N m of all plates, ground frame; NaN where one of them is not measured."""
        return total_wrench(self.recording, self.initial, lacking=True)

    @cached_property
    def wrenches(self) -> Array:
        """(P, T, 6) of each plate."""
        return np.stack([self.initial.ground.wrench_to_ground(plate.wrench) for plate in self.recording.plates])

    def in_step(self, delay: Delay) -> GroundTrial:
        """The same of what the plates say so much later."""
        white = self.noise.noise
        if white is not None:
            white = noise_in_step(self.recording, delay)[:, None, None] * white
        noise = replace(self.noise, noise=white)
        return replace(self, recording=brought_into_step(self.recording, delay), noise=noise)

    def with_noise(self) -> GroundTrial:
        """The same with the noise that these plates show."""
        if not self.recording.plates:
            return self
        return replace(self, noise=found_noise(self.wrenches, [plate.name for plate in self.recording.plates]))

    def without_plates(self) -> GroundTrial:
        """The same of the markers alone."""
        return replace(self, recording=self.recording.with_plates(()), assigned=None, noise=NO_ERRORS)


@dataclass(frozen=True, eq=False)
class OnGround:
    """Who stands where, by feet and plates.

    Attributes:
        loads: of each foot; None of a model that stands on its root.
        paths: (T, 1 + C, 3) m where the root and the declared contacts are.
        may: (T, C) frames in which each of these may bear. by_plate: (C,) those that a plate measures; taken:
            plates that are theirs though nobody said so.
        check: of the plates; None without any. errors: what is known of theirs before they are judged.
    """

    trial: GroundTrial
    loads: FootLoads | None
    paths: Array
    may: Flags
    by_plate: list[bool]
    taken: Mapping[str, tuple[str, ...]]
    check: PlateCheck | None = None
    errors: PlateErrors = NO_ERRORS

    @staticmethod
    def of(trial: GroundTrial) -> OnGround:
        """Of a trial.

        Raises:
            RecordingError: the plates are refused.
        """
        recording, initial = trial.recording, trial.initial
        paths, may = declared_contacts(initial, trial.needed.markers)
        places = {name: paths[:, 1 + c] for c, name in enumerate(initial.contacts)}
        loads = _loads_of_feet(trial, places)
        taken = dict[str, tuple[str, ...]]()
        if loads is not None and initial.contacts and recording.plates:
            taken = plates_of_their_own(recording, initial, loads, paths, may, trial.assigned or {})
            loads = _loads_of_feet(trial, places, taken) if taken else loads
        by_plate = [loads is not None and name in loads.others for name in initial.contacts]
        may &= ~np.array(by_plate, dtype=bool)
        found = OnGround(trial, loads, paths, may, by_plate, taken)
        if not recording.plates:
            return found
        # steps off the plates: their mean load is no mass
        mass = None if initial.feet else initial.weighed_kg
        steps_kg = initial.weighed_kg if initial.feet and not initial.contacts else None
        check = check_plates(recording, initial.ground, mass, initial.foot_markers, loads, steps_kg)
        turned = "" if loads is None or initial.contacts else loads.turned_moments
        turned = f"{turned}. {_CORRECT_MOMENTS}" if turned else ""
        if check.refusal:
            why = f". {sentence(turned)}" if turned else _how_to_give(initial, loads, check.under_no_foot)
            raise RecordingError(f"{recording.plates_file}: {check.refusal}{why}")
        if check.unused:
            return replace(found, check=check)
        errors = PlateErrors(unmeasured=True) if vertical_only(recording) else NO_ERRORS
        if errors.unmeasured and loads is None:
            raise RecordingError(
                f"{recording.plates_file}: the plates measure the vertical force only (horizontal forces are 0, or "
                "follow it), and this model takes all of the force: export the horizontal forces as well"
            )
        known = None if loads is None or errors.unmeasured else loads.total_known
        if known is not None and (wrong := turned_axes(trial.needed, recording.plates, known)):
            raise RecordingError(f"{recording.plates_file}: {wrong}")
        if turned:  # by the forces as well where the corners are
            raise RecordingError(f"{recording.plates_file}: {turned}")
        return replace(found, check=check, errors=errors)

    def coarse_delay(self) -> Delay | None:
        """By how much the plates lag, to some milliseconds; None where they are in step, or nothing can be said."""
        if self.loads is None or self.check is None or self.check.unused:
            return None
        needed = self.trial.needed
        return plates_delay(needed.vertically() if self.errors.unmeasured else needed, self.total(self.loads))

    @property
    def unmeasured(self) -> list[int]:
        """Declared contacts that no plate measures."""
        return [c for c, measured in enumerate(self.by_plate) if not measured]

    @property
    def places(self) -> Array:
        """(T, C, 3) m of those."""
        return self.paths[:, [1 + c for c in self.unmeasured]]

    @property
    def all_of_it(self) -> Array:
        """The total wrench (T, 6), with the motion's horizontal force where plates have none."""
        wrench = self.trial.wrench
        return self.trial.needed.with_horizontal(wrench) if self.errors.unmeasured else wrench

    def total(self, loads: FootLoads) -> Array:
        """(T, 3) N of all plates, where that is all that bears the person; NaN elsewhere."""
        return np.where(loads.total_known[:, None], self.all_of_it[:, :3], np.nan)


def _loads_of_feet(
    trial: GroundTrial, places: Mapping[str, Array], taken: Mapping[str, tuple[str, ...]] | None = None
) -> FootLoads | None:
    """What each foot carries by feet and plates, of which some are taken as declared contacts'; None of a model that
    stands on its root."""
    recording, initial, assigned = trial.recording, trial.initial, trial.assigned
    if not initial.feet:  # it takes all plates together, and is told wrong names all the same
        check_assigned(assigned or {}, recording, ("right", "left"))
        return None
    loads = foot_loads(
        recording,
        initial.ground,
        initial.foot_markers,
        assigned=assigned,
        others=list(initial.contacts),
        given=taken,
        places=places,
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
