"""Streams made for tests: markers on a line and plates that tell the time in every number."""

from __future__ import annotations

import numpy as np

from dynakin.stream.fusion import Fused, Fusion
from dynakin.stream.sources.packets import MarkerPacket, PlatePacket, StreamInfo

MARKERS = StreamInfo(("a", "b"), 100.0, "one")
PLATES = StreamInfo(("left",), 1000.0, "one")


def frame(time_s: float, arrived_s: float | None = None) -> MarkerPacket:
    return MarkerPacket(time_s, np.full((2, 3), time_s), time_s if arrived_s is None else arrived_s)


def block(start_s: float, count: int = 10, arrived_s: float | None = None, rate_hz: float = 1000.0) -> PlatePacket:
    time = start_s + np.arange(count) / rate_hz
    return PlatePacket(time, np.full((count, 1, 6), 500.0), float(time[-1]) if arrived_s is None else arrived_s)


def play(fusion: Fusion, packets: list[MarkerPacket | PlatePacket]) -> list[Fused]:
    found: list[Fused] = []
    for packet in packets:
        fusion.push(packet)
        found += fusion.poll(packet.arrived_s)
    return found


def times(found: list[Fused]) -> list[float]:
    return [round(one.sample.time_s, 6) for one in found]
