"""`dynakin check`: a rehearsal of `dynakin run`, without the estimate."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from dynakin.cli.console import out
from dynakin.cli.options import OF_A_MODEL, OF_THE_LABORATORY, OF_THE_PLATES, Given, with_settings
from dynakin.errors import ConfigError, DynakinError, ModelError, RecordingError
from dynakin.files import is_file
from dynakin.progress import stage


@with_settings("forces", *OF_A_MODEL, "parameters", *OF_THE_LABORATORY, *OF_THE_PLATES, "preset", "zero")
def check(
    trial: Annotated[Path, typer.Argument(help="Recording (.c3d, .trc, .csv), or a configuration (.toml).")],
    *,
    given: Given,
) -> None:
    """Say what `run` would make of a recording, what would be absent and why, and what to add for more.

    Exit code 0 where `run` would run; 1 where it would refuse the recording, with the line that it would refuse with; 2
    where there is no such file, or an option or key is wrong.
    """
    with stage("loading"):
        from dynakin.cli.check_rows import model_rows, nearest_sets, recording_rows, rehearsed, to_add
        from dynakin.cli.prepared import print_rows
        from dynakin.filter.build import estimator_of
        from dynakin.pipeline.stages import configure
        from dynakin.validation.case import case_of

    console = out()
    settings = configure(trial, given, {"output": Path()}, options=True)
    estimator = None
    try:
        with stage("reading the recording"):
            try:
                estimator = estimator_of(settings)
            except ModelError as error:  # of a file of the model, its markers or its table: wrong input, no refusal
                raise ConfigError(error.message) from None
            case = case_of(settings, estimator=estimator)
    except (RecordingError, ModelError) as error:
        named = (trial, settings.forces, settings.static)
        if not all(is_file(Path(file)) for file in named if file):
            raise
        raise _refused(error) from None
    console.print(f"{case.recording.path or case.recording.name}", style="bold", soft_wrap=True)
    print_rows(console, recording_rows(case.recording))
    ready, refusal = rehearsed(case)
    if ready is not None:
        print_rows(console, model_rows(ready, settings, refusal, case.recording.notes))
    else:
        print_rows(console, [("Markers", text) for text in nearest_sets(case.recording)])
    print_rows(console, [("Add", text) for text in to_add(case, ready, refusal)])
    if refusal is not None:
        raise _refused(refusal)
    console.print("`dynakin run` would run it.", style="dim")


def _refused(error: DynakinError) -> DynakinError:
    """A refusal is what was asked for: it ends the command with 1, not as wrong input does."""
    error.exit_code = 1
    return error
