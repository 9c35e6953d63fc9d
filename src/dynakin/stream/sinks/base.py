"""What a session gives its sinks: the estimate of each step, how it goes, and what is said."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from dynakin.bindings import _core
from dynakin.filter.live.ahead import Ahead
from dynakin.filter.step import Labelled, StepEstimate
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.stream.fusion import Fused
from dynakin.stream.sources.packets import Packet, StreamInfo


@dataclass(frozen=True)
class Status:
    """How the session goes.

    Attributes:
        phase: "waiting", "standing" or "running".
        rate_hz: of the samples, over the last second.
        latency_ms: from a sample's arrival to its estimate, the longest of the last second.
        nis: normalised innovation squared over the rows used, near 1 where the noise is as declared (of good cameras
            it is 0.02 to 0.1, of who stands less); far above what it is usually where markers do not fit; NaN without.
        refused: markers whose position the gate refused. missing: markers not seen.
        plates: "used", "refused", "silent", "incomplete" (they do not carry all of the person now: left out in this
            step), "left out" or "none".
        at_bound: constants that sit on a bound.
        tracking: the filter's own word ("following", "doubtful", "lost", ...); "lost" also while no markers come.
        left_out: frames so far for which the computer was too slow.
        late, lost, duplicate: packets so far.
        settled: whether lengths and masses have come to rest.
        delay_s: by which the published estimate lies behind the last sample; 0 without a lag.
    """

    phase: str = "waiting"
    rate_hz: float = float("nan")
    latency_ms: float = float("nan")
    nis: float = float("nan")
    refused: tuple[str, ...] = ()
    missing: tuple[str, ...] = ()
    plates: str = "none"
    at_bound: tuple[str, ...] = ()
    tracking: str = ""
    left_out: int = 0
    late: int = 0
    lost: int = 0
    duplicate: int = 0
    settled: bool = False
    delay_s: float = 0.0


@dataclass(frozen=True, eq=False)
class LiveFrame:
    """One published step.

    Attributes:
        estimate: of this sample. smoothed: of an earlier one, where there is a lag; None before there is one.
        published: what to use: the smoothed where the session has a lag, else the estimate; None before there is one.
        fused: what was measured.
        state: (n,) as ``Started.initial.names`` name it.
        deviations: of what is published, as `Tracker.deviations`, a few times a second (with a lag once); None in
            between.
        status: how it goes.
        ahead: what is expected after the sample, of a session that looks ahead; None while the motion is lost.
    """

    estimate: StepEstimate
    smoothed: StepEstimate | None
    published: StepEstimate | None
    fused: Fused
    state: np.ndarray
    deviations: Mapping[str, Labelled] | None
    status: Status
    ahead: Ahead | None = None


@dataclass(frozen=True, eq=False)
class Started:
    """What sinks need to know of the model once it is measured."""

    initial: CalibratedModel
    model: _core.Model
    rate_hz: float


class Sink:
    """Where estimates go; each method may be left out. None of them may block: the filter waits for it."""

    def begins(self, subject: Mapping[str, float], delay_s: float) -> None:
        """A session begins: mass (kg) and height (m) as its sources give them, and how long it waits for packets."""

    def opened(self, markers: StreamInfo, plates: StreamInfo | None) -> None:
        """The streams are known."""

    def packet(self, packet: Packet) -> None:
        """A packet came, as it is."""

    def started(self, started: Started) -> None:
        """The model is measured; also after each restart."""

    def frame(self, frame: LiveFrame) -> None:
        """A step was done."""

    def said(self, text: str, status: Status) -> None:
        """Something is said to the user."""

    def asked(self) -> list[str]:
        """What the user asked for through this sink: some of "restart", "recalibrate", "record", "stop"."""
        return []

    def failure(self) -> str | None:
        """Why it takes nothing more; said once, and the sink is closed then."""
        return None

    def close(self) -> None:
        """The session is over."""


@dataclass
class Callback(Sink):
    """Calls a function at each step."""

    function: Callable[[LiveFrame], None]
    frames: int = field(default=0)

    def frame(self, frame: LiveFrame) -> None:
        """Hand it on."""
        self.frames += 1
        self.function(frame)
