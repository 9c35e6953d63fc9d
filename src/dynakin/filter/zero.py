"""Where the joints stand in a standing trial, by the model as a trial left it: the clinical zero."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from dynakin.errors import RecordingError
from dynakin.filter.measurements import Measurements
from dynakin.filter.samples import marker_paths, total_wrench
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.model.calibration.declared import with_loads
from dynakin.model.schema import kinds_of
from dynakin.model.spec import free_names
from dynakin.recordings.recording import Recording
from dynakin.recordings.standing import standing_window
from dynakin.results.estimate import Estimate
from dynakin.results.measures.angles import Signs, mean_angles, with_angles
from dynakin.settings.lag import can_smooth

if TYPE_CHECKING:
    from dynakin.filter.estimator import Estimator

Zero = Literal["model", "standing"]

_HELD = 1e-3
"""Of their prior standard deviations: the constants stay what the trial made them."""
_CONSTANT = ("length/", "marker/", "inertia/")


def asked_angles(
    estimator: Estimator, estimate: Estimate, static: Recording | None, zero: Zero, signs: Signs
) -> Estimate:
    """The estimate with joint angles to report as a configuration asks for them; itself where it asks for nothing.

    Raises:
        RecordingError, ModelError: as `standing_zero`.
    """
    if (zero, signs) == ("model", "opensim"):
        return estimate
    standing = standing_zero(estimator, estimate, static) if zero == "standing" else {}
    return with_angles(estimate, standing, signs)


def standing_zero(estimator: Estimator, estimate: Estimate, static: Recording | None) -> dict[str, float]:
    """Mean angle (rad) of each rotation while the person first stands still, in ``static`` or in the trial itself.

    A smoothed trial stands by one set of constants from its first frame on. Otherwise the standing frames are estimated
    anew with the lengths, marker places and inertia that the trial ended with, held there: with other places the same
    posture shows other angles.

    Raises:
        RecordingError: nobody stands still for half a second. ModelError: the standing trial does not fit the model.
    """
    standing = estimate.recording if static is None else static
    window = zero_window(standing)
    if static is None and estimate.smoothed:
        coordinates = estimate.values("coordinates")[window]
        return mean_angles(estimate.coordinate_names, estimate.is_rotation(), coordinates)
    return _estimated_anew(estimator, estimate, standing, window)


def zero_window(standing: Recording) -> slice:
    """Frames of a recording that the zero is taken from.

    Raises:
        RecordingError: nobody stands still for half a second.
    """
    window = standing_window(standing)
    if window is None:
        raise RecordingError(
            f"{standing.path or standing.name}: nobody stands still for 0.5 s, expected a standing person for the zero "
            "(zero = 'standing'), there or in a trial of its own (--static)",
            asks_for="static",
        )
    return window


def _estimated_anew(estimator: Estimator, estimate: Estimate, standing: Recording, window: slice) -> dict[str, float]:
    standing_model = estimator.model.calibrate(standing, static=standing, how=estimator.how)
    start = with_loads(standing_model, estimator.loads)
    tracker = estimator.start(_as_identified(start, estimate))
    initial = tracker.calibrated
    still = standing.window(float(standing.time[window.start]), float(standing.time[window.stop - 1]))
    markers = marker_paths(still, initial, gaps=True)
    wrench = total_wrench(still, initial, gaps=True, lacking=not still.plates)
    run = tracker.run_smoothed_arrays if can_smooth(estimator.noise) else tracker.run_arrays
    state = run(Measurements(still.time, markers, wrench))["state"]
    free = free_names(initial.spec)
    kinds = kinds_of(initial.spec.segments)
    turning = np.array([kinds[name] == "rotation" for name in free])
    locked = {c.name: float(c.value) for c in initial.spec.coordinates if c.locked and kinds[c.name] == "rotation"}
    return locked | mean_angles(free, turning, state[:, : len(free)])


def _as_identified(start: CalibratedModel, estimate: Estimate) -> CalibratedModel:
    """With the constants that a trial ended with; markers that it did not see keep their own."""
    known = {p.name: p for p in estimate.parameters if p.estimated and p.name.startswith(_CONSTANT)}
    x0, sd0 = start.x0.copy(), start.sd0.copy()
    for k, name in enumerate(start.names):
        if name in known:
            x0[k], sd0[k] = known[name].value, _HELD * sd0[k]
    return replace(start, x0=np.clip(x0, start.lower, start.upper), sd0=sd0)
