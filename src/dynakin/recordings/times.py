"""Times of frames: their step, their rate, the even grid about which they lie, and stretches of them in words."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from dynakin.errors import RecordingError

Array = npt.NDArray[np.float64]

_PAUSE_S = 1.0  # nothing is led across it
_FEW = 9  # frames, over which the scatter of time stamps is averaged


def step_of(time: Array) -> float:
    """Usual step of times (T,) s: the median one, which missing frames do not change; NaN of fewer than two."""
    return float(np.median(np.diff(time))) if len(time) > 1 else float("nan")


def rate_of(time: Array) -> float:
    """Rate of times (T,) s in Hz: the mean one where they lie about an even grid, by which stamps scatter and files
    round; that of the median step where frames are missing; NaN of fewer than two."""
    if len(time) < 2:
        return float("nan")
    step = step_of(time)
    even = np.linspace(time[0], time[-1], len(time))
    if np.abs(time - even).max() < 0.1 * step:
        return float((len(time) - 1) / (time[-1] - time[0]))
    mean_step, off = even_grid(time)
    return 1.0 / mean_step if scatters(off, mean_step) else 1.0 / step


def frame_numbers(time: Array) -> npt.NDArray[np.intp]:
    """Number (T,) of each frame on the even grid that times (T,) s lie on, from 0: rows that a file lacks are left out
    of it, a pause longer than `_PAUSE_S` as that many."""
    rate = rate_of(time)
    if len(time) < 3 or not np.isfinite(rate):
        return np.arange(len(time))
    step, off = even_grid(time)
    if scatters(off, step):
        return np.arange(len(time))
    steps = np.clip(np.rint(np.diff(time) * rate), 1.0, max(_PAUSE_S * rate, 1.0)).astype(int)
    return np.concatenate([[0], np.cumsum(steps)])


def on_grid(numbers: npt.NDArray[np.intp], values: Array) -> Array:
    """Values (T, ...) of frames of these numbers with those that are lacking, NaN: (N, ...)."""
    found = np.full((int(numbers[-1]) + 1, *values.shape[1:]), np.nan)
    found[numbers] = values
    return found


def even_step(time: Array) -> float:
    """Time step (s) of evenly spaced frames; times rounded by a file are even enough.

    Raises:
        RecordingError: a frame lies more than half a step off, as after dropped frames, or there are fewer than two.
    """
    if len(time) < 2:
        raise RecordingError(f"low-pass and derivatives: {len(time)} frames, expected at least two")
    step = float((time[-1] - time[0]) / (len(time) - 1))
    off = np.abs(time - time[0] - step * np.arange(len(time)))
    if not step > 0.0 or off.max() > 0.5 * step:
        k = int(np.argmax(off))
        raise RecordingError(
            f"frame {k + 1} ({time[k]:.4f} s) lies {1000 * off[k]:.1f} ms off an even spacing of {1000 * step:.2f} ms; "
            "low-pass and derivatives expect evenly spaced frames"
        )
    return step


def even_grid(time: Array) -> tuple[float, Array]:
    """Step of the even grid that lies nearest to times (T,) s, by least squares, and how far these lie off it (T,)."""
    k = centred(len(time))
    step = float(k @ time / (k @ k))
    return step, time - time.mean() - step * k


def centred(count: int) -> Array:
    """Numbers of so many frames, from the middle one."""
    return np.asarray(np.arange(count) - 0.5 * (count - 1), dtype=float)


def scatters(off: Array, step: float) -> bool:
    """Whether times that lie off an even grid by (T,) s do so at random: each less than half a step, and on average
    over a few frames much less, as they do not where a frame is missing."""
    mean = np.convolve(off, np.full(_FEW, 1.0 / _FEW), mode="valid") if len(off) >= _FEW else off
    return bool(np.abs(off).max() < 0.5 * step and np.abs(mean).max() < 0.3 * step)


def span(time: Array, first: int, end: int) -> str:
    """When frames [first, end) are: ``0.10 to 0.55 s``."""
    return f"{time[first]:.2f} to {time[end - 1]:.2f} s"


def spans(time: Array, stretches: Sequence[tuple[int, int]], most: int | None = None) -> str:
    """When the frames of these `runs` are: ``0.10 to 0.55 s, 1.20 to 1.31 s and 2 more``."""
    more = f" and {len(stretches) - most} more" if most is not None and len(stretches) > most else ""
    return ", ".join(span(time, *stretch) for stretch in stretches[:most]) + more
