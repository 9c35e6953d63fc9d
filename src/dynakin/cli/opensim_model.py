"""`dynakin model FILE.osim`: what an OpenSim model holds and what of it would be estimated."""

from __future__ import annotations

import numpy as np
from rich.console import Console
from rich.table import Table
from rich.tree import Tree

from dynakin.cli.console import table
from dynakin.model import OpenSimDefinition
from dynakin.model.opensim.spec import free_coordinates, placements, used_scales


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
