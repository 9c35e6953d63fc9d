"""One trial and one setting: one call into the core, and the figures by which settings are chosen."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from dynakin.arrays import Array
from dynakin.bindings import _core
from dynakin.filter.augment import extended
from dynakin.filter.core_filter import core_filter
from dynakin.filter.noise import marker_variance, wrench_covariance
from dynakin.settings.noise import Noise
from dynakin.studies.tuning.trial import TuningTrial, undoubting
from dynakin.units import COMPONENTS

LOST_M = 0.5
"""Markers this far from their estimates (RMS over a frame's markers, ten frames in a row) belong to another person."""

# Criteria, all of them the smaller the better: title and unit.
CRITERIA = {
    "paper": ("sum of RMS differences", "m + N + N m"),
    "sigma": ("mean RMS difference in declared sigmas", "1"),
    "nll": ("negative log-likelihood per row", "nat"),
    "ahead": ("error 100 ms ahead, 1: of the last value held", "1"),
    "left_out": ("error of the marker that is left out", "mm"),
    "nis": ("|ln| of the NIS per row", "1"),
}


@dataclass(frozen=True, eq=False)
class Shared:
    """What all tasks of a tuning have in common. Pickles.

    left_out: whether each marker is also left out in turn, from the first frame that counts on (M more runs).
    """

    trials: tuple[TuningTrial, ...]
    base: Noise
    left_out: bool = False

    @property
    def floating(self) -> tuple[bool, ...]:
        """Whether the model is fixed nowhere, of each trial."""
        return tuple(bool(trial.initial.feet) for trial in self.trials)


def score_task(shared: Shared, payload: tuple[int, Mapping[str, float]]) -> dict[str, Any]:
    """Figures of trial number ``payload[0]`` with the base settings changed by ``payload[1]``.

    Returns:
        ``divergence`` (why the filter lost the trial; None: it did not), ``done`` (frames filtered), the criteria and
        what they are made of: ``n_rows`` and ``log_likelihood`` (sums), ``nis_per_row``, ``markers_mm`` (mean over
        markers), ``fx`` to ``mz``, and with ``ahead_`` the same 100 ms ahead. None where it is not defined.
    """
    number, changes = payload
    trial = shared.trials[number]
    noise = undoubting(shared.base.changed(**changes))
    figures = figures_of(trial, noise, shared.base)
    if figures["divergence"] is None and shared.left_out:
        figures["left_out"] = left_out_mm(trial, noise)
    return figures


def figures_of(trial: TuningTrial, noise: Noise, declared: Noise) -> dict[str, Any]:
    """Figures as of `score_task`. declared: the settings whose sigmas are the units of ``sigma``: not those that are
    being tried, or the largest would win."""
    _, _, core = core_filter(trial.initial, noise, trial.estimate)
    sums = core.score(trial.time, trial.markers, trial.wrench, trial.first, trial.end, ahead=trial.ahead, lost_m=LOST_M)
    return figures_from(sums, trial, declared)


def figures_from(sums: Mapping[str, Any], trial: TuningTrial, declared: Noise) -> dict[str, Any]:
    """`figures_of` what the core's `score` gave."""
    blank = dict.fromkeys([*CRITERIA, "n_rows", "log_likelihood", "nis_per_row", *_parts(""), *_parts("ahead_")])
    found = {"divergence": sums["divergence"] or None, "done": int(sums["done"])} | blank
    if sums["divergence"] or sums["n_rows"] == 0:
        return found
    estimated, ahead = (_rms(sums, name) for name in ("estimated", "ahead"))
    ratio = sums["nis"] / sums["n_rows"]
    relative = ahead / trial.persistence()
    return found | {
        "paper": float(np.nansum(_distances(estimated)) + np.nansum(estimated[-6:])),
        "sigma": _mean(estimated / _declared_sd(trial, declared)),
        "nll": -sums["log_likelihood"] / sums["n_rows"],
        "ahead": _mean(relative[np.isfinite(relative)]),
        "nis": abs(float(np.log(ratio))) if ratio > 0.0 else None,
        "nis_per_row": ratio,
        "n_rows": int(sums["n_rows"]),
        "log_likelihood": sums["log_likelihood"],
        **_rms_columns("", estimated),
        **_rms_columns("ahead_", ahead),
    }


def left_out_mm(trial: TuningTrial, noise: Noise) -> float | None:
    """Mean over markers of the error of each where it is not given to the filter, RMS distance in mm.

    None where the filter diverges without one of them.
    """
    errors = []
    for k in range(trial.markers.shape[1]):
        hidden = trial.markers.copy()
        hidden[trial.first :, k] = np.nan
        found = left_out_error(trial, noise, hidden, k)
        if found is None:
            return None
        errors.append(found)
    return _mean(np.array(errors))


def left_out_error(trial: TuningTrial, noise: Noise, hidden: Array, marker: int) -> float | None:
    """RMS distance (mm) of one marker that ``hidden`` (T, M, 3) does not hold."""
    _, model, core = core_filter(trial.initial, noise, trial.estimate)
    traced = core.score(trial.time, hidden, trial.wrench, trial.first, trial.end, lost_m=LOST_M, trace=True)
    if traced["divergence"]:
        return None
    axes = np.array(trial.initial.spec.markers[marker].measured)
    frames = range(trial.first, trial.end)
    places = np.stack([_core.marker_positions(model, traced["state"][k])[marker] for k in frames])
    squares = ((places - trial.markers[trial.first : trial.end, marker])[:, axes] ** 2).sum(axis=1)
    seen = np.isfinite(squares)
    return 1000.0 * float(np.sqrt(squares[seen].mean())) if seen.any() else None


def _rms(sums: Mapping[str, Any], name: str) -> Array:
    """(3M + 6,); NaN where nothing was measured."""
    counts = sums[f"{name}_counts"]
    mean = np.divide(sums[f"{name}_squares"], counts, out=np.full(len(counts), np.nan), where=counts > 0)
    return np.asarray(np.sqrt(mean))


def _distances(rms: Array) -> Array:
    """RMS distance (M,) m of each marker; NaN where it was never measured."""
    squares = rms[:-6].reshape(-1, 3) ** 2
    seen = np.isfinite(squares).any(axis=1)
    return np.where(seen, np.sqrt(np.nansum(squares, axis=1)), np.nan)


def _declared_sd(trial: TuningTrial, noise: Noise) -> Array:
    """Standard deviation (3M + 6,) of each channel's noise; the moments' about the ground origin."""
    initial = extended(trial.initial, noise, trial.estimate)
    markers = marker_variance(initial, noise, trial.estimate)
    point = initial.plate_centre if noise.reference_point_m == "auto" else np.array(noise.reference_point_m)
    x, y, z = point
    lever = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    wrench = wrench_covariance(noise)
    moments = np.diag(wrench[3:, 3:]) + np.diag(lever @ wrench[:3, :3] @ lever.T)
    return np.asarray(np.sqrt(np.concatenate([np.repeat(markers, 3), np.diag(wrench)[:3], moments])))


def _parts(prefix: str) -> list[str]:
    return [f"{prefix}markers_mm", *(f"{prefix}{name}" for name in COMPONENTS)]


def _rms_columns(prefix: str, rms: Array) -> dict[str, float | None]:
    values = [1000.0 * _nanmean(_distances(rms)), *rms[-6:]]
    return {
        name: float(value) if np.isfinite(value) else None for name, value in zip(_parts(prefix), values, strict=True)
    }


def _mean(values: Array) -> float | None:
    known = values[np.isfinite(values)]
    return float(known.mean()) if len(known) else None


def _nanmean(values: Array) -> float:
    found = _mean(values)
    return np.nan if found is None else found
