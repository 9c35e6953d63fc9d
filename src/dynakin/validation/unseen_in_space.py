"""What no method has seen, of a body that is fixed nowhere: markers left out, plates withheld, a moment ahead; by the
filter and by inverse kinematics and dynamics on the same calibrated model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt
from numpy.lib.stride_tricks import sliding_window_view

from dynakin.arrays import Array, wrench_about
from dynakin.filter.estimator import Estimator
from dynakin.filter.ground.expected import ContactPaths
from dynakin.filter.prepared import Prepared
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.model.calibration.inverse_kinematics import fixed_model, inverse_kinematics
from dynakin.progress import Progress
from dynakin.recordings.recording import Recording
from dynakin.recordings.smoothing import smooth
from dynakin.results.estimate import Estimate
from dynakin.results.measures.metrics import evaluation_window
from dynakin.validation.case import Setup
from dynakin.validation.reference.inverse_dynamics import (
    RigidMotion,
    filled,
    inverse_name,
    rigid_motions,
    usual_cutoffs,
)
from dynakin.validation.yardsticks import (
    LEFT_OUT,
    LINEAR,
    PERSISTENCE,
    WITHHELD,
    Figures,
    Judged,
    ahead,
    expected_ahead,
    span_frames,
    with_mean,
)

_PAST_S = 0.5
"""Of the recording until now, from which the classical method looks ahead: the low-pass forgets in less."""
_FEWEST_FRAMES = 8  # for a spline's second derivative, at a low rate


def figures_in_space(
    recording: Recording, setup: Setup, *, static: Recording | None, horizon_s: float, progress: Progress | None
) -> Figures:
    """All yardsticks on one trial of a floating model, over its window.

    - Marker left out: never given, so that its place is the calibration's; in groups of markers that are neither on one
      segment nor on neighbours (`left_out_groups`), because a whole body has too many for a run each.
    - Plates withheld: the whole recording without them, judged where they measure all that acts.
    - Ahead: from what is known until each frame, ``horizon_s`` on, as `LookAhead` says it of the filter's live states
      and of the classical method's, by a low-pass of what lies before.

    Wrenches are along the way the person faces, moments about the floor's point below the pelvis: about a laboratory's
    origin they would be forces times metres.

    Raises:
        DynakinError: as `Estimator.run`.
    """
    estimators = {f"EKF ({preset})": setup.estimator(preset) for preset in setup.noise}
    ready = {name: each.prepare(recording, static=static, lag_s=setup.lag_s) for name, each in estimators.items()}
    trial = _judged(next(iter(ready.values())))
    time, markers, *_ = trial.measured
    groups = left_out_groups(trial.calibrated)
    total, done = len(ready) * (len(groups) + 2), 0

    def stepped() -> None:
        nonlocal done
        done += 1
        if progress is not None:
            progress(done, total)

    cutoffs = usual_cutoffs(setup.cutoff_hz, time)
    left_out: Figures = {}
    for group in groups:
        hidden = markers.copy()
        hidden[:, group] = np.nan
        for name, each in ready.items():
            estimate = estimators[name].follow(replace(each, measured=each.measured._replace(markers=hidden))).estimate
            left_out |= trial.markers(LEFT_OUT, name, _of(estimate, "markers_estimated", trial.window), group)
            stepped()
        for cutoff, motion in rigid_motions(trial.calibrated, time, hidden, cutoffs).items():
            left_out |= trial.markers(LEFT_OUT, inverse_name(cutoff), motion.markers(), group)
    withheld: Figures = {}
    ahead_of: dict[str, tuple[Array, Array]] = {}
    for name, each in ready.items():
        withheld |= trial.wrench(WITHHELD, name, _without_plates(estimators[name], each, recording, static))
        stepped()
        ahead_of[name] = _ahead(estimators[name], each, horizon_s)
        stepped()
    for cutoff, motion in rigid_motions(trial.calibrated, time, markers, cutoffs).items():
        withheld |= trial.wrench(WITHHELD, inverse_name(cutoff), motion.wrench())
    for cutoff, expected in _classical_ahead(trial, cutoffs, horizon_s).items():
        ahead_of[inverse_name(cutoff)] = expected
    ahead_of |= trial.raw_ahead(span_frames(time, horizon_s))
    return with_mean(LEFT_OUT, left_out) | withheld | _ahead_figures(trial, ahead(horizon_s), ahead_of)


def left_out_groups(calibrated: CalibratedModel) -> list[list[int]]:
    """The model's markers (numbers) in groups, as few as come of it, none with two on one segment or on neighbours."""
    tree, segments = calibrated.tree, [marker.segment for marker in calibrated.spec.markers]
    groups: list[list[int]] = []
    for k, segment in enumerate(segments):
        for group in groups:
            if not any(segment == segments[j] or tree.adjacent(segment, segments[j]) for j in group):
                group.append(k)
                break
        else:
            groups.append([k])
    return groups


