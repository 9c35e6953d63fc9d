"""How large the noise is of what is declared, as far as a session's innovations have shown it."""

from __future__ import annotations

from collections import deque

import numpy as np

from dynakin.arrays import Array
from dynakin.bindings import _core
from dynakin.filter.noise import LATE_SHARE, MOVED_S, SETTLING_S
from dynakin.results.records import FOLLOWING, TRACKING

MOVES_M_S = 0.3
"""Speed of markers (median) from which a frame counts in full: who stands shows the cameras alone."""
FORGETS_S = 10.0
"""Of movement, after which a frame counts less by a factor of e."""
DECLARED_S = 0.5
"""As much movement counts what is declared: after so much of it half of the factor's logarithm is believed."""


class FoundNoise:
    """The factor on all variances but the plates' with which innovations are of the expected size, over the frames in
    which somebody moves: for deviations what `adapt.calibrated_noise` finds in a recording. Such a factor leaves the
    movement as it is estimated, which is why it may change while a session goes on.
    """

    def __init__(self) -> None:
        self._seen: deque[tuple[float, Array]] = deque()  # from `MOVED_S` ago on
        self._begun_s: float | None = None
        self._squares = self._rows = self._moved_s = 0.0

    def look(self, time_s: float, markers: Array, report: _core.StepReport) -> None:
        """At what a step says of the markers (M, 3) m, NaN missing, that it took."""
        dt = time_s - self._seen[-1][0] if self._seen else 0.0
        self._seen.append((time_s, markers))
        while len(self._seen) > 2 and time_s - self._seen[1][0] >= MOVED_S:
            self._seen.popleft()
        if self._begun_s is None:
            self._begun_s = time_s
        following = report.tracking == TRACKING[FOLLOWING] and report.n_rows > 0
        if not following or dt <= 0.0 or time_s - self._begun_s < SETTLING_S:
            return
        weight = min((self._speed() / MOVES_M_S) ** 2, 1.0)
        kept = float(np.exp(-weight * dt / FORGETS_S))
        self._squares = kept * self._squares + weight * report.nis
        self._rows = kept * self._rows + weight * report.n_rows
        self._moved_s = kept * self._moved_s + weight * dt

    def _speed(self) -> float:
        """m/s, of the markers that were seen in both frames, whose median leaps leave alone; 0 without any."""
        (then_s, then), (now_s, now) = self._seen[0], self._seen[-1]
        way = np.square(now - then).sum(axis=1)
        way = way[np.isfinite(way)]
        return float(np.sqrt(np.median(way))) / (now_s - then_s) if len(way) else 0.0

    def variance_scale(self, *, late: bool) -> float:
        """1: as declared, which holds until somebody moves. late: of what is estimated with later frames."""
        if not self._squares:
            return 1.0
        share = 1.0 if late else LATE_SHARE
        believed = share * self._moved_s / (self._moved_s + DECLARED_S)
        return float((self._squares / self._rows) ** believed)
