"""`dynakin tune`: noise settings chosen by the paper's grid, or fitted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.padding import Padding

from dynakin.cli.console import as_table, out
from dynakin.cli.options import (
    OF_A_MODEL,
    OF_THE_LABORATORY,
    OF_THE_PLATES,
    Backend,
    Given,
    Jobs,
    Scheduler,
    Trials,
    with_settings,
)
from dynakin.errors import ConfigError
from dynakin.progress import stage
from dynakin.settings import presets
from dynakin.settings.defaults import CUTOFF_HZ
from dynakin.settings.noise import SCALES

if TYPE_CHECKING:
    from dynakin.report.paper_figures.sensitivity import Sensitivity
    from dynakin.studies.tuning.grid import Axis, Grid
    from dynakin.studies.tuning.score import Shared
    from dynakin.validation.case import Case

tune = typer.Typer(no_args_is_help=True, rich_markup_mode=None, help="Choose noise settings by measurement.")

Output = Annotated[Path, typer.Option("-o", "--output", help="Folder for table, figures and presets.")]

Forces = Annotated[
    list[Path] | None,
    typer.Option("--forces", help="Ground forces of the trials, in their order; else TRIAL_grf.mot by each."),
]

_of_trials = with_settings(*OF_A_MODEL, "preset", *OF_THE_LABORATORY, *OF_THE_PLATES)
_GAINS = ("coordinate_variance", "speed_variance", "acceleration_variance")


@tune.command()
@_of_trials
def grid(
    output: Output,
    trials: Trials = None,
    forces: Forces = None,
    *,
    given: Given,
    vary: Annotated[
        list[str] | None,
        typer.Option(help="NAME=FROM:TO:STEPS, logarithmic; may be repeated. Else [grid], else the paper's gains."),
    ] = None,
    left_out: Annotated[
        bool, typer.Option("--left-out", help="Also leave each marker out in turn: so many runs more.")
    ] = False,
    backend: Backend = "processes",
    jobs: Jobs = None,
    scheduler: Scheduler = None,
) -> None:
    """Try all combinations of some settings, as the paper did (13 x 13 x 13 of its gains), by several criteria.

    A run that was stopped goes on where it was when it is started again with the same folder.
    """
    from dynakin.cli.compare_inputs import cases_of, forces_each
    from dynakin.report.paper_figures.figures import save_sensitivity_figures
    from dynakin.studies.engine.journal import ROWS, Journal, open_folder
    from dynakin.studies.engine.pools import open_pool
    from dynakin.studies.tuning.grid import belongs_to, check_size, run_grid
    from dynakin.studies.tuning.output import criteria_text, grid_text, write_grid

    preset = given.pop("preset", None)
    cases = cases_of(trials or [], forces_each(trials or [], forces or []), [], CUTOFF_HZ, given, "tune grid")
    axes = axes_of(vary or [], cases)
    check_size(axes)
    base = preset or ("paper" if not vary and cases[0].config.grid is None else cases[0].config.preset)
    shared = shared_of(cases, base, left_out)
    folder = open_folder(output, ("grid.", "preset_", "figure3_"))
    journal = Journal(folder / ROWS, belongs_to(shared, axes))
    with stage("grid") as progress, open_pool(backend, jobs, scheduler) as pool:
        found = run_grid(shared, axes, pool, journal=journal, progress=progress)
    with stage("drawing figures"):
        write_grid(folder, found, presets.title(base))
        save_sensitivity_figures(figures_of(found), folder, ("svg", "png"))
    console = out()
    console.print(as_table(grid_text(found)))
    for line in criteria_text(found):
        console.print(Padding(line, (0, 0, 0, 2)), style="dim")
    lost = sum(cell["diverged"] > 0 for cell in found.cells)
    console.print(f"{len(found.cells)} combinations, the filter diverged in {lost}.")
    console.print(f"Table    {folder / 'grid.csv'}", soft_wrap=True)
    console.print(f"Figures  {folder}/figure3_*.png, .svg", soft_wrap=True)
    console.print(f"Presets  {folder}/preset_*.toml (dynakin run ... --preset FILE)", soft_wrap=True)


@tune.command()
@_of_trials
def fit(
    output: Output,
    trials: Trials = None,
    forces: Forces = None,
    *,
    given: Given,
    vary: Annotated[
        list[str] | None, typer.Option(help="Setting to fit; may be repeated. Else those that the preset uses.")
    ] = None,
    criterion: Annotated[str, typer.Option(help="nll (likelihood), or ahead, sigma, paper, nis instead.")] = "nll",
    backend: Backend = "processes",
    jobs: Jobs = None,
    scheduler: Scheduler = None,
) -> None:
    """Fit noise settings to recordings by maximum likelihood, with cross-validation over trials or halves.

    A run that was stopped goes on where it was when it is started again with the same folder.
    """
    from dynakin.cli.compare_inputs import cases_of, forces_each
    from dynakin.studies.engine.journal import ROWS, Journal, open_folder
    from dynakin.studies.engine.pools import open_pool
    from dynakin.studies.tuning.fit import Fitter, belongs_to_fit, usual_names
    from dynakin.studies.tuning.output import figures_text, recommendation, settings_text, write_fit

    preset = given.pop("preset", None)
    cases = cases_of(trials or [], forces_each(trials or [], forces or []), [], CUTOFF_HZ, given, "tune fit")
    base = preset or cases[0].config.preset
    shared = shared_of(cases, base)
    names = tuple(vary) if vary else usual_names(shared.base, shared.floating)
    folder = open_folder(output, ("fit.", "preset_"))
    journal = Journal(folder / ROWS, belongs_to_fit(shared))
    others = {name: make() for name, make in presets.PRESETS.items() if make() != shared.base}
    with stage("fitting") as progress, open_pool(backend, jobs, scheduler) as pool:
        found = Fitter(shared, names, pool, journal, criterion, others, progress).run()
    advice = recommendation(found)
    write_fit(folder, found, presets.title(base), advice)
    console = out()
    for text in (settings_text(found), *figures_text(found)):
        console.print(as_table(text))
    for sentence in advice:
        console.print(sentence)
    console.print(f"\nPreset  {folder / 'preset_fit.toml'} (dynakin run ... --preset FILE)", soft_wrap=True)
    console.print(f"Tables  {folder / 'fit.csv'}, {folder / 'fit.json'}", soft_wrap=True)


def axes_of(vary: Sequence[str], cases: Sequence[Case]) -> tuple[Axis, ...]:
    """The settings to vary: of the command line, else of the first configuration's [grid], else the paper's gains."""
    from dynakin.studies.tuning.grid import axis, paper_axes

    if vary:
        return tuple(_axis(text) for text in vary)
    grid = cases[0].config.grid
    return paper_axes() if grid is None else tuple(axis(name, *values) for name, values in grid.items())


def _axis(text: str) -> Axis:
    from dynakin.studies.tuning.grid import axis

    name, _, span = text.partition("=")
    try:
        low, high, steps = span.split(":")
        return axis(name.strip(), float(low), float(high), int(steps))
    except ValueError:
        raise ConfigError(
            f"--vary: found {text!r}, expected NAME=FROM:TO:STEPS such as jerk_density_rad2_s5=1:1e4:5"
        ) from None


def shared_of(cases: Sequence[Case], base: str, left_out: bool = False) -> Shared:
    """Trials made ready with the settings of a preset; changes in [noise] of the first configuration hold for all."""
    from dynakin.studies.tuning.score import Shared
    from dynakin.studies.tuning.trial import prepare

    noise = presets.preset(base, cases[0].config.noise)
    ready = []
    for case in cases:
        with stage(f"reading {case.recording.name}"):
            estimator = replace(case.setup, noise={base: noise}).estimator(base)
            ready.append(prepare(case.recording, estimator, static=case.static))
    return Shared(tuple(ready), noise, left_out)


def figures_of(found: Grid) -> dict[str, Sensitivity]:
    """Figure 3 by each criterion."""
    import numpy as np

    from dynakin.report.paper_figures.sensitivity import GAIN_UNITS, Sensitivity
    from dynakin.studies.tuning.score import CRITERIA

    exponents = tuple(np.log10(axis.values) for axis in found.axes)
    names = tuple(_label(axis.name) for axis in found.axes)
    units = tuple(GAIN_UNITS[_GAINS.index(a.name)] if a.name in _GAINS else SCALES[a.name].unit for a in found.axes)
    return {
        f"figure3_{name}": Sensitivity(exponents, found.criterion(name), *CRITERIA[name], names, units)
        for name in found.criteria()
    }


def _label(name: str) -> str:
    from dynakin.report.paper_figures.sensitivity import GAIN_NAMES

    return GAIN_NAMES[_GAINS.index(name)] if name in _GAINS else name
