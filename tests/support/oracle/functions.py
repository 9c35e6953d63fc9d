"""Functions of one number with two derivatives, by the most obvious way; complex numbers pass through them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Jet = tuple[NDArray, NDArray, NDArray]


def _polynomial(coefficients: list[float], x: NDArray) -> Jet:
    c = list(coefficients)
    value = sum((ck * x**k for k, ck in enumerate(c)), 0 * x)
    first = sum((k * ck * x ** (k - 1) for k, ck in enumerate(c) if k >= 1), 0 * x)
    second = sum((k * (k - 1) * ck * x ** (k - 2) for k, ck in enumerate(c) if k >= 2), 0 * x)
    return value, first, second


def spline_pieces(x: NDArray, y: NDArray) -> NDArray:
    """(n - 1, 4) coefficients, ascending, about each piece's left knot: all conditions in one dense system."""
    n = len(x)
    rows: list[NDArray] = []
    right: list[float] = []

    def condition(value: float, *entries: tuple[int, list[float]]) -> None:
        row = np.zeros(4 * (n - 1))
        for piece, numbers in entries:
            row[4 * piece : 4 * piece + 4] = numbers
        rows.append(row)
        right.append(value)

    for k in range(n - 1):
        h = x[k + 1] - x[k]
        condition(y[k], (k, [1, 0, 0, 0]))
        condition(y[k + 1], (k, [1, h, h**2, h**3]))
        if k + 2 < n:  # slope and curvature go on
            condition(0.0, (k, [0, 1, 2 * h, 3 * h**2]), (k + 1, [0, -1, 0, 0]))
            condition(0.0, (k, [0, 0, 2, 6 * h]), (k + 1, [0, 0, -2, 0]))
    ends = [0.0, 0.0] if n < 4 else [np.polyfit(x[:4], y[:4], 3)[0], np.polyfit(x[-4:], y[-4:], 3)[0]]
    condition(ends[0], (0, [0, 0, 0, 1]))
    condition(ends[1], (n - 2, [0, 0, 0, 1]))
    return np.linalg.solve(np.array(rows), np.array(right)).reshape(n - 1, 4)


def _through_points(kind: str, x: NDArray, y: NDArray, at: NDArray) -> Jet:
    if kind == "piecewise_linear" or len(x) == 2:
        pieces = np.stack([y[:-1], np.diff(y) / np.diff(x), 0 * y[:-1], 0 * y[:-1]], axis=1)
    else:
        pieces = spline_pieces(x, y)
    h = x[-1] - x[-2]
    last = [y[-1], pieces[-1] @ [0, 1, 2 * h, 3 * h**2], 0.0, 0.0]
    before = [y[0], pieces[0, 1], 0.0, 0.0]
    where = np.searchsorted(x, np.real(at), side="right")
    c = np.array([before, *pieces, last])[where]
    h = at - x[np.maximum(where - 1, 0)]
    c0, c1, c2, c3 = (c[..., k] for k in range(4))
    return c0 + h * (c1 + h * (c2 + h * c3)), c1 + h * (2 * c2 + 3 * h * c3), 2 * c2 + 6 * c3 * h


def _evaluate(function: Any, at: NDArray) -> Jet:
    if function.kind == "polynomial":
        return _polynomial(function.coefficients, at)
    return _through_points(function.kind, np.array(function.x), np.array(function.y), at)


def axis_function(axis: Any, q: NDArray, scale: Any) -> Jet:
    """s = scale * sum_k c_k u^k, u what the axis' functions make of q, and its two derivatives with respect to q."""
    value, first, second = q, 1 + 0 * q, 0 * q
    for function in axis.functions:
        outer = _evaluate(function, np.asarray(value))
        value, first, second = outer[0], outer[1] * first, outer[2] * first**2 + outer[1] * second
    outer = _polynomial(axis.coefficients, value)
    return scale * outer[0], scale * outer[1] * first, scale * (outer[2] * first**2 + outer[1] * second)
