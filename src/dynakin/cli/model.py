"""`dynakin model`: what a model is made of."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.table import Table
from rich.tree import Tree

from dynakin.cli.console import out, table
from dynakin.cli.identifiability import print_identifiability
from dynakin.cli.opensim_model import export_model, print_opensim
from dynakin.cli.options import Given, with_settings
from dynakin.filter.build import definition_of
from dynakin.model.definition import ModelDefinition, available_models, load_built_in_or_toml
from dynakin.model.markers.marker_set import available_marker_sets, load_marker_set
from dynakin.model.markers.schema import Marker, MarkerSetFile
from dynakin.model.opensim.definition import OpenSimDefinition
from dynakin.model.schema import ModelFile
from dynakin.model.schema import Segment as ModelSegment
from dynakin.settings.model import Bounds
from dynakin.settings.settings import Settings, option_names


@with_settings("markers", "forces", "mass_kg", "height_m", "sex")
def model(
    name: Annotated[
        str | None, typer.Argument(help="squat7, sagittal7, fullbody, a .toml or .osim file; none: list them.")
    ] = None,
    *,
    given: Given,
    identifiable: Annotated[
        bool, typer.Option("--identifiability", help="What its measurements can tell: base parameters and gauges.")
    ] = False,
    trial: Annotated[
        Path | None,
        typer.Option(help="With --identifiability: what this recording tells, and what would tell more."),
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
    console = out()
    needless = ["--trial"] if trial is not None else []
    needless += [option_names(key)[0] for key in ("forces", "mass_kg", "height_m", "sex") if key in given]
    if needless and not identifiable and export is None:
        raise typer.BadParameter(f"{needless[0]} is of use only with --identifiability or --export")
    if parameters is not None and export is None:
        raise typer.BadParameter("--parameters is of use only with --export FILE")
    if "forces" in given and trial is None:
        raise typer.BadParameter("--forces is of use only with --trial FILE")
    if name is None:
        if identifiable:
            raise typer.BadParameter("--identifiability: expected a model's name before it")
        if export is not None:
            raise typer.BadParameter("--export: expected a model's name before it")
        console.print(_list())
        return
    settings = Settings.of({"model": name}, "model", ("model",), given)
    definition = definition_of(settings)
    if export is not None:
        export_model(definition, export, parameters, settings.mass_kg, trial, settings.forces)
        console.print(f"Written {export}", soft_wrap=True)
        return
    if isinstance(definition, OpenSimDefinition):
        if identifiable:
            raise typer.BadParameter("--identifiability: expected a built-in model or a .toml file")
        print_opensim(console, definition)
        return
    if identifiable:
        print_identifiability(definition, trial, settings.forces)
        return
    console.print(f"{definition.name}: {definition.model.description}")
    console.print()
    console.print(_tree(definition.model))
    console.print()
    console.print(_coordinates(definition.model))
    for marker_set in _marker_sets(definition):
        console.print(_markers(definition.model, marker_set))
    console.print(_states(definition.model))


def _list() -> Table:
    rows = table("name", "what it is", title="Models and marker sets")
    for name in available_models():
        rows.add_row(name, load_built_in_or_toml(name).model.description)
    for name in available_marker_sets():
        rows.add_row(name, load_marker_set(name).description)
    return rows


def _tree(model: ModelFile) -> Tree:
    root = Tree("ground" + (f" (origin: {model.ground.origin})" if model.ground.origin else ""))
    nodes = {"ground": root}
    for segment in model.segments:
        nodes[segment.name] = nodes[segment.parent].add(_segment(segment))
    return root


def _segment(segment: ModelSegment) -> str:
    lengths = " + ".join(term.length for term in segment.placement)
    at = f", placed by length {lengths}" if lengths else ""
    axes = ", ".join(axis.coordinate for axis in segment.axes) or "fixed"
    parts = f" [{', '.join(segment.parts)}{', both sides' if segment.both_sides else ''}]" if segment.parts else ""
    return f"{segment.name}{parts}: {axes}{at}"


def _coordinates(model: ModelFile) -> Table:
    rows = table("coordinate", "limits", "unit", "meaning", numbers=(1,), title="Coordinates")
    kinds = {axis.coordinate: axis.kind for segment in model.segments for axis in segment.axes}
    for coordinate in model.coordinates:
        rotation = kinds[coordinate.name] == "rotation"
        low, high = (np.degrees(v) if rotation else v for v in coordinate.limits)
        limits = (
            "locked" if coordinate.locked else "free" if np.isinf([low, high]).all() else f"{low:.4g} to {high:.4g}"
        )
        rows.add_row(coordinate.name, limits, "deg" if rotation else "m", coordinate.description)
    return rows


def _marker_sets(definition: ModelDefinition) -> list[MarkerSetFile]:
    """The set asked for, or those built-in ones that have a marker for every segment that needs one."""
    if definition.marker_set is not None:
        return [definition.marker_set]
    needed = [s.name for s in definition.model.segments if s.axes and s.without_markers is None]
    sets = [load_marker_set(name) for name in available_marker_sets()]
    return [s for s in sets if {*needed} <= {segment for segment, _ in _sites(definition.model, s)}]


def _sites(model: ModelFile, marker_set: MarkerSetFile) -> list[tuple[str, Marker]]:
    """Segments with the markers of the set that sit on them."""
    return [
        (segment.name, marker)
        for segment in model.segments
        for marker in marker_set.markers
        if marker.measures(model.planar) and marker.segment in (segment.name, *segment.parts)
    ]


def _names(marker: Marker, side: str | None) -> str:
    """Names in recordings, on one side where the model has two."""
    sides = ("right", "left", "centre") if side is None else (side, "centre")
    return " | ".join(filter(None, (", ".join(marker.aliases(one)) for one in sides)))


def _markers(model: ModelFile, marker_set: MarkerSetFile) -> Table:
    rows = table(
        "segment", "marker", "names in recordings", "sd, mm", numbers=(3,), title=f"Markers of set {marker_set.name}"
    )
    side = {segment.name: segment.side for segment in model.segments}
    for segment, marker in _sites(model, marker_set):
        if names := _names(marker, side[segment]):
            sd = "" if marker.variance is None else f"{1000 * np.sqrt(marker.variance):.0f}"
            rows.add_row(segment, marker.name, names, sd)
    return rows


def _states(model: ModelFile) -> Table:
    bounds = Bounds()
    free = sum(not c.locked for c in model.coordinates)
    carrying = sum(s.inertia_estimated and bool(s.parts or s.inertia) for s in model.segments)
    axes = 2 if model.planar else 3
    rows = table("block", "elements", "bounds", title="State, where every segment has markers")
    rows.add_row("coordinates, speeds, accelerations", f"3 x {free}", "coordinates: their limits")
    lengths = sum(length.estimated for length in model.lengths)
    rows.add_row("lengths", str(lengths), f"± {100 * bounds.length_fraction:g} % of the length at the start")
    rows.add_row("marker places", f"{axes} a marker", f"± {1000 * bounds.marker_threshold_m:g} mm around the start")
    rows.add_row(
        "inertia",
        f"{4 if model.planar else 10} x {carrying}",
        f"mass, moments of inertia: ± {100 * bounds.mass_fraction:g}, {100 * bounds.inertia_fraction:g} %; "
        f"first moments: ± {100 * bounds.first_moment_fraction:g} % of mass times length",
    )
    return rows
