"""How many frames an error lasts: what a long row of alike residuals is worth."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

_WINDOW = 5.0


def integrated_autocorrelation(residual: Array) -> float:
    """Frames (at least 1) that are worth one independent one, of a residual (T,) without NaN.

    1 + 2 sum rho(k), summed to the first lag of at least ``_WINDOW`` times the sum so far (Sokal 1997, Monte Carlo
    methods in statistical mechanics, section 3). The mean is not taken away: an error that never changes sign is the
    one that misleads most.
    """
    count = len(residual)
    power = float(residual @ residual)
    if count < 4 or power == 0.0:
        return 1.0
    spectrum = np.fft.rfft(residual, 2 * count)
    rho = np.fft.irfft(np.abs(spectrum) ** 2)[:count] / power
    total = 1.0 + 2.0 * np.cumsum(rho[1:])
    lags = np.arange(1, count)
    enough = np.flatnonzero(lags >= _WINDOW * total)
    at = int(enough[0]) if len(enough) else count - 2
    return float(np.clip(total[at], 1.0, count / 2))
