"""Between methods, where nothing is measured: joint angles against the classical method (Figure 5), moments against AT
(Figure 7); of a whole body both against inverse kinematics and dynamics."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dynakin.results.measures.fit import SignalFit, TruthError, signal_fit, truth_error
from dynakin.results.measures.power import root_coordinates
from dynakin.validation.methods import AT, CLASSICAL, ComparedTrial, Method
from dynakin.validation.reference.inverse_dynamics import INVERSE
from dynakin.validation.table2 import Spread, spread


@dataclass(frozen=True)
class AngleDifference:
    """A filter's coordinate less the classical one, mean and sd over trials; degrees (mm for a translation).

    ``mean`` is mostly a matter of where zero is; ``rms_about_mean`` is the movement's difference. against: the
    reference's name.
    """

    coordinate: str
    unit: str
    method: str
    against: str
    rms: Spread
    mean: Spread
    rms_about_mean: Spread


@dataclass(frozen=True)
class MomentDifference:
    """A filter's joint moment against AT's, mean and sd over trials; N m (N for a translation), and per cent of AT's
    signal: of its RMS and of its range. against: the reference's name."""

    coordinate: str
    unit: str
    method: str
    against: str
    rms: Spread
    nrms_rms_percent: Spread
    nrms_range_percent: Spread
    correlation: Spread


def angle_differences(trials: Sequence[ComparedTrial]) -> list[AngleDifference]:
    """Every coordinate of every filter against the classical method; empty where that cannot be had."""
    found: dict[tuple[str, str, str, str], list[TruthError]] = {}
    for trial in trials:
        for method, reference in _pairs(trial, CLASSICAL):
            for k, name in enumerate(trial.coordinate_names):
                if np.ptp(reference.coordinates[:, k]) == 0.0 == np.ptp(method.coordinates[:, k]):
                    continue  # locked
                turn = bool(trial.rotation[k])
                scale = np.degrees(1.0) if turn else 1000.0
                w = trial.window
                error = truth_error(scale * reference.coordinates[w, k], scale * method.known_coordinates()[w, k])
                found.setdefault((name, "deg" if turn else "mm", method.name, reference.name), []).append(error)
    return [AngleDifference(*key, *map(spread, zip(*errors, strict=True))) for key, errors in found.items()]


def moment_differences(trials: Sequence[ComparedTrial]) -> list[MomentDifference]:
    """Every measured joint moment of every filter against AT's; empty where that cannot be had."""
    found: dict[tuple[str, str, str, str], list[SignalFit]] = {}
    for trial in trials:
        for method, reference in _pairs(trial, AT):
            residual = root_coordinates(next(iter(trial.estimates.values()))) if reference.kind == INVERSE else set()
            for k, name in enumerate(trial.coordinate_names):
                if name in residual:
                    continue  # what plates and motion disagree on is no joint's moment
                w = trial.window
                fit = signal_fit(reference.moments[w, k], method.measured_moments()[w, k])
                unit = "N m" if trial.rotation[k] else "N"
                found.setdefault((name, unit, method.name, reference.name), []).append(fit)
    return [MomentDifference(*key, *map(spread, zip(*fits, strict=True))) for key, fits in found.items()]


def _pairs(trial: ComparedTrial, kind: str) -> list[tuple[Method, Method]]:
    """Each filter with the reference of that kind."""
    reference = trial.reference(kind)
    return [] if reference is None else [(method, reference) for method in trial.of_kind("EKF")]
