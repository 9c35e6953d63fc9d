"""`dynakin markers`: which marker sets and places there are, what a model needs, and a draft of a set of one's own."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from shlex import quote
from typing import Annotated

import typer

from dynakin.cli.console import out, table
from dynakin.errors import ConfigError
from dynakin.files import write_text

markers = typer.Typer(no_args_is_help=True, rich_markup_mode=None, help="Marker sets: built in, and one of your own.")


@markers.command("list")
def list_sets() -> None:
    """The built-in marker sets."""
    from dynakin.model.markers.marker_set import available_marker_sets, load_marker_set

    shown = table("set", "markers", "what it is", numbers=(1,))
    for name in available_marker_sets():
        found = load_marker_set(name)
        count = sum(bool(m.aliases(side)) for m in found.markers for side in ("right", "left", "centre"))
        shown.add_row(name, str(count), found.description)
    out().print(shown)


@markers.command()
def show(name: Annotated[str, typer.Argument(metavar="SET", help="A built-in marker set, or a .toml file.")]) -> None:
    """A marker set: its places, and under which names recordings have them."""
    from dynakin.model.markers.anatomy import anatomy
    from dynakin.model.markers.marker_set import load_marker_set

    found = load_marker_set(name)
    shown = table(
        "place", "right", "left", "middle", "segment", "where it is", title=f"{found.name}: {found.description}"
    )
    for marker in found.markers:
        about = anatomy()["places"].get(marker.name, {}).get("description", "follows its segment")
        names = (", ".join(marker.aliases(side)) for side in ("right", "left", "centre"))
        shown.add_row(marker.name, *names, marker.segment, about)
    out().print(shown)


@markers.command()
def places() -> None:
    """Places of the body that a marker set may name, and segments whose clusters it may name."""
    from dynakin.model.markers.anatomy import anatomy

    shown = table("place", "segment", "where it is")
    for name, about in anatomy()["places"].items():
        shown.add_row(name, about.get("segment", ""), about["description"])
    out().print(shown)
    out().print(f"Clusters: {', '.join(anatomy()['clusters'])}")


@markers.command("needs")
def needs_of(model: Annotated[str, typer.Argument(metavar="MODEL", help="A built-in model, or a .toml file.")]) -> None:
    """Which places a model needs marked."""
    from dynakin.model.calibration.needs import in_words, needs
    from dynakin.model.definition import load_built_in_or_toml

    definition = load_built_in_or_toml(model)
    shown = table(
        "for", "segments", "needed", "places that give it", title=f"{definition.name}: the first that are marked"
    )
    for need in needs(definition.model):
        shown.add_row(
            need.landmark.replace("_", " ") + (" (each side)" if need.sided else ""),
            ", ".join(need.segments),
            "no" if need.optional else "yes",
            in_words(need, 4),
        )
    out().print(shown)


@markers.command()
def new(
    trial: Annotated[Path, typer.Argument(help="Recording (.c3d, .trc, .csv), best of somebody who stands.")],
    output: Annotated[Path, typer.Option("-o", "--output", help="File to write (.toml); not one that exists.")],
) -> None:
    """Write a draft of a marker set from a recording's names and from where its markers lie.

    Each line says how sure it is and why. Nothing is asked; what is missing for each model is listed at once.
    """
    from dynakin.model.calibration.needs import in_words, missing
    from dynakin.model.definition import available_models, load_built_in_or_toml
    from dynakin.model.markers.anatomy import anatomy
    from dynakin.model.markers.draft.draft import guess_markers
    from dynakin.model.markers.draft.guess import toml_text
    from dynakin.model.markers.marker_set import load_marker_set
    from dynakin.recordings.read import read

    if output.suffix != ".toml":
        raise ConfigError(f"{output}: expected a name that ends in .toml")
    if output.exists():
        raise ConfigError(f"{output}: exists already, expected another name (it may have been edited)")
    recording = read(trial)
    guesses = guess_markers(recording)
    if not any(guess.place for guess in guesses):
        raise ConfigError(
            f"{trial}: neither names nor places of the {len(guesses)} markers say what they are; expected a trial in "
            "which the person stands still (the same set), or names that say more"
        )
    text = toml_text(guesses, output.stem, trial.name)
    write_text(output, text, ConfigError)
    load_marker_set(output)
    console = out()
    used = [guess for guess in guesses if guess.place or guess.segment in anatomy()["clusters"]]
    counts = Counter(guess.sure for guess in used)
    console.print(
        f"{output}: {len(used)} of {len(guesses)} markers ({counts['sure']} sure, {counts['likely']} likely, "
        f"{counts['unsure']} unsure).",
        soft_wrap=True,
    )
    doubtful = [f"{g.recorded} ({g.place or g.segment}: {g.why})" for g in used if g.sure == "unsure"]
    unknown = [guess.recorded for guess in guesses if guess not in used]
    for what, those in (("Unsure", doubtful), ("Unknown, not used", unknown)):
        if those:
            console.print(f"{what}: {'; '.join(those)}.", soft_wrap=True)
    there = {side: {g.place for g in used if g.place and g.side == side} for side in ("right", "left", "centre")}
    marked = {str(g.segment or anatomy()["places"].get(g.place, {}).get("segment", "")) for g in used}
    for name in available_models():
        lacks = missing(load_built_in_or_toml(name).model, there, marked)
        if not lacks:
            console.print(f"Model {name}: nothing is missing.")
            continue
        wants: dict[str, list[str]] = {}
        for need, side in lacks:
            wants.setdefault(f"{need.landmark.replace('_', ' ')}: {in_words(need)}", []).append(side)
        words = "; ".join(f"{' and '.join(filter(None, sides))} {what}".strip() for what, sides in wants.items())
        console.print(f"Model {name} lacks {words}.", soft_wrap=True)
    command = f"dynakin run {quote(str(trial))} --markers {quote(str(output))} -o OUT"
    console.print(f"Next: look at {output}, then {command}", soft_wrap=True)
