"""Methods by their error against a simulation's truth."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from dynakin.arrays import Array, rms
from dynakin.messages import note
from dynakin.results.estimate import values_of
from dynakin.results.measures.adaptation import constant_groups
from dynakin.results.measures.sources import legs_of
from dynakin.results.naming import listed
from dynakin.results.records import Parameter
from dynakin.units import COMPONENTS
from dynakin.validation.methods import ComparedTrial
from dynakin.validation.table2 import Spread, spread

if TYPE_CHECKING:
    import xarray as xr


LEG = ("ankle", "knee", "hip")
"""Joints of a leg in the built-in planar models."""

# (title, unit) of the figures of `truth_errors`, in their order.
FIGURES = (
    ("angles", "deg"),
    ("about their mean", "deg"),
    ("speeds", "rad/s"),
    ("accelerations", "rad/s2"),
    ("moments", "N m"),
    ("FX", "N"),
    ("FY", "N"),
    ("MZ", "N m"),
)


TRUTH = "truth.nc"
"""Where `dynakin simulate` leaves the truth, next to the recording."""


@dataclass(frozen=True)
class TruthRow:
    """RMS error of one quantity of `FIGURES` by one method; mean and standard deviation over trials."""

    quantity: str
    unit: str
    method: str
    rms: Spread


def against_truth(trials: Sequence[ComparedTrial]) -> tuple[list[ComparedTrial], list[TruthRow]]:
    """Every method's errors on the trials that were simulated by dynakin, none where none was; and the trials, with a
    note where one was simulated with a model of other coordinates, so that no error can be had.

    All methods over the same frames of each quantity: those that each of them has, moments only where they are
    measured for all. A filter has derived and prior moments too, which are harder, inverse dynamics none.
    """
    import xarray as xr  # the slowest library of all, which reading a trial does without

    found: dict[tuple[str, str, str], list[float]] = {}
    noted: list[ComparedTrial] = []
    for trial in trials:
        noted.append(trial)
        path = _truth_file(trial)
        if path is None:
            continue
        with xr.open_dataset(path) as truth:
            if not _is_of(truth, trial):
                continue  # another recording's
            joints, known = _leg_joints(trial), {str(name) for name in truth["coordinate"].values}
            if lacking := set(joints) - known:
                text = (
                    f"The truth in {path} is left out: it is of another model, which has no {listed(sorted(lacking))}."
                )
                noted[-1] = replace(trial, notes=(*trial.notes, note("method", text)))
                continue
            turning = known & {n for n, turns in zip(trial.coordinate_names, trial.rotation, strict=True) if turns}
            paths = truth["coordinates"].transpose("time", "coordinate")
            moving = [
                n for n in trial.coordinate_names if n in turning and np.ptp(paths.sel(coordinate=n).values) > 0.0
            ]
            for method, data in zip(trial.methods, _where_all_say(trial), strict=True):
                values = truth_errors(method.name, data, truth, trial.window, joints, moving).values
                for (quantity, unit), value in zip(FIGURES, values, strict=True):
                    found.setdefault((quantity, unit, method.name), []).append(value)
    rows = [TruthRow(*key, spread([v for v in values if np.isfinite(v)])) for key, values in found.items()]
    return noted, rows


def _truth_file(trial: ComparedTrial) -> Path | None:
    path = next(iter(trial.estimates.values())).recording.path
    found = None if path is None else Path(path).parent / TRUTH
    return found if found is not None and found.exists() else None


def _is_of(truth: xr.Dataset, trial: ComparedTrial) -> bool:
    """Whether the truth is that of this recording, by its times."""
    return truth.sizes["time"] == len(trial.time) and np.allclose(truth["time"].values, trial.time)


def _leg_joints(trial: ComparedTrial) -> Sequence[str]:
    """Coordinates of the legs, whose moments count."""
    legs = legs_of(next(iter(trial.estimates.values())).data)
    return [name for name, leg in zip(trial.coordinate_names, legs, strict=True) if leg] or LEG


def _where_all_say(trial: ComparedTrial) -> list[xr.Dataset]:
    """Data of each method, NaN where another method has nothing; one that nowhere has the quantity does not count."""
    import xarray as xr

    found = [
        {name: values_of(m.data, name) for name in ("coordinates", "speeds", "accelerations")}
        | {"moments": m.measured_moments(), "wrench_estimated": m.wrench}
        for m in trial.methods
    ]
    for name in found[0]:
        known = [np.isfinite(arrays[name]) for arrays in found]
        by_all = np.logical_and.reduce([each for each in known if each.any()])
        for arrays in found:
            arrays[name] = np.where(by_all, arrays[name], np.nan)
    labels = {"coordinate": list(trial.coordinate_names), "component": list(COMPONENTS)}
    dims = dict.fromkeys(found[0], ("time", "coordinate")) | {"wrench_estimated": ("time", "component")}
    return [xr.Dataset({name: (dims[name], each[name]) for name in each}, coords=labels) for each in found]


@dataclass(frozen=True)
class TruthErrors:
    """RMS errors of one method in the order of `FIGURES`; NaN where it does not give the quantity.

    Angles as they are, and after removing each coordinate's mean offset; these, speeds and accelerations are averaged
    over all coordinates, moments over those that `truth_errors` was asked for; what has no frame does not count.
    """

    method: str
    values: tuple[float, ...]


def truth_errors(
    method: str,
    data: xr.Dataset,
    truth: xr.Dataset,
    window: npt.NDArray[np.bool_],
    joints: Sequence[str],
    coordinates: Sequence[str] | None = None,
) -> TruthErrors:
    """Errors of ``data`` (named as `Estimate.data`) against ``truth`` over the frames ``window`` (T,).

    Args:
        joints: coordinates whose moments count; a planar model's toe is the ground's.
        coordinates: whose angles, speeds and accelerations count; all of the truth's where not given.
    """
    names = list(coordinates or (str(name) for name in truth["coordinate"].values))

    def error(variable: str, coordinates: Sequence[str] = names) -> Array:
        both = (data[variable].sel(coordinate=list(coordinates)), truth[variable].sel(coordinate=list(coordinates)))
        given, true = (entry.transpose("time", "coordinate").values for entry in both)
        return np.asarray(given - true)[window]

    angle = np.degrees(error("coordinates"))
    wrench = (data["wrench_estimated"] - truth["wrench"]).transpose("time", "component").values[window]
    return TruthErrors(
        method,
        (
            _mean_rms(angle),
            _mean_rms(angle - np.nanmean(angle, axis=0)),
            _mean_rms(error("speeds")),
            _mean_rms(error("accelerations")),
            _mean_rms(error("moments", joints)),
            *(_mean_rms(wrench[:, [k]]) for k in (0, 1, 5)),
        ),
    )


class ParameterError(NamedTuple):
    """RMS error of one kind of constant, per cent of the true values: where the filter started, and where it ended."""

    constants: int
    start_percent: float
    end_percent: float


def parameter_errors(parameters: Sequence[Parameter], truth: Mapping[str, float]) -> dict[str, ParameterError]:
    """Errors of the estimated lengths, masses and moments of inertia.

    Args:
        truth: by the names of the filter's state, as `dynakin.simulation.Truth.parameters`; constants that it does not
            hold do not count.
    """
    found = {}
    for title, group in constant_groups(parameters).items():
        known = [p for p in group if truth.get(p.name)]
        if known:
            true = np.array([truth[p.name] for p in known])
            errors = [np.array([getattr(p, key) for p in known]) / true - 1.0 for key in ("initial", "value")]
            start, end = (100.0 * float(rms(error)) for error in errors)
            found[title] = ParameterError(len(known), start, end)
    return found


def _mean_rms(errors: Array) -> float:
    """Mean of the columns' RMS, of those that are known in some frame; NaN where none is."""
    known = errors[:, np.isfinite(errors).any(axis=0)]
    return float(np.mean(rms(known, axis=0))) if known.size else float("nan")
