"""A filter at work: the state of one calibrated model, from sample to sample or over the arrays of a recording."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from functools import cached_property, partial
from typing import Any

import numpy as np

from dynakin.arrays import Array
from dynakin.bindings import _core
from dynakin.errors import ConfigError, DivergenceError, RecordingError
from dynakin.filter.contacts import ContactLoads, stands_off_plates
from dynakin.filter.core_filter import core_filter, smoothed
from dynakin.filter.live.ahead import Ahead, LookAhead, check_ahead
from dynakin.filter.live.feet import LiveFeet
from dynakin.filter.live.found_noise import FoundNoise
from dynakin.filter.live.steps import Stepped, Steps
from dynakin.filter.measurements import Measurements
from dynakin.filter.samples import Sample, sample_arrays
from dynakin.filter.sight import LiveSight
from dynakin.filter.sources import ContactSources
from dynakin.filter.step import Labelled, Labels, StepEstimate, step_estimate
from dynakin.filter.uncertainty.systematic import Systematic
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.progress import Progress
from dynakin.recordings.feet.contact import UNMEASURED
from dynakin.results.measures.sources import ABSENT, DERIVED
from dynakin.results.records import NO_ESTIMATE
from dynakin.settings.lag import check_can_smooth
from dynakin.settings.model import QUANTITIES, Quantity
from dynakin.settings.noise import Noise


class Tracker:
    """Follows one person: what `Estimator.start` gives.

    Args:
        calibrated: the model and where it starts.
        noise, estimate: as of `Estimator`.
        lag: frames by which `delayed` lies behind `step`; 0: there is none.
        plates: names of all force plates; not given: those that samples have had so far.
        assigned: plate -> foot or declared contact, as ``plates`` of `Estimator`.
        ahead_s: by which `ahead` looks ahead of `step`, s; 0: there is none.

    Attributes:
        feet: of a floating model, from its first `step` on: which feet its plates carry. Its ``news()`` are sentences.
        calibrated: the same with the states that the noise asks for, as the filter has them.
        core_model: it, compiled.

    Raises:
        ConfigError: the noise names a marker that the model does not use, or has no smoother for a lag; ``ahead_s`` is
            negative or no number.
    """

    def __init__(
        self,
        calibrated: CalibratedModel,
        noise: Noise,
        estimate: Collection[Quantity] = QUANTITIES,
        lag: int = 0,
        plates: Collection[str] = (),
        assigned: Mapping[str, str] | None = None,
        ahead_s: float = 0.0,
    ) -> None:
        self.calibrated, self.core_model, self._filter = core_filter(calibrated, noise, estimate)
        self.noise, self.estimate, self.lag, self.plates = noise, tuple(estimate), lag, tuple(plates)
        self.feet: LiveFeet | None = None
        self._assigned, self._seen_plates = assigned or {}, dict.fromkeys(plates)
        if lag:
            check_can_smooth(noise)
        self._lag = _core.FixedLag(self._filter, lag) if lag else None
        self._filter.report_sensors(True)
        self._labels = Labels.of(self.core_model)
        self._sources = ContactSources.of(self.calibrated)
        self._sight = LiveSight(self.core_model)
        self._time: float | None = None
        self._latest: StepEstimate | None = None
        self._steps = Steps(self.core_model, noise, lag)
        self._look_ahead = LookAhead(self.core_model, ahead_s) if check_ahead(ahead_s) else None
        self._found = FoundNoise() if noise.calibrates(bool(calibrated.feet)) else None

    def fresh(self) -> Tracker:
        """Another one, at the start of the same model."""
        return self.changed(self.noise)

    def changed(self, noise: Noise, calibrated: CalibratedModel | None = None) -> Tracker:
        """Another one, at the start of the same model with other noise, which asks for the same states.

        Args:
            calibrated: the same model that starts elsewhere or less surely.
        """
        ahead_s = 0.0 if self._look_ahead is None else self._look_ahead.horizon_s
        return Tracker(
            calibrated or self.calibrated, noise, self.estimate, self.lag, self.plates, self._assigned, ahead_s
        )

    @property
    def state(self) -> Array:
        """The present state (n,), named by ``calibrated.names``."""
        return self._filter.state

    @property
    def covariance(self) -> Array:
        """Its covariance (n, n)."""
        return self._filter.covariance

    @property
    def verdicts(self) -> list[str]:
        """missing, accepted or refused: each marker in the last step and, last, the plates."""
        return self._filter.verdicts

    @property
    def sensors(self) -> dict[str, Array]:
        """What each sensor said in the last step: innovation and innovation_sd (3 M + 6,), 3 a marker, then the
        plates'; test_ratio (M + 1,) as in `Estimate`. NaN: not measured."""
        return self._filter.sensors

    @cached_property
    def systematic(self) -> Systematic | None:
        """What is added to the filter's own deviations when they are reported; None where the noise asks for none, and
        for a model that is fixed in the ground: its lengths are states that drift, and its own deviations hold."""
        wanted = self.noise.systematic_scale and self.calibrated.feet
        return Systematic(self.calibrated, self.noise) if wanted else None

    def found_noise(self, *, delayed: bool = False) -> Noise:
        """The noise with the factor on its variances that innovations have shown until now (`FoundNoise`): deviations
        go by it, the movement does not. delayed: of those of `delayed`."""
        shown = 1.0 if self._found is None else self._found.variance_scale(late=delayed)
        return self.noise.changed(variance_scale=shown * self.noise.variance_scale)

    @property
    def latest(self) -> StepEstimate:
        """What the last step gave; before the first one the start, whose time is NaN."""
        if self._latest is None:
            time = np.nan if self._time is None else self._time
            sources = self._sources.moments(None)[0]
            self._latest = step_estimate(self.core_model, self._labels, time, self.state, None, sources)
        return self._latest

    def step(self, sample: Sample, feet: ContactLoads | None = None) -> StepEstimate:
        """Take one sample; samples come in the order of their times.

        The six rows of the wrench are the sum of the sample's plates; where one of them is left out, it is not known.
        For a model with a floating root the plates are given to the feet that stand on them (`LiveFeet`, by the frames
        until now), and the feet's wrenches are what moments, deviations and those of `delayed` come from; what no plate
        carries is estimated, and `moment_sources` says where. Plates are taken as they are: `dynakin.stream.Live` also
        checks their axes, signs and clock, and what of the samples is no measurement.

        Args:
            feet: the feet's wrenches in this frame (T = 1) where they are known otherwise; the sample's plates are then
                not asked.

        Raises:
            RecordingError: the sample is older than the one before, or holds something else than numbers in the shapes
                of `Sample`. ModelError: feet that do not fit the model.
            DivergenceError: the filter lost its estimate.
        """
        if strange := [name for name in sample.plates if self.plates and name not in self.plates]:
            raise RecordingError(
                f"sample at {sample.time_s} s: plate {strange[0]!r} is unknown, expected {', '.join(self.plates)}, as "
                "in the recording of the start"
            )
        self._seen_plates |= dict.fromkeys(sample.plates)
        markers, wrench = sample_arrays(sample, self.calibrated, self._seen_plates)
        dt = 0.0 if self._time is None else sample.time_s - self._time
        if dt < 0.0:
            raise RecordingError(f"sample at {sample.time_s} s: older than the one before, at {self._time} s")
        if feet is None and self.calibrated.feet:
            feet = self._on_plates(sample, markers)
        feet = feet and feet.weighed(self.noise.variance_scale)
        loads = self._loads(feet)
        covariance = effects = None
        if feet is not None:
            wrench, covariance, effects = (values[0] for values in feet.total())
        if self._lag is not None:
            report = self._lag.step(dt, markers, wrench, covariance, effects)
        else:
            if self._time is not None:
                self._filter.predict(dt)
            report = self._filter.update(markers, wrench, covariance, effects)
        if report.diverged:
            raise DivergenceError(f"the filter diverged at {sample.time_s} s: {report.status}")
        self._time = sample.time_s
        if self._found is not None:
            self._found.look(sample.time_s, markers, report)
        unmeasured = feet is not None and bool((feet.contact == UNMEASURED).any())
        plates_refused = self.verdicts[-1] == "refused"
        sources = self._sources.moments(feet, refused=plates_refused and not unmeasured)[0]
        if not self.calibrated.feet and self.verdicts[-1] != "accepted":
            sources = np.maximum(sources, np.uint8(DERIVED))
        if report.tracking in NO_ESTIMATE:
            sources = np.full_like(sources, ABSENT)
        refused = np.array(self.verdicts[:-1]) == "refused"
        unseen = self._sources.unseen(self._sight.look(sample.time_s, markers, self.state, refused), 1)[0]
        sources[unseen] = ABSENT
        blind = feet is not None and bool(feet.blind.any())
        plates_sd = None if feet is None or plates_refused or not feet.by_plates[0] else feet.plates_sd()[0]
        self._steps.off_plates |= feet is not None and stands_off_plates(feet.contact, len(self.calibrated.feet))
        segments = () if feet is None else feet.segments
        noise = None if feet is None else feet.noise_left()
        left = None if noise is None else noise[0]
        used = self._sight.used
        step = Stepped(sample.time_s, loads, sources, segments, unmeasured, blind, plates_sd, left, unseen, used)
        self._steps.add(step)
        self._latest = self._estimate(step, sample.time_s, self.state, report)
        if self._look_ahead is not None:
            if report.tracking in NO_ESTIMATE:
                self._look_ahead.interrupted()
            else:
                self._look_ahead.look(sample.time_s, self.state)
        return self._latest

    def _on_plates(self, sample: Sample, markers: Array) -> ContactLoads:
        """The feet's wrenches by the sample's plates, and its markers (M, 3) but those that were refused before."""
        names = tuple(self._seen_plates)
        if self.feet is None:
            self.feet = LiveFeet(self.calibrated, self.noise, names, self._assigned)
        elif self.feet.plates != names:
            self.feet.meet(names)
        seen = np.where(np.array(self.verdicts[:-1])[:, None] == "refused", np.nan, markers)
        unknown = np.full(6, np.nan)  # of a plate that the sample lacks
        plates = np.array([sample.plates.get(name, unknown) for name in names], dtype=float) if sample.plates else None
        return self.feet.look(self.core_model, self.state, sample.time_s, plates, seen)

    def _estimate(self, step: Stepped, time_s: float, x: Array, report: _core.StepReport | None) -> StepEstimate:
        by_plates = step.plates_sd is not None
        return step_estimate(
            self.core_model, self._labels, time_s, x, report, step.sources, step.loads, by_plates=by_plates
        )

    def delayed(self) -> StepEstimate | None:
        """The frame that lies ``lag`` frames back, smoothed by all samples until now; None before there is one.

        Its ``time_s`` is its own: the delay is the last sample's time less that. Moments come from the feet's wrenches
        that `step` had for that frame.

        Raises:
            ConfigError: the tracker was started without a lag.
        """
        lag = self._with_lag()
        if self._time is None or not lag.ready:
            return None
        step = self._delayed_step(lag)
        time = self._time - lag.delay_s
        return self._estimate(step, time, lag.state, None)

    def ahead(self) -> Ahead | None:
        """What is expected ``ahead_s`` after the last step; None before the first one, and where the motion is lost.

        Raises:
            ConfigError: the tracker was started without.
        """
        if self._look_ahead is None:
            raise ConfigError("ahead: the tracker does not look ahead, expected Estimator.start(..., ahead_s=SECONDS)")
        return self._look_ahead.expected()

    def deviations(self, *, delayed: bool = False) -> dict[str, Labelled]:
        """Standard deviations of the present estimate, as it was last stepped: propagated now, not in every step. They
        are by `found_noise`, and hold what the filter cannot know, too (`systematic`).

        Args:
            delayed: those of `delayed` instead, once there is one; they take as long as 0.6 steps for each frame of
                the lag.

        Returns:
            coordinates, speeds, accelerations, moments (C,), of all coordinates of the model; wrench (6,).

        Raises:
            ConfigError: ``delayed``, and the tracker was started without a lag.
        """
        step, state, covariance = self._steps.last, self.state, self.covariance
        if late := delayed and self._with_lag().ready:
            lag = self._with_lag()
            step, state, covariance = self._delayed_step(lag), lag.state, lag.covariance
        found = self._steps.deviations(
            step, (state, covariance), self.found_noise(delayed=late), self.systematic, late=late
        )
        return {name: Labelled(values, self._labels.on(name)) for name, values in found.items()}

    def _with_lag(self) -> _core.FixedLag:
        if self._lag is None:
            raise ConfigError("delayed: the tracker has no lag, expected Estimator.start(..., lag_s=SECONDS)")
        return self._lag

    def _delayed_step(self, lag: _core.FixedLag) -> Stepped:
        """What is known of the frame at the lag."""
        assert self._time is not None
        return self._steps.at(self._time - lag.delay_s)

    def run_arrays(
        self, measured: Measurements, progress: Progress | None = None, *, state_only: bool = False
    ) -> dict[str, Array]:
        """Go on over T frames, from the present state.

        Args:
            progress: as in `Estimator.run`.
            state_only: without what follows from the state (markers, wrenches, moments, their deviations) and what
                was expected of sensors: it takes a third of the time that the rest takes, and changes none of it.

        Returns:
            Arrays by name, as `_core.Filter.run` gives them.

        Raises:
            DivergenceError: the filter lost its estimate; the message names the frame.
        """
        run = partial(self._filter.run, output_sd=not state_only, state_only=state_only)
        return self._run(run, measured, progress)

    def run_smoothed_arrays(self, measured: Measurements, progress: Progress | None = None) -> dict[str, Array]:
        """`run_arrays`, then backwards over the same frames: the smoothed arrays take the places of the filtered.

        Raises:
            ConfigError: the bounds are kept in a way that has no smoother. DivergenceError: as `run_arrays`.
        """
        check_can_smooth(self.noise)
        return smoothed(self._run(self._filter.run_smoothed, measured, progress))

    def run_late_arrays(
        self, lag: int | None, measured: Measurements, progress: Progress | None = None
    ) -> dict[str, Array]:
        """Each frame estimated from those until ``lag`` frames later: what `delayed` gives of it, with its deviations,
        and the last frames from those that there are. None: `run_smoothed_arrays`; 0: `run_arrays`.

        Raises:
            ConfigError, DivergenceError: as `run_smoothed_arrays`.
        """
        if lag is None:
            return self.run_smoothed_arrays(measured, progress)
        if not lag:
            return self.run_arrays(measured, progress)
        check_can_smooth(self.noise)
        return smoothed(self._run(partial(self._filter.run_lagged, lag=lag), measured, progress))

    def _run(
        self, run: Callable[..., dict[str, Array]], measured: Measurements, progress: Progress | None
    ) -> dict[str, Array]:
        """One of the core's runs, from the present state."""
        time, markers, wrench = (np.ascontiguousarray(values) for values in measured[:3])
        wrench, given = self._given(wrench, measured.contacts)
        arrays = run(time, markers, wrench, progress=progress, **given)
        self._time, self._latest = float(time[-1]), None
        return arrays

    def _given(self, wrench: Array, feet: ContactLoads | None) -> tuple[Array, dict[str, Any]]:
        """The total wrench, and how it and the contacts are known: what these sum up to where there are any."""
        if feet is None:
            return wrench, {}
        feet = feet.weighed(self.noise.variance_scale)
        total, covariance, effects = feet.total()
        return total, {"feet": self._loads(feet), "wrench_covariance": covariance, "wrench_effects": effects}

    def _loads(self, feet: ContactLoads | None) -> _core.ContactLoads | None:
        if feet is None:
            return None
        feet.check(self.core_model)
        return feet.core()
