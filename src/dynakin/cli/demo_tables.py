"""How far an estimate and the reference methods are from a simulation, on screen."""

from __future__ import annotations

import numpy as np
import xarray as xr
from rich.table import Table

from dynakin.cli.console import table
from dynakin.results.estimate import Estimate
from dynakin.results.measures.fit import truth_error
from dynakin.results.measures.metrics import evaluation_window
from dynakin.results.naming import listed
from dynakin.simulation.truth import Truth
from dynakin.validation.coverage import Coverage, block_coverage, parameter_coverage
from dynakin.validation.truth import FIGURES, LEG, parameter_errors, truth_errors


def methods_by_error(methods: dict[str, xr.Dataset], estimate: Estimate, truth: Truth) -> Table:
    """RMS errors of each method against the simulation's truth, after the adaptation."""
    window = evaluation_window(estimate.time)
    columns = tuple(range(1, 1 + len(methods)))
    rows = table("", *methods, numbers=columns, title="Methods by RMS error against the truth")
    errors = [truth_errors(name, data, truth.data, window, LEG).values for name, data in methods.items()]
    for (title, unit), values in zip(FIGURES, zip(*errors, strict=True), strict=True):
        rows.add_row(f"{title}, {unit}", *map(_two_digits, values))
    return rows


def compared_with_truth(estimate: Estimate, truth: Truth) -> Table:
    """RMS errors of angles, speeds and moments of each coordinate against the simulation's, and how often the truth
    lies in the angle's own 95 % interval."""
    window = evaluation_window(estimate.time)
    rows = table(
        "coordinate",
        "angle, deg",
        "in 95 %",
        "speed, deg/s",
        "moment, N m",
        numbers=(1, 2, 3, 4),
        title="EKF (default) by coordinate: RMS error against the truth",
    )
    kinds = ("coordinates", "speeds", "moments")
    found = block_coverage(estimate.data, truth.data, window)[0]
    inside = {name: f"{100.0 * share:.0f} %" for name, share in zip(found.names, found.inside, strict=True)}
    for name in estimate.coordinate_names:
        pairs = ((truth.data[kind].sel(coordinate=name), estimate.data[kind].sel(coordinate=name)) for kind in kinds)
        errors = np.array([truth_error(true.values[window], given.values[window]).rms for true, given in pairs], float)
        angle, speed = np.degrees(errors[:2])
        rows.add_row(name, f"{angle:.1f}", inside.get(name, ""), f"{speed:.0f}", f"{errors[2]:.1f}")
    return rows


def own_uncertainty(estimate: Estimate, truth: Truth) -> Table:
    """Each block's errors and the standard deviations that the filter gives with it."""
    rows = table(
        "",
        "in 95 %",
        "no offset",
        "error²/sd²",
        "verdict",
        numbers=(1, 2, 3),
        title="EKF (default): are its standard deviations right? Truth within their 95 % interval",
    )
    found = block_coverage(estimate.data, truth.data, evaluation_window(estimate.time))
    for block in found + parameter_coverage(estimate.parameters, truth.parameters):
        about_mean = block.pooled_about_mean
        rows.add_row(
            block.block,
            f"{100.0 * block.pooled:.0f} %",
            "" if about_mean is None else f"{100.0 * about_mean:.0f} %",
            _two_digits(block.mean_square),
            _judged(block),
        )
    return rows


def _judged(block: Coverage) -> str:
    """How large the deviations are, by all elements of a block; then those that they do not hold for."""
    text = block.sizes() if block.judgement == "consistent" else f"{block.judgement}, {block.sizes()}"
    found = [f"{name} (in {100.0 * share:.0f} %)" for name, share in block.seldom.items()]
    return f"{text}, too small for {listed(found)}" if found else text


def _two_digits(value: float) -> str:
    return f"{value:#.2g}" if value < 9.95 else f"{value:.0f}"


def constants_in_words(estimate: Estimate, truth: Truth) -> str:
    """How far lengths and inertia were from the truth at the start, and are at the end."""
    errors = parameter_errors(estimate.parameters, truth.parameters).items()
    parts = [f"{title} {e.start_percent:.1f} % at the start, {e.end_percent:.1f} % at the end" for title, e in errors]
    return f"Constants, RMS error against the truth: {'; '.join(parts)}."