def _judged(ready: Prepared) -> Judged:
    """Wrenches along the way the person faces, about the floor's point below the pelvis."""
    ground = ready.calibrated.ground
    turn = ground.facing().rotation @ ground.rotation.T
    below = ContactPaths.of(ready.calibrated).at(ready.measured.markers)[:, 0] * [1.0, 0.0, 1.0]

    def seen(wrench: Array) -> Array:
        force, moment = np.split(wrench_about(wrench, below), 2, axis=1)
        return np.hstack([force @ turn.T, moment @ turn.T])

    return Judged(ready.calibrated, ready.measured, seen)


def _of(estimate: Estimate, name: str, window: npt.NDArray[np.bool_]) -> Array:
    """A variable of an estimate; of one that is lost within the window nothing: its other frames would look good."""
    values: Array = estimate.values(name)
    return np.full_like(values, np.nan) if estimate.lost[window].any() else values


def _without_plates(estimator: Estimator, ready: Prepared, recording: Recording, static: Recording | None) -> Array:
    """The total wrench (T, 6) by the motion, of a run that has no plates but the same person."""
    estimate = estimator.of_person(ready.calibrated).run(recording.without_plates, static=static, lag_s=ready.lag_s)
    wrench = _of(estimate, "wrench_estimated", evaluation_window(recording.time))
    return ready.calibrated.ground.wrench_to_ground(estimate.ground.wrench_to_laboratory(wrench))


def _ahead(estimator: Estimator, ready: Prepared, horizon_s: float) -> tuple[Array, Array]:
    """Places (T, M, 3) and wrench (T, 6) as the live states until ``horizon_s`` before say them."""
    estimate, tracker = estimator.follow(replace(ready, lag_s=0.0))
    states = _of(estimate, "state", evaluation_window(estimate.time))
    return expected_ahead(tracker.core_model, estimate.time, states, horizon_s)


def _classical_ahead(trial: Judged, cutoffs: tuple[float, ...], horizon_s: float) -> dict[float, tuple[Array, Array]]:
    """The same of the rigid model as the angles of the half second until ``horizon_s`` before say it."""
    time, model = trial.measured.time, fixed_model(trial.calibrated)
    coordinates = inverse_kinematics(trial.calibrated, filled(time, trial.measured.markers))
    past = max(span_frames(time, _PAST_S), _FEWEST_FRAMES)
    unknown = np.full((past - 1, coordinates.shape[1]), np.nan)
    found = {}
    for cutoff in cutoffs:
        low_passed = smooth(time[:past], np.eye(past), cutoff)  # linear: the share of each frame in the last one
        shares = (low_passed.values[-1], low_passed.rates[-1], low_passed.seconds[-1])
        windows = sliding_window_view(coordinates, past, axis=0)  # (T - past + 1, F, past)
        now = RigidMotion.of(model, *(np.vstack([unknown, windows @ share]) for share in shares))
        found[cutoff] = expected_ahead(model, time, now.states, horizon_s)
    return found


def _ahead_figures(trial: Judged, yardstick: str, guesses: dict[str, tuple[Array, Array]]) -> Figures:
    """All methods over the same frames: those that each of them has."""
    finite = {name: np.isfinite(wrench).all(axis=1) for name, (_, wrench) in guesses.items()}
    of_models = [known for name, known in finite.items() if name not in (PERSISTENCE, LINEAR)]
    posed = np.logical_and.reduce(of_models)[:, None, None]
    loaded = np.logical_and.reduce(list(finite.values()))[:, None]  # raw data have no wrench where the plates had none
    figures: Figures = {}
    for name, (places, _) in guesses.items():
        figures |= trial.markers(yardstick, name, np.where(posed, places, np.nan), range(places.shape[1]))
    figures = with_mean(yardstick, figures)
    for name, (_, wrench) in guesses.items():
        figures |= trial.wrench(yardstick, name, np.where(loaded, wrench, np.nan))
    return figures
