"""Which sensors are believed: the innovation of each alone against a chi-square limit for its number of rows."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2


def limits(probability: float) -> list[float]:
    """Of 1 to 6 rows: what a sensor that is as declared exceeds with this probability."""
    return [float(chi2.ppf(1.0 - probability, rows)) for rows in range(1, 7)]


def ratio(v: NDArray, H: NDArray, P: NDArray, R: NDArray, limit: list[float]) -> float:
    """v' (H P H' + R)^-1 v over its limit; more than 1 is refused."""
    return float(v @ np.linalg.inv(H @ P @ H.T + R) @ v) / limit[len(v) - 1]
