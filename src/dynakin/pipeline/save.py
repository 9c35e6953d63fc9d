"""All files of an output folder, written as one: either all of them are there or what was there before."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dynakin.errors import OutputError
from dynakin.results.estimate import Estimate
from dynakin.results.failures import LOG, Failures
from dynakin.results.files import body as body_files
from dynakin.results.files import motion as motion_files
from dynakin.results.files.config import write_config
from dynakin.results.files.folder import replacing
from dynakin.results.files.json import write_metrics, write_parameters
from dynakin.results.files.markers import write_markers
from dynakin.results.files.netcdf import write_netcdf
from dynakin.results.measures.mean_curves import curve_points, estimate_curves, write_curves
from dynakin.results.measures.metrics import known_metrics

if TYPE_CHECKING:
    from dynakin.identification.observability.trial import Identifiability
    from dynakin.validation.methods import Trial


def save_estimate(
    estimate: Estimate,
    folder: Path,
    *,
    overwrite: bool = True,
    comparison: Trial | None = None,
    identifiability: Identifiability | None = None,
    failures: Failures | None = None,
) -> Path:
    """See `dynakin.results.Estimate.save`."""
    from dynakin.report.page import write_report

    failed = Failures() if failures is None else failures
    metrics = _metrics(estimate, identifiability, failed)
    files: dict[str, Callable[[Estimate, Path], None]] = {
        "coordinates.mot": motion_files.write_coordinates,
        "speeds.sto": motion_files.write_speeds,
        "accelerations.sto": motion_files.write_accelerations,
        "moments.sto": motion_files.write_moments,
        "moments_source.sto": motion_files.write_moment_sources,
        "wrench.sto": motion_files.write_wrench,
        "uncertainty.sto": motion_files.write_deviations,
        "markers.trc": write_markers,
        "parameters.json": write_parameters,
        "estimate.nc": write_netcdf,
    }
    with replacing(folder, overwrite=overwrite) as made:
        for name, write in files.items():
            _written(made / name, failed, lambda path, write=write: write(estimate, path))  # type: ignore[misc]
        with failed.stage("files of the body", writes=True):
            body_files.write_body_files(estimate, made)
        _written(made / "repetitions.csv", failed, lambda path: _write_repetitions(estimate, comparison, path))
        write_config(estimate.config, made / "config.toml")
        told = replace(estimate, messages=[*estimate.messages, *failed.messages()])
        _written(
            made / "report.html", failed, lambda path: write_report(told, path, metrics=metrics, comparison=comparison)
        )
        said = {"messages": [*estimate.messages, *failed.messages()]}
        said["failures"] = [failure.stage for failure in failed.found]
        write_metrics(metrics | said, made / "metrics.json")
        if failed.found:
            (made / LOG).write_text(failed.log(), encoding="utf-8", newline="\n")
    if failures is None and failed.found:
        raise OutputError(f"{folder}: the results are saved ({LOG} has details). {' '.join(failed.messages())}")
    return folder


def _metrics(estimate: Estimate, identifiability: Identifiability | None, failed: Failures) -> dict[str, Any]:
    """All figures, or those that can be had."""
    metrics = known_metrics(estimate, failed)
    if identifiability is not None:
        with failed.stage("what the recording tells of the constants"):
            metrics["identifiability"] = identifiability.as_dict()
    return metrics


def _written(path: Path, failed: Failures, write: Callable[[Path], None]) -> None:
    """One file, or none: half a file looks like a whole one."""
    done = False
    with failed.stage(path.name, writes=True):
        write(path)
        done = True
    if not done:
        path.unlink(missing_ok=True)


def _write_repetitions(estimate: Estimate, comparison: Trial | None, path: Path) -> None:
    curves = estimate_curves(estimate) if comparison is None else comparison.curves()
    write_curves(path, curve_points(estimate.recording.name, curves))
