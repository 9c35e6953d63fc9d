"""Estimates as streams of the Lab Streaming Layer, with labels and units."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import pylsl

from dynakin.elements import element
from dynakin.errors import ConfigError
from dynakin.filter.parameters import element_units
from dynakin.stream.sinks.base import LiveFrame, Sink, Started
from dynakin.stream.sinks.picture import rotations

_KINDS = ("length", "marker", "inertia")


class LslSink(Sink):
    """Outlets NAME-coordinates, NAME-speeds, NAME-moments, NAME-moment-sources and NAME-parameters; a stamp is
    when its sample arrived, by this machine's clock, with a lag so much earlier.

    Args:
        name: with which the outlets' names begin.
    """

    def __init__(self, name: str = "dynakin") -> None:
        self.name = name
        self._outlets: dict[str, Any] = {}
        self._constants: list[int] = []

    def started(self, started: Started) -> None:
        """Makes the outlets, the first time."""
        if self._outlets:
            return
        initial, model = started.initial, started.model
        names = list(model.coordinate_names)
        turns = rotations(initial.spec)
        self._constants = [k for k, name in enumerate(initial.names) if element(name).kind in _KINDS]
        constants, units_of = [initial.names[k] for k in self._constants], element_units(initial)
        kinds = {
            "coordinates": (names, ["rad" if turn else "m" for turn in turns]),
            "speeds": (names, ["rad/s" if turn else "m/s" for turn in turns]),
            "moments": (names, ["N m" if turn else "N" for turn in turns]),
            "moment-sources": (names, ["code"] * len(names)),
            "parameters": (constants, [units_of[name] for name in constants]),
        }
        for kind, (labels, units) in kinds.items():
            if not labels:
                continue
            stream = f"{self.name}-{kind}"
            info = pylsl.StreamInfo(stream, "Estimate", len(labels), started.rate_hz, "double64", f"dynakin-{stream}")
            channels = info.desc().append_child("channels")
            for k, label in enumerate(labels):
                channel = channels.append_child("channel")
                channel.append_child_value("label", label)
                channel.append_child_value("unit", units[k])
            self._outlets[kind] = pylsl.StreamOutlet(info, max_buffered=10)

    def frame(self, frame: LiveFrame) -> None:
        """Sends what is published of it."""
        if frame.published is None:
            return
        stamp = pylsl.local_clock() - max(0.0, _age(frame)) - frame.status.delay_s
        estimate = frame.published
        values = {
            "coordinates": estimate.coordinates,
            "speeds": estimate.speeds,
            "moments": estimate.moments,
            "moment-sources": estimate.moment_sources,
            "parameters": frame.state[self._constants],
        }
        for kind, outlet in self._outlets.items():
            outlet.push_sample(np.ascontiguousarray(values[kind], dtype=float), stamp)

    def close(self) -> None:
        """The outlets end."""
        self._outlets.clear()


def _age(frame: LiveFrame) -> float:
    """How long ago the sample arrived, s."""
    return time.monotonic() - frame.fused.arrived_s


def lsl_sink(address: str, options: dict[str, str]) -> LslSink:
    """`lsl[:NAME]`.

    Raises:
        ConfigError: options, of which there are none.
    """
    if options:
        raise ConfigError(f"lsl: unknown options {', '.join(options)}, expected lsl or lsl:NAME")
    return LslSink(address or "dynakin")
