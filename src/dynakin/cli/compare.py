"""`dynakin compare`: filters, the table and the classical method, judged by what was measured."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.padding import Padding

from dynakin.cli.compare_inputs import cases_of, chosen_trials, halves_of
from dynakin.cli.console import as_table, busy, out, print_error, progress_bar
from dynakin.cli.options import OF_A_MODEL, OF_THE_LABORATORY, OF_THE_PLATES, ForceEach, Given, Trials, with_settings
from dynakin.errors import DynakinError
from dynakin.identification.held_out import with_subject
from dynakin.recordings.smoothing import CUTOFF_HZ
from dynakin.report.comparison_page import render_comparison
from dynakin.report.text_tables import angle_text, moment_text, table2_text, truth_text, unseen_texts
from dynakin.results.measures.mean_curves import curve_points
from dynakin.validation.case import Case
from dynakin.validation.differences import angle_differences, moment_differences
from dynakin.validation.files import check_comparison_folder, save_comparison
from dynakin.validation.held_out import identify_on, judge, predict_blind
from dynakin.validation.methods import Trial, compare_trial
from dynakin.validation.table2 import merged, table2
from dynakin.validation.truth import truth_rows
from dynakin.validation.unseen import unseen, unseen_figures
from dynakin.validation.yardsticks import HORIZON_S

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
    if output is not None:
        check_comparison_folder(output)
    chosen = chosen_trials(trials or [], identify_trial, test_trial, halved or not_seen)
    cases = cases_of(chosen, forces or [], preset or [], cutoff, given)
    console = out()
    tables: dict[str, Sequence[Any]] = {}
    more: dict[str, Any] = {"settings": settings_of(cases)}
    compared: list[Trial] = []
    notes: list[str] = []  # of what was held out; each trial keeps its own
    failed: DynakinError | None = None  # what is computed by then is kept
    if identify_trial is not None:
        tables |= print_held_out(console, [(cases[0], cases[1], False)], notes)
    else:
        compared = compare_cases(cases)
        tables |= print_comparison(console, compared)
        try:
            if halved:
                tables |= print_held_out(console, [(*halves_of(case), True) for case in cases], notes)
            if not_seen:
                tables |= print_unseen(console, cases, horizon)
        except DynakinError as error:
            failed = error
        tables |= print_repetitions(console, compared)
        more["trials"] = [_described(trial) for trial in compared]
    if output is not None:
        with busy("writing tables and report"):
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


def compare_cases(cases: Sequence[Case]) -> list[Trial]:
    """All methods on all trials."""
    compared = []
    for case in cases:
        with progress_bar(case.recording.name) as progress:
            compared.append(compare_trial(case.recording, case.setup, static=case.static, progress=progress))
    return compared


def print_comparison(console: Console, compared: Sequence[Trial]) -> dict[str, Sequence[Any]]:
    """Table II, angles and moments on screen; the rows by the name of their file."""
    rows, angles, moments = table2(compared), angle_differences(compared), moment_differences(compared)
    first = compared[0]
    if len(compared) == 1:
        seconds = first.time[first.window]
        title = f"{first.name}: {seconds[0]:g} to {seconds[-1]:g} s"
    else:
        title = f"{len(compared)} trials, mean ± standard deviation, each after its adaptation"
    console.print(as_table(table2_text(rows, title)))
    if angles:
        console.print(as_table(angle_text(angles)))
    if moments:
        console.print(as_table(moment_text(moments)))
    truth = truth_rows(compared)
    if truth:
        console.print(as_table(truth_text(truth)))
    for trial in compared:
        for note in trial.notes:
            text = note if len(compared) == 1 else f"{trial.name}: {note}"
            console.print(Padding(text, (0, 0, 0, 2)), style="dim")
    return {"table2": rows, "angles": angles, "moments": moments, "truth": truth}


def print_held_out(
    console: Console, pairs: Sequence[tuple[Case, Case, bool]], notes: list[str]
) -> dict[str, Sequence[Any]]:
    """Identified on one, judged on the other; (identifying, judging, of one recording) each. Adds to ``notes``."""
    tables = []
    for fitted, judging, same in pairs:
        with busy(f"{judging.recording.name}: judging what was identified"):
            identified = identify_on(fitted.recording, fitted.setup, static=fitted.static, same_recording=same)
            identified, decided = with_subject(identified)
            blind = predict_blind(identified, judging.recording)
            tables.append(judge(blind, judging.recording))
            notes += [f"{fitted.recording.name}: {said}" for said in decided]
            notes += [f"{judging.recording.name}: {note}" for note in blind.notes]
    names = f"{pairs[0][0].recording.name} -> {pairs[0][1].recording.name}"
    title = f"Identified -> judged from markers alone: {names if len(pairs) == 1 else f'{len(pairs)} trials'}"
    rows = merged(tables)
    console.print(as_table(table2_text(rows, title)))
    for note in notes:
        console.print(Padding(note, (0, 0, 0, 2)), style="dim")
    return {"held_out": rows}


def print_unseen(console: Console, cases: Sequence[Case], horizon_ms: float) -> dict[str, Sequence[Any]]:
    """What no filter could follow, because it was not given."""
    figures = []
    for case in cases:
        with progress_bar(f"{case.recording.name}: leaving markers out") as progress:
            figures.append(
                unseen_figures(
                    case.recording,
                    case.setup,
                    static=case.static,
                    horizon_s=horizon_ms / 1000.0,
                    progress=progress,
                )
            )
    rows = unseen(figures)
    for text in unseen_texts(rows):
        console.print(as_table(text))
    return {"unseen": rows}


def print_repetitions(console: Console, compared: Sequence[Trial]) -> dict[str, Sequence[Any]]:
    """Which squats or gait cycles were found; their mean curves are for the file."""
    rows = []
    for trial in compared:
        rows += curve_points(trial.name, trial.curves())
        console.print(f"{trial.name}: {trial.repetitions.note}")
    return {"repetitions": rows}


def settings_of(cases: Sequence[Case]) -> list[dict[str, Any]]:
    """The configuration of each trial as used."""
    return [
        case.config.as_used()
        | {"output": None, "cutoff_hz": case.setup.cutoff_hz}
        | {"presets": {name: noise.model_dump(mode="json") for name, noise in case.setup.noise.items()}}
        for case in cases
    ]


def _described(trial: Trial) -> dict[str, Any]:
    """What is written of a trial in addition to its figures."""
    seconds = trial.time[trial.window]
    return {
        "name": trial.name,
        "window": {"start_s": float(seconds[0]), "end_s": float(seconds[-1])},
        "mass_kg": trial.mass_kg,
        "methods": [method.name for method in trial.methods],
        "repetitions": [asdict(repetition) for repetition in trial.repetitions.items],
        "notes": list(trial.notes),
    }
