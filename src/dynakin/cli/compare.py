"""`dynakin compare`: filters, the table and the classical method, judged by what was measured."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from dynakin.cli.console import out, print_error
from dynakin.cli.options import OF_A_MODEL, OF_THE_LABORATORY, OF_THE_PLATES, ForceEach, Given, Trials, with_settings
from dynakin.errors import DynakinError
from dynakin.progress import stage
from dynakin.settings.defaults import CUTOFF_HZ, HORIZON_S

HORIZON_MS = 1000.0 * HORIZON_S


@with_settings(*OF_A_MODEL, *OF_THE_LABORATORY, *OF_THE_PLATES, "lag_s")
def compare(
    trials: Trials = None,
    forces: ForceEach = None,
    *,
    given: Given,
    preset: Annotated[list[str] | None, typer.Option(help="Noise settings: default, paper. May be repeated.")] = None,
    cutoff: Annotated[
        float, typer.Option("--cutoff-hz", help="Low-pass of AT, classical and IK + ID, Hz.")
    ] = CUTOFF_HZ,
    halved: Annotated[
        bool, typer.Option("--halves", help="Identify on each trial's first half, judge on its second.")
    ] = False,
    identify_trial: Annotated[Path | None, typer.Option("--identify-on", help="Trial to identify on.")] = None,
    test_trial: Annotated[Path | None, typer.Option("--test-on", help="Trial to judge on, from markers alone.")] = None,
    not_seen: Annotated[
        bool, typer.Option("--unseen", help="Plates withheld, markers left out one by one, and ahead of time.")
    ] = False,
    horizon: Annotated[float, typer.Option("--horizon-ms", help="How far ahead --unseen looks, ms.")] = HORIZON_MS,
    output: Annotated[Path | None, typer.Option("-o", "--output", help="Folder for tables and curves.")] = None,
) -> None:
    """Compare the filter with the table and the classical method, over one or many trials (the paper's Table II)."""
    with stage("loading"):
        from dynakin.cli.compare_inputs import (
            cases_of,
            chosen_trials,
            halves_of,
            refuse_copies_of,
            refuse_without_plates,
            without_plates_in_words,
        )
        from dynakin.cli.compare_tables import (
            compare_cases,
            described,
            print_comparison,
            print_held_out,
            print_notes,
            print_repetitions,
            print_unseen,
            settings_of,
        )
        from dynakin.report.comparison_page import render_comparison
        from dynakin.results.files.folder import check_output_writable
        from dynakin.validation.files import COMPARISON, save_comparison
        from dynakin.validation.methods import ComparedTrial
        from dynakin.validation.unseen import check_horizon

    if output is not None:
        check_output_writable(output, kind=COMPARISON)
    chosen = chosen_trials(trials or [], identify_trial, test_trial, halved or not_seen)
    with stage("reading the recordings"):
        cases = cases_of(chosen, forces or [], preset or [], cutoff, given)
    refuse_copies_of(cases)
    if halved or identify_trial is not None:
        refuse_without_plates(cases)
    for case in cases if not_seen else []:
        check_horizon(case.recording, horizon / 1000.0)
    console = out()
    tables: dict[str, Sequence[Any]] = {}
    more: dict[str, Any] = {"settings": settings_of(cases)}
    compared: list[ComparedTrial] = []
    notes = without_plates_in_words(cases)  # and what was held out; each trial keeps its own
    print_notes(console, notes)
    failed: DynakinError | None = None  # what is computed by then is kept
    if identify_trial is not None:
        tables |= print_held_out(console, [(cases[0], cases[1], False)], notes)
    else:
        compared, truth = compare_cases(cases)
        tables |= print_comparison(console, compared, truth)
        try:
            if halved:
                tables |= print_held_out(console, [(*halves_of(case), True) for case in cases], notes)
            if not_seen:
                tables |= print_unseen(console, cases, horizon)
        except DynakinError as error:
            failed = error
        tables |= print_repetitions(console, compared)
        more["trials"] = [described(trial) for trial in compared]
    if notes:
        more["notes"] = list(map(str, notes))
    if output is not None:
        with stage("writing tables and report"):
            names = [case.recording.name for case in cases]
            page = render_comparison(compared, tables, more["settings"], names, notes)
            save_comparison(output, tables, more, page)
        console.print(f"Tables  {output}", soft_wrap=True)
        console.print(f"Report  {output / 'report.html'}", soft_wrap=True)
    if failed is not None:
        raise failed
    lost = [f"{trial.name}, EKF ({preset}): {why}" for trial in compared for preset, why in trial.lost.items()]
    for reason in lost:
        print_error(reason)
    if lost:
        raise typer.Exit(1)
