"""`dynakin run`: estimate a recording and write everything into a folder."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

from dynakin.cli.console import busy, out, print_error, progress_bar
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
from dynakin.cli.summary import print_summary
from dynakin.config import RunConfig, make_config, read_config
from dynakin.errors import DynakinError
from dynakin.filter import presets
from dynakin.filter.zero import asked_angles
from dynakin.identification.observability.trial import Identifiability, identifiability
from dynakin.recordings.plates.loads import without_plate_loads
from dynakin.recordings.read import read
from dynakin.report.paper_figures.figures import save_figures
from dynakin.report.paper_figures.sensitivity import read_sensitivity
from dynakin.results.estimate import Estimate
from dynakin.results.failures import Failures
from dynakin.results.files.folder import check_folder_writable, check_output_writable
from dynakin.results.measures.tracking import refuse_lost
from dynakin.validation.methods import Trial, trial_of

LARGEST_BENCH = 250
"""States up to which a run also tells what the recording says of the constants: it filters a dozen motions more."""


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
    failures = Failures()
    with progress_bar("estimating") as progress:
        found, comparison, told = estimate_from(config, failures, progress, keep_lost=keep_lost)
    save = partial(found.save, config.output, comparison=comparison, identifiability=told, keep_lost=keep_lost)
    with busy("writing results and report"):
        folder = save(failures=failures)
    saved = len(failures.found)
    with failures.stage("summary"):
        print_summary(found, folder)
    if figures is not None:
        with failures.stage("figures"):
            with busy("drawing figures"):
                written = save_figures(found, figures, comparison=comparison, sensitivity=grid, failures=failures)
            out().print(f"Figures  {figures} ({len(written)} files)", soft_wrap=True)
    if len(failures.found) > saved:  # what failed since then is to stand in the files too
        with failures.stage("what failed, in the files"):  # these stay as they were saved
            save(failures=failures)
    wrong = [*failures.messages(), *filter(None, [found.why_lost])]
    for message in wrong:
        print_error(message)
    if wrong:
        raise typer.Exit(1)


def configure(trial: Path, given: dict[str, Any]) -> RunConfig:
    """Merge a configuration file, if that is what ``trial`` is, with what the command line gives, which wins."""
    options = {key: value for key, value in given.items() if value is not None}
    if trial.suffix.casefold() == ".toml":
        return make_config(read_config(trial) | options, str(trial))
    return make_config({"trial": trial} | options, "run")


def estimate_from(
    config: RunConfig,
    failures: Failures,
    progress: Callable[[int, int], None] | None = None,
    *,
    keep_lost: bool = False,
) -> tuple[Estimate, Trial | None, Identifiability | None]:
    """Read, load, estimate: what a configuration asks for, with it kept in the result; the same recording by the
    reference methods; and what it tells of the constants, None with a note in the estimate where that cannot be said.

    Args:
        failures: takes what fails once the estimate is there. keep_lost: go on with a trial that was lost.

    Raises:
        DynakinError: anything that is wrong with the input, in one line. LostError: the person was lost.
    """
    estimator = config.estimator()
    recording = read(
        config.trial,
        config.forces,
        plate_filter_hz=config.plate_filter_hz,
        force_threshold_n=config.force_threshold_n,
    )
    recording = without_plate_loads(recording, config.plate_loads, config.vertical)
    static = None if config.static is None else read(config.static)
    estimate, tracker = estimator.track(recording, static=static, smooth=config.smooth, progress=progress)
    estimate = replace(estimate, config=config.as_used() | estimate.config)
    if not keep_lost:
        refuse_lost(estimate, "--keep-lost")
    with failures.stage("joint angles of angles.sto"):
        estimate = asked_angles(estimator, estimate, static, config.zero, config.signs)
    n_states = len(tracker.calibrated.names)
    comparison = None
    with failures.stage("comparison with the reference methods"):
        comparison = trial_of(
            {presets.title(config.preset): estimate}, tracker.calibrated, estimator.model, whatever=True
        )
    if n_states > LARGEST_BENCH:
        note = (
            f"What the recording tells of the constants is left out: with {n_states} states it takes many minutes; "
            "dynakin model --identifiability tells."
        )
        return replace(estimate, messages=[*estimate.messages, note]), comparison, None
    told = None
    with failures.stage("what the recording tells of the constants"):
        try:
            told = identifiability(tracker, estimate)
        except DynakinError as error:  # a trial of a few frames, say: no failure
            note = f"What the recording tells of the constants is left out: {error.message}"
            estimate = replace(estimate, messages=[*estimate.messages, note])
    return estimate, comparison, told


def estimated(text: str | None) -> list[str] | None:
    """`--estimate lengths,markers` as a list; "none" is an empty one. The words are checked with the configuration."""
    if text is None:
        return None
    return [] if text.strip() == "none" else [part.strip() for part in text.split(",") if part.strip()]
