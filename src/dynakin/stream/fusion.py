"""Markers and plates, each with its own clock and rate, as samples for the estimator: fused by time stamp."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from dynakin.arrays import Array
from dynakin.errors import StreamError
from dynakin.filter.samples import Sample
from dynakin.recordings.limits import FARTHEST_M
from dynakin.recordings.pushes import UNLOADED_N
from dynakin.settings.defaults import DELAY_S
from dynakin.stream.plate_samples import PlateSamples
from dynakin.stream.sources.clock import Clock, offset_between
from dynakin.stream.sources.in_order import Counts, InOrder
from dynakin.stream.sources.packets import MarkerPacket, Packet, PlatePacket, Seam, StreamInfo

SILENT_S = 0.25
"""A stream from which nothing has come for so long is silent: nobody waits for it."""
OFFSET_S = 1.0
"""How long arrivals are watched before two clocks that have nothing in common are put together."""


@dataclass(frozen=True, eq=False)
class Fused:
    """One sample for the estimator.

    Attributes:
        sample: markers, plates or both at one time.
        positions: (M, 3) m, as the markers came; NaN where they did not.
        wrenches: (P, 6) N and N m at the same time; None without plates.
        arrived_s: when its last part arrived, s of ``time.monotonic``.
    """

    sample: Sample
    positions: Array
    wrenches: Array | None
    arrived_s: float

    def with_positions(self, names: Sequence[str], positions: Array) -> Fused:
        """The same with other markers (M, 3) m."""
        sample = replace(self.sample, markers=dict(zip(names, positions, strict=True)))
        return replace(self, sample=sample, positions=positions)


class Fusion:
    """Gives one sample at each marker frame, with the plates there; while markers are silent, with plates alone.

    A frame goes out as soon as it is the next one and the plates have reached its time. Where something is missing
    it waits at most ``delay_s``; what comes later than that is left out and counted. Times go on where a clock was
    set back, and never back themselves.

    Raises:
        StreamError: there are no markers among the streams.
    """

    def __init__(self, markers: StreamInfo | None, plates: StreamInfo | None, *, delay_s: float = DELAY_S) -> None:
        if markers is None or not markers.names:
            raise StreamError("no stream of markers, expected one (plates alone show no movement)")
        self.markers, self.plates, self.delay_s = markers, plates, delay_s
        self.period_s = 1.0 / markers.rate_hz
        self._clocks = {info.clock: Clock() for info in (markers, plates) if info is not None}
        self._frames: InOrder[MarkerPacket] = InOrder(self.period_s, delay_s, ordered=markers.ordered)
        self._blocks: InOrder[PlatePacket] | None = None
        self._resampled: PlateSamples | None = None
        if plates is not None:
            self._blocks = InOrder(1.0 / plates.rate_hz, delay_s, 4096, plates.ordered)
            self._resampled = PlateSamples(plates.rate_hz, markers.rate_hz, len(plates.names))
        self._offset_s: float | None = None if len(self._clocks) > 1 else 0.0  # of the plates' clock
        self._early: list[PlatePacket] = []  # plates that came before the offset was known
        self._first_arrived: dict[str, float] = {}
        self._head: tuple[float, MarkerPacket] | None = None
        self._marker_arrived = self._plate_arrived = -np.inf
        self._last_s: float | None = None
        self._at_seam = False
        self.plates_behind_s = 0.0
        """By how much the plates lag behind the markers: what they say so much later is of a frame."""

    @property
    def marker_counts(self) -> Counts:
        """What was wrong with the markers' stamps."""
        return self._frames.counts

    @property
    def plate_counts(self) -> Counts:
        """What was wrong with the plates' stamps."""
        return Counts() if self._blocks is None else self._blocks.counts

    @property
    def clock_offset_s(self) -> float | None:
        """What is added to the plates' stamps; None while it is not known."""
        return self._offset_s

    @property
    def clock_restarts(self) -> int:
        """How often a clock was set back."""
        return max(clock.restarts for clock in self._clocks.values())

    @property
    def frozen_plates(self) -> list[tuple[str, float]]:
        """Which plates repeated one row while somebody stood on them, from when on, s."""
        if self._resampled is None or self.plates is None:
            return []
        return [(self.plates.names[p], since) for p, since in self._resampled.frozen]

    @property
    def frozen_until(self) -> list[float]:
        """Until when each of these did, so far, s."""
        return [] if self._resampled is None else self._resampled.frozen_until

    def markers_silent(self, now_s: float) -> bool:
        """Whether nothing comes from the markers."""
        return not self._at_seam and now_s - self._marker_arrived > max(SILENT_S, 3.0 * self.period_s)

    def plates_silent(self, now_s: float) -> bool:
        """Whether plates were declared and nothing comes from them."""
        return self.plates is not None and not self._at_seam and now_s - self._plate_arrived > SILENT_S

    def push(self, packet: Packet | Seam) -> None:
        """Take a packet, as it arrived."""
        if isinstance(packet, Seam):
            self._push_seam(packet)
        elif isinstance(packet, MarkerPacket):
            self._at_seam = False
            self._push_markers(packet)
        elif self.plates is not None:
            self._push_plates(packet)

    def _push_markers(self, packet: MarkerPacket) -> None:
        if packet.positions.shape != (len(self.markers.names), 3):
            self._frames.counts.invalid += 1
            return
        self._marker_arrived = packet.arrived_s
        self._first_arrived.setdefault("markers", packet.arrived_s)
        time = self._clocks[self.markers.clock].time(packet.time_s, packet.arrived_s)
        if time is None:
            self._frames.counts.invalid += 1
            return
        seen = (np.abs(packet.positions) <= FARTHEST_M).all(axis=1, keepdims=True)
        seen &= packet.positions.any(axis=1, keepdims=True)
        positions = np.where(seen, packet.positions, np.nan)  # infinite or 0, 0, 0: some systems' words for missing
        self._frames.push(time, time, packet.arrived_s, MarkerPacket(time, positions, packet.arrived_s))

    def _push_seam(self, packet: Seam) -> None:
        self._at_seam = True
        time = packet.time_s + self._clocks[self.markers.clock].offset_s
        self._frames.seam(time)
        if self._blocks is not None and self.plates is not None and self.plates.clock == self.markers.clock:
            self._blocks.seam(time)

    def _push_plates(self, packet: PlatePacket) -> None:
        assert self.plates is not None and self._blocks is not None
        stamps = np.atleast_1d(np.asarray(packet.time_s, float))
        if not len(stamps) or packet.wrenches.shape != (len(stamps), len(self.plates.names), 6):
            self._blocks.counts.invalid += 1
            return
        self._plate_arrived = packet.arrived_s
        self._first_arrived.setdefault("plates", packet.arrived_s)
        clock = self._clocks[self.plates.clock]
        newest = clock.time(float(stamps[-1]), packet.arrived_s)
        if newest is None or not (np.diff(stamps) > 0.0).all():
            self._blocks.counts.invalid += 1
            return
        placed = PlatePacket(stamps + (newest - stamps[-1]), packet.wrenches, packet.arrived_s)
        if self._offset_s is None:
            self._early.append(placed)
            self._find_offset(packet.arrived_s)
            return
        self._take_block(placed)

    def _find_offset(self, now_s: float) -> None:
        """Put the two clocks together once both streams have been watched for a while."""
        assert self.plates is not None
        if len(self._first_arrived) < 2 or now_s - max(self._first_arrived.values()) < OFFSET_S:
            return
        self._offset_s = offset_between(self._clocks[self.markers.clock], self._clocks[self.plates.clock])
        for packet in self._early:
            self._take_block(packet)
        self._early.clear()

    def _take_block(self, packet: PlatePacket) -> None:
        assert self._blocks is not None and self._resampled is not None and self._offset_s is not None
        time = packet.time_s + self._offset_s
        placed = PlatePacket(time, packet.wrenches, packet.arrived_s)
        self._blocks.push(float(time[0]), float(time[-1]), packet.arrived_s, placed, len(time))

    def poll(self, now_s: float) -> list[Fused]:
        """All samples that are ready, oldest first; at ``now_s`` infinite all that are left."""
        if self._blocks is not None and self._resampled is not None:
            while (block := self._blocks.pop(now_s)) is not None:
                self._resampled.push(block.time_s, block.wrenches)
        found: list[Fused] = []
        while True:
            if self._head is None:
                frame = self._frames.pop(now_s)
                if frame is None:
                    break
                self._head = (frame.time_s, frame)
            time, frame = self._head
            if not self._plates_ready(time, frame.arrived_s, now_s):
                break
            self._head = None
            found.append(self._fused(time, frame.positions, max(frame.arrived_s, self._plate_arrival())))
        if np.isfinite(now_s) and self._head is None and self._last_s is not None and self.markers_silent(now_s):
            found += self._plates_alone()
        return found

    def _plate_arrival(self) -> float:
        return self._plate_arrived if self._offset_s is not None and np.isfinite(self._plate_arrived) else -np.inf

    def _plates_ready(self, time_s: float, arrived_s: float, now_s: float) -> bool:
        if self._resampled is None or self._offset_s is None:
            return True
        covered = self._resampled.covers(time_s + self.plates_behind_s)
        longest = self.delay_s + max(self.plates_behind_s, 0.0)
        return covered or self.plates_silent(now_s) or now_s - arrived_s >= longest

    def _wrenches_at(self, time_s: float) -> Array | None:
        if self._resampled is None or self._offset_s is None:
            return None
        return self._resampled.at(time_s + self.plates_behind_s)

    def _plates_alone(self) -> list[Fused]:
        """Samples without markers, at the markers' rate, as far as the plates reach."""
        found: list[Fused] = []
        assert self._last_s is not None
        if self._resampled is None:
            return found
        missing = np.full((len(self.markers.names), 3), np.nan)
        while self._resampled.newest_s - (time := self._last_s + self.period_s) > self.delay_s:
            if self._wrenches_at(time) is None:
                break
            found.append(self._fused(time, missing, self._plate_arrived))
            self._frames.skip_to(time)
        return found

    def _fused(self, time_s: float, positions: Array, arrived_s: float) -> Fused:
        wrenches = None
        if self._resampled is not None and self.plates is not None:
            wrenches = self._wrenches_at(time_s)
            if wrenches is not None:  # an empty plate, as offline
                idle = np.linalg.norm(wrenches[:, :3], axis=1) < UNLOADED_N
                wrenches = (
                    np.where(idle[:, None], 0.0, wrenches)
                    if self.plates.rate_hz > 1.01 * self.markers.rate_hz
                    else wrenches
                )
        self._last_s = time_s
        markers = dict(zip(self.markers.names, positions, strict=True))
        plates = {} if wrenches is None or self.plates is None else dict(zip(self.plates.names, wrenches, strict=True))
        return Fused(Sample(time_s, markers, plates), positions, wrenches, arrived_s)
