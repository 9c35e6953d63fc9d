"""Do the plates carry the person, at this moment? What `filter.ground.closure` asks of a whole recording, some
tenths of a second later."""

from __future__ import annotations

from collections import deque

import numpy as np

from dynakin.arrays import Array
from dynakin.filter.ground.closure import EDGE, EXCESS
from dynakin.filter.ground.load_ratio import AMPLITUDE
from dynakin.filter.ground.mass_centre import CentreWeights
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.units import GRAVITY_M_S2

WINDOW_S = 0.3
"""The centre of mass' path over it is fitted by a parabola; what is found is of its middle, so `DELAY_S` ago."""
DELAY_S = 0.5 * WINDOW_S
KEPT_S = 0.5
"""How long something undeclared is remembered while nobody can judge: a person who leaves a chair walks off."""
_LEAST_FRAMES = 6
_EVERY_S = 0.018  # between questions: 50 a second, where frames come more often


class LiveClosure:
    """Whether something that no plate measures bears or pulls the person.

    The acceleration that a parabola has is the true one's mean over the window, weighted by (h² - t²)², h half of the
    window: the plates' sum is taken with the same weights, so that the two are of one time and one bandwidth. What
    bears less than a fifth of the weight is not noticed live: a mass that is somewhat wrong looks like it.
    """

    def __init__(self, initial: CalibratedModel) -> None:
        self._mass = initial.weighed_kg
        self._weights = CentreWeights(initial).of(np.arange(len(initial.spec.markers)))
        self._axes = np.array(initial.spec.wrench_measured[:3])
        self._kept: deque[tuple[float, Array, Array]] = deque()
        self.bears, self._judged_s = False, -np.inf

    def look(self, time_s: float, markers: Array, force: Array | None) -> bool:
        """The next frame: whether something undeclared bears, `DELAY_S` ago. While nobody can judge it stays as it was,
        for `KEPT_S`.

        Args:
            markers: (M, 3) m, of the model, ground frame, all known. force: (3,) N, the plates' sum, ground frame; None
                where it is not all that is declared to bear the person.
        """
        if self._weights is None:
            return False
        if force is None or not np.isfinite(force).all():
            self._kept.clear()
            self.bears &= time_s - self._judged_s < KEPT_S
            return self.bears
        self._kept.append((time_s, self._weights @ markers, force))
        while self._kept[0][0] < time_s - WINDOW_S - 1e-9:
            self._kept.popleft()
        short = len(self._kept) < _LEAST_FRAMES or time_s - self._kept[0][0] < 0.9 * WINDOW_S
        if short or 0.0 <= time_s - self._judged_s < _EVERY_S:
            return self.bears
        time = np.array([at for at, _, _ in self._kept])
        excess, acceleration = self._excess(time)
        weight = self._mass * GRAVITY_M_S2
        least = EDGE * weight if self.bears else EXCESS * weight + AMPLITUDE * self._mass * np.abs(acceleration)
        self.bears, self._judged_s = bool((self._axes & (np.abs(excess) > least)).any()), time_s
        return self.bears

    def _excess(self, time: Array) -> tuple[Array, Array]:
        """(3,) N: what the motion needs less what the plates carry; (3,) m/s^2 how the centre of mass accelerates."""
        half = 0.5 * (time[-1] - time[0])
        t = (time - time[0] - half) / half
        path, force = (np.stack([row[k] for row in self._kept]) for k in (1, 2))
        acceleration = 2.0 * np.polynomial.polynomial.polyfit(t, path, 2)[2] / half**2
        weights = (1.0 - t**2) ** 2
        need = self._mass * (acceleration + np.array([0.0, GRAVITY_M_S2, 0.0]))
        return np.asarray(need - weights @ force / weights.sum()), np.asarray(acceleration)
