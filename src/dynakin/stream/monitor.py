"""Watches a session: rate, latency, what is refused or missing, what has settled, what fell silent."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from dynakin.arrays import Array, rms_length
from dynakin.elements import element
from dynakin.filter.step import StepEstimate
from dynakin.filter.tracker import Tracker
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.results.naming import listed
from dynakin.results.records import NO_ESTIMATE
from dynakin.stream.fusion import Fused, Fusion
from dynakin.stream.plates import LivePlates
from dynakin.stream.sinks.base import Status

_SETTLE_S = 5.0  # constants that moved by less than their own standard deviation in so long have settled
_SOON_S = 1.0
_SLOW_S = 60.0  # how often it is said that frames were left out


class Monitor:
    """What a session's status shows, kept cheap: a step pays for some sums only.

    Args:
        holds: whether the filter holds a motion that it does not see, instead of carrying it on.
    """

    def __init__(self, initial: CalibratedModel, rate_hz: float, plates: LivePlates, holds: bool = True) -> None:
        self.initial, self.rate_hz = initial, rate_hz
        self.last = Status(phase="running")
        self._plates, self._holds = plates, holds
        self._recent: deque[float] = deque()  # times of the last second's estimates
        self._late: deque[float] = deque()  # and by how much they were late, s
        kinds = [element(name).kind for name in initial.names]
        self._constants = np.flatnonzero([kind in ("length", "inertia") for kind in kinds])
        self._bounded = np.flatnonzero(np.isfinite(initial.lower) & [k in ("length", "inertia") for k in kinds])
        self._lower, self._upper = initial.lower[self._bounded], initial.upper[self._bounded]
        self._since: tuple[float, Array] | None = None
        self._begun: float | None = None
        self._silent = {"markers": False, "plates": False}
        self._restarts = 0
        self.left_out = self._said_left_out = 0
        self.steps = self.lost_frames = self.without_plates = 0
        self._said_s = -np.inf
        self.stepped_s = -np.inf  # time of the last step
        self._followed_s = np.nan  # time of the last step with markers that fitted
        self._lost = False
        self._expected_until_s = -np.inf

    def status(
        self,
        fusion: Fusion,
        fused: Fused,
        whole: bool,
        estimate: StepEstimate,
        smoothed: StepEstimate | None,
        state: Array,
        verdicts: Sequence[str],
    ) -> Status:
        """The status of a step.

        Args:
            whole: whether the plates carry all of the person. verdicts: of each marker and the plates, as the filter
                gives them.
        """
        names, report = self.initial.recorded_markers, estimate.report
        on_plates = "none"
        if self._plates.there:
            self.without_plates += fused.wrenches is None
            others = "left out" if whole else "incomplete"
            plates = {"accepted": "used" if whole else "incomplete", "refused": "refused"}.get(verdicts[-1], others)
            on_plates = "silent" if fused.wrenches is None else plates if self._plates.used else "left out"
        bounded, recent = self._bounded, self._recent
        within = (self._lower < state[bounded]) & (state[bounded] < self._upper)
        rows = 0 if report is None else report.n_rows
        span = recent[-1] - recent[0] if len(recent) > 1 else np.nan
        markers, blocks = fusion.marker_counts, fusion.plate_counts
        self.last = Status(
            phase="running",
            rate_hz=(len(recent) - 1) / span if span > 0.0 else float("nan"),
            latency_ms=1e3 * max(self._late, default=float("nan")),
            nis=report.nis / rows if report is not None and rows else float("nan"),
            refused=tuple(name for name, word in zip(names, verdicts, strict=False) if word == "refused"),
            missing=tuple(name for name, word in zip(names, verdicts, strict=False) if word == "missing"),
            plates=on_plates,
            at_bound=tuple(self.initial.names[k] for k in bounded[~within]),
            tracking="" if report is None else report.tracking,
            left_out=self.left_out,
            late=markers.late + blocks.late,
            lost=markers.lost + blocks.lost,
            duplicate=markers.duplicate + blocks.duplicate,
            settled=self.last.settled,
            delay_s=0.0 if smoothed is None else estimate.time_s - smoothed.time_s,
        )
        return self.last

    def motion(self, estimate: StepEstimate, fused: Fused) -> list[str]:
        """A sentence where the motion is lost, and where it is found again: then the markers fit."""
        word, at, before = self.last.tracking, estimate.time_s, self._followed_s
        self.steps += 1
        expected = at < self._expected_until_s
        self.lost_frames += word in NO_ESTIMATE and not expected
        if np.isfinite(fused.positions).any() and word in ("following", "found"):
            self._followed_s = at
        if expected and not self._lost:
            return []
        if word in ("lost", "restarted") and not self._lost:
            self._lost = True
            return [f"The motion is lost at {at:.2f} s: it is held until the markers fit again."]
        if word != "found":
            return []
        self._lost = False
        off_mm = 1e3 * self._distance(estimate, fused)
        since = f", {at - before:.1f} s after it was last followed" if before == before else ""
        return [f"The motion is found again at {at:.2f} s{since}; the markers used are {off_mm:.0f} mm off (RMS)."]

    def _distance(self, estimate: StepEstimate, fused: Fused) -> float:
        """RMS over the markers that were used, m, on the axes that the model measures."""
        sample, refused = fused.sample.markers, self.last.refused
        used = [k for k, name in enumerate(self.initial.recorded_markers) if name in sample and name not in refused]
        measured = np.stack([np.asarray(sample[self.initial.recorded_markers[k]], float) for k in used])
        axes = np.array([self.initial.spec.markers[k].measured for k in used])
        off = np.where(axes, self.initial.ground.points_to_ground(measured) - estimate.markers[used], 0.0)
        return float(rms_length(off))

    def begins_again(self, time_s: float) -> None:
        """A recording does, at this time: that the motion is lost there says nothing of the measurement."""
        self._expected_until_s = time_s + _SOON_S

    def published(self, time_s: float, latency_s: float) -> None:
        """An estimate went out, so long after its sample had arrived."""
        self.stepped_s = time_s
        self._recent.append(time_s)
        self._late.append(latency_s)
        while time_s - self._recent[0] > _SOON_S:
            self._recent.popleft()
            self._late.popleft()

    def settling(self, time_s: float, state: Array, tracker: Tracker) -> list[str]:
        """A sentence once lengths and masses have come to rest."""
        if self.last.settled or not len(self._constants):
            return []
        values = state[self._constants]
        if self._since is None or self._begun is None:
            self._since, self._begun = (time_s, values), time_s
            return []
        if time_s - self._since[0] < _SETTLE_S:
            return []
        sd = np.sqrt(np.diagonal(tracker.covariance)[self._constants])
        moved = np.abs(values - self._since[1]) > sd
        self._since = (time_s, values)
        if moved.any():
            return []
        self.last = replace(self.last, settled=True)
        return [f"Lengths and masses have settled, {time_s - self._begun:.0f} s after the start."]

    def summary(self, fusion: Fusion) -> str:
        """A sentence at the end, on what was left out, lost or not measured; "" where nothing was."""
        markers, blocks = fusion.marker_counts, fusion.plate_counts
        frames = {
            "left out because the computer was too slow": self.left_out,
            "without the plates": self.without_plates,
            "with the motion lost": self.lost_frames,
        }
        packets = {
            "late": markers.late + blocks.late,
            "lost": markers.lost + blocks.lost,
            "not as declared": markers.invalid + blocks.invalid,
        }
        kinds = ((f"Of {self.steps + self.left_out} frames", frames), ("Packets", packets))
        found = [(of, [f"{count} {how}" for how, count in counts.items() if count]) for of, counts in kinds]
        return " ".join(f"{of}: {listed(counts)}." for of, counts in found if counts)

    def go_on_from(self, before: Monitor) -> None:
        """Takes over what was counted of the session, after a restart."""
        self.steps, self.lost_frames, self.without_plates = before.steps, before.lost_frames, before.without_plates
        self.left_out, self._said_left_out = before.left_out, before._said_left_out

    def changes(self, fusion: Fusion, now_s: float) -> list[str]:
        """Sentences on frames left out, streams that fell silent or came back, and clocks that were set back."""
        said = []
        for kind, silent in (("markers", fusion.markers_silent(now_s)), ("plates", fusion.plates_silent(now_s))):
            if silent != self._silent[kind]:
                self._silent[kind] = silent
                if silent and kind == "markers" and self._holds:  # nothing may be stepped until they are back
                    self.last = replace(self.last, tracking="lost")
                goes_on = "going on with markers alone" if kind == "plates" else self._without_markers(fusion, now_s)
                said.append(f"The {kind} are silent; {goes_on}." if silent else f"The {kind} are back.")
        if self.left_out > self._said_left_out and now_s - self._said_s > _SLOW_S:
            said.append(
                f"This computer is too slow for {self.rate_hz:g} Hz: {self.left_out - self._said_left_out} frames were "
                "left out."
            )
            self._said_left_out, self._said_s = self.left_out, now_s
        if fusion.clock_restarts > self._restarts:
            self._restarts = fusion.clock_restarts
            said.append("A source's clock was set back; time goes on.")
        return said

    def _without_markers(self, fusion: Fusion, now_s: float) -> str:
        if self._holds:
            return "the motion is held until they are back"
        if not self._plates.there or fusion.plates_silent(now_s):
            return "the estimate waits for them"
        return "going on with plates alone" if self._plates.used else "the movement is only predicted meanwhile"
