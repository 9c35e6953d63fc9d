"""The paper's figures for any run, and mean curves of its repetitions, as files for papers: `save_figures`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from functools import partial
from pathlib import Path

import matplotlib as mpl

from dynakin.errors import ConfigError, OutputError
from dynakin.files import expanded
from dynakin.progress import stage
from dynakin.report.figure import FILE_STYLE, Figure
from dynakin.report.paper_figures.movement import (
    angles_figure,
    knee_moment_figure,
    markers_figure,
    moments_figure,
    repetitions_figure,
    wrench_figure,
)
from dynakin.report.paper_figures.parameters import inertias_figure, lengths_and_masses_figure
from dynakin.report.paper_figures.saving import FORMATS, save_each
from dynakin.report.paper_figures.sensitivity import Sensitivity, sensitivity_figure
from dynakin.report.sections.repetitions import KINDS
from dynakin.results.estimate import Estimate
from dynakin.results.failures import Failures
from dynakin.results.measures.facing import facing
from dynakin.settings.strict import nearest
from dynakin.validation.methods import ComparedTrial

Draw = Callable[[Estimate, ComparedTrial | None], Figure | None]
FIGURES: dict[str, Draw] = {
    "figure4_markers": markers_figure,
    "figure5_angles": angles_figure,
    "figure6_wrench": wrench_figure,
    "figure7_knee_moment": knee_moment_figure,
    "figure8_lengths_and_masses": lengths_and_masses_figure,
    "figure9_inertias": inertias_figure,
    "moments": moments_figure,
    **{f"repetitions_{kind}": partial(repetitions_figure, kind=kind) for kind in KINDS},
}
"""File name -> what draws it; it gives None where the estimate has nothing to show."""
SENSITIVITY_FIGURE = "figure3_sensitivity"


def draw_figure(name: str, estimate: Estimate, comparison: ComparedTrial | None = None) -> Figure:
    """One of `FIGURES`, by its name with or without the number that it has in the paper.

    Raises:
        ConfigError: no such figure, or the estimate has nothing to show in it.
    """
    named = {stem.partition("_")[2] if stem.startswith("figure") else stem: draw for stem, draw in FIGURES.items()}
    if (draw := FIGURES.get(name) or named.get(name)) is None:
        raise ConfigError(f"plot: no figure {name!r}{nearest(name, named)}, expected one of {', '.join(named)}")
    with mpl.rc_context(FILE_STYLE):
        figure = draw(facing(estimate), comparison)
    if figure is None:
        raise ConfigError(f"plot: {estimate.recording.name} has nothing to show in {name!r}")
    return figure


def save_figures(
    estimate: Estimate,
    folder: str | Path,
    formats: Sequence[str] = FORMATS,
    *,
    comparison: ComparedTrial | None = None,
    sensitivity: Sensitivity | None = None,
    failures: Failures | None = None,
) -> list[Path]:
    """Write Figures 4 to 9 of the paper for this run and its repetitions' mean curves, 300 dots an inch where dots
    are needed.

    Args:
        folder: made where it is not there; files of the same names are replaced.
        formats: some of svg, pdf, png.
        comparison: this estimate against the reference methods (`dynakin.validation.trial_of`): classical angles
            (Figure 5), the table's wrench (6) and moments (7) and their mean curves are drawn too.
        sensitivity: a criterion over the gains (`read_sensitivity`): Figure 3 is drawn too.
        failures: takes the figures that fail; the others are drawn.

    Returns:
        The files written, in the order of the paper; a figure without anything to show is left out.

    Raises:
        ConfigError: an unknown format, or a comparison of another recording.
        OutputError: the folder cannot be written.
    """
    if comparison is not None and len(comparison.time) != len(estimate.time):
        raise ConfigError(
            f"comparison has {len(comparison.time)} frames, expected the estimate's {len(estimate.time)}: "
            "make it from the same recording"
        )
    estimate = facing(estimate)
    draws: dict[str, Callable[[], Figure | None]] = {
        name: lambda draw=draw: draw(estimate, comparison)  # type: ignore[misc]
        for name, draw in FIGURES.items()
    }
    if sensitivity is not None:
        draws = {SENSITIVITY_FIGURE: lambda: sensitivity_figure(sensitivity), **draws}
    return _write(draws, expanded(folder), formats, failures)


def save_sensitivity_figures(
    grids: Mapping[str, Sensitivity], folder: str | Path, formats: Sequence[str] = FORMATS
) -> list[Path]:
    """Write one such figure a criterion, by the names of their files.

    Raises:
        ConfigError: an unknown format. OutputError: the folder cannot be written.
    """
    return _write({name: partial(sensitivity_figure, grid) for name, grid in grids.items()}, expanded(folder), formats)


def _write(
    draws: dict[str, Callable[[], Figure | None]],
    folder: Path,
    formats: Sequence[str],
    failures: Failures | None = None,
) -> list[Path]:
    unknown = [name for name in formats if name not in FORMATS]
    if unknown:
        raise ConfigError(f"formats: {unknown[0]!r} is not known, expected some of {', '.join(FORMATS)}")

    def guarded(name: str) -> AbstractContextManager[object]:
        return nullcontext() if failures is None else failures.stage(f"figure {name}", writes=True)

    figures: dict[str, Figure] = {}
    written: list[Path] = []
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with stage("drawing figures"):
            for name, draw in draws.items():
                with guarded(name), mpl.rc_context(FILE_STYLE):
                    figure = draw()
                    if figure is not None:
                        figures[name] = figure
        for name, made in save_each(figures, folder, formats).items():
            with guarded(name):
                if isinstance(made, Exception):
                    raise made
                written += made
    except OSError as error:
        raise OutputError(f"{folder}: cannot write figures there ({error.strerror or error})") from error
    return written
