"""Gauges: directions of the constants and of the coordinates' zeros along which no measurement changes.

The derivatives of markers and wrench are stacked over random postures, in units of the sensors' and of the prior
standard deviations; the null space, found by SVD, holds the gauges. A shift of a coordinate's zero is a column of its
own: the filter estimates each coordinate anew at each frame, so such a shift costs nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from dynakin.arrays import Array
from dynakin.errors import ModelError
from dynakin.identification.observability.measured import MeasuredModel
from dynakin.units import COMPONENTS

ZERO = "zero/"
_POSTURES = 60
_UNSEEN = 1e-9
"""Of the largest singular value: the derivatives are exact to rounding (1e-14); the weakest direction that a posture
shows lies above 1e-6."""
_NOTHING = 1e-7  # of the largest entry of a direction: less is rounding


@dataclass(frozen=True, eq=False)
class Gauge:
    """One direction: change by name (m, rad, kg, kg m, kg m^2, N, N m), zero/knee for a coordinate's zero.

    The largest change, in units of the prior standard deviations, is 1.
    """

    direction: dict[str, float]


@dataclass(frozen=True, eq=False)
class Gauges:
    """All gauges of a model.

    Attributes:
        names: (c,) what was looked at. singular_values: (c,) of the stack, signal over noise of a prior standard
            deviation in 60 random postures; those of the gauges are rounding.
        found: as many as there are independent ones, each with as few names in it as possible.
    """

    names: tuple[str, ...]
    singular_values: Array
    found: tuple[Gauge, ...]


def gauges_of(measured: MeasuredModel) -> Gauges:
    """Stack, decompose, and write the null space in directions of few names."""
    names, sd, columns = _columns(measured)
    last = np.array([name.startswith(("soft_tissue/", "plates/")) for name in names])
    rows = []
    for x in measured.random_states(_POSTURES, seed=1):
        wrench = _with_offsets(measured, measured.wrench_rows(x)) / measured.wrench_sigma()[:, None]
        rows.append(np.vstack([measured.marker_rows(x), wrench])[:, columns] * sd)
    triangle = np.linalg.qr(np.vstack(rows), mode="r")  # columns that are all 0 stay so
    _, singular, right = np.linalg.svd(triangle)
    null = right[int((singular > _UNSEEN * singular[0]).sum()) :]
    found = (_gauge(names, sd, direction) for direction in sparse_basis(null, last))
    return Gauges(names, singular, tuple(found))


def _columns(measured: MeasuredModel) -> tuple[tuple[str, ...], Array, list[int]]:
    """Names, prior standard deviations and columns of the state: constants, what has a mean of its own, zeros."""
    blocks = ("lengths", "markers", "soft_tissue", "inertia", "plates")
    columns = [k for block in blocks for k in range(measured.core.layout.size)[measured.block(block)]]
    columns = [k for k in columns if measured.names[k] != "plates/delay"]
    names = [measured.names[k] for k in columns]
    zeros = list(range(measured.core.layout.size)[measured.block("coordinates")])
    names += [ZERO + measured.names[k] for k in zeros]
    columns += zeros
    return tuple(names), np.sqrt(np.diag(measured.prior)[columns]), columns


def _with_offsets(measured: MeasuredModel, rows: Array) -> Array:
    """A plate's constant error is added to its component."""
    components = [
        f"plates/{name}" for name, seen in zip(COMPONENTS, measured.initial.spec.wrench_measured, strict=True) if seen
    ]
    for k, name in enumerate(components):
        if name in measured.names:
            rows[k, measured.names.index(name)] = 1.0
    return rows


def _gauge(names: tuple[str, ...], sd: Array, direction: Array) -> Gauge:
    largest = np.abs(direction).max()
    kept = np.flatnonzero(np.abs(direction) > _NOTHING * largest)
    sign = np.sign(direction[kept[0]])
    return Gauge({names[k]: float(sign * sd[k] * direction[k] / largest) for k in kept})


def sparse_basis(null: Array, last: Array | None = None) -> list[Array]:
    """A basis of the rows of ``null`` (d, c) with few entries each.

    For each entry in turn the vector of least 1-norm in which it is 1 (a linear programme, which finds sparse vectors),
    and what is left of two of them when one entry of both is cancelled; of all these, those with the fewest entries
    that are independent of each other.

    Args:
        last: (c,) bool, entries that are left out where as few others do.
    """
    candidates = []
    for part in _parts(null):
        found = np.zeros((len(part), null.shape[1]))
        found[:, part] = _least(_echelon(null, part))
        candidates += [*found, *_cancelled(found)]
    masked = np.zeros(null.shape[1], dtype=bool) if last is None else last
    candidates.sort(key=lambda v: (_count(v), _count(v[masked])))
    basis: list[Array] = []
    kept = np.zeros((0, null.shape[1]))
    for candidate in candidates:
        left = candidate / np.linalg.norm(candidate)
        left = left - kept.T @ (kept @ left)
        size = np.linalg.norm(left)
        if size > 1e-6:
            basis.append(candidate)
            kept = np.vstack([kept, left / size])
        if len(basis) == len(null):
            break
    return basis


def _count(vector: Array) -> int:
    return int((np.abs(vector) > _NOTHING).sum())


def _cancelled(vectors: Array) -> list[Array]:
    """What is left of each pair of rows when one entry of both is cancelled, where that is less than either had."""
    found = []
    some = np.abs(vectors) > _NOTHING
    count = some.sum(axis=1)
    for i, a in enumerate(vectors):
        for j in np.flatnonzero((some[:i] & some[i]).any(axis=1)):
            b = vectors[j]
            for k in np.flatnonzero(some[i] & some[j]):
                rest = a - a[k] / b[k] * b
                size = np.abs(rest).max()
                if size > 1e-5:  # else both are the same direction
                    rest = np.where(np.abs(rest) > _NOTHING * size, rest / size, 0.0)
                    if _count(rest) <= max(count[i], count[j]):
                        found.append(rest)
    return found


