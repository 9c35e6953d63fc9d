"""From the analog rate of force plates to the times of the markers, without aliasing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy
from scipy.linalg import blas

from dynakin.arrays import Array, runs
from dynakin.errors import ConfigError, RecordingError
from dynakin.recordings.times import rate_of, step_of

UNEVEN = 0.1
"""Part of a step by which a sample's time may be off an even rate: files round their times, and a lost sample moves
all others by half a step and more."""
PASS = 0.4  # end of the pass band, times the marker rate
_STOP = 0.6  # begin of the stop band: what lies between folds back only above the pass band
_STOP_DB = 60.0
_CAUSAL_ORDER = 4


class CausalLowPass:
    """Butterworth low-pass that only looks back and keeps its state: blocks pushed in turn give what one push
    of the whole gives, so that an offline run equals live use.

    Args:
        rate_hz: samples per second of the input.
        cutoff_hz: -3 dB frequency.
        order: of the filter.
    """

    def __init__(self, rate_hz: float, cutoff_hz: float, order: int = _CAUSAL_ORDER) -> None:
        _check_cutoff(rate_hz, cutoff_hz)
        self._sos = scipy.signal.butter(order, cutoff_hz, fs=rate_hz, output="sos")
        b, a = scipy.signal.butter(order, cutoff_hz, fs=rate_hz)
        self.delay_s: float = float(scipy.signal.group_delay((b, a), w=[0.0], fs=rate_hz)[1][0] / rate_hz)
        self._state: Array | None = None

    def push(self, block: Array) -> Array:
        """Filter the next samples (n, k) and keep the state; the first sample is taken as having lasted for
        ever."""
        if not len(block):
            return block.copy()
        if self._state is None:
            self._state = scipy.signal.sosfilt_zi(self._sos)[:, :, None] * block[0]
        out, self._state = scipy.signal.sosfilt(self._sos, block, axis=0, zi=self._state)
        return np.asarray(out)


def filled(samples: Array, missing: npt.NDArray[np.bool_]) -> Array:
    """Samples (N, k) with those that are missing (N,) on the lines between their neighbours, so that a filter does not
    spread NaN over all; what it makes of them goes again by `touched`."""
    if not missing.any() or missing.all():
        return samples
    at = np.arange(len(samples))
    return np.column_stack([np.interp(at, at[~missing], column[~missing]) for column in samples.T])


def bridged(samples: Array, most: int) -> tuple[Array, int]:
    """Samples (N, k) with lines over gaps (rows that hold no number) of at most so many that have neighbours on both
    sides, and how many they are. Longer ones stay."""
    missing = np.asarray(~np.isfinite(samples).all(axis=1))
    short = np.zeros_like(missing)
    for first, end in runs(missing):
        short[first:end] = first > 0 and end < len(samples) and end - first <= most
    if not short.any():
        return samples, 0
    return np.where(short[:, None], filled(samples, missing), samples), int(np.count_nonzero(short))


def touched(missing: npt.NDArray[np.bool_], time_in: Array, time_out: Array, reach_s: float) -> npt.NDArray[np.bool_]:
    """Which of ``time_out`` (T,) a filter of this reach makes of missing samples (N,), too."""
    lost = time_in[missing]
    if not len(lost):
        return np.zeros(len(time_out), dtype=bool)
    k = np.searchsorted(lost, time_out)
    before, after = lost[np.maximum(k - 1, 0)], lost[np.minimum(k, len(lost) - 1)]
    return np.asarray(np.minimum(np.abs(time_out - before), np.abs(after - time_out)) <= reach_s)


def reach_s(rate_in: float, rate_out: float, cutoff_hz: float | None) -> float:
    """How far from a sample `resample`, and a `low_pass` before it, still use it: half the length of the first's
    kernel, and where the second's answer to an impulse has come down to a ten thousandth."""
    kernel = 0.0
    if rate_in > 1.01 * rate_out:
        kernel = 0.5 * scipy.signal.kaiserord(_STOP_DB, (_STOP - PASS) * rate_out / (0.5 * rate_in))[0] / rate_in
    return kernel + (0.0 if cutoff_hz is None else 2.0 / cutoff_hz)


