"""The last steps of a session, and how sure what they estimate is."""

from __future__ import annotations

from collections import deque
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from dynakin.arrays import Array, Codes
from dynakin.bindings import _core
from dynakin.filter.augment import variance_scales
from dynakin.filter.noise import prior_factor
from dynakin.filter.step import deviations_of
from dynakin.filter.uncertainty.frames import Frames, as_believed
from dynakin.filter.uncertainty.geometry import BLOCKS
from dynakin.filter.uncertainty.systematic import Systematic
from dynakin.recordings.times import step_of
from dynakin.results.measures.sources import ABSENT, MEASURED
from dynakin.settings.noise import Noise


class Stepped(NamedTuple):
    """Of a step: its feet, whose moments are measured, their segments, whether plates miss one of them, or all; (6,)
    deviations of their sum where plates measure all of it, else None; noise as of `Frames`, of one; (C,) coordinates of
    which nothing is seen; (M,) markers that show the posture."""

    time_s: float
    loads: _core.ContactLoads | None
    sources: Codes
    segments: tuple[str, ...]
    unmeasured: bool
    blind: bool
    plates_sd: Array | None
    noise: Array | None
    unseen: npt.NDArray[np.bool_]
    used: npt.NDArray[np.bool_]


class Steps:
    """Those of one filter, as far back as its lag, and the one before, by which loads change.

    Attributes:
        last: before the first one the start, as if all of it were seen and measured.
        off_plates: whether some foot has stood off the plates.
    """

    def __init__(self, model: _core.Model, noise: Noise, lag: int) -> None:
        self._model, self._noise = model, noise
        count, markers = len(model.coordinate_names), len(model.spec.markers)
        unseen, used = np.zeros(count, dtype=bool), np.ones(markers, dtype=bool)
        self.last = Stepped(0.0, None, np.zeros(count, np.uint8), (), False, False, None, None, unseen, used)
        self.off_plates = False
        self._steps: deque[Stepped] = deque(maxlen=lag + 2)

    def add(self, step: Stepped) -> None:
        """The next one."""
        self._steps.append(step)
        self.last = step

    def at(self, time_s: float) -> Stepped:
        """The one nearest to a time."""
        return min(self._steps, key=lambda step: abs(step.time_s - time_s))

    def deviations(
        self,
        step: Stepped,
        known: tuple[Array, Array],
        found_noise: Noise,
        systematic: Systematic | None,
        *,
        late: bool,
    ) -> dict[str, Array]:
        """Standard deviations of what is known: blocks (C,), wrench (6,).

        Args:
            known: state (n,) and its covariance (n, n), by the filter's noise. found_noise: that these go by, but of
                what rests on a contact that no plate measures, whose prior innovations say nothing of.
            systematic: what is added to the filter's own. late: whether later frames helped.
        """
        (state, covariance), names = known, self._model.layout.names
        root = np.sqrt(variance_scales(names, found_noise) / variance_scales(names, self._noise))
        shown = root[:, None] * covariance * root
        found = deviations_of(self._model, state, shown, step.loads, step.plates_sd)
        if step.unmeasured:
            prior, factor = found, prior_factor(self._noise)
            if found_noise.variance_scale != self._noise.variance_scale:
                prior = deviations_of(self._model, state, covariance, step.loads, step.plates_sd)
            found["moments"] = np.where(step.sources != MEASURED, factor * prior["moments"], found["moments"])
            found["wrench"] = factor * prior["wrench"] if step.blind else found["wrench"]
        if systematic is not None:
            wrench, rate = self.wrenches(step, state)
            if step.plates_sd is not None:
                found["wrench"] = np.hypot(found["wrench"], systematic.sizes.clock * rate[:-1].sum(axis=0))
            frames = Frames(
                time=np.array([step.time_s]),
                step_s=step_of(np.array([each.time_s for each in self._steps])),
                states=state[None],
                sd={block: found[block][None] for block in BLOCKS},
                known_sd=np.ones((1, len(state))),
                known=covariance / self._noise.variance_scale,
                wrench=wrench[None],
                wrench_rate=rate[None],
                segments=step.segments,
                used=step.used[None],
                sources=(step.sources if step.unmeasured else as_believed(step.sources))[None],
                ends=np.zeros(1, dtype=bool),  # a session has none
                off_plates=self.off_plates,
                late=late,
                variance_scale=found_noise.variance_scale,
                noise=None if step.noise is None else step.noise[None],
            )
            found |= {block: values[0] for block, values in systematic.added(frames).items()}
        found["moments"] = np.where(step.sources == ABSENT, np.nan, found["moments"])
        return found | {name: np.where(step.unseen, np.nan, found[name]) for name in BLOCKS[:3]}

    def wrenches(self, step: Stepped, state: Array) -> tuple[Array, Array]:
        """The contacts' wrenches (F, 6), and by how much they changed since the step before, a second: not at all of
        the first, and where other contacts bore before."""
        if step.loads is None:
            return np.zeros((0, 6)), np.zeros((0, 6))
        wrench = np.asarray(_core.contact_moments(self._model, state, step.loads)["foot_wrench"])
        earlier = [each for each in self._steps if each.time_s < step.time_s]
        before = max(earlier, default=None, key=lambda each: each.time_s)
        if before is None or before.loads is None or before.segments != step.segments:
            return wrench, np.zeros_like(wrench)
        then = _core.contact_moments(self._model, state, before.loads)["foot_wrench"]
        return wrench, np.asarray((wrench - then) / (step.time_s - before.time_s))
