"""Figures 4 to 9 of the paper for any run, as files for papers: `save_figures`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import matplotlib as mpl
import xarray as xr
from matplotlib.figure import Figure

from dynakin.errors import ConfigError, OutputError
from dynakin.report.movement_figures import angles_figure, knee_moment_figure, markers_figure, wrench_figure
from dynakin.report.parameter_figures import inertias_figure, lengths_and_masses_figure
from dynakin.report.plot import FILE_STYLE
from dynakin.results import Estimate

FORMATS = ("svg", "pdf", "png")
_DATES: dict[str, dict[str, None]] = {"svg": {"Date": None}, "pdf": {"CreationDate": None}, "png": {}}

Draw = Callable[[Estimate, xr.Dataset | None], Figure | None]
FIGURES: dict[str, Draw] = {
    "figure4_markers": markers_figure,
    "figure5_angles": angles_figure,
    "figure6_wrench": wrench_figure,
    "figure7_knee_moment": knee_moment_figure,
    "figure8_lengths_and_masses": lengths_and_masses_figure,
    "figure9_inertias": inertias_figure,
}
"""File name -> what draws it; it gives None where the estimate has nothing to show."""


def save_figures(
    estimate: Estimate,
    folder: str | Path,
    formats: Sequence[str] = FORMATS,
    *,
    reference: xr.Dataset | None = None,
) -> list[Path]:
    """Write Figures 4 to 9 of the paper for this run, 300 dots an inch where dots are needed.

    Args:
        folder: made where it is not there; files of the same names are replaced.
        formats: some of svg, pdf, png.
        reference: `dynakin.reference.Reference.data`: classical angles (Figure 5), the table's wrench (6) and moments
            (7), drawn beside the estimate. Its times are the estimate's.

    Returns:
        The files written, in the order of the paper; a figure without anything to show is left out.

    Raises:
        ConfigError: an unknown format, or a reference of another recording.
        OutputError: the folder cannot be written.
    """
    unknown = [name for name in formats if name not in FORMATS]
    if unknown:
        raise ConfigError(f"formats: {unknown[0]!r} is not known, expected some of {', '.join(FORMATS)}")
    if reference is not None and reference.sizes["time"] != len(estimate.time):
        raise ConfigError(
            f"reference has {reference.sizes['time']} frames, expected the estimate's {len(estimate.time)}: "
            "make it from the same recording"
        )
    folder, written = Path(folder), []
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, draw in FIGURES.items():
            with mpl.rc_context({**FILE_STYLE, "svg.hashsalt": name}):
                figure = draw(estimate, reference)
                for form in formats if figure is not None else ():
                    assert figure is not None
                    figure.savefig(folder / f"{name}.{form}", dpi=300, metadata=_DATES[form])
                    written.append(folder / f"{name}.{form}")
    except OSError as error:
        raise OutputError(f"{folder}: cannot write figures there ({error.strerror or error})") from error
    return written
