"""How plates are brought to the marker rate when a recording is read."""

from __future__ import annotations

from dataclasses import dataclass

from dynakin.errors import ConfigError


@dataclass(frozen=True)
class ReadOptions:
    """Options that concern the plates.

    Attributes:
        plate_filter_hz: low-pass all plates at this frequency (4th-order zero-lag Butterworth, -3 dB there;
            2nd order one way if causal), besides what resampling needs; None: no filter of its own.
        force_threshold_n: push along the plate's normal below which a plate's wrench is set to 0, N. None: 10
            N for plates that are resampled, while a force file at the marker rate passes through untouched.
        causal: only filters that look back, as in live use (they delay; the notes say by how much).
    """

    plate_filter_hz: float | None = None
    force_threshold_n: float | None = None
    causal: bool = False

    def __post_init__(self) -> None:
        if self.plate_filter_hz is not None and not self.plate_filter_hz > 0:
            raise ConfigError(f"plate_filter_hz: found {self.plate_filter_hz!r}, expected a frequency above 0 Hz")
        if self.force_threshold_n is not None and not self.force_threshold_n >= 0:
            raise ConfigError(f"force_threshold_n: found {self.force_threshold_n!r}, expected 0 N or more")
