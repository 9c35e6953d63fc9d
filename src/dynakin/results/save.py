"""All files of an output folder, written as one: either all of them are there or what was there before."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from dynakin.results import body_files, motion_files
from dynakin.results.config_file import write_config
from dynakin.results.estimate import Estimate
from dynakin.results.json_files import write_metrics, write_parameters
from dynakin.results.marker_file import write_markers
from dynakin.results.mean_curves import curve_points, estimate_curves, write_curves
from dynakin.results.netcdf_file import write_netcdf
from dynakin.results.output_folder import replacing

if TYPE_CHECKING:
    from dynakin.comparison import Trial
    from dynakin.identifiability import Identifiability


def save_estimate(
    estimate: Estimate,
    folder: Path,
    *,
    overwrite: bool = True,
    comparison: Trial | None = None,
    identifiability: Identifiability | None = None,
) -> Path:
    """See `dynakin.results.Estimate.save`."""
    from dynakin.report import write_report  # the report is made from results, so it comes after them

    metrics = estimate.metrics()
    if identifiability is not None:
        metrics["identifiability"] = identifiability.as_dict()
    curves = estimate_curves(estimate) if comparison is None else comparison.curves()
    with replacing(folder, overwrite=overwrite) as made:
        motion_files.write_coordinates(estimate, made / "coordinates.mot")
        motion_files.write_speeds(estimate, made / "speeds.sto")
        motion_files.write_accelerations(estimate, made / "accelerations.sto")
        motion_files.write_moments(estimate, made / "moments.sto")
        motion_files.write_moment_sources(estimate, made / "moments_source.sto")
        motion_files.write_wrench(estimate, made / "wrench.sto")
        motion_files.write_deviations(estimate, made / "uncertainty.sto")
        body_files.write_body_files(estimate, made)
        write_curves(made / "repetitions.csv", curve_points(estimate.recording.name, curves))
        write_markers(estimate, made / "markers.trc")
        write_parameters(estimate, made / "parameters.json")
        write_metrics(metrics, made / "metrics.json")
        write_netcdf(estimate, made / "estimate.nc")
        write_config(estimate.config, made / "config.toml")
        write_report(estimate, made / "report.html", metrics=metrics, comparison=comparison)
    return folder
