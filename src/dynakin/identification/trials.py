"""Trials of one subject as the identification takes them: kinematics from markers alone, on one common geometry."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from dynakin.arrays import Array, filled
from dynakin.bindings import _core
from dynakin.errors import LostError, ModelError, RecordingError
from dynakin.filter.estimator import Estimator
from dynakin.filter.measurements import Measurements
from dynakin.filter.samples import marker_paths
from dynakin.filter.sight import hidden_segments, root_of
from dynakin.filter.sources import ContactSources
from dynakin.filter.tracker import Tracker
from dynakin.messages import Message, warning, warnings_of
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.progress import Progress
from dynakin.recordings.companions import another_person, copies_among
from dynakin.recordings.plates.pressure import pressed_at
from dynakin.recordings.recording import Recording
from dynakin.recordings.smoothing import smooth
from dynakin.recordings.times import step_of
from dynakin.results.measures.sources import unseen_in_words
from dynakin.results.measures.tracking import why_lost
from dynakin.settings.defaults import CUTOFF_HZ
from dynakin.units import GRAVITY_M_S2
from dynakin.validation.freeze import freeze, initial_values
from dynakin.validation.held_out import as_estimate, measured_wrench, start_as

RATE_HZ = 25.0
"""Frames a second that are kept: the model's error is alike for 0.15 to 0.3 s, so more say nothing new."""

LOAD_APART = 0.04
"""Part by which the mean load of a trial's plates may miss the body mass: a second of walking ends as fast as it began
within 0.2 m/s, 2 % of gravity; other plates or another person miss by more."""


SHORTEST_S = 1.0
"""Seconds of frames with the plates' wrench: in one trial at least, and in each of which the plates are doubted."""


@dataclass(frozen=True, eq=False)
class Movement:
    """A trial without its plates: what can be predicted is in here, what it is judged by is not.

    Attributes:
        recording: as read, its plates taken away. time: (T,) s. states: (T, n) of `Common.core`, with the constants
            of the start. lost: (T,) frames that are no estimate, of the person or of a limb that nobody sees.
        unfiltered: (T, n) states with the smoother's own coordinates, speeds and accelerations, not low-passed.
        start: the trial's own coordinates and ground frame.
        doubts: what a run would warn of its markers.
    """

    recording: Recording
    time: Array
    states: Array
    lost: npt.NDArray[np.bool_]
    unfiltered: Array
    start: CalibratedModel
    doubts: tuple[Message, ...] = ()


@dataclass(frozen=True, eq=False)
class MeasuredTrial:
    """A movement and the wrench measured with it.

    Attributes:
        wrench: (T, 6) N and N m about the ground origin; NaN: not known. unfiltered: (T, 6) the same, not low-passed.
        floating: whether the body is fixed nowhere. doubts: what a run would warn of its plates.
    """

    movement: Movement
    wrench: Array
    unfiltered: Array
    floating: bool = False
    doubts: tuple[Message, ...] = ()

    @property
    def reference(self) -> Array:
        """(3,) m: errors are weighed and judged about this point. A floating body's is its mean centre of pressure: an
        origin that is far from the person would turn an error of a force into one of a moment."""
        return mean_centre_of_pressure(self.wrench) if self.floating else np.zeros(3)

    def part(self, frames: slice) -> MeasuredTrial:
        """Some of its frames."""
        whole = self.movement
        kept = replace(
            whole,
            time=whole.time[frames],
            states=whole.states[frames],
            lost=whole.lost[frames],
            unfiltered=whole.unfiltered[frames],
        )
        return replace(self, movement=kept, wrench=self.wrench[frames], unfiltered=self.unfiltered[frames])

    def full_band(self) -> MeasuredTrial:
        """The same movement as the smoother gives it and the plates as they measured: nothing is low-passed."""
        whole = self.movement
        return replace(self, movement=replace(whole, states=whole.unfiltered), wrench=self.unfiltered)


