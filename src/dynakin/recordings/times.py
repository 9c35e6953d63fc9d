"""Times of frames: their step, their rate, the even grid about which they lie, and stretches of them in words.

Times may scatter about an even grid because the frames do, or because a program stamped them late. Samples that were
taken evenly and stamped by software (a stream, say) lie on a smooth path over the even grid; samples that were taken
when their stamps say do so over the stamps. The movement decides.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from dynakin.arrays import Array, by_neighbours
from dynakin.errors import RecordingError
from dynakin.messages import Message, note

ENDS_S = 0.03
"""How near a recording's ends frames on one side alone help: how much the movement changes there is a guess."""
_PAUSE_S = 1.0  # nothing is led across it
_FEW = 9  # frames, over which the scatter of time stamps is averaged


def step_of(time: Array) -> float:
    """Usual step of times (T,) s: the median one, which missing frames do not change; NaN of fewer than two."""
    return float(np.median(np.diff(time))) if len(time) > 1 else float("nan")


def frames_apart(time: Array, apart_s: float) -> npt.NDArray[np.intp]:
    """Places of frames of times (T,) s that lie so far apart or more, the first and the last among them."""
    step = np.floor((time - time[0]) / apart_s + 1e-9)
    chosen = np.flatnonzero(np.diff(step, prepend=-1.0) > 0)
    return np.unique(np.append(chosen, len(time) - 1))


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


_SCATTER = 0.02
"""Part of a step from which on stamps scatter: 0.2 ms at 100 Hz, in which a foot moves by 1 mm at most."""
_ENOUGH = 20  # frames
_SURE = 3.0
"""Standard errors by which what is decided is known."""


def settled_times(time: Array, samples: Array, rate_in_header: float | None = None) -> tuple[Array, list[Message]]:
    """Times (T,) s on the even grid about which they scatter, and a note, where samples (T, K; NaN where missing) show
    that they were taken evenly; all others as they are."""
    grid = _grid(time, rate_in_header)
    if grid is None:
        return time, []
    off = time - grid
    scatter = float(np.sqrt(np.mean(np.square(off))))
    step = float(grid[1] - grid[0])
    if scatter < _SCATTER * step or not scatters(off, step) or not _stamped(off, samples, step):
        return time, []
    text = (
        f"Time stamps scatter by {1000.0 * scatter:.1f} ms (RMS) about an even {1.0 / step:.6g} Hz, and what was "
        "measured is smoother without that: taken as even."
    )
    return grid, [note("recording", text)]


def _grid(time: Array, rate_in_header: float | None) -> Array | None:
    """The even grid that lies nearest to times (T,): at the header's rate, or a whole number of Hz, where that lies as
    near as can be told."""
    if len(time) < _ENOUGH or not np.isfinite(time).all() or (np.diff(time) <= 0).any():
        return None
    slope, left = even_grid(time)
    k = centred(len(time))
    error = float(np.sqrt(np.mean(np.square(left)) / (k @ k)))
    for rate in (rate_in_header, float(np.rint(1.0 / slope))):
        if rate and abs(1.0 / rate - slope) < _SURE * error:
            slope = 1.0 / rate
            break
    return np.asarray(time.mean() + slope * k)


def _stamped(off: Array, samples: Array, step: float) -> bool:
    """Whether samples on an even grid do not go with how far their stamps lie off it (T,).

    A sample that was taken off the grid lies beside the cubic through its neighbours by its speed times that: the part
    of it that is there is 1 if the stamps are right, 0 if the grid is.
    """
    values = samples.reshape(len(samples), -1)
    beside = values[2:-2] - by_neighbours(values)
    speed = (values[4:] - values[:-4]) / (4.0 * step)
    expected = speed * (off[2:-2] - by_neighbours(off))[:, None]
    known = np.isfinite(beside) & np.isfinite(expected)
    noise = np.square(np.where(known, beside, 0.0)).sum(axis=0) / np.maximum(known.sum(axis=0), 1)
    known &= np.square(step * speed) > noise  # four deviations of a speed that is noise alone
    beside, expected = np.where(known, beside, 0.0), np.where(known, expected, 0.0)
    along, size = (beside * expected).sum(axis=1), np.square(expected).sum(axis=1)
    if np.count_nonzero(size) < _ENOUGH:
        return False
    part = along.sum() / size.sum()
    error = np.sqrt(np.square(along - part * size).sum()) / size.sum()
    return bool(part + _SURE * error < 0.5)


def at_the_ends(time: Array) -> npt.NDArray[np.bool_]:
    """(T,) which of several frames lie within `ENDS_S` of the first or the last."""
    if len(time) < 2:
        return np.zeros(len(time), dtype=bool)
    return np.asarray(np.minimum(time - time[0], time[-1] - time) < ENDS_S - 1e-9)
