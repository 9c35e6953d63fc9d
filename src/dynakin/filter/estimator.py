"""The estimator: a model and its noise; `run` for recordings, `start` and `step` for live use."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping, Sequence

import numpy as np
import numpy.typing as npt

import dynakin._core as _core
from dynakin.errors import ConfigError, DivergenceError, RecordingError
from dynakin.filter import presets
from dynakin.filter.alignment import PASSES, contradicted, delay_of, in_step, in_words, is_late
from dynakin.filter.assemble import assemble
from dynakin.filter.augment import QUANTITIES, Quantity, initial_covariance
from dynakin.filter.closure import plates_misfit
from dynakin.filter.core_filter import core_filter, filter_settings
from dynakin.filter.foot_wrenches import FootWrenches
from dynakin.filter.live import StepEstimate, deviations_of, step_estimate
from dynakin.filter.noise import Noise
from dynakin.filter.samples import Sample, recording_arrays, sample_arrays
from dynakin.filter.smoothing import check_can_smooth, smoothed, whether_to_smooth
from dynakin.filter.total_wrench import Ground, doubtful_mass, foot_wrenches, known_ground
from dynakin.model.calibration.initial import InitialModel
from dynakin.model.calibration.initialise import initialise
from dynakin.model.calibration.loads import CarriedLoad, with_loads
from dynakin.model.definition import Definition
from dynakin.model.identified import IdentifiedSubject, with_identified
from dynakin.model.priors import Bounds, Priors
from dynakin.model.validation import nearest
from dynakin.recordings.limits import rate_problem
from dynakin.recordings.recording import Recording
from dynakin.results.estimate import Estimate
from dynakin.results.measures.tracking import without_lost

Array = npt.NDArray[np.float64]
Progress = Callable[[int, int], None]
Feet = Callable[[InitialModel], FootWrenches | None]

LARGEST_LAG = 1000
"""Frames. Each step goes back over all of them and each keeps its covariance: a whole body's take half a gigabyte, and
no camera's frame is so long that a step would end within it."""