def low_pass(samples: Array, rate_hz: float, cutoff_hz: float, *, causal: bool = False) -> Array:
    """Butterworth low-pass of (N, k) samples, -3 dB at ``cutoff_hz``: 4th-order zero-lag (2nd order both
    ways, its cutoff corrected for the two passes as in Winter, Biomechanics and Motor Control, 2009), or 2nd
    order one way.

    Raises:
        RecordingError: the cutoff is not below half the rate.
    """
    if causal:
        return CausalLowPass(rate_hz, cutoff_hz, order=2).push(samples)
    _check_cutoff(rate_hz, cutoff_hz)
    # Two passes of |H|^2 = 1/(1 + w^4), w warped, are -3 dB where w = (sqrt 2 - 1)^(1/4).
    warped = np.tan(np.pi * cutoff_hz / rate_hz) / (np.sqrt(2) - 1) ** 0.25
    beyond = min(len(samples) - 1, int(rate_hz / cutoff_hz))
    return both_ways(samples, rate_hz, np.arctan(warped) / np.pi * rate_hz, beyond)


def both_ways(samples: Array, rate_hz: float, cutoff_hz: float, beyond: int) -> Array:
    """Butterworth of 2nd order of (N, k) samples, run forwards and then backwards: SciPy's `sosfiltfilt`, whose module
    takes half a second to load.

    Args:
        cutoff_hz: -3 dB of one pass. beyond: samples, fewer than N, by which each end is led on, turned about its last
            sample, so that the filter has settled where the samples begin.
    """
    w = np.tan(np.pi * cutoff_hz / rate_hz)  # bilinear, so that the cut-off is kept
    scale = 1.0 + np.sqrt(2.0) * w + w * w
    gain, first, second = w * w / scale, 2.0 * (w * w - 1.0) / scale, (1.0 - np.sqrt(2.0) * w + w * w) / scale
    found = np.pad(samples, ((beyond, beyond), (0, 0)), mode="reflect", reflect_type="odd")
    bands = np.asfortranarray(np.repeat([[1.0], [first], [second]], len(found), axis=1))
    for _ in range(2):
        start = found[0]  # as if it had lasted for ever
        x = np.vstack([np.zeros((2, found.shape[1])), found - start])
        x = gain * (x[2:] + 2.0 * x[1:-1] + x[:-2])
        # y[n] = x[n] - first y[n - 1] - second y[n - 2] is a triangular system with three bands.
        y = [blas.dtbsv(2, bands, column, lower=1, diag=1) for column in x.T]
        found = (np.column_stack(y) + start)[::-1]
    return found[beyond : len(found) - beyond]


