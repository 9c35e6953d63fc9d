"""What a file holds but markers and plates: events, and analog channels (EMG, switches, the plates' own signals)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import numpy.typing as npt


@dataclass(frozen=True)
class Event:
    """Something that somebody, or a program, marked in the file.

    Attributes:
        time_s: at the recording's times.
        label: as the file has it, "Foot Strike" or "Foot Off", say.
        side: of the body; "" where the file names none.
    """

    time_s: float
    label: str
    side: Literal["left", "right", ""] = ""


@dataclass(frozen=True, eq=False)
class AnalogChannel:
    """One analog channel at its own rate.

    Attributes:
        name: as the file has it.
        unit: as the file has it ("V", "N", "Nmm"), "" where it has none.
        start_s: time of the first sample, at the recording's times.
        rate_hz: samples per second.
        values: (N,) in ``unit``, NaN where the file holds no number.
    """

    name: str
    unit: str
    start_s: float
    rate_hz: float
    values: npt.NDArray[np.float32]

    @property
    def time(self) -> npt.NDArray[np.float64]:
        """(N,) s."""
        return np.asarray(self.start_s + np.arange(len(self.values)) / self.rate_hz)

    def between(self, start_s: float, end_s: float) -> AnalogChannel:
        """The samples with ``start_s <= time < end_s``."""
        slack = 1e-6  # of a sample
        first, last = (
            int(np.clip(np.ceil((at - self.start_s) * self.rate_hz - slack), 0, len(self.values)))
            for at in (start_s, end_s)
        )
        return replace(self, start_s=self.start_s + first / self.rate_hz, values=self.values[first:last])
