"""What `dynakin compare` prints, and the rows of its files."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from rich.console import Console
from rich.padding import Padding

from dynakin.cli.console import as_table
from dynakin.identification.subject import with_subject
from dynakin.messages import Message, note, warnings_of
from dynakin.progress import stage
from dynakin.report.text_tables import angle_text, moment_text, table2_text, truth_text, unseen_texts
from dynakin.results.measures.mean_curves import curve_points
from dynakin.validation.case import Case
from dynakin.validation.differences import angle_differences, moment_differences
from dynakin.validation.held_out import identify_on, judge, predict_blind
from dynakin.validation.methods import ComparedTrial, compare_trial
from dynakin.validation.table2 import merged, table2
from dynakin.validation.truth import TruthRow, against_truth
from dynakin.validation.unseen import unseen, unseen_figures


def compare_cases(cases: Sequence[Case]) -> tuple[list[ComparedTrial], list[TruthRow]]:
    """All methods on all trials, and their errors where the truth is known."""
    compared = []
    for case in cases:
        with stage(case.recording.name) as progress:
            compared.append(compare_trial(case.recording, case.setup, static=case.static, progress=progress))
    return against_truth(compared)


def print_comparison(
    console: Console, compared: Sequence[ComparedTrial], truth: Sequence[TruthRow]
) -> dict[str, Sequence[Any]]:
    """Table II, angles and moments on screen; the rows by the name of their file."""
    rows, angles, moments = table2(compared), angle_differences(compared), moment_differences(compared)
    first = compared[0]
    if len(compared) == 1:
        seconds = first.time[first.window]
        title = f"{first.name}: {seconds[0]:g} to {seconds[-1]:g} s"
    else:
        title = f"{len(compared)} trials, mean ± standard deviation, each after its adaptation"
    console.print(as_table(table2_text(rows, title, of=len(compared))))
    if angles:
        console.print(as_table(angle_text(angles)))
    if moments:
        console.print(as_table(moment_text(moments)))
    if truth:
        console.print(as_table(truth_text(truth)))
    for trial in compared:
        for said in trial.notes:
            _print_note(console, said if len(compared) == 1 else said.of(trial.name))
    return {"table2": rows, "angles": angles, "moments": moments, "truth": truth}


def print_held_out(
    console: Console, pairs: Sequence[tuple[Case, Case, bool]], notes: list[Message]
) -> dict[str, Sequence[Any]]:
    """Identified on one, judged on the other; (identifying, judging, of one recording) each. Adds to ``notes``."""
    tables = []
    for fitted, judging, same in pairs:
        with stage(f"{judging.recording.name}: judging what was identified"):
            identified = identify_on(fitted.recording, fitted.setup, static=fitted.static, same_recording=same)
            identified, decided = with_subject(identified)
            blind = predict_blind(identified, judging.recording)
            tables.append(judge(blind, judging.recording))
            fits = [said for each in identified.estimates.values() for said in warnings_of(each.messages)]
            chosen = [note("method", text) for text in decided]
            notes += [said.of(fitted.recording.name) for said in dict.fromkeys([*fits, *chosen])]
            notes += [said.of(judging.recording.name) for said in (*warnings_of(blind.start.messages), *blind.notes)]
    names = f"{pairs[0][0].recording.name} -> {pairs[0][1].recording.name}"
    title = f"Identified -> judged from markers alone: {names if len(pairs) == 1 else f'{len(pairs)} trials'}"
    rows = merged(tables)
    console.print(as_table(table2_text(rows, title)))
    print_notes(console, notes)
    return {"held_out": rows}


def print_notes(console: Console, notes: Sequence[Message]) -> None:
    """A line each."""
    for said in notes:
        _print_note(console, said)


def _print_note(console: Console, said: Message) -> None:
    console.print(Padding(str(said), (0, 0, 0, 2)), style="yellow" if said.level == "warning" else "dim")


def print_unseen(console: Console, cases: Sequence[Case], horizon_ms: float) -> dict[str, Sequence[Any]]:
    """What no filter could follow, because it was not given."""
    figures = []
    for case in cases:
        with stage(f"{case.recording.name}: leaving markers out") as progress:
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


def print_repetitions(console: Console, compared: Sequence[ComparedTrial]) -> dict[str, Sequence[Any]]:
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


def described(trial: ComparedTrial) -> dict[str, Any]:
    """What is written of a trial in addition to its figures."""
    seconds = trial.time[trial.window]
    return {
        "name": trial.name,
        "window": {"start_s": float(seconds[0]), "end_s": float(seconds[-1])},
        "mass_kg": trial.mass_kg,
        "methods": [method.name for method in trial.methods],
        "repetitions": [asdict(repetition) for repetition in trial.repetitions.items],
        "warnings": list(map(str, warnings_of(trial.notes))),
        "notes": list(map(str, trial.notes)),
    }
