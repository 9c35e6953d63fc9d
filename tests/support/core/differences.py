"""Central differences, and derivatives compared block by block of the state."""

from __future__ import annotations

import numpy as np

BLOCKS = (
    "coordinates",
    "speeds",
    "accelerations",
    "lengths",
    "markers",
    "soft_tissue",
    "inertia",
    "plates",
    "contacts",
)


def central_differences(function, x):
    """Steps of 1e-5: truncation about 1e-10, rounding about 1e-11 of the function's size."""
    columns = []
    for i in range(x.size):
        h = 1e-5 * max(1.0, abs(x[i]))
        plus, minus = x.copy(), x.copy()
        plus[i] += h
        minus[i] -= h
        columns.append((function(plus) - function(minus)).ravel() / (plus[i] - minus[i]))
    return np.array(columns).T


def compare(name, actual, expected, relative, scale):
    """``scale``: size of the quantity itself, below which a derivative is as good as zero."""
    assert actual.shape == expected.shape, name
    tolerance = relative * max(scale, np.abs(expected).max(initial=0.0))
    np.testing.assert_allclose(actual, expected, rtol=0, atol=tolerance, err_msg=name)