class Estimator:
    """Estimates movement and what drives it with one constrained extended Kalman filter.

    Args:
        model: what `load_model` returns.
        noise: `presets.default()` where not given.
        priors, bounds: prior standard deviations and half widths of (9); see `dynakin.model.priors`.
        side: limb markers of a lumped model ("auto", "right", "left", "both").
        vertical, forward: laboratory directions, found in the recording where "auto".
        estimate: kinds of parameters to estimate, of "lengths", "markers", "soft_tissue" and "inertia"; the others stay
            as they are at the start (displacements of skin are then noise of the markers).
        plates: plate -> "right" or "left", where a floating model's own assignment of plates to feet is wrong.
        loads: known bodies that the person carries; the subject's mass is then needed, without them.
        parameters: an identified subject (`model.identified`), whose values and deviations the filter starts from.
        lag: frames by which `delayed` lies behind `step`, for smoothing while it is measured; 0: none.
    """

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
        lag: int = 0,
        loads: Sequence[CarriedLoad] = (),
        parameters: IdentifiedSubject | None = None,
    ) -> None:
        for kind in estimate:
            if kind not in QUANTITIES:
                known = ", ".join(QUANTITIES)
                raise ConfigError(f"estimate: {kind!r} is unknown{nearest(kind, QUANTITIES)}; expected some of {known}")
        if not (isinstance(lag, int) and 0 <= lag <= LARGEST_LAG):
            raise ConfigError(
                f"lag is {lag!r}, expected 0 to {LARGEST_LAG} frames (all of a recording: run with smooth=True)"
            )
        if loads and model.subject.mass_kg is None:
            raise ConfigError("loads: the plates carry them too, expected the person's own mass beside them (mass_kg)")
        self.model = model
        self.loads = tuple(loads)
        self.parameters = parameters
        self.noise = noise or presets.default()
        self.priors = priors or Priors()
        self.bounds = bounds or Bounds()
        self.side = side
        self.vertical = vertical
        self.forward = forward
        self.estimate = tuple(kind for kind in QUANTITIES if kind in estimate)
        self.plates = dict(plates or {})
        self.lag = lag
        self.initial: InitialModel | None = None
        self._filter: _core.Filter | None = None
        self._lag: _core.FixedLag | None = None
        self._core_model: _core.Model | None = None
        self._time: float | None = None
        self._stepped: deque[tuple[float, _core.FootLoads | None]] = deque(maxlen=lag + 1)

    def run(
        self,
        recording: Recording,
        *,
        static: Recording | None = None,
        smooth: bool | None = None,
        feet: Feet | None = None,
        progress: Progress | None = None,
    ) -> Estimate:
        """Estimate a whole recording.

        Frames in which the filter lost the person are NaN (`Estimate.lost`), and a message names them; of a trial that
        was lost as a whole `results.measures.tracking.why_lost` gives the reason.

        Args:
            recording: markers and plates, as `read` gives them.
            static: the same person and markers, standing: lengths and marker places are taken from it.
            smooth: whether each frame is estimated from all frames, those after it too (`filter.smoothing`); False: as
                it would be live. None: smoothed wherever the noise settings have a smoother, else a message says so.
            feet: for models with a floating root: gives the wrench of each foot once the model is measured and its
                ground frame known, instead of the plates' own division by `foot_loads`. Moments are those that the
                feet's wrenches leave, adjusted so that nothing is left at the root; the state does not depend on it.
            progress: called with (frames done, frames in all) now and then.

        Raises:
            ModelError, RecordingError: model, markers, plates and recording do not fit.
            ConfigError: smoothing was asked for, and the noise settings have no smoother.
            DivergenceError: the filter lost its estimate; the message names the frame.
        """
        smooth, unsmoothed = whether_to_smooth(smooth, self.noise)
        if problem := rate_problem(recording.time):
            raise RecordingError(f"{recording.path or recording.name}: {problem}")
        initial = self.start(recording, static=static)
        assert self._core_model is not None
        markers, wrench, ground = self._measured(recording, initial)
        notes = list(ground.notes)
        on_feet = None
        if feet is not None:
            on_feet = feet(initial)
        elif ground.loads is not None:
            on_feet = foot_wrenches(ground.loads, initial, self.noise)
        try:
            doubt = doubtful_mass(wrench, initial.weighed_kg, ground.load_ratio)
            passes = 0 if doubt else PASSES
            there, back = _shares(progress, recording.n_frames) if smooth else (progress, None)
            arrays, shift, clock = self.run_in_step(initial, recording.time, markers, wrench, there, on_feet, passes)
            wrench = in_step(recording.time, wrench, shift) if shift else wrench
            on_feet = on_feet and on_feet.in_step(recording.time, shift)
            if smooth:
                self.start_from(initial)
                arrays = self.run_smoothed_arrays(recording.time, markers, wrench, back, on_feet)
        except ValueError as error:  # a frame that the core refuses, named by it
            raise RecordingError(f"{recording.path or recording.name}: {error}") from None
        config = self.settings() | {"smooth": smooth, "ground_reasons": list(ground.reasons)}
        notes += [*([doubt] if doubt else clock if ground.usable else []), *unsmoothed]
        assert self._filter is not None
        covariances = (initial_covariance(initial, self.noise), self._filter.covariance)
        measured = (markers, wrench)
        lacking = ground.undeclared
        return without_lost(
            assemble(
                arrays, self._core_model, initial, recording, measured, config, notes, covariances, on_feet, lacking
            )
        )

    def _measured(self, recording: Recording, initial: InitialModel) -> tuple[Array, Array, Ground]:
        markers, wrench = recording_arrays(recording, initial, gaps=self.noise.recover)
        tolerance = self.noise.plate_load_tolerance
        return markers, wrench, known_ground(recording, initial, markers, wrench, self.plates, tolerance)

    def measured(self, recording: Recording, initial: InitialModel) -> tuple[Array, Array, list[str]]:
        """What the filter takes of a recording: markers (T, M, 3) m, wrench (T, 6), NaN where it is not known (all of
        it where the plates carry something that the model does not have), and what there is to say of the plates.

        Raises:
            RecordingError: markers or plates do not fit the model.
        """
        markers, wrench, ground = self._measured(recording, initial)
        return markers, wrench, list(ground.notes)

    def run_in_step(
        self,
        initial: InitialModel,
        time: Array,
        markers: Array,
        wrench: Array,
        progress: Progress | None = None,
        feet: FootWrenches | None = None,
        passes: int = PASSES,
    ) -> tuple[dict[str, Array], float, list[str]]:
        """`run_arrays`, again (``passes`` times at most) with the plates brought into step where they turn out to lag.

        Returns:
            The arrays, the seconds by which the last run took the plates earlier, and what there is to say of that.
        """
        arrays, shift = self.run_arrays(time, markers, wrench, progress, feet), 0.0
        misfit = None
        for done in range(passes):
            delay = self._delay(arrays)
            if delay is None or not is_late(delay):
                break
            if not done:  # of nearly every run nobody asks
                misfit = plates_misfit(initial, time, markers, wrench)
            taken = in_step(time, wrench, shift + delay[0])
            fits = plates_misfit(initial, time, markers, taken)
            if misfit is not None and fits is not None and fits > misfit:
                return arrays, shift, [contradicted(shift + delay[0], misfit, fits)]
            shift, misfit = shift + delay[0], fits
            self.start_from(initial)
            arrays = self.run_arrays(time, markers, taken, progress, feet and feet.in_step(time, shift))
        return arrays, shift, in_words(shift, self._delay(arrays))

    def start(self, recording: Recording, *, static: Recording | None = None) -> InitialModel:
        """Measure the model on a recording (or the first seconds of a live one) and make the filter ready to step.

        Raises:
            ModelError, RecordingError: as in `run`.
        """
        return self.start_from(self.measure(recording, static=static))

    def measure(self, recording: Recording, *, static: Recording | None = None) -> InitialModel:
        """The model as measured on a recording, before any states are added that the noise asks for.

        Raises:
            ModelError, RecordingError: as in `run`.
        """
        initial = initialise(
            self.model,
            recording,
            static=static,
            side=self.side,
            vertical=self.vertical,
            forward=self.forward,
            priors=self.priors,
            bounds=self.bounds,
        )
        if self.parameters is not None:
            initial = with_identified(initial, self.parameters)
        return with_loads(initial, self.loads)

    def again(self) -> Estimator:
        """Another one with the same model and settings, not started."""
        return Estimator(
            self.model,
            self.noise,
            priors=self.priors,
            bounds=self.bounds,
            side=self.side,
            vertical=self.vertical,
            forward=self.forward,
            estimate=self.estimate,
            plates=self.plates,
            loads=self.loads,
            parameters=self.parameters,
        )

    def start_from(self, initial: InitialModel) -> InitialModel:
        """Make the filter ready to step from a model that was measured before, or changed since."""
        initial, self._core_model, self._filter = core_filter(initial, self.noise, self.estimate)
        if self.lag:
            check_can_smooth(self.noise)
        self._lag = _core.FixedLag(self._filter, self.lag) if self.lag else None
        self.initial, self._time = initial, None
        self._stepped = deque(maxlen=self.lag + 1)
        return initial

    def run_arrays(
        self,
        time: Array,
        markers: Array,
        wrench: Array,
        progress: Progress | None = None,
        feet: FootWrenches | None = None,
    ) -> dict[str, Array]:
        """Run over arrays after `start` or `start_from`, which it needs anew before another run.

        Args:
            time: (T,) s. markers: (T, M, 3) m, ground frame, in the order of the model's markers. wrench: (T, 6) N and
                N m, ground on person, about the ground origin. NaN: not measured.
            feet: as in `run`.

        Returns:
            Arrays by name, as `_core.Filter.run` gives them.

        Raises:
            DivergenceError: the filter lost its estimate; the message names the frame.
        """
        if self._filter is None:
            raise ConfigError("run_arrays: the estimator has not been started; call start or start_from first")
        time, markers, wrench = (np.ascontiguousarray(values) for values in (time, markers, wrench))
        arrays = self._filter.run(time, markers, wrench, progress, output_sd=True, feet=self._loads(feet))
        self._time = float(time[-1])
        return arrays

    def run_smoothed_arrays(
        self,
        time: Array,
        markers: Array,
        wrench: Array,
        progress: Progress | None = None,
        feet: FootWrenches | None = None,
    ) -> dict[str, Array]:
        """`run_arrays`, then backwards over the same frames: the smoothed arrays take the places of the filtered.

        Raises:
            ConfigError: the bounds are kept in a way that has no smoother. DivergenceError: as `run_arrays`.
        """
        if self._filter is None:
            raise ConfigError("run_smoothed_arrays: the estimator has not been started; call start or start_from first")
        check_can_smooth(self.noise)
        time, markers, wrench = (np.ascontiguousarray(values) for values in (time, markers, wrench))
        arrays = self._filter.run_smoothed(time, markers, wrench, progress, feet=self._loads(feet))
        self._time = float(time[-1])
        return smoothed(arrays)

    def step(self, sample: Sample, feet: FootWrenches | None = None) -> StepEstimate:
        """Take one sample, after `start`; samples come in the order of their times.

        The six rows of the wrench are the sum of the sample's plates. For a model with a floating root give plates
        only where they carry all that the ground does to the person, as `dynakin.stream.Live` decides in each step.

        Args:
            feet: for models with a floating root: the feet's wrenches in this frame (T = 1). Moments, deviations and
                those of `delayed` are then what these leave, as in `run`. Without them the moments of a floating model
                have no ground reaction in them, and are no joint moments of a person on the ground: use `run`, or
                `dynakin.stream.Live`, which finds the feet's wrenches. The state does not depend on it.

        Raises:
            RecordingError: the sample is older than the one before, or holds something else than numbers in the shapes
                of `Sample`. ModelError: feet that do not fit the model.
            DivergenceError: the filter lost its estimate.
        """
        if self._filter is None or self._core_model is None or self.initial is None:
            raise ConfigError("step: the estimator has not been started; call start(recording) first")
        markers, wrench = sample_arrays(sample, self.initial)
        dt = 0.0 if self._time is None else sample.time_s - self._time
        if dt < 0.0:
            raise RecordingError(f"sample at {sample.time_s} s: older than the one before, at {self._time} s")
        loads = self._loads(feet)
        if self._lag is not None:
            report = self._lag.step(dt, markers, wrench)
        else:
            if self._time is not None:
                self._filter.predict(dt)
            report = self._filter.update(markers, wrench)
        if report.diverged:
            raise DivergenceError(f"the filter diverged at {sample.time_s} s: {report.status}")
        self._time = sample.time_s
        self._stepped.append((sample.time_s, loads))
        return step_estimate(self._core_model, sample.time_s, self._filter.state, report, loads)

    def delayed(self) -> StepEstimate | None:
        """The frame that lies ``lag`` frames back, smoothed by all samples until now; None before there is one.

        Its ``time_s`` is its own: the delay is the last sample's time less that. Moments come from the feet's wrenches
        that `step` was given for that frame; without them, of a floating model, they have no ground reaction in them.

        Raises:
            ConfigError: the estimator was made without a lag.
        """
        if self._lag is None or self._core_model is None or self._time is None:
            raise ConfigError("delayed: expected Estimator(..., lag=frames), started and stepped")
        if not self._lag.ready:
            return None
        time = self._time - self._lag.delay_s
        _, loads = min(self._stepped, key=lambda stepped: abs(stepped[0] - time))
        return step_estimate(self._core_model, time, self._lag.state, None, loads)

    @property
    def core_model(self) -> _core.Model:
        """The core's model, once started."""
        if self._core_model is None:
            raise ConfigError("core_model: the estimator has not been started; call start(recording) first")
        return self._core_model

    @property
    def state(self) -> Array:
        """The present state (n,), named by ``initial.names``."""
        return self._started_filter("state").state

    @property
    def covariance(self) -> Array:
        """Its covariance (n, n)."""
        return self._started_filter("covariance").covariance

    @property
    def verdicts(self) -> list[str]:
        """missing, accepted or refused: each marker in the last step and, last, the plates."""
        return self._started_filter("verdicts").verdicts

    def _started_filter(self, what: str) -> _core.Filter:
        if self._filter is None:
            raise ConfigError(f"{what}: the estimator has not been started; call start(recording) first")
        return self._filter

    def deviations(self) -> dict[str, Array]:
        """Standard deviations of the present estimate, as it was last stepped: propagated now, not in every step.

        Returns:
            coordinates, speeds, accelerations, moments (C,), of all coordinates of the model; wrench (6,). Moments as
            `step` gave them: with the feet's wrenches where it had these.
        """
        if self._filter is None or self._core_model is None:
            raise ConfigError("deviations: the estimator has not been started; call start(recording) first")
        loads = self._stepped[-1][1] if self._stepped else None
        return deviations_of(self._core_model, self._filter.state, self._filter.covariance, loads)

    def _loads(self, feet: FootWrenches | None) -> _core.FootLoads | None:
        assert self._core_model is not None
        if feet is None:
            return None
        feet.check(self._core_model)
        return feet.core()

    def _delay(self, arrays: dict[str, Array]) -> tuple[float, float] | None:
        assert self.initial is not None
        return delay_of(self.initial, arrays["state"][-1], arrays["state_sd"][-1])

    def settings(self) -> dict[str, object]:
        """What was asked for, as plain data: written into the outputs."""
        return {
            "model": str(self.model.path if self.model.path.parent.name != "builtin" else self.model.name),
            "side": self.side,
            "loads": [load.model_dump(mode="json") for load in self.loads],
            "identified": None if self.parameters is None else self.parameters.use,
            "vertical": self.vertical,
            "forward": self.forward if isinstance(self.forward, str) else list(self.forward),
            "estimate": list(self.estimate),
            "noise": self.noise.model_dump(mode="json"),
            "priors": self.priors.model_dump(mode="json"),
            "bounds": self.bounds.model_dump(mode="json"),
        }

    def filter_settings(self, initial: InitialModel) -> _core.FilterSettings:
        """The core's settings for a measured model: this noise, the marker set's variances, the bounds of (9)."""
        assert self._core_model is not None
        return filter_settings(initial, self.noise, self._core_model.layout, self.estimate)


def _shares(progress: Progress | None, frames: int) -> tuple[Progress | None, Progress | None]:
    """One progress for a run forwards and the smoothing after it, which goes over the frames twice."""
    if progress is None:
        return None, None
    return lambda done, total: progress(done, 3 * frames), lambda done, total: progress(frames + done, 3 * frames)
