"""What is expected a moment ahead: posture and markers by speeds and accelerations that fade, the ground's push by what
has become of such pushes until now."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np

from dynakin.arrays import Array, wrench_about
from dynakin.bindings import _core
from dynakin.errors import ConfigError
from dynakin.filter.step import Labelled, Labels

FADE_S = 0.05
"""In which accelerations fade as a posture is carried on, and in which what the ground pushes beyond the weight returns
to nothing, as long as nothing else has been seen. The former was chosen on `squats1` and `MH0222_BP06` of 0 to 150 ms;
the latter there, on simulated squats and walks and on six more recordings, of 35 to 60 ms (docs/derivations.md)."""
_SLOPE_S = 0.03  # over which a slope is taken: 20 and 50 ms do as well
_BELIEVED_S = 1.0  # of movement that counts as much as what is expected before any: 0.5 and 2 s do as well
_MEMORY_S = 10.0  # as of the noise that a session finds
_SETTLED_S = 0.2  # a filter that begins has accelerations of its own, and nothing is to be learned from them
_BLOCKS = ("coordinates", "speeds", "accelerations")


@dataclass(frozen=True, eq=False, slots=True)
class Ahead:
    """What is expected.

    Attributes:
        time_s: of what is expected, s.
        values: the arrays that the properties label, by the properties' names.
        labels: whose names they have.
    """

    time_s: float
    values: Mapping[str, Array]
    labels: Labels

    @property
    def coordinates(self) -> Labelled:
        """(C,) rad or m."""
        return Labelled(self.values["coordinates"], self.labels.coordinates)

    @property
    def speeds(self) -> Labelled:
        """(C,) rad/s or m/s."""
        return Labelled(self.values["speeds"], self.labels.coordinates)

    @property
    def markers(self) -> Labelled:
        """(M, 3) m, ground frame."""
        return Labelled(self.values["markers"], self.labels.markers)

    @property
    def wrench(self) -> Labelled:
        """(6,) N, N m: the total that the motion needs, fx to mz about the model's ground origin."""
        return Labelled(self.values["wrench"], self.labels.on("wrench"))

    @property
    def wrench_sd(self) -> Labelled:
        """(6,) N, N m: by what it has erred until now, as the motion then said; NaN before a horizon is over."""
        return Labelled(self.values["wrench_sd"], self.labels.on("wrench"))


class _Seen(NamedTuple):
    """Of a step: what the ground pushes beyond the weight and its slope (2, 6), and what was expected to be left of it
    (6,), about the floor below the body's centre."""

    time_s: float
    beyond: Array
    expected: Array


