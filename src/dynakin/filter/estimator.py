"""The estimator: a model and how it is estimated. `run` takes recordings; `start` gives a tracker for live use."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from dynakin.arrays import Array
from dynakin.blas import one_blas_thread
from dynakin.errors import ConfigError, RecordingError
from dynakin.filter.assemble import assemble
from dynakin.filter.contacts import ContactLoads
from dynakin.filter.ground.expected import ContactPaths, expected_loads
from dynakin.filter.ground.ground import Ground
from dynakin.filter.ground.known import known_ground
from dynakin.filter.ground.place import off_place
from dynakin.filter.measurements import Measurements
from dynakin.filter.passes import passes
from dynakin.filter.prepared import Prepared
from dynakin.filter.samples import marker_paths, total_wrench
from dynakin.filter.tracker import Tracker
from dynakin.filter.uncertainty.locked import with_locked
from dynakin.filter.uncertainty.skin import skin_found
from dynakin.filter.uncertainty.upright import hips_turned
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.model.calibration.declared import with_contacts, with_loads
from dynakin.model.calibration.how import Calibration
from dynakin.model.definition import Definition
from dynakin.model.identified import IdentifiedSubject, with_identified
from dynakin.progress import Progress
from dynakin.recordings.limits import rate_problem
from dynakin.recordings.low_passed import found_low_pass
from dynakin.recordings.recording import Recording
from dynakin.results.estimate import Estimate
from dynakin.results.measures.tracking import without_lost
from dynakin.results.records import FOLLOWING
from dynakin.settings import presets
from dynakin.settings.contacts import DeclaredContact, declared
from dynakin.settings.lag import ALL_FRAMES, check_lag, frames_later, known_lag, lag_frames
from dynakin.settings.model import QUANTITIES, Bounds, Priors, Quantity
from dynakin.settings.noise import Noise
from dynakin.settings.strict import nearest
from dynakin.settings.subject import CarriedLoad

Feet = Callable[[CalibratedModel], ContactLoads | None]


class Tracked(NamedTuple):
    """A recording's estimate, and the tracker as the last frame left it."""

    estimate: Estimate
    tracker: Tracker


