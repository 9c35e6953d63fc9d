"""`dynakin run`: estimate a recording and write everything into a folder."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from dynakin.cli.console import out
from dynakin.cli.options import OF_A_MODEL, OF_THE_LABORATORY, OF_THE_PLATES, Given, with_settings
from dynakin.errors import DynakinError, OutputError
from dynakin.progress import stage


@with_settings(
    "forces",
    *OF_A_MODEL,
    "parameters",
    "preset",
    "lag_s",
    "estimate",
    *OF_THE_LABORATORY,
    *OF_THE_PLATES,
    "zero",
    "signs",
    "output",
)
def run(
    trial: Annotated[Path, typer.Argument(help="Recording (.c3d, .trc, .csv), or a configuration (.toml).")],
    *,
    given: Given,
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
    with stage("loading"):  # the libraries alone take seconds on a busy machine
        from dynakin.cli.prepared import assumed, changed, naming_static, print_rows
        from dynakin.messages import notes_of
        from dynakin.pipeline.stages import configure, prepare_case, run_case
        from dynakin.results.files.folder import check_folder_writable, check_output_writable
        from dynakin.results.naming import plural
        from dynakin.validation.case import case_of

    config = configure(trial, given, options=True)
    check_output_writable(config.output)
    if sensitivity is not None and figures is None:
        raise typer.BadParameter("--sensitivity is a figure for papers, expected --figures FOLDER with it")
    if figures is not None:
        check_folder_writable(figures)
        if config.output.resolve() in (figures.resolve(), *figures.resolve().parents):
            raise OutputError(
                f"--figures {figures}: lies in the output folder {config.output}, which is replaced as a whole by the "
                "next run; name a folder beside it"
            )
    grid = None
    if sensitivity is not None:
        from dynakin.report.paper_figures.sensitivity import read_sensitivity  # Matplotlib: only who draws waits

        grid = read_sensitivity(sensitivity)
    with stage("reading the recording"):
        case = case_of(config)
    with stage("measuring the person"):
        try:
            ready = prepare_case(case)
        except DynakinError as refusal:
            raise naming_static(refusal, case) from None
    first = next(iter(ready.values()))
    print_rows(out(), [*assumed(first, config), *changed(first)])
    result = run_case(case, ready=ready, keep_lost=keep_lost, keep="--keep-lost")
    folder = result.save(config.output, keep_lost=keep_lost, check=False)
    from dynakin.cli.summary import end, print_summary  # loaded while the core works, for the most part

    failures = result.failures
    saved = len(failures.found)
    with failures.stage("summary"):
        print_summary(result, folder, notes_of(first.recording.notes))
    if figures is not None:
        with failures.stage("figures"):
            written = result.save_figures(figures, sensitivity=grid)
            out().print(f"Figures  {figures} ({plural(len(written), 'file')})", soft_wrap=True)
    if len(failures.found) > saved:  # what failed since then is to stand in the files too
        with failures.stage("what failed, in the files"):  # these stay as they were saved
            result.save(config.output, keep_lost=keep_lost, check=False)
    end(result)
