"""`dynakin model FILE.osim`: what an OpenSim model holds; `--export`: any model as an .osim file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import typer
from rich.console import Console
from rich.table import Table
from rich.tree import Tree

from dynakin.cli.console import table
from dynakin.model.definition import Definition
from dynakin.model.opensim.definition import OpenSimDefinition
from dynakin.model.opensim.export import mass_of_run, of_definition, of_initial, read_values
from dynakin.model.opensim.spec import free_coordinates, placements, used_scales
from dynakin.model.opensim.write import write_osim
from dynakin.recordings.read import read


def print_opensim(console: Console, definition: OpenSimDefinition) -> None:
    """Tree, coordinates, markers and scales of the model."""
    source = definition.source
    console.print(
        f"{definition.name}: OpenSim model, {len(source.bodies)} bodies, {source.mass:.2f} kg", soft_wrap=True
    )
    for sentence in source.left_out:
        console.print(f"  {sentence}", soft_wrap=True)
    console.print()
    console.print(_tree(definition))
    console.print()
    console.print(_coordinates(definition))
    console.print(_markers(definition))
    scales = used_scales(placements(source, definition.scales))
    console.print(f"Scales (1 as the file has it): {', '.join(scales) or 'none'}", soft_wrap=True)


def export_model(
    definition: Definition,
    path: Path,
    parameters: Path | None,
    mass_kg: float | None,
    trial: Path | None,
    forces: Path | None,
) -> None:
    """Write a model with a run's values, where given.

    Raises:
        DynakinError: files that cannot be read or written, or do not fit; in one line.
    """
    if path.suffix.casefold() != ".osim":
        raise typer.BadParameter(f"--export is {path}, expected a file that ends in .osim")
    values = {} if parameters is None else read_values(parameters)
    if isinstance(definition, OpenSimDefinition):
        mass = mass_of_run(parameters) if mass_kg is None and parameters is not None else mass_kg
        write_osim(of_definition(definition, values, mass), path)
        return
    if trial is None:
        raise typer.BadParameter("--export of a model that is no .osim file: expected --trial to measure it on")
    write_osim(of_initial(definition.calibrate(read(trial, forces)), values), path)


def _tree(definition: OpenSimDefinition) -> Tree:
    root = Tree("ground")
    nodes = {"ground": root}
    for joint in definition.source.joints:
        names = ", ".join(c.name for c in joint.coordinates) or "fixed"
        mass = definition.source.body(joint.child).mass
        nodes[joint.child] = nodes[joint.parent].add(f"{joint.child} ({mass:.3g} kg): {joint.kind}, {names}")
    return root


def _coordinates(definition: OpenSimDefinition) -> Table:
    rows = table("coordinate", "limits", "unit", "meaning", numbers=(1,), title="Coordinates")
    free = {c.name for c in free_coordinates(definition.source)}
    for joint in definition.source.joints:
        kinds = {axis.coordinate: axis.kind for axis in reversed(joint.axes)}
        for c in joint.coordinates:
            turn = kinds[c.name] == "rotation"
            low, high = (np.degrees(v) if turn else v for v in c.limits)
            limits = "locked" if c.locked else f"{low:.4g} to {high:.4g}"
            follows = "" if c.name in free else "coupled to another"
            rows.add_row(c.name, limits, "deg" if turn else "m", follows)
    return rows


def _markers(definition: OpenSimDefinition) -> Table:
    rows = table("body", "markers", title="Markers")
    for body in definition.source.bodies:
        names = [marker.name for marker in definition.source.markers if marker.body == body.name]
        if names:
            rows.add_row(body.name, ", ".join(names))
    return rows
