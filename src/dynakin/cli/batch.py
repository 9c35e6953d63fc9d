"""`dynakin batch`: all trials of a study."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from dynakin.cli.console import as_table, out
from dynakin.cli.options import Backend, Jobs, Scheduler
from dynakin.errors import ConfigError, DynakinError
from dynakin.progress import stage
from dynakin.settings.defaults import CUTOFF_HZ


def batch(
    dataset: Annotated[Path, typer.Argument(help="DATASET.toml: subjects, trials, and what holds for all.")],
    output: Annotated[Path | None, typer.Option("-o", "--output", help="Folder, instead of the dataset's.")] = None,
    preset: Annotated[list[str] | None, typer.Option(help="Noise settings to compare. May be repeated.")] = None,
    cutoff: Annotated[float, typer.Option("--cutoff-hz", help="Low-pass of AT and classical, Hz.")] = CUTOFF_HZ,
    tables_only: Annotated[bool, typer.Option("--tables-only", help="Write no results of single trials.")] = False,
    identify: Annotated[
        bool,
        typer.Option("--identify/--no-identify", help="Identify each subject on its trials first."),
    ] = True,
    backend: Backend = "processes",
    jobs: Jobs = None,
    scheduler: Scheduler = None,
) -> None:
    """Work on all trials of all subjects, each by itself: Table II over them, and those that failed by name.

    A subject with two trials or more is identified on them first. What predicts its left-out trials better than the
    table is what all its trials start from, unless they have `parameters` already.

    The exit code is 1 where some failed, or a filter lost the person. A batch that was stopped goes on where it was;
    those that failed are tried again.
    """
    with stage("loading"):
        from dynakin.report.text_tables import table2_text
        from dynakin.results.naming import plural
        from dynakin.studies.batch.dataset import check_presets, copies, read_dataset
        from dynakin.studies.batch.process import TRIALS, Options, belongs_to, run_batch, write_batch
        from dynakin.studies.batch.subjects import identify_subjects, with_parameters
        from dynakin.studies.engine.journal import ROWS, Journal, open_folder
        from dynakin.studies.engine.pools import open_pool
        from dynakin.studies.engine.tasks import Failure

    if backend == "threads":
        raise ConfigError("batch: --backend threads, expected processes or dask: a crash would take all trials with it")
    whole = read_dataset(dataset, output)
    twice = copies(whole)
    found = replace(whole, sessions=tuple(session for session in whole.sessions if session.name not in twice))
    check_presets(preset or [], "batch: --preset")
    options = Options(tuple(preset or found.presets), cutoff, not tables_only)
    subjects = sorted({session.subject for session in found.sessions})
    folder = open_folder(found.output, ("table2", "batch.", "trials.", *subjects))
    subject_of = {session.name: session.subject for session in found.sessions} if identify else {}

    def together(key: str) -> str:
        """A subject is identified on all its trials, and these start from what was found."""
        return subject_of.get(key, key)

    journal = Journal(folder / ROWS, belongs_to(found, options, identify=identify), TRIALS, together)
    identified = {}
    with open_pool(backend, jobs, scheduler) as pool:
        if identify:
            with stage("identifying") as progress:
                identified = identify_subjects(found, pool, journal=journal, progress=progress)
        with stage("batch") as progress:
            result = run_batch(with_parameters(found, identified), options, pool, journal=journal, progress=progress)
    for name, earlier in twice.items():
        result.failures[name] = Failure(f"is a copy of {earlier} and left out, expected each recording once")
    console = out()
    if result.rows:
        people = len({name.split("/")[0] for name in result.rows})
        title = (
            f"{plural(len(result.rows), 'trial')} of {plural(people, 'subject')}, mean ± standard deviation over trials"
        )
        console.print(as_table(table2_text(result.table2(), title, of=len(result.rows), doubted=result.doubted)))
    with stage("writing tables"):
        written = write_batch(folder, result, identified)
    console.print(f"Tables  {folder}/{', '.join(written)}", soft_wrap=True)
    for subject, row in identified.items():
        for text in (*row["doubts"], row["said"][-1]):
            console.print(f"Subject {subject}: {text}", soft_wrap=True)
    for name, row in result.rows.items():
        for preset_name, verdict in row["verdict"].items():
            which = f", EKF ({preset_name})" if len(row["verdict"]) > 1 else ""
            console.print(f"Verdict {name}{which}: {verdict}", soft_wrap=True)
        for warning in row["warnings"]:
            console.print(f"Warned  {name}: {warning}", soft_wrap=True)
    for name, failure in result.failures.items():
        console.print(f"Failed  {name}: {failure.message}", soft_wrap=True)
    lost = [(name, *entry) for name, row in result.rows.items() for entry in row["lost"].items()]
    for name, preset_name, reason in lost:
        console.print(f"Lost    {name}, EKF ({preset_name}): {reason}", soft_wrap=True)
    if not result.rows:
        raise DynakinError(f"{dataset}: none of {plural(len(found.sessions), 'trial')} could be worked on")
    if result.failures or lost:
        raise typer.Exit(1)
