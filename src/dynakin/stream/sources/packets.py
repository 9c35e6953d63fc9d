"""What a capture system sends: streams by name, rate and clock, and packets of samples with time stamps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from dynakin.arrays import Array


@dataclass(frozen=True)
class StreamInfo:
    """What a source says of one of its streams.

    Attributes:
        names: of the markers, or of the plates.
        rate_hz: nominal rate.
        clock: name of the clock of its time stamps. Streams with the same clock share one time; the offset between
            two clocks is estimated from when packets arrive.
        ordered: whether the transport keeps the order (TCP, a file): then nobody waits for a sample that is missing.
    """

    names: tuple[str, ...]
    rate_hz: float
    clock: str
    ordered: bool = False


@dataclass(frozen=True)
class Streams:
    """The streams of a source: markers, plates or both.

    Attributes:
        notes: sentences for the user.
        paced: whether samples come when they are measured; False: as fast as they are read.
        subject: "mass_kg" and "height_m" where the source gives them.
        length_s: of a recording, which follows no request to stand still; inf: somebody is measured now.
    """

    markers: StreamInfo | None = None
    plates: StreamInfo | None = None
    notes: tuple[str, ...] = ()
    subject: Mapping[str, float] = field(default_factory=dict)
    paced: bool = True
    length_s: float = np.inf


@dataclass(frozen=True, eq=False)
class MarkerPacket:
    """One frame of markers.

    Attributes:
        time_s: s, by the stream's clock.
        positions: (M, 3) m, laboratory frame, in the order of the stream's names; NaN where a marker is missing.
        arrived_s: when it arrived, s of ``time.monotonic``.
    """

    time_s: float
    positions: Array
    arrived_s: float = field(default=np.nan)


@dataclass(frozen=True, eq=False)
class PlatePacket:
    """One or more samples of all plates.

    Attributes:
        time_s: (K,) s, by the stream's clock.
        wrenches: (K, P, 6) N and N m, ground on person, laboratory frame, about the laboratory origin.
        arrived_s: as of markers.
    """

    time_s: Array
    wrenches: Array
    arrived_s: float = field(default=np.nan)


@dataclass(frozen=True, eq=False)
class Seam:
    """A recording has ended and begins again: what lies between was never sent, so that none of it is lost.

    Attributes:
        time_s: s, by the markers' clock, of the next frame.
        arrived_s: as of markers.
    """

    time_s: float
    arrived_s: float = field(default=np.nan)


Packet = MarkerPacket | PlatePacket


class Source(Protocol):
    """Where packets come from. It lives in a thread of its own, so it may block; it is opened again after an error."""

    def open(self, timeout_s: float) -> Streams:
        """Connect and describe the streams.

        Raises:
            StreamError: nothing found within the timeout; it is tried again.
        """
        ...

    def read(self, timeout_s: float) -> Sequence[Packet | Seam] | None:
        """What has come since the last call, after at most ``timeout_s``; None: it is over for good.

        Raises:
            StreamError: the connection is lost; the source is closed and opened again.
        """
        ...

    def close(self) -> None:
        """Let go of everything; may be called twice."""
        ...