def resample(samples: Array, time_in: Array, time_out: Array, *, causal: bool = False) -> Array:
    """Samples (N, k) at the evenly spaced ``time_in`` (N,) brought to ``time_out`` (T,), both in s.

    The same times pass through untouched. From a higher rate, a linear-phase FIR filter (Kaiser window, 60
    dB, pass band up to 0.4 and stop band from 0.6 of the output's rate, odd extension at the ends) goes
    first, centred, so that nothing is delayed. ``causal``: instead a 4th-order Butterworth low-pass at 0.4 of
    the output's rate that only looks back (it delays by ``CausalLowPass.delay_s``). Then the sample at each
    time is picked, or, where times do not coincide, interpolated (cubic; causal: the latest sample before).

    Raises:
        RecordingError: ``time_in`` is uneven, or does not cover ``time_out``.
    """
    if same_times(time_in, time_out):
        return samples
    rate_in, rate_out = rate_of(time_in), rate_of(time_out)
    step = 1 / rate_in
    even = time_in[0] + (time_in[-1] - time_in[0]) * np.linspace(0.0, 1.0, len(time_in))
    if np.abs(time_in - even).max() > UNEVEN * step:
        raise RecordingError("the forces are sampled unevenly, expected a constant rate to resample from")
    # The last marker frame may lie up to one marker step after the last analog sample of the frame before.
    before, after = time_in[0] - 0.5 * step, time_in[-1] + max(step, 0.5 / rate_out)
    if len(time_in) < 2 or time_out[0] < before or time_out[-1] > after:
        raise RecordingError(
            f"forces from {time_in[0]:g} s to {time_in[-1]:g} s do not cover {time_out[0]:g} s to {time_out[-1]:g} s"
        )
    if causal:
        low_pass_first = low_pass_for(rate_in, rate_out)
        samples = samples if low_pass_first is None else low_pass_first.push(samples)
        held: Array = samples[np.maximum(latest_before(time_in, time_out, step), 0)]
        return held
    if rate_in > 1.01 * rate_out:
        samples = _antialias(samples, rate_in, rate_out)
    nearest = np.clip(np.rint((time_out - time_in[0]) * rate_in).astype(int), 0, len(time_in) - 1)
    if np.abs(time_in[nearest] - time_out).max() < 0.01 * step:
        picked: Array = samples[nearest]
        return picked
    inside = np.clip(time_out, time_in[0], time_in[-1])
    return np.asarray(scipy.interpolate.CubicSpline(time_in, samples, axis=0)(inside))


def low_pass_for(rate_in: float, rate_out: float) -> CausalLowPass | None:
    """The causal filter that goes before samples are picked at a lower rate (Hz), None where no filter is needed."""
    return CausalLowPass(rate_in, PASS * rate_out) if rate_in > 1.01 * rate_out else None


def latest_before(time_in: Array, time_out: Array, step_s: float) -> npt.NDArray[np.intp]:
    """Index of the latest of ``time_in`` at or before each of ``time_out``, -1 where there is none; 1 % of a step of
    the input counts as the same time."""
    return np.searchsorted(time_in, time_out + 0.01 * step_s, side="right") - 1


def same_times(a: Array, b: Array) -> bool:
    """Whether two time columns are the same within 1 % of a step."""
    return len(a) == len(b) and (len(a) < 2 or bool(np.abs(a - b).max() < 0.01 * step_of(b)))


def _antialias(samples: Array, rate_in: float, rate_out: float) -> Array:
    width = (_STOP - PASS) * rate_out
    taps, beta = scipy.signal.kaiserord(_STOP_DB, width / (0.5 * rate_in))
    half = taps // 2
    cutoff = min(0.5 * (PASS + _STOP) * rate_out, 0.49 * rate_in)
    kernel = scipy.signal.firwin(2 * half + 1, cutoff, window=("kaiser", beta), fs=rate_in)
    reach = min(half, len(samples) - 1)
    padded = np.pad(samples, ((reach, reach), (0, 0)), mode="reflect", reflect_type="odd")
    padded = np.pad(padded, ((half - reach, half - reach), (0, 0)), mode="edge")
    return np.asarray(scipy.signal.oaconvolve(padded, kernel[:, None], mode="valid", axes=0))


def _check_cutoff(rate_hz: float, cutoff_hz: float) -> None:
    if not 0 < cutoff_hz < 0.5 * rate_hz:
        raise RecordingError(
            f"low-pass at {cutoff_hz:g} Hz is not possible at {rate_hz:g} Hz, expected less than {rate_hz / 2:g} Hz"
        )


@dataclass(frozen=True)
class ReadOptions:
    """Options that concern the plates.

    Attributes:
        plate_filter_hz: low-pass all plates at this frequency (4th-order zero-lag Butterworth, -3 dB there;
            2nd order one way if causal), besides what resampling needs; None: no filter of its own.
        force_threshold_n: push along the plate's normal below which a plate's wrench is set to 0, N. None: 10
            N for plates that are resampled, but for those that read something else than noise while they are empty,
            of which markers say whose it is; a force file at the marker rate passes through untouched.
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
