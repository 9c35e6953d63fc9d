"""0 to 100 % curves of repetitions, with mean and standard deviation over them; moments and forces also per kg."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields
from operator import attrgetter
from pathlib import Path

import numpy as np
import numpy.typing as npt

from dynakin.arrays import Array
from dynakin.results.estimate import Estimate, values_of
from dynakin.results.measures.facing import facing
from dynakin.results.measures.repetitions import Movement, Repetition, repetitions_of
from dynakin.results.measures.sources import measured_moments, measured_wrench
from dynakin.results.naming import plural
from dynakin.units import COMPONENTS

PERCENT = np.linspace(0.0, 100.0, 101)
MEASURED = "measured"
"""Name of what the plates say, next to the methods."""


@dataclass(frozen=True, eq=False)
class Signal:
    """values (T,) in ``unit``: a coordinate ("knee", deg or mm), its moment ("knee/moment", N m or N) or a component
    of the wrench ("fy", N or N m)."""

    quantity: str
    unit: str
    values: Array


@dataclass(frozen=True, eq=False)
class MeanCurve:
    """One quantity by one method over the repetitions of one side.

    side: "both" (squats), "left" or "right". n, mean, sd: (101,) at `PERCENT`; n repetitions of ``of`` are known there,
    of a coordinate with a deviation; of a moment or a force only those count that are measured in every frame. sd: the
    sample's, NaN below two.
    mean_per_kg, sd_per_kg: over the body mass; None for coordinates, which have no such.
    """

    movement: Movement
    side: str
    method: str
    quantity: str
    unit: str
    n: npt.NDArray[np.int64]
    of: int
    mean: Array
    sd: Array
    mean_per_kg: Array | None
    sd_per_kg: Array | None

    @property
    def times(self) -> str:
        """How many repetitions it is the mean of, in words."""
        most = int(self.n.max())
        return plural(most, "repetition") if most == self.of else f"{most} of {plural(self.of, 'repetition')}"


@dataclass(frozen=True)
class CurvePoint:
    """One point of a mean curve: a row of ``repetitions.csv``. None: not defined (one repetition has no sd, a
    coordinate nothing per kg). ``repetitions``: how many there are, ``n`` of them known here."""

    trial: str
    movement: str
    side: str
    method: str
    quantity: str
    unit: str
    percent: float
    n: int
    mean: float | None
    sd: float | None
    mean_per_kg: float | None
    sd_per_kg: float | None
    repetitions: int


def signals(
    names: Sequence[str],
    rotation: npt.NDArray[np.bool_],
    coordinates: Array | None = None,
    moments: Array | None = None,
    wrench: Array | None = None,
) -> list[Signal]:
    """Arrays as signals with units for people; what is nowhere known is left out.

    Args:
        names, rotation: (C,) of the coordinates.
        coordinates: (T, C) rad or m. moments: (T, C) N m or N. wrench: (T, 6) N and N m.
    """
    found = []
    for k, name in enumerate(names):
        turn = bool(rotation[k])
        if coordinates is not None:
            found.append(Signal(name, "deg" if turn else "mm", (np.degrees(1.0) if turn else 1e3) * coordinates[:, k]))
        if moments is not None:
            found.append(Signal(f"{name}/moment", "N m" if turn else "N", moments[:, k]))
    for k, name in enumerate(COMPONENTS if wrench is not None else ()):
        assert wrench is not None
        found.append(Signal(name, "N" if name.startswith("f") else "N m", wrench[:, k]))
    return [signal for signal in found if np.isfinite(signal.values).any()]


def normalised(time: Array, values: Array, first: int, last: int) -> Array:
    """A signal (T,) at 0 to 100 % of the frames first to last (101,), linearly between frames; NaN across gaps."""
    part = slice(first, last + 1)
    at = time[first] + PERCENT / 100.0 * (time[last] - time[first])
    return np.asarray(np.interp(at, time[part], values[part]))


def mean_curves(
    time: Array, repetitions: Sequence[Repetition], methods: dict[str, list[Signal]], mass_kg: float
) -> list[MeanCurve]:
    """Mean and sample standard deviation of each method's signals over the repetitions, each side on its own.

    A repetition in which a moment or force is not known in every frame is left out of the mean of that one.
    """
    found = []
    for side in dict.fromkeys(repetition.side for repetition in repetitions):
        own = [repetition for repetition in repetitions if repetition.side == side]
        for method, every in methods.items():
            for signal in every:
                each = np.stack([normalised(time, signal.values, r.first, r.last) for r in own])
                found.append(_mean_curve(own[0].movement, side, method, signal, each, mass_kg))
    return found


def _mean_curve(movement: Movement, side: str, method: str, signal: Signal, each: Array, mass_kg: float) -> MeanCurve:
    kinetic = signal.unit in ("N", "N m")
    known = np.isfinite(each)
    if kinetic:  # the mean of some cycles' beginnings and others' ends is nobody's
        known &= known.all(axis=1, keepdims=True)
    n = known.sum(axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.where(known, each, 0.0).sum(axis=0) / n
        sd = np.sqrt(np.where(known, (each - mean) ** 2, 0.0).sum(axis=0) / (n - 1))
    sd[n < 2] = np.nan
    per_kg = (mean / mass_kg, sd / mass_kg) if kinetic else (None, None)
    return MeanCurve(movement, side, method, signal.quantity, signal.unit, n, len(each), mean, sd, *per_kg)


def estimate_curves(estimate: Estimate) -> list[MeanCurve]:
    """Mean curves of the filter's own quantities and of the plates'; nothing without a repetition."""
    estimate = facing(estimate)
    preset = estimate.config.get("preset")
    data = estimate.data
    own = (estimate.known("coordinates"), measured_moments(data), measured_wrench(data))
    names, rotation = estimate.coordinate_names, estimate.is_rotation()
    methods = {
        f"EKF ({preset})" if preset else "EKF": signals(names, rotation, *own),
        MEASURED: signals(names, rotation, wrench=values_of(data, "wrench_measured")),
    }
    repetitions = repetitions_of(estimate).items
    return mean_curves(estimate.time, repetitions, methods, float(estimate.config.get("mass_kg") or np.nan))


def curve_points(trial: str, curves: Iterable[MeanCurve]) -> list[CurvePoint]:
    """Mean curves as rows, one a point."""

    def known(values: Array | None, k: int) -> float | None:
        return None if values is None or not np.isfinite(values[k]) else float(values[k])

    return [
        CurvePoint(
            trial=trial,
            movement=curve.movement,
            side=curve.side,
            method=curve.method,
            quantity=curve.quantity,
            unit=curve.unit,
            percent=float(percent),
            n=int(curve.n[k]),
            mean=known(curve.mean, k),
            sd=known(curve.sd, k),
            mean_per_kg=known(curve.mean_per_kg, k),
            sd_per_kg=known(curve.sd_per_kg, k),
            repetitions=curve.of,
        )
        for curve in curves
        for k, percent in enumerate(PERCENT)
    ]


def write_curves(path: Path, points: Iterable[CurvePoint]) -> None:
    """``repetitions.csv``; only the line of names where nothing repeats."""
    names = [entry.name for entry in fields(CurvePoint)]
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(names)
        # Means to six digits, their spread over some repetitions to four.
        forms = [f"%.{4 if name.startswith('sd') else 6}g" for name in names]
        cells = attrgetter(*names)
        writer.writerows(
            [
                form % value if isinstance(value, float) else value
                for form, value in zip(forms, cells(point), strict=True)
            ]
            for point in points
        )
