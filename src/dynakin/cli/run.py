"""`dynakin run`: estimate a recording and write everything into a folder."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from dynakin.cli.console import busy, out, progress_bar
from dynakin.cli.options import (
    Estimated,
    Force,
    ForceThreshold,
    Forward,
    Height,
    Markers,
    Mass,
    ModelName,
    PlateFilter,
    Preset,
    Sex,
    Side,
    Smooth,
    Static,
    TableName,
    Vertical,
    forward_direction,
)
from dynakin.cli.summary import end, print_summary
from dynakin.pipeline.stages import configure, run_case
from dynakin.report.paper_figures.sensitivity import read_sensitivity
from dynakin.results.files.folder import check_folder_writable, check_output_writable
from dynakin.validation.case import case_of


def run(
    trial: Annotated[Path, typer.Argument(help="Recording (.c3d, .trc, .csv), or a configuration (.toml).")],
    forces: Force = None,
    model: ModelName = None,
    markers: Markers = None,
    static: Static = None,
    parameters: Annotated[
        Path | None, typer.Option(help="Subject that dynakin identify wrote: start from its parameters.")
    ] = None,
    mass: Mass = None,
    height: Height = None,
    sex: Sex = None,
    preset: Preset = None,
    smooth: Smooth = None,
    side: Side = None,
    estimate: Estimated = None,
    vertical: Vertical = None,
    forward: Forward = None,
    table: TableName = None,
    plate_filter: PlateFilter = None,
    zero: Annotated[str | None, typer.Option(help="Zero of the joint angles: model, standing.")] = None,
    signs: Annotated[str | None, typer.Option(help="Names and signs of the joint angles: opensim, clinical.")] = None,
    force_threshold: ForceThreshold = None,
    output: Annotated[Path | None, typer.Option("-o", "--output", help="Folder for the results.")] = None,
    figures: Annotated[
        Path | None, typer.Option(help="Also write figures for papers (SVG, PDF, PNG) into this folder.")
    ] = None,
    keep_lost: Annotated[
        bool, typer.Option("--keep-lost", help="Save a trial that was lost too, its lost frames empty.")
    ] = False,
    sensitivity: Annotated[
        Path | None, typer.Option(help="Criterion over the gains (.csv, .nc): draw it too, the paper's Figure 3.")
    ] = None,
) -> None:
    """Estimate coordinates, moments, lengths and masses from a recording, and write a report."""
    given = {
        "forces": forces,
        "model": model,
        "markers": markers,
        "static": static,
        "parameters": parameters,
        "mass_kg": mass,
        "height_m": height,
        "sex": sex,
        "preset": preset,
        "smooth": smooth,
        "side": side,
        "estimate": estimated(estimate),
        "vertical": vertical,
        "forward": forward_direction(forward),
        "table": table,
        "plate_filter_hz": plate_filter,
        "zero": zero,
        "signs": signs,
        "force_threshold_n": force_threshold,
        "output": output,
    }
    config = configure(trial, given)
    check_output_writable(config.output)
    if sensitivity is not None and figures is None:
        raise typer.BadParameter("--sensitivity is a figure for papers, expected --figures FOLDER with it")
    if figures is not None:
        check_folder_writable(figures)
    grid = None if sensitivity is None else read_sensitivity(sensitivity)
    case = case_of(config)
    with progress_bar("estimating") as progress:
        result = run_case(case, keep_lost=keep_lost, keep="--keep-lost", progress=progress)
    with busy("writing results and report"):
        folder = result.save(config.output, keep_lost=keep_lost, check=False)
    failures = result.failures
    saved = len(failures.found)
    with failures.stage("summary"):
        print_summary(result, folder)
    if figures is not None:
        with failures.stage("figures"):
            with busy("drawing figures"):
                written = result.save_figures(figures, sensitivity=grid)
            out().print(f"Figures  {figures} ({len(written)} files)", soft_wrap=True)
    if len(failures.found) > saved:  # what failed since then is to stand in the files too
        with failures.stage("what failed, in the files"):  # these stay as they were saved
            result.save(config.output, keep_lost=keep_lost, check=False)
    end(result)


def estimated(text: str | None) -> list[str] | None:
    """`--estimate lengths,markers` as a list; "none" is an empty one. The words are checked with the configuration."""
    if text is None:
        return None
    return [] if text.strip() == "none" else [part.strip() for part in text.split(",") if part.strip()]
