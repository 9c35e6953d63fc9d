"""`dynakin identify`: inertial parameters of a subject from several trials, kept where they predict."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from dynakin.cli.console import out, table
from dynakin.cli.options import OF_A_MODEL, OF_THE_LABORATORY, Given, with_settings
from dynakin.errors import ConfigError
from dynakin.progress import stage
from dynakin.settings.settings import Settings

if TYPE_CHECKING:
    from dynakin.identification.subject import Identification
    from dynakin.recordings.recording import Recording


@with_settings(*OF_A_MODEL, *OF_THE_LABORATORY)
def identify(
    trials: Annotated[
        list[Path] | None, typer.Argument(help="Recordings of one subject with force plates (.c3d, .trc, .csv).")
    ] = None,
    forces: Annotated[
        list[Path] | None,
        typer.Option("--forces", help="Ground forces of the trials, in their order; else TRIAL_grf.mot by each."),
    ] = None,
    *,
    given: Given,
    output: Annotated[Path | None, typer.Option("-o", "--output", help="Subject file (.toml) to write.")] = None,
    compare: Annotated[
        bool, typer.Option("--compare", help="Arguments are two subject files: what changed between the sessions.")
    ] = False,
) -> None:
    """Identify a subject, and keep what predicts trials that it was not fitted to better than the table does."""
    from dynakin.filter.build import estimator_of
    from dynakin.identification.subject import identify_subject

    paths = trials or []
    if compare:
        _compare(paths)
        return
    if not paths or output is None:
        raise ConfigError("identify: expected TRIAL... and -o subject.toml (or --compare A B)")
    _check_trials(paths)
    _check_output(output)
    settings = Settings.of({}, "identify", (), given)
    recordings, standing = _read(paths, forces or [], settings.static)
    estimator = estimator_of(settings)
    with stage("identifying") as progress:
        found = identify_subject(estimator, recordings, static=standing, progress=progress)
    found.subject.write(output)
    _print(found)
    out().print(f"Subject  {output}", soft_wrap=True)


def _print(found: Identification) -> None:
    """What the decision was, what moved, how sure."""
    from dynakin.identification.report import base_in_words, segment_rows

    console = out()
    for warning in (*found.lost, *found.warned):
        console.print(f"- {warning}", style="yellow")
    for text in found.decision.in_words():
        console.print(f"- {text}")
    used = "used" if found.subject.use == "bodies" else "not used: the table is kept"
    total = found.posterior.unknowns.inertial.total
    shown = table(
        "segment", "mass, kg", "table's", "sd", "centre of mass moved", numbers=(1, 2, 3),
        title=f"Identified segment masses ({used}), {total:.2f} kg of {found.subject.mass_kg:.2f}",
    )  # fmt: skip
    for row in segment_rows(found.posterior):
        shown.add_row(row.segment, f"{row.mass:.2f}", f"{row.table:.2f}", f"{row.sd:.2f}", row.moved)
    console.print(shown)
    for text in base_in_words(found.subject.batch):
        console.print(f"- {text}")


def _check_trials(paths: list[Path]) -> None:
    if len(paths) == 1:
        raise ConfigError(
            f"identify: one trial ({paths[0]}), expected at least two of the same subject: identified parameters "
            "are judged by a trial that is held out"
        )
    seen: set[Path] = set()
    for path in paths:
        if path.resolve() in seen:
            raise ConfigError(f"identify: {path} is given twice, expected different trials: each is held out in turn")
        seen.add(path.resolve())


def _check_output(output: Path) -> None:
    """Before anything that takes long."""
    if output.suffix.casefold() != ".toml":
        raise ConfigError(f"identify: -o {output}, expected a .toml file")
    if output.is_dir() or not output.resolve().parent.is_dir():
        raise ConfigError(f"identify: -o {output} cannot be written, expected a file in a folder that exists")


def _read(paths: list[Path], forces: list[Path], static: Path | None) -> tuple[list[Recording], Recording | None]:
    """The trials and the standing one, each with the ground forces given or found in its folder."""
    from dynakin.cli.compare_inputs import forces_each, named_forces, told_apart
    from dynakin.recordings.read import read
    from dynakin.results.naming import plural

    if forces and len(forces) != len(paths):
        counted = f"{plural(len(forces), 'force file')} for {plural(len(paths), 'trial')}"
        raise ConfigError(f"identify: {counted}, expected one a trial or none")
    chosen = forces_each(paths, forces)
    recordings = [read(path, force) for path, force in zip(paths, chosen, strict=True)]
    names = told_apart(recordings)
    recordings = [replace(recording, name=name) for recording, name in zip(recordings, names, strict=True)]
    if static is None:
        return recordings, None
    same = [recording for path, recording in zip(paths, recordings, strict=True) if path.resolve() == static.resolve()]
    return recordings, same[0] if same else read(static, named_forces(static))


def _compare(paths: list[Path]) -> None:
    from dynakin.identification.report import change_between, change_in_words
    from dynakin.model.identified import read_identified

    if len(paths) != 2:
        raise ConfigError(f"identify --compare: found {len(paths)}, expected two subject files (before, after)")
    before, after = (read_identified(path) for path in paths)
    for path, subject in zip(paths, (before, after), strict=True):
        for text in subject.warnings:
            out().print(f"- {path}: {text}", style="yellow")
    for text in change_in_words(change_between(before, after), (before.mass_kg, after.mass_kg)):
        out().print(f"- {text}")
