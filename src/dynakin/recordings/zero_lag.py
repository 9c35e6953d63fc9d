"""A low-pass without delay. SciPy's own takes half a second to load, with its statistics: a tenth of a short run."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.linalg import blas

Array = npt.NDArray[np.float64]


def both_ways(samples: Array, rate_hz: float, cutoff_hz: float, beyond: int) -> Array:
    """Butterworth of 2nd order of (N, k) samples, run forwards and then backwards.

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
