"""Small smooth changes of a posed motion, fitted so that its forces are what they are to be.

A change is a spline of degree 5 (forces, from its second derivative, are smooth themselves); it and its derivatives
vanish at both ends of its window. Each coefficient acts on six intervals between knots only, so that every sixth one
can be tried at once: the Jacobian costs six evaluations for each thing that changes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BSpline
from scipy.sparse import csr_matrix, diags
from scipy.sparse.linalg import spsolve

from dynakin.arrays import Array
from dynakin.errors import ConfigError
from dynakin.simulation.jets import Jet

_DEGREE = 5
_SPAN = _DEGREE + 1
_TRIED = 1e-6  # m or rad
# How far to go along a round's step. Rows are nearly of second degree in it, so a full one that makes things worse is
# mended by the next round; a shorter one would only crawl.
_PARTS, _WORSE = (1.0, 0.5, 0.2, 0.1, 0.03), 30.0


@dataclass(frozen=True)
class Corrections:
    """What is added to each name (m or rad): coefficients (N, K) of the splines on knots (K + 6,) s."""

    names: tuple[str, ...]
    knots: Array
    coefficients: Array

    def at(self, time: Array) -> dict[str, Jet]:
        """By name; nothing outside the window."""
        inside = np.clip(time, self.knots[0], self.knots[-1])
        within = ((time > self.knots[0]) & (time < self.knots[-1]))[:, None]
        # Five more knots and zeros at either end, between which a spline of these is defined.
        before, after = (
            np.arange(1.0, _SPAN) * step for step in (self.knots[1] - self.knots[0], self.knots[-1] - self.knots[-2])
        )
        knots = np.concatenate([self.knots[0] - before[::-1], self.knots, self.knots[-1] + after])
        spline = BSpline(knots, np.pad(self.coefficients.T, ((_DEGREE, _DEGREE), (0, 0))), _DEGREE)
        values = [np.where(within, spline(inside, order), 0.0) for order in range(3)]
        return {name: Jet(*(v[:, k] for v in values)) for k, name in enumerate(self.names)}


def fit_corrections(
    sizes: Mapping[str, float],
    knots: Array,
    time: Array,
    residuals: Callable[[Mapping[str, Jet]], Array],
    rounds: int,
    changed: Sequence[str] | None = None,
    start: Corrections | None = None,
) -> Corrections:
    """The corrections that make rows (T, R) at times (T,) small, by Gauss and Newton.

    Args:
        sizes: by name, how large a coefficient may well be (m or rad).
        knots: (K + 6,) s, rising.
        residuals: corrections at ``time`` -> rows (T, R), each over what it may well be; a row depends on what is at
            its time only.
        rounds: of Gauss and Newton.
        changed: names whose corrections are sought, all where None; the others stay as they are at the start.
        start: from where, on the same knots.
    """
    names, count = tuple(sizes), len(knots) - _SPAN
    weights = np.repeat([1.0 / size**2 for size in sizes.values()], count)
    found = np.zeros((len(names), count)) if start is None else start.coefficients

    def rows_of(coefficients: Array) -> Array:
        return residuals(Corrections(names, knots, coefficients).at(time))

    # A coefficient moves rows between its first and its last knot.
    starts = np.searchsorted(time, knots[:count])
    ends = np.searchsorted(time, knots[_SPAN:])
    rows = rows_of(found)
    for _ in range(rounds):
        blocks = []
        for n, name in enumerate(names):
            if changed is not None and name not in changed:
                continue
            for first in range(_SPAN):
                tried = found.copy()
                tried[n, first::_SPAN] += _TRIED
                change = (rows_of(tried) - rows) / _TRIED
                for k in range(first, count, _SPAN):
                    own = np.arange(starts[k], ends[k])
                    at = (own[:, None] * rows.shape[1] + np.arange(rows.shape[1])).ravel()
                    blocks.append((at, np.full(at.size, n * count + k), change[own].ravel()))
        place, column, value = (np.concatenate(parts) for parts in zip(*blocks, strict=True))
        jacobian = csr_matrix((value, (place, column)), shape=(rows.size, found.size))
        slope = jacobian.T @ rows.ravel() + weights * found.ravel()
        step = -spsolve((jacobian.T @ jacobian + diags(weights)).tocsc(), slope).reshape(found.shape)
        cost = float(np.sum(rows**2) + weights @ found.ravel() ** 2)
        for part in _PARTS:
            try:
                after = rows_of(found + part * step)
            except ConfigError:  # a leg does not reach
                continue
            reached = float(np.sum(after**2) + weights @ (found + part * step).ravel() ** 2)
            if reached < _WORSE * cost:
                found, rows = found + part * step, after
                break
        else:
            break
    return Corrections(names, knots, found)
