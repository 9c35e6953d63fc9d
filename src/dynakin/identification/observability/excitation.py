"""Which motion would identify more: the filter's own deviations after the trial's motion with something added to it.

Nothing is drawn at random and nothing is fitted: from the same prior, with the same noise, least squares along the
motion (`KnownMotion`) give the deviations that the filter would end with. So a gain counts all that the filter does not
know either (coordinates, soft tissue, slow errors of the plates), which the information matrix of the regressor alone
leaves out: that one takes the motion for known and can promise twice too much (the arm's first moment of `squat7`,
shoulder swinging: 8.5 times instead of 4.4).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dynakin.arrays import Array
from dynakin.bindings import _core
from dynakin.filter.tracker import Tracker
from dynakin.identification.observability.known_motion import Known, KnownMotion
from dynakin.identification.observability.measured import MeasuredModel
from dynakin.recordings.plates.pressure import pressed_at
from dynakin.recordings.times import step_of
from dynakin.results.estimate import Estimate
from dynakin.results.naming import words
from dynakin.simulation.jets import Jet, sinusoids, step

LONGEST_S = 20.0  # of the trial that is tried: gains are ratios, a longer stretch changes both sides
ROTATIONS = ((30.0, 1.0), (20.0, 1.0), (10.0, 1.0), (10.0, 0.5), (5.0, 1.0), (5.0, 0.5))
"""deg and Hz, liveliest first; 30 deg once a second has a peak speed of 190 deg/s: brisk, not violent."""
TRANSLATIONS = ((0.10, 1.0), (0.05, 1.0), (0.02, 1.0))
"""m and Hz."""
FASTER = (1.5, 1.25)
_RAMP_S = 1.0
_LIGHTEST = 0.3  # of the person's mean load: less comes near to a jump


@dataclass(frozen=True, eq=False)
class Motion:
    """Coordinates of a motion, their speeds and accelerations, (T, F) each, at times (T,) s."""

    time: Array
    q: Array
    qd: Array
    qdd: Array


@dataclass(frozen=True, eq=False)
class Excitation:
    """A motion tried in place of the trial's.

    Attributes:
        name: coordinate that is moved, or "faster". words: what to do.
        sd: (n,) standard deviations after it, as `Bench.deviations` gives them.
    """

    name: str
    words: str
    sd: Array


class Bench:
    """The trial's motion, to try other motions in its place.

    Args:
        tracker, estimate: as `Estimator.track` gave them.
    """

    def __init__(self, tracker: Tracker, estimate: Estimate) -> None:
        self.measured = MeasuredModel.of(tracker)
        initial = tracker.calibrated
        self.coordinates = self.measured.names[self.measured.block("coordinates")]
        time = estimate.time
        frames = int(np.searchsorted(time, time[0] + LONGEST_S)) if time[-1] - time[0] > LONGEST_S else len(time)
        first = (len(time) - frames) // 2
        stretch = slice(first, first + frames)
        self.missing = np.isnan(estimate.values("markers_measured")[stretch][:, :, estimate.modelled_axes()]).any(
            axis=2
        )
        modelled = np.array(initial.spec.wrench_measured)
        self.blind = np.isnan(estimate.values("wrench_measured")[stretch][:, modelled]).any(axis=1)
        state = estimate.values("state")
        self.constants = state[-1].copy()
        for block in ("soft_tissue", "plates"):  # their means
            self.constants[self.measured.block(block)] = 0.0
        at = [self.measured.block(block) for block in ("coordinates", "speeds", "accelerations")]
        self.trial = Motion(time[stretch] - time[first], *(state[stretch, block] for block in at))
        self._tracker = tracker
        self.limits = (initial.lower[at[0]], initial.upper[at[0]])
        rotations = {name for name, kind in zip(estimate.coordinate_names, estimate.is_rotation(), strict=True) if kind}
        self.rotation = [name in rotations for name in self.coordinates]
        tree, feet = initial.tree, initial.feet.values()
        self.standing = set(feet) or set(tree.roots)
        held = {*tree.up(*self.standing), *tree.below(*feet)}  # what would move the feet: all up to the root; and toes
        self.grounded = {axis.coordinate for s in initial.spec.segments if s.name in held for axis in s.axes}
        self.support = self._support()
        self.least_load = _LIGHTEST * abs(float(self.loads(self.trial)[0].mean()))

    def states(self, motion: Motion) -> Array:
        """States (T, n) of a motion, the constants as the trial ended with."""
        states = np.tile(self.constants, (len(motion.time), 1))
        for block, values in (("coordinates", motion.q), ("speeds", motion.qd), ("accelerations", motion.qdd)):
            states[:, self.measured.block(block)] = values
        return states

    @cached_property
    def _known(self) -> KnownMotion:
        step_s = step_of(self.trial.time) if len(self.trial.time) > 1 else 1.0
        return KnownMotion(self._tracker, self.measured, step_s)

    def deviations(self, *motions: Motion) -> Array:
        """Standard deviations (n,) after these motions, one after the other, measured as the trial was; NaN: skin and
        contacts."""
        known, first = [], 0
        for motion in motions:
            end = first + len(motion.time)
            known.append(Known(self.states(motion), self.missing[first:end], self.blind[first:end]))
            first = end
        return self._known.deviations(*known)

    def loads(self, motion: Motion) -> tuple[Array, Array]:
        """Vertical force (T,) N and centre of pressure (T,) m, forward from the ground origin, of a motion."""
        wrench = np.stack([_core.wrench(self.measured.core, x) for x in self.states(motion)])
        return wrench[:, 1], pressed_at(wrench, least_n=0.0)[:, 0]

    def possible(self, motion: Motion) -> bool:
        """Within the joints' limits, the feet loaded and the centre of pressure under them."""
        if (motion.q < self.limits[0]).any() or (motion.q > self.limits[1]).any():
            return False
        load, centre = self.loads(motion)
        return bool(load.min() > self.least_load and self.support[0] <= centre.min() <= centre.max() <= self.support[1])

    def with_added(self, index: int, size: float, frequency_hz: float) -> Motion:
        """The trial's motion with a sinusoid of coordinate ``index`` (rad or m) on top, that sets in within 1 s."""
        t = self.trial
        added: Jet = step(t.time, 0.0, _RAMP_S) * sinusoids(
            t.time, np.array([size]), np.array([frequency_hz]), np.zeros(1)
        )
        q, qd, qdd = t.q.copy(), t.qd.copy(), t.qdd.copy()
        for values, more in ((q, added.value), (qd, added.rate), (qdd, added.second)):
            values[:, index] += more
        return Motion(t.time, q, qd, qdd)

    def faster(self, factor: float) -> tuple[Motion, ...]:
        """The trial's motion so many times as fast, again and again within the same time."""
        t, found, left = self.trial, [], len(self.trial.time)
        at = factor * t.time[t.time * factor <= t.time[-1]]

        def slower(values: Array) -> Array:
            return np.stack([np.interp(at, t.time, column) for column in values.T], axis=1)

        once = Motion(at / factor, slower(t.q), factor * slower(t.qd), factor**2 * slower(t.qdd))
        while left > 0:
            n = min(left, len(at))
            found.append(Motion(once.time[:n], once.q[:n], once.qd[:n], once.qdd[:n]))
            left -= n
        return tuple(found)

    def try_all(self, progress: Callable[[int, int], None] | None = None) -> tuple[Array, list[Excitation]]:
        """Standard deviations (n,) after the trial's own motion, and after each motion that is possible."""
        now = self.deviations(self.trial)
        found = []
        for k, name in enumerate(self.coordinates):
            if name not in self.grounded and (tried := self.liveliest(k)) is not None:
                found.append(Excitation(name, tried[0], self.deviations(tried[1])))
            if progress is not None:
                progress(k + 1, len(self.coordinates) + 1)
        for factor in FASTER:
            quick = self.faster(factor)
            if all(self.possible(motion) for motion in quick):
                text = f"the same movement {factor:g} times as fast"
                found.append(Excitation("faster", text, self.deviations(*quick)))
                break
        return now, found

    def liveliest(self, index: int) -> tuple[str, Motion] | None:
        """The first of the sinusoids of one coordinate that is possible, in words too."""
        turns = self.rotation[index]
        for size, frequency in ROTATIONS if turns else TRANSLATIONS:
            motion = self.with_added(index, np.radians(size) if turns else size, frequency)
            if self.possible(motion):
                much = f"{size:.0f} deg" if turns else f"{100.0 * size:.0f} cm"
                often = "once a second" if frequency == 1.0 else f"once in {1.0 / frequency:g} s"
                return f"moving the {words(self.coordinates[index])} by ± {much} {often}", motion
        return None

    def _support(self) -> tuple[float, float]:
        """From the rearmost to the foremost point of what stands on the ground, or as far as the trial's own centre of
        pressure goes, m forward from the ground origin."""
        spec = self.measured.initial.spec
        places = _core.marker_positions(self.measured.core, self.states(self.trial)[0])
        ends = [0.0, *(float(p[0]) for p, m in zip(places, spec.markers, strict=True) if m.segment in self.standing)]
        centre = self.loads(self.trial)[1]
        return min(*ends, float(centre.min())), max(*ends, float(centre.max()))
