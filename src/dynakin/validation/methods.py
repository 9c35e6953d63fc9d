"""One trial worked on by every method, in arrays of the same shape: filters, and the classical methods as well: the
table ("AT") and "classical" of a planar chain, inverse kinematics and dynamics ("IK + ID") of a whole body."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import nullcontext
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from dynakin.arrays import Array, Flags
from dynakin.blas import one_blas_thread
from dynakin.errors import DynakinError, LostError, ModelError
from dynakin.filter.prepared import Prepared
from dynakin.filter.tracker import Tracker
from dynakin.filter.zero import asked_angles, zero_window
from dynakin.messages import Message, about, note, notes_of, warning, warnings_of
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.model.definition import Definition
from dynakin.progress import Progress, stage
from dynakin.recordings.recording import Recording
from dynakin.results.estimate import Estimate, known_of, values_of
from dynakin.results.failures import Failures
from dynakin.results.measures.facing import facing
from dynakin.results.measures.mean_curves import MEASURED, MeanCurve, mean_curves, signals
from dynakin.results.measures.metrics import evaluation_window
from dynakin.results.measures.repetitions import Found, repetitions_of
from dynakin.results.measures.sources import measured_only, moment_sources, needed_wrench, wrench_sources
from dynakin.results.measures.tracking import why_lost
from dynakin.settings.defaults import CUTOFF_HZ
from dynakin.settings.lag import in_words
from dynakin.units import COMPONENTS
from dynakin.validation.case import Setup
from dynakin.validation.reference.inverse_dynamics import (
    INVERSE,
    inverse_name,
    rigid_motions,
    usual_cutoffs,
    with_plates,
)
from dynakin.validation.reference.methods import Lengths, Reference, reference_methods

if TYPE_CHECKING:
    import xarray as xr


AT = "AT"
CLASSICAL = "classical"
ASK_FOR_INVERSE = (
    f"{INVERSE} (inverse kinematics, low-pass, inverse dynamics) are left out, they take 4 ms a frame: dynakin compare "
    "has them next to the filter."
)


@dataclass(frozen=True, eq=False)
class Method:
    """What one method makes of a trial; ground frame, NaN where it says nothing.

    Attributes:
        name: "EKF (paper)", "AT (6 Hz)", ...; kind: "EKF", "AT", "classical" or "IK + ID".
        coordinates: (T, C) rad or m. moments: (T, C) N m or N.
        markers: (T, M, 3) m. wrench: (T, 6) N and N m, ground on person, about the ground origin.
        data: what it was taken from, named as `Estimate.data`, with speeds and accelerations too.
    """

    name: str
    kind: str
    coordinates: Array
    moments: Array
    markers: Array
    wrench: Array
    data: xr.Dataset

    def known_coordinates(self) -> Array:
        """Coordinates (T, C), NaN where nobody sees the joint."""
        return np.where(np.isnan(known_of(self.data, "coordinates")), np.nan, self.coordinates)

    def measured_moments(self) -> Array:
        """Moments (T, C), NaN where a contact behind them is not measured: what figures and mean curves take."""
        return measured_only(self.moments, moment_sources(self.data))


@dataclass(frozen=True, eq=False)
class ComparedTrial:
    """A recording with what all methods make of it.

    Attributes:
        window: (T,) bool, the frames that figures are taken over: after the adaptation.
        measured_markers: (T, M, 3) m; measured_wrench: (T, 6).
        axes: (3,) bool, ground axes that the model explains. rotation: (C,) bool.
        repetitions: squats or gait cycles after the adaptation.
        notes: what was warned of, what was left out and why.
        estimates: of each preset, for whoever wants more. lost: presets that lost the person, and why.
    """

    name: str
    time: Array
    window: Flags
    marker_names: tuple[str, ...]
    coordinate_names: tuple[str, ...]
    measured_markers: Array
    measured_wrench: Array
    axes: Flags
    rotation: Flags
    repetitions: Found
    mass_kg: float
    methods: tuple[Method, ...]
    notes: tuple[Message, ...]
    estimates: dict[str, Estimate]
    lost: dict[str, str] = field(default_factory=dict)

    def of_kind(self, kind: str) -> list[Method]:
        """The methods of one kind, in order."""
        return [method for method in self.methods if method.kind == kind]

    def reference(self, kind: str) -> Method | None:
        """The classical method of that kind ("AT", "classical"); of a whole body inverse kinematics and dynamics, the
        first of their cut-offs, stand for both."""
        return next(iter([*self.of_kind(kind), *self.of_kind(INVERSE)]), None)

    def curves(self) -> list[MeanCurve]:
        """Mean curves of each method's coordinates, moments and wrench over the repetitions, and of the plates'."""
        names, rotation = self.coordinate_names, self.rotation
        methods = {
            m.name: signals(
                names,
                rotation,
                m.known_coordinates(),
                m.measured_moments(),
                measured_only(m.wrench, wrench_sources(m.data)),
            )
            for m in self.methods
        }
        methods[MEASURED] = signals(names, rotation, wrench=self.measured_wrench)
        return mean_curves(self.time, self.repetitions.items, methods, self.mass_kg)


@one_blas_thread
def compare_trial(
    recording: Recording, setup: Setup, *, static: Recording | None = None, progress: Progress | None = None
) -> ComparedTrial:
    """Run every preset and the reference methods.

    "AT" is the paper's: classical angles, low-passed, on a chain of constant lengths with the table's inertia.
    "classical" lets every joint follow its own landmarks, so that each segment stands for itself; the table's inertia
    moves with it. The markers of both are carried rigidly from where they were while standing. A whole body has
    "IK + ID" instead (`reference.inverse_dynamics`), with each of two cut-offs.

    Raises:
        LostError: no filter followed the person. DynakinError: as `Estimator.run`.
    """
    estimates, lost, trackers = estimate_each(recording, setup, static=static, progress=progress)
    initial = list(trackers.values())[-1].calibrated
    with stage(f"{recording.name}: the reference methods"):
        trial = trial_of(estimates, initial, setup.definition, setup.cutoff_hz, inverse=True)
    mass = notes_of(about(initial.messages, "mass"))
    said = warnings_of(initial.messages)
    said += [message for estimate in estimates.values() for message in warnings_of(estimate.messages)]
    return with_lost(replace(trial, notes=tuple(dict.fromkeys((*said, *mass, *trial.notes)))), lost)


def with_lost(trial: ComparedTrial, lost: Mapping[str, str]) -> ComparedTrial:
    """The trial with the filters that lost the person, which are left out, in its notes."""
    notes = [warning("lost", f"EKF ({preset}) is left out: {reason}.") for preset, reason in lost.items()]
    return replace(trial, notes=(*trial.notes, *notes), lost=dict(lost))


def prepare_each(recording: Recording, setup: Setup, *, static: Recording | None = None) -> dict[str, Prepared]:
    """The trial as prepared for every preset, before any takes its time.

    Raises:
        DynakinError: as `Estimator.prepare`; RecordingError: the standing zero that is asked for is nowhere.
    """
    ready = {
        preset: setup.estimator(preset).prepare(recording, static=static, lag_s=setup.lag_s) for preset in setup.noise
    }
    if setup.zero == "standing":
        zero_window(static or recording)
    return ready


def estimate_each(
    recording: Recording,
    setup: Setup,
    *,
    static: Recording | None = None,
    progress: Progress | None = None,
    keep_lost: bool = False,
    failures: Failures | None = None,
    ready: Mapping[str, Prepared] | None = None,
) -> tuple[dict[str, Estimate], dict[str, str], dict[str, Tracker]]:
    """Run every preset.

    Args:
        keep_lost: those that lost the person are estimates like the others. failures: takes what fails once an
            estimate is there (the angles that were asked for); not given: it is raised.
        ready: what `prepare_each` gave, where that has been done.

    Returns:
        By preset: the estimates, why others lost the person, and the trackers of all as they ended.

    Raises:
        LostError: no filter followed the person. DynakinError: as `prepare_each` and `Estimator.run`.
    """
    ready = prepare_each(recording, setup, static=static) if ready is None else ready
    estimates: dict[str, Estimate] = {}
    lost: dict[str, str] = {}
    trackers: dict[str, Tracker] = {}
    for preset in setup.noise:
        estimator = setup.estimator(preset)
        estimate, trackers[preset] = estimator.follow(ready[preset], progress)
        reason = None if keep_lost else why_lost(estimate)
        if reason is not None:
            lost[preset] = reason
            continue
        with nullcontext() if failures is None else failures.stage("joint angles of angles.sto"):
            estimate = asked_angles(estimator, estimate, static, setup.zero, setup.signs)
        estimates[preset] = estimate
    if not estimates:
        where = recording.path or recording.name
        raise LostError(f"{where}: {'; '.join(f'EKF ({preset}): {reason}' for preset, reason in lost.items())}")
    return estimates, lost, trackers


def trial_of(
    estimates: Mapping[str, Estimate],
    initial: CalibratedModel,
    definition: Definition,
    cutoff_hz: float = CUTOFF_HZ,
    *,
    tolerant: bool = False,
    inverse: bool = False,
) -> ComparedTrial:
    """Estimates of one recording against the reference methods on it; nothing is filtered again.

    Args:
        estimates: by the name of their preset, at least one. initial, definition: what they started from
            (`Tracker.calibrated`, `Estimator.model`).
        tolerant: a reference method that fails stops nothing: the notes say why it is left out. Else only a model
            that is no hinge chain in the plane is a note.
        inverse: a model in space has inverse kinematics and dynamics next to it; else a note
            says where to get them.

    Raises:
        RecordingError: uneven time steps, or a cut-off that is not below half the rate; not with ``tolerant``.
    """
    turned = {preset: facing(estimate) for preset, estimate in estimates.items()}
    methods = [_method(f"EKF ({preset})", "EKF", estimate.data) for preset, estimate in turned.items()]
    given, first = next(iter(estimates.values())), next(iter(turned.values()))
    notes, in_space = how_estimated(estimates), not first.planar
    try:
        if not in_space:
            methods += _in_plane(first, initial, definition, cutoff_hz, notes)
        elif inverse:
            methods += _inverse(given, initial, cutoff_hz, notes)
        else:
            notes.append(note("method", ASK_FOR_INVERSE))
    except DynakinError as error:
        if not (tolerant or isinstance(error, ModelError)):
            raise
        notes.append(note("method", f"AT and the classical method are left out: {error.message}"))
    data = first.data
    return ComparedTrial(
        name=first.recording.name,
        time=first.time,
        window=evaluation_window(first.time),
        marker_names=tuple(first.marker_names),
        coordinate_names=tuple(first.coordinate_names),
        measured_markers=values_of(data, "markers_measured"),
        measured_wrench=values_of(data, "wrench_measured"),
        axes=first.modelled_axes(),
        rotation=first.is_rotation(),
        repetitions=repetitions_of(first),
        mass_kg=initial.mass_kg,
        methods=tuple(methods),
        notes=tuple(notes),
        estimates=dict(estimates),
    )


def how_estimated(estimates: Mapping[str, Estimate]) -> list[Message]:
    """Which filters are smoothed and which are as live, where they are shown together and differ."""
    if len({estimate.lag_s for estimate in estimates.values()}) < 2:
        return []
    return [note("method", f"EKF ({preset}): each frame {in_words(e.lag_s)}.") for preset, e in estimates.items()]


def _method(name: str, kind: str, data: xr.Dataset) -> Method:
    return Method(
        name,
        kind,
        values_of(data, "coordinates"),
        values_of(data, "moments"),
        values_of(data, "markers_estimated"),
        needed_wrench(data),
        data,
    )


def _in_plane(
    first: Estimate, initial: CalibratedModel, definition: Definition, cutoff_hz: float, notes: list[Message]
) -> list[Method]:
    options: tuple[tuple[str, Lengths], ...] = ((AT, "constant"), (CLASSICAL, "frame"))
    found = []
    for kind, lengths in options:
        reference = reference_methods(first.recording, initial, definition, cutoff_hz, lengths=lengths)
        found.append(_referred(kind, reference, initial))
        notes += [note("method", f"{kind}: {text}") for text in reference.notes]
    return found


def _inverse(first: Estimate, initial: CalibratedModel, cutoff_hz: float, notes: list[Message]) -> list[Method]:
    """Inverse kinematics and dynamics at the cut-off that was asked for, and at the other usual one.

    Args:
        first: any estimate, for what it was given, its plates and their feet; not turned.
    """
    found = []
    data = first.data
    markers = values_of(data, "markers_measured")
    for cutoff, motion in rigid_motions(initial, first.time, markers, usual_cutoffs(cutoff_hz, first.time)).items():
        name = inverse_name(cutoff)
        judged, said = with_plates(motion, data)
        found.append(_method(name, INVERSE, facing(replace(first, data=judged)).data))
        notes += [note("method", f"{name}: {text}") for text in said]
    return found


def _referred(kind: str, reference: Reference, initial: CalibratedModel) -> Method:
    data = reference.data
    cutoff = "" if reference.cutoff_hz is None else f" ({reference.cutoff_hz:g} Hz)"
    segments = reference.chain.moving(reference.kinematics).segments
    markers = np.stack([segments[site.segment].point(site.position) for site in initial.measured_plan().sites], axis=1)
    return Method(
        kind + cutoff,
        kind,
        values_of(data, "coordinates"),
        values_of(data, "moments"),
        markers,
        data["wrench_estimated"].transpose("time", "component").sel(component=list(COMPONENTS)).values,
        data,
    )
