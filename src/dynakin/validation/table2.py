"""The paper's Table II: how far each method's markers and wrench are from the measured ones."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from dynakin.arrays import Array, Flags, rms_length
from dynakin.results.measures.fit import SignalFit, signal_fit
from dynakin.units import COMPONENTS
from dynakin.validation.methods import ComparedTrial

MARKERS = "markers"
"""Name of the rows that are means over all markers."""


@dataclass(frozen=True)
class Row:
    """One quantity by one method, mean and standard deviation over the trials.

    quantity: "markers" (mean over markers), a marker's name, or fx to mz. unit: of ``rms``: mm, N or N m.
    The other figures as in `SignalFit`; for a marker they are those of `marker_fit`.
    """

    quantity: str
    unit: str
    method: str
    rms: Spread
    nrms_rms_percent: Spread
    nrms_range_percent: Spread
    correlation: Spread


def marker_fit(measured: Array, estimated: Array, axes: Flags) -> SignalFit:
    """Agreement of one marker's path, RMS in mm.

    A place has no zero of its own, so per cent are of the path's size about its mean: its RMS distance from there, and
    the diagonal of the box it stays in. The correlation is that of both paths about their means, all axes together;
    it does not depend on where the axes point.

    Args:
        measured, estimated: (T, 3) m; frames in which one is NaN do not count. axes: (3,) bool, those modelled.
    """
    a, b = measured[:, axes], estimated[:, axes]
    seen = np.isfinite(a).all(axis=1) & np.isfinite(b).all(axis=1)
    if not seen.any():
        return SignalFit(None, None, None, None)
    a, b = a[seen], b[seen]
    off = float(rms_length(a - b))
    span = float(np.linalg.norm(np.ptp(a, axis=0)))
    a, b = a - a.mean(axis=0), b - b.mean(axis=0)
    size, power = float(rms_length(a)), float(np.sqrt(np.sum(a**2) * np.sum(b**2)))
    return SignalFit(
        1000.0 * off,
        100.0 * off / size if size > 0.0 else None,
        100.0 * off / span if span > 0.0 else None,
        float(np.sum(a * b)) / power if power > 0.0 else None,
    )


def mean_fit(fits: Sequence[SignalFit]) -> SignalFit:
    """Mean of each figure over markers, those that have it."""
    return SignalFit(*(spread([fit[k] for fit in fits]).mean for k in range(len(SignalFit._fields))))


def trial_fits(trial: ComparedTrial) -> dict[tuple[str, str], SignalFit]:
    """Fit over the trial's window of each (quantity, method): "markers", each marker, each modelled component."""
    w = trial.window
    found: dict[tuple[str, str], SignalFit] = {}
    for method in trial.methods:
        each = {
            name: marker_fit(trial.measured_markers[w, k], method.markers[w, k], trial.axes)
            for k, name in enumerate(trial.marker_names)
        }
        found[MARKERS, method.name] = mean_fit(list(each.values()))
        found |= {(name, method.name): fit for name, fit in each.items()}
        for k, name in enumerate(COMPONENTS):
            if np.isfinite(trial.measured_wrench[:, k]).any():
                found[name, method.name] = signal_fit(trial.measured_wrench[w, k], method.wrench[w, k])
    return found


def table2(trials: Sequence[ComparedTrial]) -> list[Row]:
    """Rows by quantity, then method: all markers, the wrench, then each marker; over one or many trials."""
    return table2_of([trial_fits(trial) for trial in trials])


def table2_of(fits: Sequence[Mapping[tuple[str, str], SignalFit]]) -> list[Row]:
    """`table2` of what `trial_fits` gave for each trial."""
    keys = dict.fromkeys(key for fit in fits for key in fit)
    first = (MARKERS, *COMPONENTS)
    quantities = [name for name in first if any(key[0] == name for key in keys)]
    quantities += [name for name in dict.fromkeys(key[0] for key in keys) if name not in first]
    methods = list(dict.fromkeys(method for _, method in keys))
    return [
        _row(quantity, method, [fit[quantity, method] for fit in fits if (quantity, method) in fit])
        for quantity in quantities
        for method in methods
        if (quantity, method) in keys
    ]


def _row(quantity: str, method: str, fits: Sequence[SignalFit]) -> Row:
    figures = {name: spread([getattr(fit, name) for fit in fits]) for name in SignalFit._fields}
    return Row(quantity, unit_of(quantity), method, **figures)


def merged(tables: Sequence[Sequence[Row]]) -> list[Row]:
    """Rows of single trials as rows over all of them, in the order of their first appearance."""
    found: dict[tuple[str, str], list[Row]] = {}
    for row in (row for rows in tables for row in rows):
        found.setdefault((row.quantity, row.method), []).append(row)
    return [
        Row(
            rows[0].quantity,
            rows[0].unit,
            rows[0].method,
            *(spread([getattr(row, name).mean for row in rows]) for name in SignalFit._fields),
        )
        for rows in found.values()
    ]


def unit_of(quantity: str) -> str:
    """Unit of a row's RMS."""
    if quantity not in COMPONENTS:
        return "mm"
    return "N" if quantity.startswith("f") else "N m"


class Spread(NamedTuple):
    """Mean over ``n`` trials and the sample standard deviation (None below two); mean None if no trial has it."""

    mean: float | None
    sd: float | None
    n: int


def spread(values: Sequence[float | None]) -> Spread:
    """Over the values that are defined."""
    known = [value for value in values if value is not None]
    if not known:
        return Spread(None, None, 0)
    sd = float(np.std(known, ddof=1)) if len(known) > 1 else None
    return Spread(float(np.mean(known)), sd, len(known))
