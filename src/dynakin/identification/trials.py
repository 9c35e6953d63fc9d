"""Trials of one subject as the identification takes them: kinematics from markers alone, on one common geometry."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from dynakin import _core
from dynakin.comparison.freeze import freeze, initial_values
from dynakin.comparison.held_out import marker_paths, measured_wrench
from dynakin.errors import RecordingError
from dynakin.filter import Estimator
from dynakin.model import InitialModel, initialise
from dynakin.recordings import GroundFrame, Recording, check_plates
from dynakin.recordings.smoothing import CUTOFF_HZ, smooth

Array = npt.NDArray[np.float64]
Progress = Callable[[int, int], None]

RATE_HZ = 25.0
"""Frames a second that are kept: the model's error is alike for 0.15 to 0.3 s, so more say nothing new."""


@dataclass(frozen=True, eq=False)
class Movement:
    """A trial without its plates: what can be predicted is in here, what it is judged by is not.

    Attributes:
        recording: as read, its plates taken away. time: (T,) s. states: (T, n) of `Common.core`, with the constants
            of the start. start: the trial's own coordinates and ground frame.
    """

    recording: Recording
    time: Array
    states: Array
    start: InitialModel


@dataclass(frozen=True, eq=False)
class MeasuredTrial:
    """A movement and the wrench measured with it (T, 6), N and N m about the ground origin; NaN: not known."""

    movement: Movement
    wrench: Array

    def part(self, frames: slice) -> MeasuredTrial:
        """Some of its frames."""
        kept = replace(self.movement, time=self.movement.time[frames], states=self.movement.states[frames])
        return MeasuredTrial(kept, self.wrench[frames])


@dataclass(frozen=True, eq=False)
class Common:
    """The model as measured on the subject's first trial, which all trials share.

    Attributes:
        estimator: how trials are filtered. initial: as measured. static: the standing trial, or the first one.
        core: with lengths and inertia among its states.
    """

    estimator: Estimator
    initial: InitialModel
    static: Recording
    core: _core.Model

    @classmethod
    def measure(cls, estimator: Estimator, first: Recording, static: Recording | None = None) -> Common:
        """Measure the model.

        Args:
            estimator: model and noise; preset default or another one that has a smoother.

        Raises:
            ModelError, RecordingError: as `Estimator.start`.
        """
        initial = estimator.start(first, static=static)
        return cls(estimator, initial, static or first, _core.Model(initial.spec))

    def columns(self, block: str) -> slice:
        """Where a block stands in a state of ``core``."""
        offset, size = self.core.layout.blocks[block]
        return slice(offset, offset + size)

    def see(
        self, recording: Recording, ground: GroundFrame | None = None, progress: Progress | None = None
    ) -> Movement:
        """Smoothed kinematics from the markers alone, lengths and inertia held at the start. Plates are not looked at.

        Without plates the smoother's accelerations carry 12 N of noise above 6 Hz, so the coordinates are low-passed.

        Args:
            ground: directions of the laboratory where the trial is a part of another.

        Raises:
            ModelError, RecordingError: the trial does not fit. DivergenceError: from the filter.
        """
        recording = replace(recording, plates=())
        start = self._start(recording, ground)
        markers = marker_paths(recording, self.initial, start.ground)
        other = self.estimator.again()
        coordinates = {c.name: float(c.value) for c in start.spec.coordinates}
        frozen = freeze(self.initial, initial_values(self.initial), coordinates)
        other.start_from(frozen)
        arrays = other.run_smoothed_arrays(
            recording.time, markers, np.full((recording.n_frames, 6), np.nan), progress
        )  # fmt: skip
        every = max(1, round(1.0 / (RATE_HZ * float(np.median(np.diff(recording.time))))))
        states = np.tile(self.initial.x0, (recording.n_frames, 1))
        columns = [self.columns(block) for block in ("coordinates", "speeds", "accelerations")]
        quiet = smooth(recording.time, arrays["state"][:, columns[0]], CUTOFF_HZ)
        for at, values in zip(columns, (quiet.values, quiet.rates, quiet.seconds), strict=True):
            states[:, at] = values
        return Movement(recording, recording.time[::every], states[::every], start)

    def with_plates(self, movement: Movement, recording: Recording, *, as_measured: bool = False) -> MeasuredTrial:
        """The movement with the plates of its recording.

        Args:
            as_measured: without the low-pass that the kinematics have: for judging.

        Raises:
            RecordingError: it has none, or they are refused.
        """
        wrench = measured_wrench(recording, movement.start)
        check = check_plates(recording, movement.start.ground, self.initial.weighed_kg)
        if check.refusal:
            raise RecordingError(f"{recording.path or recording.name}: {check.refusal}")
        if not as_measured:
            wrench = smooth(recording.time, wrench, CUTOFF_HZ).values
        every = np.searchsorted(recording.time, movement.time - 1e-9)
        return MeasuredTrial(movement, wrench[every])

    def measured(self, recording: Recording, progress: Progress | None = None) -> MeasuredTrial:
        """A trial to identify on."""
        return self.with_plates(self.see(recording, progress=progress), recording)

    def _start(self, recording: Recording, ground: GroundFrame | None) -> InitialModel:
        estimator, initial = self.estimator, self.initial
        known = {"mass_kg": initial.mass_kg, "height_m": initial.height_m}
        definition = replace(estimator.model, subject=estimator.model.subject.model_copy(update=known))
        return initialise(
            definition,
            recording,
            ground,
            static=self.static,
            side=initial.side,
            vertical=initial.ground.vertical,
            forward=estimator.forward,
            priors=estimator.priors,
            bounds=estimator.bounds,
        )


def measure_all(
    common: Common, recordings: Sequence[Recording], progress: Progress | None = None
) -> list[MeasuredTrial]:
    """All trials to identify on; ``progress`` counts trials."""
    found = []
    for k, recording in enumerate(recordings):
        found.append(common.measured(recording))
        if progress is not None:
            progress(k + 1, len(recordings))
    return found
