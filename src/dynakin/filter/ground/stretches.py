"""Stretches of a recording in which the plates bear the person, and what the motion of the whole body needs there, by
inverse kinematics of each frame, joints rigid: no filter, which would take up what is wrong with the plates."""

from __future__ import annotations

from copy import copy
from functools import cached_property
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from dynakin.arrays import Array, Flags, runs
from dynakin.bindings import _core
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.model.calibration.inverse_kinematics import FEWEST_MARKERS, inverse_kinematics
from dynakin.model.calibration.pose_start import bare
from dynakin.model.inertia import INERTIA_NAMES
from dynakin.recordings.resampling import low_pass
from dynakin.recordings.times import frame_numbers, on_grid, rate_of
from dynakin.units import GRAVITY_M_S2

CUTOFF_HZ = 6.0
"""Low-pass of motion and plates, of one delay: none."""
MASS, CENTRE_M, INERTIA, LEAST_INERTIA = 0.1, 0.02, 0.2, 1e-3
"""What is not known of segments: parts of mass and moments of inertia (kg m2 at least), m of the centre of mass."""
ROOM_S = 0.03
"""What is left at both ends of a stretch for plates that are out of step."""
SHORTEST_S, END_S, LONGEST_S = 0.4, 0.1, 5.0
"""Stretches that are judged; their ends are not; so much is, where loads change most."""
BRIDGED_S = 0.1
"""Longest gap of the markers that motion and plates are led across: little of a movement below `CUTOFF_HZ` is lost. Its
frames themselves do not count."""
LOADED, MOST_LOAD = 0.3, 2.0
"""Of the weight: mean of a stretch at least, and of the recording at most, because flesh follows a landing later than
bones do: a drop jump fits its plates worse by the 5 to 8 ms that its calmer parts ask for."""
FRAMES_HZ = 100.0
"""Twice as many frames a second show no more."""


class Stretch(NamedTuple):
    """What the ``part`` of the recording needs: wrench (T, 6) about the ground's origin, and its derivatives (T, 6, I)
    by inertia; both low-passed; the frames (T,) that count."""

    part: slice
    wrench: Array
    by_inertia: Array
    inner: Flags
    rate: float


class Moving:
    """A recording's motion on an even grid of N frames, of which rows that the file lacks show no markers.

    Attributes:
        time: (N,) s. rate: Hz.
    """

    def __init__(self, initial: CalibratedModel, time: Array, markers: Array) -> None:
        self._initial, self.rate = initial, rate_of(time)
        self._numbers = frame_numbers(time)
        self.time = _even_time(time, self._numbers)
        self._markers = self.laid(markers)
        self._seen: Flags = np.asarray(np.isfinite(self._markers).all(axis=2).sum(axis=1) >= FEWEST_MARKERS)
        self._found: dict[tuple[int, int, int], Stretch] = {}

    @cached_property
    def body(self) -> Body:
        """The person."""
        return Body(self._initial)

    def laid(self, values: Array) -> Array:
        """Values of the recording's frames (T, ...) on the grid."""
        return on_grid(self._numbers, values)

    def borne(self, wrench: Array) -> Borne | None:
        """Where a wrench (T, 6) that is NaN elsewhere bears the person; None where no stretch can be judged."""
        weight = self._initial.weighed_kg * GRAVITY_M_S2
        if self._initial.contacts or not self.rate >= 4.0 * CUTOFF_HZ:  # a rate that is NaN, too
            return None
        if (wrench[:, 1] > MOST_LOAD * weight).any():
            return None
        wrench, led = _led_across(self.laid(wrench), self._seen, round(BRIDGED_S * self.rate))
        shown = np.where((self._seen | led)[:, None], wrench, np.nan)
        parts = _parts(shown, self.rate, LOADED * weight)
        return Borne(wrench, self._stretches(parts), self, shown) if parts else None

    def at_the_ends(self, borne: Borne) -> list[Stretch]:
        """Other stretches, of the first and the last third."""
        weight = self._initial.weighed_kg * GRAVITY_M_S2
        return self._stretches(_at_the_ends(borne.shown, self.rate, LOADED * weight))

    def _stretches(self, parts: list[slice]) -> list[Stretch]:
        for part in parts:
            key = part.start, part.stop, part.step
            if key not in self._found:
                self._found[key] = self.body.needed(part, self._markers, self._seen, self.rate / part.step)
        return [self._found[part.start, part.stop, part.step] for part in parts]


class Borne(NamedTuple):
    """A wrench (N, 6) on the grid of the motion, led across short gaps of the markers, the stretches in which it is
    known, and itself as it is ``shown`` (N, 6) by markers."""

    wrench: Array
    stretches: list[Stretch]
    moving: Moving
    shown: Array