class LookAhead:
    """Looks ahead from each state of a filter (docs/derivations.md, section 20).

    Standing still in a posture needs the weight at the body's centre. What the ground pushes beyond that belongs to the
    motion: it goes along with the body and is expected to be left by ``c_0 times itself + c_1 times its slope``, for
    each component by a regression on the states until now, drawn to what a critically damped return gives.

    Args:
        model: whose states these are. horizon_s: how far ahead, more than 0.

    Raises:
        ConfigError: a horizon that is no such number.
    """

    def __init__(self, model: _core.Model, horizon_s: float) -> None:
        self.horizon_s = check_ahead(horizon_s)
        self._model, self._labels = model, Labels.of(model)
        self._blocks = [slice(first, first + size) for first, size in (model.layout.blocks[name] for name in _BLOCKS)]
        left = np.exp(-horizon_s / FADE_S)
        self._prior = left * np.array([1.0 + horizon_s / FADE_S, horizon_s])
        self._normal, self._right = np.zeros((6, 2, 2)), np.zeros((6, 2))
        self._errors, self._learned_s = np.zeros((6, 6)), 0.0
        self._state: Array | None = None
        self.interrupted()

    def interrupted(self) -> None:
        """The motion is not known now: what comes later does not follow from what was before."""
        self._past: deque[_Seen] = deque()
        self._since_s: float | None = None
        self._state = None

    def look(self, time_s: float, state: Array) -> None:
        """Take the state (n,) of the next step."""
        before = self._past[-1].time_s if self._past else time_s
        if time_s - before > self.horizon_s + _SLOPE_S:
            self.interrupted()
        self._since_s = time_s if self._since_s is None else self._since_s
        self._state, self._time_s = state, time_s
        step_s = time_s - before
        beyond, slope = self._beyond(state), np.zeros(6)
        if (then := self._nearest(time_s - _SLOPE_S)) and then.time_s < time_s:
            slope = (beyond - then.beyond[0]) / (time_s - then.time_s)
        then, start = self._nearest(time_s - self.horizon_s), time_s - self.horizon_s
        if then and abs(start - then.time_s) <= 0.5 * step_s + 1e-6 and start >= self._since_s + _SETTLED_S:
            self._learn(beyond, then, step_s)
        self._past.append(_Seen(time_s, np.stack([beyond, slope]), self._shares(beyond, slope)))
        while self._past[0].time_s < time_s - 1.5 * max(self.horizon_s, _SLOPE_S):
            self._past.popleft()

    def expected(self) -> Ahead | None:
        """From the last step on; None where there is none."""
        if self._state is None:
            return None
        later = carried_on(np.stack([self._state[block] for block in self._blocks]), self.horizon_s)
        state = self._state.copy()
        for block, values in zip(self._blocks, later, strict=True):
            state[block] = values
        q, speeds, _ = _core.coordinates(self._model, state)
        weight = self._weight(state)
        about_origin = partial(wrench_about, point=-_below(weight))
        errors = self._errors / self._learned_s if self._learned_s > 0.0 else np.full((6, 6), np.nan)
        values = {
            "coordinates": q,
            "speeds": speeds,
            "markers": _core.marker_positions(self._model, state),
            "wrench": weight + about_origin(self._past[-1].expected),
            "wrench_sd": np.sqrt(np.maximum(np.diagonal(about_origin(about_origin(errors).T)), 0.0)),
        }
        return Ahead(self._time_s + self.horizon_s, values, self._labels)

    def _learn(self, beyond: Array, then: _Seen, seconds: float) -> None:
        """Of a horizon that is over: what was left then."""
        kept = np.exp(-seconds / _MEMORY_S)
        z = then.beyond.T  # (6, 2)
        unexpected = beyond - z @ self._prior
        self._normal = kept * self._normal + seconds * z[:, :, None] * z[:, None, :]
        self._right = kept * self._right + seconds * z * unexpected[:, None]
        error = beyond - then.expected
        self._errors = kept * self._errors + seconds * np.outer(error, error)
        self._learned_s = kept * self._learned_s + seconds

    def _shares(self, beyond: Array, slope: Array) -> Array:
        """What is expected to be left (6,): a ridge regression, in which the prior counts as `_BELIEVED_S` would."""
        shares = np.broadcast_to(self._prior, (6, 2))
        if self._learned_s > 0.0:
            size = np.sqrt(np.einsum("cii->ci", self._normal))
            size[size == 0.0] = 1.0  # nothing is there, and nothing is found
            normal = self._normal / (size[:, :, None] * size[:, None, :])
            normal += _BELIEVED_S / self._learned_s * np.eye(2)
            shares = shares + np.linalg.solve(normal, (self._right / size)[:, :, None])[:, :, 0] / size
        return np.asarray(shares[:, 0] * beyond + shares[:, 1] * slope)

    def _beyond(self, state: Array) -> Array:
        """(6,) of a state, about the floor below the body's centre."""
        weight = self._weight(state)
        return np.asarray(wrench_about(_core.wrench(self._model, state) - weight, _below(weight)))

    def _weight(self, state: Array) -> Array:
        """(6,): the wrench of the same posture without speeds and accelerations."""
        still = state.copy()
        for block in self._blocks[1:]:
            still[block] = 0.0
        return np.asarray(_core.wrench(self._model, still))

    def _nearest(self, time_s: float) -> _Seen | None:
        """Of the steps before."""
        found: _Seen | None = min(self._past, key=lambda seen: abs(seen.time_s - time_s), default=None)
        return found


def _below(weight: Array) -> Array:
    """The point (3,) of the ground through which a weight (6,) acts."""
    return np.asarray(np.array([weight[5], 0.0, -weight[3]]) / weight[1])


def check_ahead(ahead_s: float) -> float:
    """The same.

    Raises:
        ConfigError: it is negative or no number.
    """
    if not 0.0 <= ahead_s < np.inf:
        raise ConfigError(f"ahead_s: {ahead_s:g} s, expected 0 (not at all) or more")
    return ahead_s


def carried_on(motion: Array, horizon_s: float) -> Array:
    """Coordinates, speeds and accelerations (3, ...) ``horizon_s`` later, accelerations fading in `FADE_S`."""
    q, speed, acceleration = motion
    left = np.exp(-horizon_s / FADE_S)
    gained = FADE_S * (1.0 - left)
    later = q + horizon_s * speed + FADE_S * (horizon_s - gained) * acceleration
    return np.stack([later, speed + gained * acceleration, left * acceleration])