@dataclass(frozen=True, eq=False)
class Common:
    """The model as measured on the subject's first trial, which all trials share.

    Attributes:
        estimator: how trials are filtered. initial: as measured. reference: whose person and markers all trials show.
            static: the standing trial, or the first one.
        core: with lengths and inertia among its states.
    """

    estimator: Estimator
    initial: CalibratedModel
    reference: Recording
    static: Recording
    core: _core.Model

    @classmethod
    def measure(
        cls,
        estimator: Estimator,
        first: Recording,
        static: Recording | None = None,
        reference: Recording | None = None,
    ) -> Common:
        """Measure the model on the markers of the first trial; only a standing trial's plates may give the mass.

        Args:
            estimator: model and noise; preset default or another one that has a smoother.
            reference: who the person is (`companions.of_most`); the first trial where not given.

        Raises:
            ModelError, RecordingError: as `Estimator.start`.
        """
        weighed = static is not None and bool(static.plates)
        if not estimator.model.has_mass and not weighed:
            raise ModelError(
                "identification: the body mass is not known; expected it (--mass), or a standing trial with plates "
                "(--static): it must not come from the plates of a held-out trial"
            )
        initial = estimator.start(first.without_plates, static=static).calibrated
        return cls(estimator, initial, reference or first, static or first, _core.Model(initial.spec))

    def tracker(self) -> Tracker:
        """A filter that starts from the model as it was measured."""
        return self.estimator.start(self.initial)

    @property
    def rows(self) -> npt.NDArray[np.intp]:
        """Components of the wrench that the model predicts: fx, fy, mz in the plane, all six in space."""
        return np.flatnonzero(self.initial.spec.wrench_measured)

    @property
    def floating(self) -> bool:
        """Whether the body is fixed nowhere."""
        return bool(self.initial.feet)

    def columns(self, block: str) -> slice:
        """Where a block stands in a state of ``core``."""
        offset, size = self.core.layout.blocks[block]
        return slice(offset, offset + size)

    def see(self, recording: Recording, progress: Progress | None = None) -> Movement:
        """Smoothed kinematics from the markers alone, lengths and inertia held at the start. Plates are not looked at.

        Without plates the smoother's accelerations carry 12 N of noise above 6 Hz, so the coordinates are low-passed.

        Raises:
            ModelError, RecordingError: the trial does not fit. DivergenceError: from the filter. LostError: the filter
                lost the person in too many frames.
        """
        recording = recording.without_plates
        start = start_as(self.initial, self.estimator, recording, self.static)
        markers = marker_paths(recording, self.initial, start.ground, lacking=True)
        coordinates = {c.name: float(c.value) for c in start.spec.coordinates}
        frozen = freeze(self.initial, initial_values(self.initial), coordinates)
        tracker = self.estimator.start(frozen)
        measured = Measurements(recording.time, markers, np.full((recording.n_frames, 6), np.nan))
        arrays = tracker.run_smoothed_arrays(measured, progress)
        judged = as_estimate(self.estimator, tracker, arrays, recording, measured)
        if (reason := why_lost(judged)) is not None:
            raise LostError(f"{recording.path or recording.name}: {reason}")
        every = max(1, round(1.0 / (RATE_HZ * step_of(recording.time))))
        states, unfiltered = (np.tile(self.initial.x0, (recording.n_frames, 1)) for _ in range(2))
        columns = [self.columns(block) for block in ("coordinates", "speeds", "accelerations")]
        quiet = smooth(recording.time, arrays["state"][:, columns[0]], CUTOFF_HZ)
        names = list(tracker.core_model.layout.names)
        for at, values in zip(columns, (quiet.values, quiet.rates, quiet.seconds), strict=True):
            states[:, at] = values
            own = [names.index(name) for name in self.core.layout.names[at]]
            unfiltered[:, at] = arrays["state"][:, own]
        hidden = hidden_segments(tracker.core_model, arrays["state"], markers, recording.time, arrays["verdicts"])
        lost = judged.lost | ContactSources.of(start).unseen(hidden, recording.n_frames).any(axis=1)
        doubts = warnings_of([*recording.notes, *start.messages])
        if said := unseen_in_words(hidden, recording.time, root_of(self.initial.spec)):
            doubts.append(warning("recording", f"{said} These frames are left out."))
        kept = slice(None, None, every)
        return Movement(
            recording, recording.time[kept], states[kept], lost[kept], unfiltered[kept], start, tuple(doubts)
        )

    def with_plates(self, movement: Movement, recording: Recording) -> MeasuredTrial:
        """The movement with the plates of its recording; NaN in frames in which the person was lost, or in which the
        plates do not fit the motion.

        Raises:
            RecordingError: it has none, or they are refused.
        """
        measured, doubts = self._measured_wrench(recording, movement.start)
        first_of_second = movement.time[middle_of(len(movement.time))]
        wrench = _low_passed(recording.time, measured, int(np.searchsorted(recording.time, first_of_second - 1e-9)))
        every = np.searchsorted(recording.time, movement.time - 1e-9)
        kept, unfiltered = (np.where(movement.lost[:, None], np.nan, w[every]) for w in (wrench, measured))
        return MeasuredTrial(movement, kept, unfiltered, self.floating, tuple(doubts))

    def _measured_wrench(self, recording: Recording, start: CalibratedModel) -> tuple[Array, list[Message]]:
        return measured_wrench(recording, start, self.estimator.plates, self.estimator.noise.plate_load_tolerance)

    def check(self, recording: Recording) -> None:
        """Whether a trial can be identified on: before anything that takes long.

        Raises:
            ModelError, RecordingError: its markers are others than the reference's, or another person's; it has no
                plates, they are refused, they carry somebody of another mass, or what does not fit the motion leaves
                less than a second of them.
        """
        where = recording.path or recording.name
        if other := another_person(recording, self.reference):
            raise RecordingError(f"{where}: {other}; expected trials of one person with the same markers")
        if not recording.plates:
            raise RecordingError(f"{where}: no force plates, expected at least one; give its ground forces (--forces)")
        start = start_as(self.initial, self.estimator, recording.without_plates, self.static)
        wrench, doubts = self._measured_wrench(recording, start)
        known_s = np.isfinite(wrench).all(axis=1).sum() / recording.rate
        if doubts and known_s < SHORTEST_S:
            raise RecordingError(
                f"{where}: the plates fit the motion for {known_s:.2f} s, expected {SHORTEST_S:g} s or more: "
                f"{'; '.join(message.text.rstrip('.') for message in doubts)}"
            )
        load, weighed = float(np.nanmean(wrench[:, 1])) / GRAVITY_M_S2, self.initial.weighed_kg
        if abs(load - weighed) > LOAD_APART * weighed:
            raise RecordingError(
                f"{where}: its plates carry {load:.1f} kg on average, the subject weighs {weighed:.1f} kg (expected "
                f"within {100.0 * LOAD_APART:.0f} %): another mass (--mass), another person, other plates, or a foot "
                "off the plates"
            )

    def measured(self, recording: Recording, progress: Progress | None = None) -> MeasuredTrial:
        """A trial to identify on."""
        return self.with_plates(self.see(recording, progress=progress), recording)


