"""What a marker's name says of its place: names of the built-in sets, usual abbreviations, words."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any, Literal

from dynakin.errors import ModelError
from dynakin.model.markers.anatomy import anatomy, standing_at
from dynakin.model.markers.marker_set import available_marker_sets, load_marker_set
from dynakin.model.markers.match import letters_of_sides
from dynakin.model.markers.sides import LONG_SIDE_WORDS, SHORT_SIDE_WORDS
from dynakin.recordings.landmarks import plain_name
from dynakin.settings.strict import read_toml

Sure = Literal["sure", "likely", "unsure"]

_FILE = resources.files("dynakin.model") / "markers" / "draft" / "places.toml"
_FRENCH = ("cuisse", "jambe", "pied")
# Segments whose clusters are named after them, longest word first.
_SEGMENTS = {
    "thigh": ("oberschenkel", "upperleg", "thigh", "femur", "cuisse", "muslo", "coscia", "uleg", "tgh", "thi", "th"),
    "shank": ("unterschenkel", "lowerleg", "shank", "tibia", "jambe", "gamba", "calf", "shin", "lleg", "leg", "tib",
              "sha", "shk", "sk", "sh"),
    "foot": ("midfoot", "foot", "fuss", "pied"),
    "pelvis": ("pelvis", "becken", "bassin", "pelv", "pel", "sacrum", "sacral", "sacr", "sac"),
    "upper_arm": ("upperarm", "oberarm", "humerus", "deltoid", "triceps", "biceps", "bicep", "uparm", "uarm",
                  "upa", "arm"),
    "forearm": ("handgelenk", "poignet", "wrist", "lowerarm", "unterarm", "forearm", "farm", "larm", "frm", "fra"),
    "hand": ("finger", "thumb", "hand", "fin", "mcp", "hnd"),
    "thorax": ("thorax", "trunk", "torso", "chest", "rib", "trnk"),
    "head": ("head", "kopf", "tete"),
}  # fmt: skip
_MIDDLE = ("pelvis", "thorax", "head")
"""Segments that the body has once: a name without a side lacks none."""
_CENTRES = {
    "hip": "HJC",
    "knee": "KJC",
    "ankle": "AJC",
    "shoulder": "SJC",
    "h": "HJC",
    "k": "KJC",
    "a": "AJC",
    "s": "SJC",
}
_SKIN_OVER = {"KJ": "KNE", "AJ": "ANK"}
_CENTRE = re.compile(r"^(hip|knee|ankle|shoulder|[hkas])(jc|jointcent(?:er|re)|cent(?:er|re)|joint)(?:reg)?$")
_QUALIFIED = (
    r"(?:\d+|[a-d]|front|rear|back|top|bottom|upper|lower|up|low|lat|med|ant|post|sup|inf|prox|dist"
    r"|cluster|tracking|marker)*"
)


@dataclass(frozen=True)
class Said:
    """place of anatomy.toml, or else the segment on which it is one of a cluster; side None: the name has none."""

    place: str | None
    segment: str | None
    side: str | None
    sure: Sure
    why: str


@cache
def places() -> dict[str, Any]:
    """The contents of places.toml."""
    return read_toml(Path(str(_FILE)))


@cache
def _sets() -> dict[str, set[tuple[str | None, str | None, str]]]:
    """Plain name -> what built-in sets have under it: place or None, segment of a cluster or None, side."""
    found: dict[str, set[tuple[str | None, str | None, str]]] = {}
    for name in available_marker_sets():
        try:
            markers = load_marker_set(name).markers
        except ModelError:
            continue
        for marker in markers:
            place = marker.name if marker.name in anatomy()["places"] else None
            for side in ("right", "left", "centre"):
                for alias in marker.aliases(side):
                    found.setdefault(plain_name(alias), set()).add((place, None if place else marker.segment, side))
    return found


def said(name: str) -> Said | None:
    """What a name says, None where it says nothing."""
    known = _sets().get(plain_name(name), set())
    if len(known) == 1:
        place, segment, side = next(iter(known))
        return Said(place, segment or None, side, "sure", "name of a built-in set")
    for own_side, rest in _readings(name):
        place = _place(rest)
        if place is not None:
            centre = place in standing_at() and standing_at()[place][0][2] == 0.0
            if centre and own_side is not None:  # off the middle: a clavicle's own marker
                segment = anatomy()["places"][place].get("segment")
                return Said(None, segment, own_side, "likely", f"its name: {rest}, on one side")
            return Said(place, None, "centre" if centre else own_side, "likely", f"its name: {rest}")
        segment = _segment(rest)
        if segment is not None:
            where = own_side or ("centre" if segment in _MIDDLE else None)
            return Said(None, segment, where, "likely", f"its name: {rest}")
    return None


def said_together(names: Iterable[str]) -> dict[str, Said]:
    """What names say that stand in one recording, those that say something.

    Beside markers on the pelvis' skin (`worn`), names that markerless systems give to joint centres (RKnee) are those
    of markers on the skin; a hip's may be anywhere between trochanter and crest.
    """
    own_names = tuple(names)
    letters = letters_of_sides(own_names)
    read = {name: letters.english.get(name, name) if letters else name for name in own_names}
    found = {name: own for name in own_names if (own := said(read[name])) is not None}
    if not worn(own.place for own in found.values()):
        return found
    skin = {name: replace(own, place=_SKIN_OVER.get(own.place or "", own.place)) for name, own in found.items()}
    return {name: own for name, own in skin.items() if own.place != "HJ"}


def worn(said_places: Iterable[str | None]) -> bool:
    """Whether who has these places named wears markers: on the pelvis, and not beside the joint centres of a system
    that needs none."""
    there = set(said_places)
    return bool(there & {"ASI", "PSI"}) and not {"KJ", "KNE"} <= there


def sided(name: str) -> tuple[str | None, str]:
    """Side and rest of a name by its likeliest reading."""
    return _readings(name)[0]


def on_foot(name: str) -> str | None:
    """The side of the foot on which a marker of this name lies; None where it says none."""
    found = said(name)
    if found is None or found.side not in ("right", "left"):
        return None
    segment = found.segment if found.place is None else anatomy()["places"][found.place].get("segment")
    return found.side if segment in ("foot", "toes") else None


def _readings(name: str) -> list[tuple[str | None, str]]:
    """Ways to part a name into a side and a rest, the likeliest first."""
    letters = unicodedata.normalize("NFKD", name.rsplit(":", 1)[-1].replace("ß", "ss"))
    last = "".join(c for c in letters if not unicodedata.combining(c))  # Knöchel, malléole
    tokens = [t.casefold() for t in re.findall(r"[^\W\d_]?[a-z]+|[A-Z]+(?![a-z])|\d+", last)]
    found: list[tuple[str | None, str]] = []
    for side, words in LONG_SIDE_WORDS.items():
        for k in (0, len(tokens) - 1, *range(1, len(tokens) - 1)):
            if len(tokens) > 1 and tokens[k] in words:
                found.append((side, "".join(tokens[:k] + tokens[k + 1 :])))
    whole = "".join(tokens)
    for side, words in LONG_SIDE_WORDS.items():
        for word in words:
            if len(word) > 2 and whole.startswith(word) and len(whole) > len(word):
                found.append((side, whole[len(word) :]))
            if len(word) > 2 and whole.endswith(word) and len(whole) > len(word):
                found.append((side, whole[: -len(word)]))
    for side in ("right", "left"):
        if len(whole) > 1 and whole[0] == side[0]:
            found.append((side, whole[1:]))
    for side, words in SHORT_SIDE_WORDS.items():
        for k in {0, len(tokens) - 1}:
            rest = "".join(tokens[:k] + tokens[k + 1 :])
            if len(tokens) > 1 and tokens[k] in words and (len(tokens[k]) > 1 or rest in _FRENCH or _place(rest)):
                found.append((side, rest))
    found.append((None, whole))
    for side in ("right", "left"):
        if len(whole) > 2 and whole[-1] == side[0]:
            found.append((side, whole[:-1]))
    return found


def _place(rest: str) -> str | None:
    """The place of anatomy.toml that a name without its side says."""
    centre = _CENTRE.match(rest)
    if centre:
        return _CENTRES[centre.group(1)]
    exact = [place for place, about in places().items() if rest in about["names"] or rest == place.casefold()]
    if len(exact) == 1:
        return exact[0]
    best: tuple[int, list[str]] = (0, [])
    for place, about in places().items():
        for words in about["words"]:
            wanted = [word for word in words if not word.startswith("!")]
            if all(word in rest for word in wanted) and not any(w[1:] in rest for w in words if w.startswith("!")):
                weight = sum(map(len, wanted))
                if weight >= best[0]:
                    best = (weight, [*(best[1] if weight == best[0] else []), place])
    return best[1][0] if len(set(best[1])) == 1 else None


def _segment(rest: str) -> str | None:
    """The segment whose cluster a name without its side says."""
    for segment, words in _SEGMENTS.items():
        if any(re.fullmatch(word + _QUALIFIED, rest) for word in words):
            return segment
    return None