class Body:
    """The calibrated person as a rigid model whose inertia may be somewhat other than it is said to be."""

    def __init__(self, initial: CalibratedModel) -> None:
        self._initial = initial
        spec = bare(copy(initial.spec))
        segments = spec.segments
        for segment in segments:
            segment.inertia_estimated = [bool(segment.inertia[0] > 0.0)] * len(INERTIA_NAMES)
        spec.segments = segments
        self._model = _core.Model(spec)
        self._state = np.array(self._model.initial_state())
        self._inertia = [k for k, name in enumerate(self._model.layout.names) if name.startswith("inertia/")]
        known = [_unsure(np.array(segment.inertia)) for segment in segments if segment.inertia[0] > 0.0]
        self.inertia_sd = np.concatenate(known)

    def needed(self, part: slice, every: Array, known: Flags, rate: float) -> Stretch:
        """Of a part of the markers (N, M, 3), which show enough in most of its frames (N,); rate: Hz, of the part."""
        markers, seen = every[part], known[part]
        posed = inverse_kinematics(self._initial, markers[seen])
        q = through(np.flatnonzero(seen), posed, np.arange(len(markers))) if not seen.all() else posed
        q = low_pass(q, rate, CUTOFF_HZ)
        qd = np.gradient(q, 1.0 / rate, axis=0)
        motion = np.hstack([q, qd, np.gradient(qd, 1.0 / rate, axis=0)])
        wrench, by_inertia = np.empty((len(q), 6)), np.empty((len(q), 6, len(self._inertia)))
        x = self._state.copy()
        for k, moving in enumerate(motion):
            x[: len(moving)] = moving
            wrench[k] = _core.wrench(self._model, x)
            by_inertia[k] = _core.wrench_jacobian(self._model, x)[:, self._inertia]
        inner, end = seen.copy(), round(END_S * rate)
        inner[:end] = inner[len(inner) - end :] = False
        return Stretch(part, wrench, by_inertia, inner, rate)


def _even_time(time: Array, numbers: npt.NDArray[np.intp]) -> Array:
    """Times (N,) s of all frames of the grid on which those (T,) of these numbers lie."""
    return np.interp(np.arange(int(numbers[-1]) + 1), numbers, time)


def _led_across(wrench: Array, seen: Flags, most: int) -> tuple[Array, Flags]:
    """The wrench (T, 6) led across gaps of the markers (T,) of at most so many frames, and which (T,) those are:
    without the feet it is not known who stands on which plate. Frames that are seen without it are left as they are."""
    known: Flags = np.asarray(np.isfinite(wrench).all(axis=1))
    led = np.zeros(len(seen), dtype=bool)
    for first, end in runs(~seen):
        if first > 0 and end < len(seen) and end - first <= most and known[first - 1] and known[end]:
            led[first:end] = True
    if not led.any():
        return wrench, led
    found = wrench.copy()
    found[led] = through(np.flatnonzero(known), wrench[known], np.flatnonzero(led))
    return found, led


def _unsure(inertia: Array) -> Array:
    """Standard deviations of the ten numbers of a segment, in the order of ``INERTIA_NAMES``."""
    mass = inertia[0]
    return np.concatenate(
        [[MASS * mass], np.full(3, CENTRE_M * mass), np.maximum(INERTIA * np.abs(inertia[4:]), LEAST_INERTIA)]
    )


def _at_the_ends(wrench: Array, rate: float, least_n: float) -> list[slice]:
    """`_parts` of the first and the last third of a long recording, where a drift shows; none of a short one, or
    where one of them has none."""
    third = len(wrench) // 3
    if not len(wrench) > 1.5 * LONGEST_S * rate:
        return []
    first, last = wrench.copy(), wrench.copy()
    first[third:] = last[:-third] = np.nan
    found = [_parts(each, rate, least_n, 0.5 * LONGEST_S) for each in (first, last)]
    return [*found[0], *found[1]] if all(found) else []


def _parts(wrench: Array, rate: float, least_n: float, longest_s: float = LONGEST_S) -> list[slice]:
    """Stretches of known frames that bear so much, so long in all: those in which loads change most; with room for a
    delay."""
    known = np.asarray(np.isfinite(wrench).all(axis=1))
    room, most = round(ROOM_S * rate) + 1, round(longest_s * rate)
    found = [(a + room, b - room) for a, b in runs(known) if b - a - 2 * room >= (SHORTEST_S + 2.0 * END_S) * rate]
    parts = [slice(a, min(a + most, b)) for first, b in found for a in range(first, b, most)]
    stride = max(int(rate / FRAMES_HZ + 1e-6), 1)
    parts = [
        slice(part.start, part.stop, stride)
        for part in parts
        if part.stop - part.start >= (SHORTEST_S + 2.0 * END_S) * rate and wrench[part, 1].mean() > least_n
    ]
    change = [float(np.square(np.diff(wrench[part, :3], axis=0)).mean()) for part in parts]
    chosen, left = list[slice](), most
    for k in np.argsort(change)[::-1]:
        if left >= parts[k].stop - parts[k].start or not chosen:
            chosen.append(parts[k])
            left -= parts[k].stop - parts[k].start
    return chosen


def through(at: npt.NDArray[np.intp], values: Array, wanted: npt.NDArray[np.intp]) -> Array:
    """Values at wanted frames of the spline through others at theirs."""
    from scipy.interpolate import CubicSpline  # loads scipy.optimize, slowly

    return np.asarray(CubicSpline(at, values)(wanted))
