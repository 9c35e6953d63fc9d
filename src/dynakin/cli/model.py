"""`dynakin model`: what a model is made of, what its measurements observe, and any model as an .osim file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from dynakin.cli.console import out
from dynakin.cli.options import Given, with_settings
from dynakin.settings.settings import Settings, option_names


@with_settings("markers", "forces", "static", "mass_kg", "height_m", "sex")
def model(
    name: Annotated[
        str | None, typer.Argument(help="squat7, sagittal7, fullbody, a .toml or .osim file; none: list them.")
    ] = None,
    *,
    given: Given,
    identifiable: Annotated[
        bool, typer.Option("--identifiability", help="Observability of its constants: base parameters, gauges.")
    ] = False,
    trial: Annotated[
        Path | None,
        typer.Option(help="With --identifiability: posterior of this recording, and movements that would help."),
    ] = None,
    export: Annotated[
        Path | None,
        typer.Option(
            help="Write the model as an OpenSim file (.osim); a built-in one needs --trial to be measured on."
        ),
    ] = None,
    parameters: Annotated[
        Path | None, typer.Option(help="With --export: a run's parameters.json, whose values are written.")
    ] = None,
) -> None:
    """Print a model: its tree, coordinates, states, markers and bounds; or what it lets one identify; or export it."""
    from dynakin.cli.model_tables import export_model, list_models, print_identifiability, print_model, print_opensim
    from dynakin.filter.build import definition_of
    from dynakin.model.opensim.definition import OpenSimDefinition
    from dynakin.model.opensim.export import settings_of_run

    console = out()
    needless = ["--trial"] if trial is not None else []
    needless += [option_names(key)[0] for key in ("forces", "static", "mass_kg", "height_m", "sex") if key in given]
    if needless and not identifiable and export is None:
        raise typer.BadParameter(f"{needless[0]} is of use only with --identifiability or --export")
    if parameters is not None and export is None:
        raise typer.BadParameter("--parameters is of use only with --export FILE")
    for key in ("forces", "static"):
        if key in given and trial is None:
            raise typer.BadParameter(f"{option_names(key)[0]} is of use only with --trial FILE")
    if name is None:
        if identifiable:
            raise typer.BadParameter("--identifiability: expected a model's name before it")
        if export is not None:
            raise typer.BadParameter("--export: expected a model's name before it")
        console.print(list_models())
        return
    settings = Settings.of({"model": name}, "model", ("model",), given)
    if parameters is not None:
        settings = settings_of_run(settings, parameters)
    definition = definition_of(settings)
    if export is not None:
        export_model(definition, export, parameters, trial, settings)
        console.print(f"Written {export}", soft_wrap=True)
        return
    if identifiable:
        print_identifiability(definition, trial, settings)
    elif isinstance(definition, OpenSimDefinition):
        print_opensim(console, definition)
    else:
        print_model(console, definition)