def _parts(null: Array) -> list[list[int]]:
    """Entries that some direction ties to each other, in groups; entries that are 0 in all of them in none."""
    tied = np.abs(null.T @ null) > _NOTHING
    groups: list[list[int]] = []
    left = [k for k in range(null.shape[1]) if tied[k, k]]
    while left:
        group, fringe = [], [left[0]]
        while fringe:
            k = fringe.pop()
            if k in left:
                left.remove(k)
                group.append(k)
                fringe += [int(j) for j in np.flatnonzero(tied[k])]
        groups.append(sorted(group))
    return groups


def _echelon(null: Array, part: list[int]) -> Array:
    """A basis (c, d) of the rows of ``null`` over the entries of ``part``: the unit matrix in d of them, so mostly 0,
    which makes linear programmes over it several times as quick."""
    B = null[:, part].T
    B = np.linalg.svd(B, full_matrices=False)[0][:, : np.linalg.matrix_rank(B, tol=_NOTHING)]
    pivots = scipy.linalg.qr(B.T, mode="r", pivoting=True)[1][: B.shape[1]]
    B = np.linalg.solve(B[pivots].T, B.T).T
    return np.where(np.abs(B) > _NOTHING * np.abs(B).max(), B, 0.0)


def _least(B: Array) -> Array:
    """Combinations (c, c) of the columns of ``B`` (c, d), row k that of least 1-norm among those whose entry k is 1.

    Entries that every measurement sees alike, but for a factor (a place and its skin), are merged into the one that is
    seen best. An entry is then cancelled by the next best of its group, at the ratio of their weights, or by other
    groups as the linear programme of the merged one says, whichever is less.
    """
    c, d = B.shape
    if d == 1:
        return np.asarray(B[:, 0] / B)
    alike = _alike(B)
    share = alike.sum(axis=0)
    stand_in = np.argmax(alike != 0.0, axis=0)
    merged = (alike @ B).T
    shortest, price = np.zeros((c, c)), np.full(c, np.inf)
    for part in _parts(merged):
        shortest[np.ix_(part, part)] = _programmes(_echelon(merged, part))
        price[part] = np.abs(shortest[part]).sum(axis=1) - 1.0
    found = np.zeros((c, c))
    for k, by in enumerate(stand_in):
        others = np.where(stand_in == by, np.abs(share), 0.0)
        others[k] = 0.0
        other = int(np.argmax(others))
        if others[other] * price[by] > 1.0:
            found[k, other] = -share[k] / share[other]
        else:
            found[k] = share[k] * shortest[by]
            found[k, by] = 0.0
        found[k, k] = 1.0
    return found


def _alike(B: Array) -> Array:
    """(c, c) weights: row k, of the entry that is seen best of those that are seen alike, holds what each of them is
    worth compared with it (1 or less; itself 1). Rows of the others are 0."""
    c = len(B)
    Q = np.linalg.qr(B)[0]
    seen = np.eye(c) - Q @ Q.T  # columns as the measurements have them, but for one map
    alike = np.zeros((c, c))
    left = np.ones(c, dtype=bool)
    for k in np.argsort(-np.diag(seen), kind="stable"):
        if left[k]:
            share = seen[k] / seen[k, k]
            same = left & (np.abs(seen - np.outer(seen[:, k], share)).max(axis=0) < _NOTHING)
            alike[k, same] = share[same]
            left &= ~same
    return alike


def _programmes(B: Array) -> Array:
    """As `_least`, by a linear programme for each entry: B y = p - q, the sum of p and q, which are not negative, as
    small as it can be."""
    c, d = B.shape
    if d == 1:
        return np.asarray(B[:, 0] / B)
    eye = scipy.sparse.eye_array(c)
    balance = scipy.sparse.hstack([scipy.sparse.csc_array(B), -eye, eye], format="csc")
    cost = np.concatenate([np.zeros(d), np.ones(2 * c)])
    balanced = scipy.optimize.LinearConstraint(balance, 0.0, 0.0)
    found = np.zeros((c, c))
    for k in range(c):
        least = np.repeat([-np.inf, 0.0], [d, 2 * c])
        most = np.full(d + 2 * c, np.inf)
        least[d + k] = most[d + k] = 1.0
        most[d + c + k] = 0.0
        bounds = scipy.optimize.Bounds(least, most)
        fit = scipy.optimize.milp(cost, constraints=balanced, bounds=bounds)  # half of `linprog`'s time
        if fit.x is None:  # the simplex method gives up on some of a whole body's
            fit = scipy.optimize.linprog(
                cost, A_eq=balance, b_eq=np.zeros(c), bounds=np.column_stack([least, most]), method="highs-ipm"
            )
        if fit.x is None:
            raise ModelError(f"identifiability: a sparse direction of {c} numbers was not found: {fit.message}")
        # The solver stops at 1e-7 or so: what is nearly 0 is put to 0 by solving for the rest exactly.
        vector = B @ fit.x[:d]
        zero = np.abs(vector) < 1e-5
        wanted = np.append(np.zeros(zero.sum()), 1.0)
        exact = B @ np.linalg.lstsq(np.vstack([B[zero], B[k]]), wanted, rcond=1e-6)[0]
        found[k] = exact if np.abs(exact - vector).max() < 1e-4 else vector
    return found
