"""Markers that the laboratory low-passed before it gave them: found by what is left of the cameras' noise.

Raw markers have white noise up to half the rate (0.02 to 0.5 mm a frame in every raw recording that we have); a
low-pass leaves 0.002 mm of it and less. Where it begins is found by its shape.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise, product

import numpy as np

from dynakin.arrays import Array, runs
from dynakin.recordings.recording import Recording
from dynakin.recordings.times import frame_numbers, on_grid

QUIET_M = 5e-6
"""Noise a frame near half the rate, median over the markers, below which no camera measured it: raw recordings have
0.02 mm and more there, low-passed ones 0.002 mm and less, where coordinates are written to 0.01 mm or finer."""
MOVES_M = 1e-3
"""The same at 2 to 4 Hz above which somebody moves; a low-pass takes nothing of one who stands."""
_ORDERS = {4: 0.0, 6: 8.0}
"""Exponents of the amplitude 1 / (1 + (w / wc)^n): of a Butterworth filter of 2nd order run both ways (Winter 2009),
and of a quintic smoothing spline (Woltring 1986, which Plug-in Gait runs); with what speaks against each before a look
at the spectrum, in units of the misfit."""
_REACH = 2.0
"""Times the cut-off up to which is worked out what was taken: above, little is left of the movement to tell from."""
_WINDOW_S = 1.0
_FEWEST = 64  # frames of a window
_TOP = (0.7, 0.96)  # of half the rate: where noise alone is left
_BANDS = 24
_CUTOFFS_HZ = np.geomspace(1.5, 40.0, 56)
_FALLS = np.arange(2.0, 6.1, 0.5)  # exponents of a movement's spectrum
_NOISES_M = 1e-3 * np.array([0.03, 0.06, 0.12, 0.25, 0.5, 1.0])  # of raw markers


@dataclass(frozen=True)
class LowPass:
    """A zero-lag low-pass, -3 dB at ``cutoff_hz``, of frames at ``rate_hz``; order: see `_ORDERS`."""

    cutoff_hz: float
    rate_hz: float
    order: int = 4

    @cached_property
    def _corner(self) -> float:
        return float(np.tan(np.pi * self.cutoff_hz / self.rate_hz) / (np.sqrt(2.0) - 1.0) ** (1.0 / self.order))

    def attenuation(self, frequency_hz: Array) -> Array:
        """The amplitude before over the one behind it, less one; warped as a digital filter is."""
        w = np.tan(np.pi * np.minimum(frequency_hz / self.rate_hz, 0.49))
        return np.asarray((w / self._corner) ** self.order)

    def taken(self, values: Array, derivative: int = 0) -> Array:
        """What the filter took of signals, or of their derivatives, by what it left of them (T, K): up to `_REACH`
        times the cut-off, since more is not there to tell from."""
        pad = min(len(values) - 1, int(2.0 * self.rate_hz / self.cutoff_hz))
        signals = np.pad(values, ((pad, pad), (0, 0)), mode="reflect", reflect_type="odd")
        signals = signals - signals[0] - (signals[-1] - signals[0]) * np.linspace(0.0, 1.0, len(signals))[:, None]
        signals = np.vstack([signals, -signals[::-1]])  # goes on without a step
        f: Array = np.asarray(np.fft.rfftfreq(len(signals), 1.0 / self.rate_hz), dtype=float)
        fades = np.cos(0.5 * np.pi * np.clip(4.0 * f / (_REACH * self.cutoff_hz) - 3.0, 0.0, 1.0)) ** 2
        gain = self.attenuation(f) * fades * (2j * np.pi * f) ** derivative
        lost = np.fft.irfft(np.fft.rfft(signals, axis=0) * gain[:, None], len(signals), axis=0)
        return np.asarray(lost[pad : pad + len(values)])

    def size(self, taken: Array) -> Array:
        """RMS (T, K) over one period of the cut-off about each frame, within which it is not known where it lies."""
        half = max(1, int(0.5 * self.rate_hz / self.cutoff_hz))
        squares = np.pad(np.square(taken), ((half, half), (0, 0)), mode="edge")
        sums = np.cumsum(np.vstack([np.zeros((1, squares.shape[1])), squares]), axis=0)
        return np.asarray(np.sqrt(np.maximum(sums[2 * half + 1 :] - sums[: -2 * half - 1], 0.0) / (2 * half + 1)))


def found_low_pass(recording: Recording) -> LowPass | None:
    """The low-pass that the markers of a movement went through; None of raw ones, of one who stands, and where too few
    frames or too coarse numbers do not show it."""
    if not recording.n_frames or not recording.rate >= 4.0 * _CUTOFFS_HZ[0]:
        return None
    f, amplitude = _spectrum(recording)
    half = 0.5 * recording.rate
    top, low = (f > _TOP[0] * half) & (f < _TOP[1] * half), (f >= 2.0) & (f <= 4.0)
    if not len(amplitude) or not low.any() or not (amplitude[f >= 2.0] > 0.0).all():
        return None
    left = float(np.median(amplitude[top]))
    if left > QUIET_M or np.median(amplitude[low]) < MOVES_M:
        return None
    return _fitted(f, amplitude, left, recording.rate)


def _spectrum(recording: Recording) -> tuple[Array, Array]:
    """Frequencies (F,) Hz and amplitudes (F,) m, median over the markers: the noise a frame of a white one. By windows
    within the stretches without blank frames and without rows that the file lacks: noise does not show across them."""
    markers, rate = on_grid(frame_numbers(recording.time), recording.markers), recording.rate
    stretches = runs(np.asarray(np.isfinite(markers).any(axis=(1, 2))))
    longest = max((end - first for first, end in stretches), default=0)
    if longest < _FEWEST:
        return np.zeros(0), np.zeros(0)
    size = min(longest, max(_FEWEST, round(_WINDOW_S * rate)))
    starts = [k for first, end in stretches for k in range(first, end - size + 1, max(size // 2, 1))]
    at = np.linspace(-1.0, 1.0, size)
    basis = np.linalg.qr(np.vander(at, 4))[0]
    # Blackman-Harris: side lobes of -92 dB, as the noise lies that far below the movement
    window = np.cos(np.pi * np.outer(at + 1.0, np.arange(4))) @ [0.35875, -0.48829, 0.14128, -0.01168]
    total, count = np.zeros((size // 2 + 1, markers.shape[1])), np.zeros(markers.shape[1])
    for start in starts:
        part = markers[start : start + size]
        seen = np.isfinite(part).all(axis=(0, 2))
        if not seen.any():
            continue
        flat = part[:, seen].reshape(size, -1)
        flat = (flat - basis @ (basis.T @ flat)) * window[:, None]
        power = np.square(np.abs(np.fft.rfft(flat, axis=0))).reshape(-1, int(seen.sum()), 3).mean(axis=2)
        total[:, seen] += power / np.square(window).sum()
        count[seen] += 1.0
    known = count > 0
    f: Array = np.asarray(np.fft.rfftfreq(size, 1.0 / rate), dtype=float)
    if not known.any():
        return f, np.zeros(0)
    return f, np.sqrt(np.median(total[:, known] / count[known], axis=1))


def _fitted(f: Array, amplitude: Array, left: float, rate: float) -> LowPass:
    """The low-pass by which a movement that falls with a power of the frequency, and white noise, fit best. How much of
    either there was is known only roughly, so that the cut-off is found to a quarter."""
    edges = np.geomspace(2.0, _TOP[1] * 0.5 * rate, _BANDS + 1)
    bands = [(f >= a) & (f < b) for a, b in pairwise(edges)]
    bands = [band for band in bands if band.any()]
    at = np.array([np.exp(np.log(f[band]).mean()) for band in bands])
    found = np.array([np.log(amplitude[band]).mean() for band in bands])
    use = found > np.log(3.0 * left)  # what is left is rounding
    use[:4] = True
    at, found = at[use], found[use]
    best, cost = LowPass(float(_CUTOFFS_HZ[0]), rate), np.inf
    for order, cutoff in product(_ORDERS, _CUTOFFS_HZ[0.4 * rate > _CUTOFFS_HZ]):
        tried = LowPass(float(cutoff), rate, order)
        answer = -np.log1p(tried.attenuation(at))
        moving = -_FALLS[:, None] * np.log(at)
        moving = moving + (found - moving - answer)[:, :3].mean(axis=1, keepdims=True)
        off = found - answer - 0.5 * np.logaddexp(2.0 * moving[:, None], 2.0 * np.log(_NOISES_M)[:, None])
        # a band counts as known to 30 %, the noise of 0.25 mm to a factor of 3, the exponent 3.5 to 1
        prior = (np.log(_NOISES_M / 2.5e-4) / np.log(3.0)) ** 2 + (_FALLS[:, None] - 3.5) ** 2
        least = float((np.square(off).sum(axis=2) / 0.1 + prior).min()) + _ORDERS[order]
        if least < cost:
            best, cost = tried, least
    return best
