"""Which places of the body a model needs marked: derived from its file and the landmarks that all marker sets share."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from itertools import product
from typing import Any

from dynakin.model.calibration.posture import frame_landmarks
from dynakin.model.markers.anatomy import anatomy
from dynakin.model.markers.schema import Recipe
from dynakin.model.mirroring import SUFFIXES
from dynakin.model.schema import ModelFile

_MOST_WAYS = 300  # of one landmark: of those that others start from the first are enough


@dataclass(frozen=True)
class Need:
    """A landmark of a model: segments that need it, whether these do without (by proportions), whether each side has
    its own; ways: the places that give it, the first that are there are taken."""

    landmark: str
    segments: tuple[str, ...]
    optional: bool
    sided: bool
    ways: tuple[frozenset[str], ...]


def needs(model: ModelFile) -> list[Need]:
    """What the segments' frames and joints need, in the order of the model."""
    shared = anatomy()
    recipes = {**shared["landmarks"], **(shared["in_space"] if model.sided else {})}
    fixed = {c.name for c in model.coordinates if c.locked and not c.as_measured}
    found: dict[str, tuple[list[str], bool, bool]] = {}
    for segment in model.segments:
        if segment.axes and all(axis.coordinate in fixed for axis in segment.axes):
            continue  # its pose follows from its parent's
        for name in frame_landmarks(segment):
            suffix = next((end for end in SUFFIXES.values() if name.endswith(end) and name not in recipes), "")
            plain = name.removesuffix(suffix)
            if plain not in recipes:
                continue  # the floor
            owner = segment.name.removesuffix(SUFFIXES.get(segment.side or "", ""))
            # of models in space all but the root is completed from proportions (`completion`)
            optional = segment.without_markers is not None or segment.when_marked or segment.parent != "ground"
            optional = optional if model.sided else segment.without_markers is not None
            segments, was_optional, sided = found.get(plain, ([], True, False))
            found[plain] = (
                list(dict.fromkeys([*segments, owner])), optional and was_optional, sided or bool(suffix)
            )  # fmt: skip
    return [
        Need(name, tuple(segments), optional, sided, tuple(_ways(name, recipes, shared["places"])))
        for name, (segments, optional, sided) in found.items()
    ]


def lacking(model: ModelFile, there: Mapping[str, Collection[str]]) -> list[tuple[Need, str]]:
    """Needs that no way meets, and the side ("" for the middle or a model of one side).

    Args:
        there: places that are marked, by side: "right", "left", "centre".
    """
    found = []
    for need in needs(model):
        middle = set(there.get("centre", ()))
        sides = {side: middle | set(there.get(side, ())) for side in ("right", "left")}
        if not need.sided:
            either = sides.values() if not model.sided else [sides["right"] & sides["left"]]
            if not any(way <= marked for way in need.ways for marked in either):
                found.append((need, ""))
            continue
        found += [(need, side) for side, marked in sides.items() if not any(way <= marked for way in need.ways)]
    return found


def missing(model: ModelFile, there: Mapping[str, Collection[str]], marked: Collection[str]) -> list[tuple[Need, str]]:
    """Of what is `lacking` that for want of which the model is refused: in the plane also what a segment can do without
    only as long as nothing is marked on it (`find_locks`).

    Args:
        marked: parts of the body with a marker.
    """
    bearing = {s.name for s in model.segments if {s.name, *s.parts, *s.takes_markers_of} & set(marked)}
    return [
        (need, side)
        for need, side in lacking(model, there)
        if not need.optional or (not model.sided and bearing & set(need.segments))
    ]


def in_words(need: Need, most: int = 3) -> str:
    """The ways as text: "KNE + KNM, or KJC"."""
    short = sorted(need.ways, key=len)[:most]
    text = ", or ".join(" + ".join(sorted(way)) for way in short)
    return text + (", or others" if len(need.ways) > most else "")


def _ways(name: str, recipes: Mapping[str, Any], places: Collection[str]) -> list[frozenset[str]]:
    if name in places and name not in recipes:
        return [frozenset({name})]
    found: list[frozenset[str]] = []
    for raw in recipes.get(name, ()):
        parts = [_ways(source, recipes, places) for source in Recipe.model_validate(raw).inputs]
        for chosen in product(*parts):
            way = frozenset().union(*chosen)
            if not any(known <= way for known in found):
                found = [known for known in found if not way < known] + [way]
            if len(found) >= _MOST_WAYS:
                return found
    return found
