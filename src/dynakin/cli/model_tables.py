"""What a model is made of, on screen, and what its measurements observe."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import typer
from rich.console import Console
from rich.table import Table
from rich.tree import Tree

from dynakin.cli.console import out, table
from dynakin.errors import ConfigError
from dynakin.filter.estimator import Estimator
from dynakin.identification.observability.simulated import tracker_of
from dynakin.identification.observability.structure import Structure, structure_of
from dynakin.identification.observability.trial import Identifiability, identifiability
from dynakin.model.definition import Definition, ModelDefinition, available_models, load_built_in_or_toml
from dynakin.model.identified import read_constants
from dynakin.model.markers.marker_set import available_marker_sets, load_marker_set
from dynakin.model.markers.schema import Marker, MarkerSetFile
from dynakin.model.opensim.definition import OpenSimDefinition
from dynakin.model.opensim.export import of_definition, of_initial
from dynakin.model.opensim.spec import independent_coordinates, placements, used_scales
from dynakin.model.opensim.write import write_osim
from dynakin.model.schema import ModelFile, kinds_of
from dynakin.model.schema import Segment as ModelSegment
from dynakin.progress import stage
from dynakin.recordings.read import read
from dynakin.recordings.recording import Recording
from dynakin.results.measures.posterior import JUDGEMENT_WORDS, judged
from dynakin.results.naming import number, sentence
from dynakin.settings.model import Bounds
from dynakin.settings.settings import Settings


def list_models() -> Table:
    """The built-in models and marker sets."""
    rows = table("name", "what it is", title="Models and marker sets")
    for name in available_models():
        rows.add_row(name, load_built_in_or_toml(name).model.description)
    for name in available_marker_sets():
        rows.add_row(name, load_marker_set(name).description)
    return rows


def print_model(console: Console, definition: ModelDefinition) -> None:
    """Tree, coordinates, markers and states of a model of our own."""
    console.print(f"{definition.name}: {definition.model.description}")
    console.print()
    console.print(_tree(definition.model))
    console.print()
    console.print(_coordinates(definition.model))
    for marker_set in _marker_sets(definition):
        console.print(_markers(definition.model, marker_set))
    console.print(_states(definition.model))


def _tree(model: ModelFile) -> Tree:
    root = Tree("ground" + (f" (origin: {model.ground.origin})" if model.ground.origin else ""))
    nodes = {"ground": root}
    for segment in model.segments:
        nodes[segment.name] = nodes[segment.parent].add(_segment(segment))
    return root


def _segment(segment: ModelSegment) -> str:
    lengths = " + ".join(term.length for term in segment.placement)
    at = f", placed by length {lengths}" if lengths else ""
    axes = ", ".join(dict.fromkeys(axis.coordinate for axis in segment.axes)) or "fixed"
    parts = f" [{', '.join(segment.parts)}{', both sides' if segment.both_sides else ''}]" if segment.parts else ""
    return f"{segment.name}{parts}: {axes}{at}"


def _coordinates(model: ModelFile) -> Table:
    rows = table("coordinate", "limits", "unit", "meaning", numbers=(1,), title="Coordinates")
    kinds = kinds_of(model.segments)
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


def print_identifiability(definition: Definition, trial: Path | None, settings: Settings) -> None:
    """Structure of the model, by a simulated person where no trial is given; the trial's posterior where one is.

    Raises:
        DynakinError: model and trial do not fit.
    """
    if trial is None:
        with stage("looking at what is observed"):
            structure = structure_of(tracker_of(definition))
        _print_structure(structure)
        return
    with stage("estimating") as progress:
        recording, static = _read(trial, settings)
        estimate, tracker = Estimator(definition).track(recording, static=static, progress=progress)
    with stage("trying motions") as progress:
        found = identifiability(tracker, estimate, progress)
    _print_structure(found.structure, found)
    console = out()
    console.print("\nObservability in this trial", style="bold")
    for text in found.in_words():
        console.print(f"- {text}")
    console.print("\nMovements that would help", style="bold")
    for text in found.advice:
        console.print(f"- {text}")


def _print_structure(structure: Structure, trial: Identifiability | None = None) -> None:
    console = out()
    for text in structure.in_words():
        console.print(text)
    console.print(_base(structure, trial))
    console.print("Gauges: directions that no measurement observes", style="bold")
    for text in structure.gauges_in_words:
        console.print(f"- {sentence(text)}.")


def _base(structure: Structure, trial: Identifiability | None) -> Table:
    if trial is None:
        rows = table("", "base parameter", numbers=(0,), title="Base parameters")
        for k, text in enumerate(structure.base_in_words, start=1):
            rows.add_row(str(k), text)
        return rows
    rows = table(
        "base parameter", "value", "prior sd", "posterior sd", "", numbers=(1, 2, 3), title="Base parameters (kg, m)"
    )
    for entry in trial.base:
        numbers = (number(value) for value in (entry.value, entry.prior_sd, entry.sd))
        rows.add_row(entry.words, *numbers, JUDGEMENT_WORDS[judged(entry.share)])
    return rows


def print_opensim(console: Console, definition: OpenSimDefinition) -> None:
    """Tree, coordinates, markers and scales of the model."""
    source = definition.source
    console.print(
        f"{definition.name}: OpenSim model, {len(source.bodies)} bodies, {source.mass:.2f} kg", soft_wrap=True
    )
    for line in source.left_out:
        console.print(f"  {line}", soft_wrap=True)
    console.print()
    console.print(_opensim_tree(definition))
    console.print()
    console.print(_opensim_coordinates(definition))
    console.print(_opensim_markers(definition))
    scales = used_scales(placements(source, definition.scales))
    console.print(f"Scales (1 as the file has it): {', '.join(scales) or 'none'}", soft_wrap=True)


def export_model(
    definition: Definition,
    path: Path,
    parameters: Path | None,
    trial: Path | None,
    settings: Settings,
) -> None:
    """Write a model with a run's values, where given.

    Raises:
        DynakinError: files that cannot be read or written, or do not fit; in one line.
    """
    if path.suffix.casefold() != ".osim":
        raise typer.BadParameter(f"--export is {path}, expected a file that ends in .osim")
    if path.exists():
        raise ConfigError(f"--export: {path} exists already, expected another name (a model, perhaps the only one)")
    found = None if parameters is None else read_constants(parameters)
    if isinstance(definition, OpenSimDefinition):
        if trial is not None:
            raise typer.BadParameter("--trial is of no use with --export of an .osim file, which has places of its own")
        write_osim(of_definition(definition, found, settings.mass_kg), path)
        return
    if trial is None:
        raise typer.BadParameter("--export of a model that is no .osim file: expected --trial to measure it on")
    recording, static = _read(trial, settings)
    write_osim(of_initial(definition.calibrate(recording, static=static), found), path)


def _read(trial: Path, settings: Settings) -> tuple[Recording, Recording | None]:
    """The trial with its forces, and the standing trial where there is one."""
    return read(trial, settings.forces), None if settings.static is None else read(settings.static)


def _opensim_tree(definition: OpenSimDefinition) -> Tree:
    root = Tree("ground")
    nodes = {"ground": root}
    for joint in definition.source.joints:
        names = ", ".join(c.name for c in joint.coordinates) or "fixed"
        mass = definition.source.body(joint.child).mass
        nodes[joint.child] = nodes[joint.parent].add(f"{joint.child} ({mass:.3g} kg): {joint.kind}, {names}")
    return root


def _opensim_coordinates(definition: OpenSimDefinition) -> Table:
    rows = table("coordinate", "limits", "unit", "meaning", numbers=(1,), title="Coordinates")
    free = {c.name for c in independent_coordinates(definition.source)}
    for joint in definition.source.joints:
        kinds = kinds_of([joint])
        for c in joint.coordinates:
            turn = kinds[c.name] == "rotation"
            low, high = (np.degrees(v) if turn else v for v in c.limits)
            limits = "locked" if c.locked else f"{low:.4g} to {high:.4g}"
            follows = "" if c.name in free else "coupled to another"
            rows.add_row(c.name, limits, "deg" if turn else "m", follows)
    return rows


def _opensim_markers(definition: OpenSimDefinition) -> Table:
    rows = table("body", "markers", title="Markers")
    for body in definition.source.bodies:
        names = [marker.name for marker in definition.source.markers if marker.body == body.name]
        if names:
            rows.add_row(body.name, ", ".join(names))
    return rows
