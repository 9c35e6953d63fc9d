"""Identified on one trial, frozen, judged on another from its markers alone: what a parameter is worth."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from dynakin.arrays import Array
from dynakin.blas import one_blas_thread
from dynakin.errors import LostError, ModelError, RecordingError
from dynakin.filter.assemble import assemble
from dynakin.filter.estimator import Estimator
from dynakin.filter.ground.known import known_ground
from dynakin.filter.measurements import Measurements
from dynakin.filter.samples import marker_paths
from dynakin.filter.tracker import Tracker
from dynakin.messages import Message, note, warnings_of
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.model.identified import IdentifiedSubject
from dynakin.recordings.frame import GroundFrame
from dynakin.recordings.recording import Recording
from dynakin.results.estimate import Estimate, values_of
from dynakin.results.measures.fit import signal_fit
from dynakin.results.measures.metrics import evaluation_window
from dynakin.results.measures.tracking import why_lost, without_lost
from dynakin.settings.lag import frames_later, known_lag
from dynakin.units import COMPONENTS
from dynakin.validation.case import Setup
from dynakin.validation.freeze import final_values, freeze, initial_values
from dynakin.validation.reference.inverse_dynamics import inverse_name, rigid_motions, usual_cutoffs
from dynakin.validation.reference.least_squares import identify, predicted_wrench
from dynakin.validation.reference.methods import reference_methods
from dynakin.validation.table2 import Row, spread, unit_of

BATCH, CHOSEN = "batch inertia", "chosen"


@dataclass(frozen=True, eq=False)
class IdentifyingTrial:
    """What was identified on the identifying trial.

    initial: the model as measured there. estimates: by preset. static: the recording that lengths were measured on.
    wrench: (T, 6) N and N m, the plates', as `measured_wrench`; ground: of the same laboratory, given to the judging
    trial too where both are one recording. subject: what `identify_subject` makes of the trial, where that was asked
    (`identification.subject.with_subject`).
    """

    recording: Recording
    static: Recording | None
    setup: Setup
    initial: CalibratedModel
    estimates: dict[str, Estimate]
    wrench: Array
    ground: GroundFrame | None = None
    subject: IdentifiedSubject | None = None

    def estimator(self, preset: str) -> Estimator:
        """Of this preset, with the scales of its noise that were found on the identifying trial."""
        asked = self.setup.estimator(preset)
        return replace(asked, noise=asked.noise.changed(**self.estimates[preset].config["noise_used"]))

    def constants(self, preset: str) -> dict[str, dict[str, float]]:
        """Lengths (m), marker places (m) and inertia (SI) that the judging trial may be predicted with, by label."""
        table = initial_values(self.initial)
        found = {"identified": final_values(self.estimates[preset]), "table": table}
        if self.subject is not None:
            found[BATCH] = table | dict(zip(self.subject.batch.names, self.subject.batch.values, strict=True))
        return found


@dataclass(frozen=True, eq=False)
class Blind:
    """Predictions of a trial's wrench from its markers; nothing in here has seen its plates.

    start: the judging trial's own coordinates and ground frame. wrenches: (T, 6) N and N m by method. plates,
    tolerance: as `Setup` has them, for judging.
    """

    recording: Recording
    start: CalibratedModel
    wrenches: dict[str, Array]
    notes: tuple[Message, ...]
    plates: Mapping[str, str] | None = None
    tolerance: float | None = None


def halves(recording: Recording) -> tuple[Recording, Recording]:
    """First and second half of a trial.

    Raises:
        RecordingError: fewer than four frames.
    """
    if recording.n_frames < 4:
        raise RecordingError(f"{recording.path or recording.name}: {recording.n_frames} frames, too few to halve")
    middle = recording.n_frames // 2
    times = recording.time
    first = recording.window(times[0], times[middle - 1])
    second = recording.window(times[middle], times[-1])
    return replace(first, name=f"{first.name}, first half"), replace(second, name=f"{second.name}, second half")


def identify_on(
    recording: Recording, setup: Setup, *, static: Recording | None = None, same_recording: bool
) -> IdentifyingTrial:
    """Run every preset on the identifying trial.

    Args:
        same_recording: the judging trial is a part of the same recording, so its directions are this one's: a part may
            begin in the middle of a movement.

    Raises:
        LostError: a filter lost the person. Other DynakinErrors: as `Estimator.run`.
    """
    estimates = {}
    for preset in setup.noise:
        estimator = setup.estimator(preset)
        # only what it ends with is used
        estimates[preset], tracker = estimator.track(recording, static=static, lag_s=0.0)
        _refuse_lost(estimates[preset], f"EKF ({preset})")
    initial = tracker.calibrated
    wrench, _ = measured_wrench(recording, initial, setup.common.plates, setup.plate_load_tolerance)
    ground = initial.ground if same_recording else None
    return IdentifyingTrial(recording, static, setup, initial, estimates, wrench, ground)


@one_blas_thread
def predict_blind(identified: IdentifyingTrial, recording: Recording) -> Blind:
    """Every prediction of the judging trial's wrench. Its plates are taken away before anything else is done.

    Filters, smoothed where their noise settings have a smoother and `Setup.lag_s` lets them. `EKF (preset),
    identified` and `EKF (preset), table`: lengths and inertia frozen at what the filter ended with on the identifying
    trial, or at what was measured standing and the table. Where a subject was identified, `EKF (preset), batch inertia`
    has its inertia instead of the table's, and `EKF (preset), chosen` is this or the table, as was decided on the
    identifying trial. Reference: the table's inertia on classical kinematics, then the same kinematics with least
    squares (in the bounds of (9), and free) and with each filter's inertia; in space inverse kinematics with the
    table's inertia. Persistence: the identifying trial's last wrench, and its mean.

    Raises:
        ModelError, RecordingError: the trial's markers do not fit the model. DivergenceError: from a filter. LostError:
            a filter lost the person.
    """
    recording = recording.without_plates
    setup, measured = identified.setup, identified.initial
    standing = identified.static or identified.recording
    start = start_as(measured, setup.common, recording, standing, identified.ground)
    markers = marker_paths(recording, measured, start.ground, lacking=True)
    seen = Measurements(recording.time, markers, np.full((recording.n_frames, 6), np.nan))
    coordinates = {c.name: float(c.value) for c in start.spec.coordinates}
    found: dict[str, Array] = {}
    for preset in identified.estimates:
        lag_s, _ = known_lag(setup.lag_s, setup.noise[preset])
        late = frames_later(lag_s, recording.rate)
        for label, values in identified.constants(preset).items():
            method, estimator = f"EKF ({preset}), {label}", identified.estimator(preset)
            tracker = estimator.start(freeze(measured, values, coordinates))
            arrays = tracker.run_late_arrays(late, seen)
            _refuse_lost(as_estimate(estimator, tracker, arrays, recording, seen), method)
            found[method] = arrays["wrench_estimated"]
        if identified.subject is not None:
            label = BATCH if identified.subject.use == "bodies" else "table"
            found[f"EKF ({preset}), {CHOSEN}"] = found[f"EKF ({preset}), {label}"]
    notes: list[Message] = []
    try:
        planar = setup.definition.planar
        found |= _referred(identified, recording, start) if planar else _inverse(setup, start, recording)
    except ModelError as error:
        notes.append(note("method", f"AT, the classical method and least squares are left out: {error.message}"))
    known = identified.wrench[np.isfinite(identified.wrench).all(axis=1)]
    for label, guess in (("last", known[-1]), ("mean", known.mean(axis=0))):
        found[f"persistence: {label}"] = np.repeat(guess[None], recording.n_frames, axis=0)
    return Blind(recording, start, found, tuple(notes), setup.common.plates, setup.plate_load_tolerance)


def judge(blind: Blind, recording: Recording) -> list[Row]:
    """The predictions against the plates of the same trial, over its window, where they measure the whole wrench; rows
    by component, then method.

    Raises:
        RecordingError: as `measured_wrench`.
    """
    measured, _ = measured_wrench(recording, blind.start, blind.plates, blind.tolerance)
    window = evaluation_window(recording.time)
    rows = []
    for k in np.flatnonzero(blind.start.spec.wrench_measured):
        for method, wrench in blind.wrenches.items():
            fit = signal_fit(measured[window, k], wrench[window, k])
            rows.append(Row(COMPONENTS[k], unit_of(COMPONENTS[k]), method, *(spread([figure]) for figure in fit)))
    return rows


def measured_wrench(
    recording: Recording,
    initial: CalibratedModel,
    plates: Mapping[str, str] | None = None,
    tolerance: float | None = None,
) -> tuple[Array, list[Message]]:
    """The plates' total wrench (T, 6) N and N m about the ground origin, NaN where they do not measure all of it, and
    what a run would warn of.

    Args:
        plates, tolerance: plate -> foot, and how far the plates' mean may be from the weight, as for `known_ground`.

    Raises:
        RecordingError: there are no plates to identify on or to be judged by, they are refused, or in no frame do they
            measure the whole wrench.
    """
    if not recording.plates:
        raise RecordingError(
            f"{recording.path or recording.name}: no force plates, expected at least one: what is predicted is "
            "judged by them (--forces)"
        )
    markers = marker_paths(recording, initial, lacking=True)
    ground, wrench = known_ground(recording, initial, markers, plates, tolerance)
    warnings = warnings_of([*ground.notes, *([ground.doubt] if ground.doubt else [])])
    if not np.isfinite(wrench).all(axis=1).any():
        where = recording.path or recording.name
        why = "".join(f"; {message.text.rstrip('.')}" for message in warnings)
        raise RecordingError(
            f"{where}: in no frame do the plates measure the whole wrench, expected a second of them{why}"
        )
    return wrench, warnings


def as_estimate(
    estimator: Estimator, tracker: Tracker, arrays: Mapping[str, Array], recording: Recording, measured: Measurements
) -> Estimate:
    """What a tracker that an estimator started made of what was measured, judged frame by frame like any other
    estimate."""
    return without_lost(assemble(arrays, tracker, recording, measured, estimator.settings(), []))


def _refuse_lost(estimate: Estimate, method: str) -> None:
    if (reason := why_lost(estimate)) is not None:
        where = estimate.recording.path or estimate.recording.name
        raise LostError(f"{where}: {method}: {reason}; nothing is judged by it")


def start_as(
    measured: CalibratedModel,
    estimator: Estimator,
    recording: Recording,
    static: Recording,
    ground: GroundFrame | None = None,
) -> CalibratedModel:
    """Where a trial begins on a model that was ``measured`` on another one: lengths, places and body as there.

    Args:
        estimator: that measured it. static: lengths come from it. ground: of the same laboratory, None: found.
    """
    how = replace(estimator.how, side=measured.side, vertical=measured.ground.vertical, ground=ground, measured=True)
    return estimator.of_person(measured).model.calibrate(recording, static=static, how=how)


def _inverse(setup: Setup, start: CalibratedModel, recording: Recording) -> dict[str, Array]:
    markers = marker_paths(recording, start, lacking=True)
    cutoffs = usual_cutoffs(setup.cutoff_hz, recording.time)
    motions = rigid_motions(start, recording.time, markers, cutoffs)
    return {f"{inverse_name(cutoff)}, table": motion.wrench() for cutoff, motion in motions.items()}


def _referred(identified: IdentifyingTrial, recording: Recording, start: CalibratedModel) -> dict[str, Array]:
    setup, measured = identified.setup, identified.initial
    hertz = f"({setup.cutoff_hz:g} Hz)"
    at = reference_methods(recording, start, setup.definition, setup.cutoff_hz)
    identifying = reference_methods(identified.recording, measured, setup.definition, setup.cutoff_hz, lengths="frame")
    fit = identify(
        identifying.chain,
        measured.measured_plan(),
        identifying.kinematics,
        identified.wrench,
        mass_kg=measured.mass_kg,
        bounds=setup.common.bounds,
    )
    inertia = {"table": fit.table, "least squares in bounds": fit.bounded, "least squares free": fit.free}
    for preset, estimate in identified.estimates.items():
        values = final_values(estimate)
        inertia[f"inertia of EKF ({preset})"] = np.array(
            [values.get(name, table) for name, table in zip(fit.names, fit.table, strict=True)]
        )
    moving = reference_methods(recording, start, setup.definition, setup.cutoff_hz, lengths="frame")
    wrenches = {f"AT {hertz}": values_of(at.data, "wrench_estimated")}
    for label, parameters in inertia.items():
        wrenches[f"classical {hertz}, {label}"] = predicted_wrench(moving.chain, moving.kinematics, parameters)
    return wrenches
