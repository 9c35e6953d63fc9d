"""A trial made ready to be filtered again and again: the same numbers for every setting, and nothing but plain data."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from dynakin.arrays import Array
from dynakin.filter.alignment import run_in_step
from dynakin.filter.estimator import Estimator
from dynakin.filter.measurements import Measurements
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.recordings.recording import Recording
from dynakin.recordings.times import step_of
from dynakin.results.measures.metrics import evaluation_window
from dynakin.results.records import FOLLOWING, REFUSED
from dynakin.settings.model import QUANTITIES, Quantity
from dynakin.settings.noise import Noise
from dynakin.studies.engine.journal import digest

HORIZON_S = 0.1


@dataclass(frozen=True, eq=False)
class TuningTrial:
    """What every setting is tried on. Pickles.

    Attributes:
        initial: the model as measured, without the states that a setting asks for.
        time: (T,) s. markers: (T, M, 3) m, wrench: (T, 6), ground frame; NaN missing, or taken out.
        first, end: the frames that count; those before are filtered too.
        ahead: frames of the horizon of "100 ms ahead".
        estimate: kinds of parameters that are estimated.
    """

    name: str
    initial: CalibratedModel
    time: Array
    markers: Array
    wrench: Array
    first: int
    end: int
    ahead: int
    estimate: tuple[Quantity, ...] = QUANTITIES

    def halves(self) -> tuple[TuningTrial, TuningTrial]:
        """The frames that count in two: the second half's figures then go on from what the first half taught."""
        middle = (self.first + self.end) // 2
        first = replace(self, name=f"{self.name}, first half", end=middle)
        return first, replace(self, name=f"{self.name}, second half", first=middle)

    def persistence(self) -> Array:
        """RMS change (3M + 6,) of each channel over the horizon, in the frames that count: what holding the last
        value is wrong by; NaN where nothing was measured."""
        channels = np.hstack([self.markers.reshape(len(self.time), -1), self.wrench])
        then = np.arange(max(self.first, self.ahead), self.end)
        change = channels[then] - channels[then - self.ahead]
        counts = np.isfinite(change).sum(axis=0)
        squares = np.where(np.isfinite(change), change**2, 0.0).sum(axis=0)
        return np.asarray(np.sqrt(np.divide(squares, counts, out=np.full(len(counts), np.nan), where=counts > 0)))

    def identity(self) -> dict[str, object]:
        """Plain data that stands for this trial where rows are kept."""
        arrays = {
            "times": self.time,
            "markers": self.markers,
            "forces": self.wrench,
            "model as measured": self.initial.x0,
            "its deviations": self.initial.sd0,
        }
        return {
            "name": self.name,
            "arrays": {what: digest([float(x).hex() for x in values.ravel()]) for what, values in arrays.items()},
            "estimate": list(self.estimate),
            "counted": [self.first, self.end, self.ahead],
        }


def prepare(recording: Recording, estimator: Estimator, *, static: Recording | None = None) -> TuningTrial:
    """Read everything off a recording that does not depend on the settings to be tried.

    The estimator's own settings start: plates that lag are brought into step, and what its gates refuse is taken out
    once, so that every setting is judged by the same rows (a filter that refuses more would else look better).

    Raises:
        DynakinError: as `Estimator.run`.
    """
    recording = recording.without_empty_ends()
    initial = estimator.calibrate(recording, static=static)
    tracker = estimator.start(initial)
    markers, wrench, _ = estimator.measured(recording, tracker.calibrated)
    if _doubts(estimator.noise):
        measured = Measurements(recording.time, markers, wrench)
        _, arrays, shift, _ = run_in_step(tracker, measured)
        wrench = measured.in_step(shift).wrench
        refused = arrays["verdicts"] == REFUSED
        refused[arrays["tracking"] != FOLLOWING] = True
        markers, wrench = markers.copy(), wrench.copy()
        markers[refused[:, :-1]] = np.nan
        wrench[refused[:, -1]] = np.nan
    window = np.flatnonzero(evaluation_window(recording.time))
    step = step_of(recording.time)
    return TuningTrial(
        recording.name,
        initial,
        np.ascontiguousarray(recording.time, dtype=float),
        np.ascontiguousarray(markers),
        np.ascontiguousarray(wrench),
        int(window[0]),
        len(recording.time),
        max(1, round(HORIZON_S / step)),
        estimator.estimate,
    )


def undoubting(noise: Noise) -> Noise:
    """The same settings without gates and recovery: a trial that is ready needs none, and a filter that diverges is to
    be seen to."""
    return noise.changed(marker_gate=0.0, wrench_gate=0.0, recover=False, unseen_sd=None)


def _doubts(noise: Noise) -> bool:
    return noise.marker_gate > 0.0 or noise.wrench_gate > 0.0 or noise.recover or noise.plate_delay_sd_s > 0.0
