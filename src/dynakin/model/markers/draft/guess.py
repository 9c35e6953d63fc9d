"""What is guessed of a marker, and a drafted marker set made of such guesses: as data, and as the text of its file."""

from __future__ import annotations

import json
import re
from collections import defaultdict
from dataclasses import dataclass
from typing import Any

from dynakin.model.markers.anatomy import anatomy
from dynakin.model.markers.draft.by_name import Sure
from dynakin.recordings.landmarks import plain_name


@dataclass(frozen=True)
class Guess:
    """One marker of the recording. place: of anatomy.toml; else segment: of whose cluster it is; neither: unknown.
    side: "right", "left" or "centre"."""

    recorded: str
    place: str | None
    segment: str | None
    side: str
    sure: Sure
    why: str


def names_of(guesses: list[Guess]) -> dict[str, Any]:
    """Guesses as what a marker set's file has of ``places`` and ``clusters``, with names as they stand."""
    places_, clusters = contents(guesses)
    return {
        "places": {place: {g.side: [g.recorded] for g in own} for place, own in places_.items()},
        "clusters": {
            segment: [
                {"name": f"{segment}, {own[0].recorded}", **{g.side: [g.recorded] for g in own}} for _, own in entries
            ]
            for segment, entries in clusters.items()
        },
    }


def toml_text(guesses: list[Guess], name: str, source: str) -> str:
    """The marker set's file, with a comment on each line: how sure, and why."""
    lines = [
        f"# Draft of a marker set: `dynakin markers new` from {printable(source)}. Look at what is unsure, then:",
        "#   dynakin run TRIAL --markers THIS.toml -o OUT",
        "# Places are those of `dynakin markers places`; {right,left} in braces, or a plain name in the middle.",
        "schema_version = 1",
        f"name = {_quoted(name)}",
        'description = "draft from a recording"',
        "",
        "[places]",
    ]
    places_, clusters = contents(guesses)
    lines += [f"{place} = {_toml(names_in_set(own))}  # {_comment(own)}" for place, own in places_.items()]
    if clusters:
        lines += ["", "# Markers that follow a segment and mark no place of it.", "[clusters]"]
    for segment, entries in clusters.items():
        lines += [f"{segment} = [", *(f"  {_toml(entry)},  # {_comment(pair)}" for entry, pair in entries), "]"]
    unknown = [g for g in guesses if not g.place and g.segment not in anatomy()["clusters"]]
    if unknown:
        lines += ["", "# Unknown, not used:", *(f"#   {printable(g.recorded)}: {g.why}" for g in unknown)]
    return "\n".join(lines) + "\n"


def contents(
    guesses: list[Guess],
) -> tuple[dict[str, list[Guess]], dict[str, list[tuple[dict[str, Any], list[Guess]]]]]:
    """Of a marker set's file: places, and by segment the entries of clusters; with the guesses behind each."""
    own = {place: [g for g in guesses if g.place == place] for place in anatomy()["places"]}
    clusters: dict[str, list[Guess]] = defaultdict(list)
    for guess in guesses:
        if not guess.place and guess.segment in anatomy()["clusters"]:
            clusters[str(guess.segment)].append(guess)
    entries: dict[str, list[tuple[dict[str, Any], list[Guess]]]] = {}
    for segment, followers in clusters.items():
        entries[segment] = []
        for k, pair in enumerate(_pairs(followers)):
            names = names_in_set(pair)
            entry = names if isinstance(names, dict) else {"names": names}
            entries[segment].append(({"name": f"{segment}{k + 1}", **entry}, pair))
    return {place: found for place, found in own.items() if found}, entries


def _pairs(own: list[Guess]) -> list[list[Guess]]:
    """Markers of a cluster, right and left together by their names' rest or, without one, by their order."""
    sides: dict[str, list[Guess]] = {side: [g for g in own if g.side == side] for side in ("right", "left", "centre")}
    pairs: list[list[Guess]] = []
    left = list(sides["left"])
    for right in sides["right"]:
        mate = next((g for g in left if rest_of(g.recorded) == rest_of(right.recorded)), left[0] if left else None)
        if mate is not None:
            left.remove(mate)
        pairs.append([right] if mate is None else [right, mate])
    return [*pairs, *([g] for g in left), *([g] for g in sides["centre"])]


def rest_of(name: str) -> str:
    """A name without what says its side."""
    return re.sub(r"right|left|^[rl]|[rl]$", "", plain_name(name))


def names_in_set(own: list[Guess]) -> str | dict[str, Any]:
    """The names of a place in a marker set's file: a pattern, or by side where they have what patterns use."""
    by_side = {g.side: g.recorded for g in own}
    plain = not any(set(",{}") & set(name) for name in by_side.values())
    if plain and set(by_side) == {"right", "left"}:
        return f"{{{by_side['right']},{by_side['left']}}}"
    if plain and set(by_side) == {"centre"}:
        return by_side["centre"]
    return {side: [name] for side, name in by_side.items()}


def _toml(entry: str | list[str] | dict[str, Any]) -> str:
    if isinstance(entry, str):
        return _quoted(entry)
    if isinstance(entry, list):
        return f"[{', '.join(map(_quoted, entry))}]"
    return "{ " + ", ".join(f"{key} = {_toml(value)}" for key, value in entry.items()) + " }"


def _comment(own: list[Guess]) -> str:
    parts = list(dict.fromkeys(f"{g.sure}: {printable(g.why)}" for g in own))
    return parts[0] if len(parts) == 1 else "; ".join(f"{g.side} {g.sure}: {printable(g.why)}" for g in own)


def is_text(name: str) -> bool:
    """Whether a name can be written (halves of a character, which programs hand over, cannot)."""
    return not any("\ud800" <= c <= "\udfff" for c in name)


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")  # which JSON allows and TOML does not


def printable(text: str) -> str:
    """A text of a recording as a line of a file can have it."""
    return "".join(c if c.isprintable() else "?" for c in text)