@dataclass(frozen=True, eq=False, init=False)
class Estimator:
    """Estimates movement and what drives it with one constrained extended Kalman filter.

    It does not change: `start` gives what does. `dataclasses.replace` makes a changed copy.

    Args:
        model: what `load_model` returns.
        noise: `presets.default()` where not given.
        priors, bounds: prior standard deviations and half widths of (9); see `dynakin.settings.model`.
        side: limb markers of a lumped model ("auto", "right", "left", "both").
        vertical, forward: laboratory directions, found in the recording where "auto".
        estimate: kinds of parameters to estimate, of "lengths", "markers", "soft_tissue" and "inertia"; the others stay
            as they are at the start (displacements of skin are then noise of the markers).
        plates: plate -> "right", "left" or a declared contact, where a floating model's own assignment of plates to
            feet is wrong.
        contacts: what else bears or pulls the person: names ("seat", "hand_right", a segment of the model), or mappings
            with ``name`` and ``segment``.
        loads: known masses that the person carries; the subject's mass is then needed, without them.
        parameters: an identified subject (`model.identified`), whose values and deviations the filter starts from.
    """

    model: Definition
    noise: Noise
    priors: Priors
    bounds: Bounds
    side: str
    vertical: str
    forward: str | tuple[float, float, float]
    estimate: tuple[Quantity, ...]
    plates: Mapping[str, str]
    contacts: tuple[DeclaredContact, ...]
    loads: tuple[CarriedLoad, ...]
    parameters: IdentifiedSubject | None

    def __init__(
        self,
        model: Definition,
        noise: Noise | None = None,
        *,
        priors: Priors | None = None,
        bounds: Bounds | None = None,
        side: str = "auto",
        vertical: str = "auto",
        forward: str | tuple[float, float, float] = "auto",
        estimate: Sequence[Quantity] = QUANTITIES,
        plates: Mapping[str, str] | None = None,
        contacts: Sequence[str | Mapping[str, str] | DeclaredContact] = (),
        loads: Sequence[CarriedLoad] = (),
        parameters: IdentifiedSubject | None = None,
    ) -> None:
        for kind in estimate:
            if kind not in QUANTITIES:
                known = ", ".join(QUANTITIES)
                raise ConfigError(f"estimate: {kind!r} is unknown{nearest(kind, QUANTITIES)}; expected some of {known}")
        if loads and model.subject.mass_kg is None:
            raise ConfigError("loads: the plates carry them too, expected the person's own mass as well (mass_kg)")
        chosen: dict[str, object] = {
            "model": model,
            "noise": noise or presets.default(),
            "priors": priors or Priors(),
            "bounds": bounds or Bounds(),
            "side": side,
            "vertical": vertical,
            "forward": forward,
            "estimate": tuple(kind for kind in QUANTITIES if kind in estimate),
            "plates": dict(plates or {}),
            "contacts": declared(contacts),
            "loads": tuple(loads),
            "parameters": parameters,
        }
        for name, value in chosen.items():
            object.__setattr__(self, name, value)

    @property
    def how(self) -> Calibration:
        """How the model is calibrated."""
        return Calibration(self.side, self.vertical, self.forward, self.priors, self.bounds)

    def of_person(self, measured: CalibratedModel) -> Estimator:
        """The same for somebody whose mass and height are known, as measured in another trial."""
        known = {"mass_kg": measured.mass_kg, "height_m": measured.height_m}
        return replace(self, model=self.model.with_subject(self.model.subject.changed(**known)))

    @one_blas_thread
    def calibrate(self, recording: Recording, *, static: Recording | None = None) -> CalibratedModel:
        """The model of one person: measured on a recording (or the first seconds of a live one), with the identified
        parameters and the known loads, before any states are added that the noise asks for.

        Raises:
            ModelError, RecordingError: as in `run`.
        """
        calibrated = self.model.calibrate(recording, static=static, how=self.how)
        if self.parameters is not None:
            calibrated = with_identified(calibrated, self.parameters)
        calibrated = replace(calibrated, messages=(*calibrated.messages, *calibrated.unlike_the_tables()))
        return with_contacts(with_loads(calibrated, self.loads), self.contacts)

    def start(
        self,
        source: Recording | CalibratedModel,
        *,
        static: Recording | None = None,
        lag_s: float = 0.0,
        rate_hz: float | None = None,
        ahead_s: float = 0.0,
    ) -> Tracker:
        """A tracker that is ready for its first sample, of a recording to calibrate on or of a calibrated model.

        Args:
            static: as in `run`; a calibrated model needs none.
            lag_s: by which `Tracker.delayed` lies behind `Tracker.step`, s, as many frames as that is about; 0: none.
            rate_hz: of the samples, where not that of the recording. A calibrated model with a lag needs it.
            ahead_s: by which `Tracker.ahead` looks ahead of `Tracker.step`, s; 0: it does not.

        Raises:
            ModelError, RecordingError: as in `run`. ConfigError: the noise does not fit the model or the lag.
        """
        if check_lag(lag_s) == ALL_FRAMES:
            raise ConfigError("lag_s: all frames are known of a recording alone (Estimator.run), expected seconds")
        if isinstance(source, Recording):
            rate_hz = rate_hz or source.rate
        if lag_s and not (rate_hz and np.isfinite(rate_hz)):
            raise ConfigError("lag_s: a lag needs the rate of the samples, expected rate_hz")
        calibrated = self.calibrate(source, static=static) if isinstance(source, Recording) else source
        plates = [plate.name for plate in source.plates] if isinstance(source, Recording) else []
        lag = lag_frames(lag_s, rate_hz or 0.0)
        return Tracker(calibrated, self.noise, self.estimate, lag, plates, self.plates, ahead_s)

    def run(
        self,
        recording: Recording,
        *,
        static: Recording | None = None,
        lag_s: float | None = None,
        feet: Feet | None = None,
        progress: Progress | None = None,
    ) -> Estimate:
        """Estimate a whole recording.

        Frames in which the filter lost the person are NaN (`Estimate.lost`), and a message names them; of a trial that
        was lost as a whole `results.measures.tracking.why_lost` gives the reason.

        Args:
            recording: markers and plates, as `read` gives them.
            static: the same person and markers, standing: lengths and marker places are taken from it.
            lag_s: each frame is estimated from the frames until so many seconds later, as it would be live with that
                lag (0: without any); inf: from all frames. None: inf wherever the noise settings have a smoother, else
                0, and a message says so. A finite lag takes as long as smoothing for every 20 ms or so of it.
            feet: for models with a floating root: gives the wrench of each foot once the model is measured and its
                ground frame known, instead of the plates' own division by `foot_loads`. Moments are those that the
                feet's wrenches leave, and their sum is the total wrench that the filter takes.
            progress: called with (frames done, frames in all) now and then.

        Raises:
            ModelError, RecordingError: model, markers, plates and recording do not fit.
            ConfigError: a lag that cannot be, or for which the noise settings have no smoother.
            DivergenceError: the filter lost its estimate; the message names the frame.
        """
        return self.track(recording, static=static, lag_s=lag_s, feet=feet, progress=progress).estimate

    def track(
        self,
        recording: Recording,
        *,
        static: Recording | None = None,
        lag_s: float | None = None,
        feet: Feet | None = None,
        progress: Progress | None = None,
    ) -> Tracked:
        """`run`, and the tracker that made it: the calibrated model, and the state after the last frame (of a smoothed
        .osim without the displacements of skin that follow the joints)."""
        return self.follow(self.prepare(recording, static=static, lag_s=lag_s, feet=feet), progress)

    @one_blas_thread
    def prepare(
        self,
        recording: Recording,
        *,
        static: Recording | None = None,
        lag_s: float | None = None,
        feet: Feet | None = None,
    ) -> Prepared:
        """All of `run` but the estimate: what is known of the person, the plates and the contacts before it.

        Raises:
            ModelError, RecordingError, ConfigError: as in `run`.
        """
        lag_s, unsmoothed = known_lag(lag_s, self.noise)
        recording = recording.without_empty_ends()
        problem = rate_problem(recording.time)
        if recording.n_frames < 2 and self.model.floating:
            problem = f"found {recording.n_frames} frame, expected at least 2: one shows no movement"
        if problem:
            raise RecordingError(f"{recording.path or recording.name}: {problem}")
        calibrated = self.calibrate(recording, static=static)
        markers, wrench, ground = self.measured(recording, calibrated)
        tracker = Tracker(calibrated, self.noise, self.estimate)
        calibrated = tracker.calibrated
        contacts = None
        if feet is not None:
            contacts = feet(calibrated)
        elif ground.loads is not None:
            contacts = expected_loads(ground, calibrated, self.noise, ContactPaths.of(calibrated).at(markers))
        measured = Measurements(recording.time, markers, wrench, contacts)
        return Prepared(recording, tracker, measured, ground, lag_s, tuple(unsmoothed))

    @one_blas_thread
    def follow(self, ready: Prepared, progress: Progress | None = None) -> Tracked:
        """The estimate of a recording that is prepared, once or again: `ready` does not change.

        Raises:
            RecordingError, DivergenceError: as in `run`.
        """
        recording, calibrated, ground = ready.recording, ready.calibrated, ready.ground
        try:
            tracker, arrays, measured, notes, clock = passes(ready, progress)
        except ValueError as error:  # a frame that the core refuses, named by it
            raise RecordingError(f"{recording.path or recording.name}: {error}") from None
        late = frames_later(ready.lag_s, recording.rate)
        config = self.settings() | {
            "lag_s": ALL_FRAMES if late is None else late / recording.rate,
            "ground": {"reasons": [reason.text for reason in ground.reasons], "plates_behind_s": ground.behind_s},
            "noise_used": tracker.noise.scales(),
        }
        doubt = clock if ground.usable else []
        if ground.doubt:
            unsought = " No further delay of the plates is sought, because a wrong mass looks like one."
            doubt = [replace(ground.doubt, text=ground.doubt.text + unsought * (not calibrated.feet))]
        notes = [*ground.notes, *notes, *doubt, *ready.unsmoothed]
        if not ground.doubt:
            plates = [plate.name for plate in recording.plates]
            place = off_place(ground, calibrated, tracker.core_model, arrays["state"], measured.wrench, plates)
            notes += [place] if place else []
        systematic = None
        if tracker.systematic is not None:
            notes += tracker.systematic.misfit(arrays["state"][-1])
            systematic = tracker.systematic.with_found(
                ground.clock_sd_s,
                ground.in_hands_kg,
                skin_found(calibrated, arrays),
                hips_turned(calibrated, arrays["state"][arrays["tracking"] == FOLLOWING]),
            )
        undeclared = ready.undeclared(measured.contacts)
        estimate = assemble(
            arrays, tracker, recording, measured, config, notes, undeclared, systematic, found_low_pass(recording)
        )
        estimate = without_lost(estimate)
        if systematic is not None:
            data, said = with_locked(estimate.data, calibrated, systematic, self.model.path.name)
            estimate = replace(estimate, data=data, messages=[*estimate.messages, *said])
        return Tracked(estimate, tracker)

    def measured(self, recording: Recording, calibrated: CalibratedModel) -> tuple[Array, Array, Ground]:
        """What the filter takes of a recording: markers (T, M, 3) m, and wrench (T, 6), NaN where it is not known (all
        of it where the plates carry something that the model does not have); and what is known of the ground.

        Raises:
            RecordingError: markers or plates do not fit the model.
        """
        total_wrench(recording, calibrated, gaps=self.noise.recover)  # refuses what the filter cannot take
        markers = marker_paths(recording, calibrated, gaps=self.noise.recover)
        tolerance = self.noise.plate_load_tolerance
        ground, wrench = known_ground(recording, calibrated, markers, self.plates, tolerance)
        return markers, wrench, ground

    def settings(self) -> dict[str, object]:
        """What was asked for, as plain data: written into the outputs."""
        return {
            "model": str(self.model.path if self.model.path.parent.name != "builtin" else self.model.name),
            "side": self.side,
            "contacts": [contact.model_dump(mode="json", exclude_none=True) for contact in self.contacts],
            "loads": [load.model_dump(mode="json") for load in self.loads],
            "identified": None if self.parameters is None else self.parameters.use,
            "vertical": self.vertical,
            "forward": self.forward if isinstance(self.forward, str) else list(self.forward),
            "estimate": list(self.estimate),
            "noise": self.noise.model_dump(mode="json"),
            "priors": self.priors.model_dump(mode="json"),
            "bounds": self.bounds.model_dump(mode="json"),
        }