def middle_of(count: int) -> int:
    """Where a trial of ``count`` kept frames is halved."""
    return count // 2


def mean_centre_of_pressure(wrench: Array) -> Array:
    """(3,) m on the ground, of a wrench (T, 6) about its origin; the origin where no frame is known."""
    known = wrench[np.isfinite(wrench).all(axis=1)]
    x, z = filled(pressed_at(known.mean(axis=0))) if len(known) else (0.0, 0.0)
    return np.array([x, 0.0, z])


def _low_passed(time: Array, wrench: Array, middle: int) -> Array:
    """Like the kinematics; each half on its own, for one half may have to predict the other. What is unknown stays
    unknown."""
    halves = [smooth(time[part], wrench[part], CUTOFF_HZ).values for part in (slice(middle), slice(middle, None))]
    return np.where(np.isfinite(wrench), np.concatenate(halves), np.nan)


def refuse_copies(recordings: Sequence[Recording]) -> None:
    """A copy would predict the trial that is held out because it is that trial.

    Raises:
        RecordingError: the markers of two recordings are the same; both are named.
    """
    if found := copies_among(recordings):
        one, other = found
        raise RecordingError(
            f"{one.path or one.name} and {other.path or other.name}: the markers are the same, one is a copy; "
            "expected different trials: each is held out in turn"
        )


def measure_all(
    common: Common,
    recordings: Sequence[Recording],
    progress: Progress | None = None,
    lost: dict[int, str] | None = None,
) -> list[MeasuredTrial]:
    """All trials to identify on; ``progress`` counts frames.

    Args:
        lost: takes why the filter lost the person, by the trial's place among the recordings; these are left out.

    Raises:
        ModelError, RecordingError: as `Common.check`, or a copy of another trial; before anything that takes long.
        DivergenceError: from the filter. LostError: from the filter, where ``lost`` is not given.
    """
    refuse_copies(recordings)
    for recording in recordings:
        common.check(recording)
    found, total, before = [], sum(recording.n_frames for recording in recordings), 0
    for k, recording in enumerate(recordings):

        def advance(done: int, of: int, before: int = before, frames: int = recording.n_frames) -> None:
            if progress is not None:
                progress(before + round(frames * done / max(of, 1)), total)

        try:
            found.append(common.measured(recording, advance))
        except LostError as error:
            if lost is None:
                raise
            lost[k] = error.message
        before += recording.n_frames
    return found
