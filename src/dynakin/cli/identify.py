"""`dynakin identify`: inertial parameters and geometry of a subject from several trials, kept where they predict."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from dynakin.cli.console import out, progress_bar
from dynakin.cli.options import Forward, Height, Markers, Mass, Sex, Side, Static, Vertical
from dynakin.cli.run import forward_direction
from dynakin.errors import ConfigError
from dynakin.filter import Estimator
from dynakin.identification import change_between, change_in_words, identify_subject
from dynakin.model import Subject, load_model
from dynakin.model.identified import read_identified
from dynakin.recordings import Recording, read


def identify(
    trials: Annotated[
        list[Path] | None, typer.Argument(help="Recordings of one subject with force plates (.c3d, .trc, .csv).")
    ] = None,
    forces: Annotated[
        list[Path] | None,
        typer.Option("--forces", help="Ground forces of the trials, in their order; not given: TRIAL_grf.mot beside."),
    ] = None,
    model: Annotated[str | None, typer.Option(help="Planar model: squat7, sagittal7 or a .toml file.")] = None,
    markers: Markers = None,
    static: Static = None,
    mass: Mass = None,
    height: Height = None,
    sex: Sex = None,
    side: Side = None,
    vertical: Vertical = None,
    forward: Forward = None,
    output: Annotated[Path | None, typer.Option("-o", "--output", help="Subject file (.toml) to write.")] = None,
    compare: Annotated[
        bool, typer.Option("--compare", help="Arguments are two subject files: what changed between the sessions.")
    ] = False,
) -> None:
    """Identify a subject, and keep what predicts trials that it was not fitted to better than the table does."""
    paths = trials or []
    if compare:
        _compare(paths)
        return
    if not paths or model is None or output is None:
        raise ConfigError("identify: expected TRIAL..., --model NAME and -o subject.toml (or --compare A B)")
    if output.suffix.casefold() != ".toml":
        raise ConfigError(f"identify: -o {output}, expected a .toml file")
    recordings = _read(paths, forces or [])
    definition = load_model(model, Subject(mass_kg=mass, height_m=height, sex=sex), markers=markers or "auto")
    estimator = Estimator(
        definition,
        side=side or "auto",
        vertical=vertical or "auto",
        forward=forward_direction(forward) or "auto",  # type: ignore[arg-type]
    )
    with progress_bar("identifying") as progress:
        found = identify_subject(
            estimator, recordings, static=None if static is None else read(static), progress=progress
        )
    found.subject.write(output)
    console = out()
    for text in found.subject.report:
        console.print(f"- {text}")
    console.print(f"Subject  {output}", soft_wrap=True)


def _read(paths: list[Path], forces: list[Path]) -> list[Recording]:
    if forces and len(forces) != len(paths):
        raise ConfigError(f"identify: {len(forces)} force files for {len(paths)} trials, expected one a trial or none")
    beside = [path.with_name(f"{path.stem}_grf.mot") for path in paths]
    found: list[Path | None] = [name if name.is_file() else None for name in beside]
    return [read(path, force) for path, force in zip(paths, forces or found, strict=True)]


def _compare(paths: list[Path]) -> None:
    if len(paths) != 2:
        raise ConfigError(f"identify --compare: {len(paths)} files, expected two subject files (before, after)")
    before, after = (read_identified(path) for path in paths)
    for text in change_in_words(change_between(before, after), (before.mass_kg, after.mass_kg)):
        out().print(f"- {text}")
