"""The small records that accompany the arrays of an estimate: parameters, events, timing and tracking."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

ParameterKind = Literal["length", "marker", "inertia", "plates"]
REFUSED = 2
"""Value of a verdict on a marker or the plates: 0 missing, 1 accepted, 2 refused (as the core has it)."""
TRACKING = ("following", "doubtful", "lost", "found", "restarted")
"""Words of the core's tracking states, by their number."""
FOLLOWING = TRACKING.index("following")
"""Value of tracking where nothing is wrong."""
NO_ESTIMATE = ("doubtful", "lost", "restarted")
"""Those of a frame whose numbers are no estimate."""
NO_ESTIMATE_CODES = tuple(TRACKING.index(word) for word in NO_ESTIMATE)
"""Their numbers."""
TAUGHT = 0.7
"""Of a constant's deviation before the first frame at most so much is left where the recording taught what it is. By
truth (squats, no marker off its place) the lumbar length, of which 0.95 to 1.0 is left, ends on its bound as often as
with the pelvis' markers 20 mm off; knees' axes, 0.3, and hips' centres, 0.2 to 0.3, move by what markers are off."""

EventKind = Literal["missing", "gated", "at_bound", "reset", "note"]


@dataclass(frozen=True)
class Parameter:
    """One constant: a segment length, a marker's place on its segment, an inertial number, or an error of the plates
    (slow, as it ends, or their delay).

    ``value`` and ``sd`` (one standard deviation) are those of the last frame; ``initial`` and ``prior_sd`` those
    before the first, with the declared total mass in them where it is a prior (None: not estimated); ``skin_sd`` is
    the part of ``sd`` that the filter cannot see: skin that follows an angle looks like a length, jerk like a delay;
    ``table`` is what the anthropometric table says, None where it says nothing; ``lower`` and ``upper`` are the bounds
    of equation (9), None where there is none. All in ``unit`` (m, m/rad, rad, kg, kg m, kg m2, N, N m, s).
    """

    name: str
    kind: ParameterKind
    segment: str
    unit: str
    value: float
    sd: float
    initial: float
    table: float | None
    lower: float | None
    upper: float | None
    at_bound: bool
    estimated: bool
    prior_sd: float | None = None
    skin_sd: float = 0.0

    @property
    def posterior_sd(self) -> float:
        """``sd`` without ``skin_sd``: how sure the filter is of what it sees."""
        return math.sqrt(max(self.sd**2 - self.skin_sd**2, 0.0))

    @property
    def bound_tells(self) -> bool:
        """Whether it tells something that it ends on its bound: the recording taught what it is, and better than the
        bound is far from where it began. The axial inertia of a thigh in a walk is not known so well, and the length of
        the lumbar region no better than before: these wander to one by chance."""
        if self.prior_sd is not None and self.posterior_sd > TAUGHT * self.prior_sd:
            return False
        if not self.at_bound or self.lower is None or self.upper is None:
            return self.at_bound
        bound = min(self.lower, self.upper, key=lambda limit: abs(self.value - limit))
        return self.posterior_sd < abs(self.initial - bound)

    @property
    def is_correction(self) -> bool:
        """A length that starts at 0: a correction of a joint's place, or an amount such as ``knee_roll``."""
        return self.kind == "length" and self.initial == 0.0

    def change_percent(self) -> float | None:
        """Change from the initial value in percent of its size; None where the initial value is zero."""
        if self.initial == 0.0 or not math.isfinite(self.initial):
            return None
        return 100.0 * (self.value - self.initial) / abs(self.initial)


@dataclass(frozen=True)
class Event:
    """Something that happened at one frame: a marker missing or gated, a bound reached, a reset, a note."""

    time_s: float
    frame: int
    kind: EventKind
    subject: str
    message: str


@dataclass(frozen=True)
class Timing:
    """How long the filter's steps took. ``realtime_factor`` is recording time over computing time (above 1: faster)."""

    frames: int
    median_us: float
    p99_us: float
    realtime_factor: float


@dataclass(frozen=True, eq=False)
class Tracking:
    """How the filter followed the person, frame by frame.

    Attributes:
        lost: (T,) bool. measured: (T,) bool, some marker was seen.
        distance_m: (T, M) of each measured marker from where the bone carries it: residual, displaced skin and place.
        refused: (T, M) bool.
    """

    lost: npt.NDArray[np.bool_]
    measured: npt.NDArray[np.bool_]
    distance_m: npt.NDArray[np.float64]
    refused: npt.NDArray[np.bool_]
