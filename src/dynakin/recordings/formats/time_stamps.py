"""Times that scatter about an even grid: of the frames themselves, or of a program that stamped them late?

Samples that were taken evenly and stamped by software (a stream, say) lie on a smooth path over the even grid; samples
that were taken when their stamps say do so over the stamps. The movement decides.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from dynakin.arrays import by_neighbours
from dynakin.messages import Message, note
from dynakin.recordings.times import centred, even_grid, scatters

Array = npt.NDArray[np.float64]

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
