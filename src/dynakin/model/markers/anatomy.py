"""Places of the body that marker sets share: a set that names them gets their numbers and their landmarks."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from dynakin.settings.strict import nearest, read_toml

_FOLDER = resources.files("dynakin.model") / "markers"
_NO_MARKERS = ("description", "at", "at_sd")
"""Keys of a place that say what and where it is, and nothing of a marker there."""
_SIDED = re.compile(r"\{([^{},]*),([^{},]*)\}")


@cache
def anatomy() -> dict[str, Any]:
    """Contents of anatomy.toml: ``places``, ``clusters``, ``units``, ``landmarks``, ``in_space``, keys of a set."""
    return read_toml(Path(str(_FOLDER / "anatomy.toml")))


@cache
def standing_at() -> dict[str, tuple[npt.NDArray[np.float64], float]]:
    """Place, or segment of a cluster -> where it lies on a standing adult, (3,), right side, and its deviation, over
    the height; those that anatomy.toml gives."""
    both = {**anatomy()["places"], **anatomy()["clusters"]}
    return {name: (np.array(about["at"]), float(about["at_sd"])) for name, about in both.items() if "at" in about}


def sided(pattern: str) -> dict[str, str]:
    """Names in recordings by side: "{R,L}KNE" is RKNE on the right and LKNE on the left, a plain name in the centre.

    Raises:
        ValueError: braces that do not hold a right and a left spelling.
    """
    if not re.search(r"[{}]", pattern):
        return {"centre": pattern}
    names = {"right": _SIDED.sub(r"\1", pattern), "left": _SIDED.sub(r"\2", pattern)}
    if re.search(r"[{}]", names["right"]) or names["right"] == names["left"]:
        raise ValueError(f'{pattern!r}: expected a plain name, or right and left in braces, such as "{{R,L}}KNE"')
    return names


def expanded(data: Mapping[str, Any]) -> dict[str, Any]:
    """A marker set's file with its places and clusters written out as markers, and the landmarks that follow.

    What the file gives itself stands: its own numbers and markers, its own recipes for a landmark instead. With
    ``extends`` the places and clusters of a built-in set come first; a place that is given here stands instead, one
    without names is left out.

    Raises:
        ValueError: a place or segment that anatomy.toml does not have, or no such set to extend (the nearest is named),
            or a wrong name pattern.
    """
    shared = anatomy()
    if "extends" in data:
        data = _extended(data)
    rest = {key: value for key, value in data.items() if key not in ("places", "clusters")}
    if "places" not in data:
        return rest  # a set that gives all of itself
    markers: list[Any] = []
    for place, names in data["places"].items():
        known = shared["places"].get(place)
        if known is None:
            raise ValueError(
                f"places: {place!r} is no place of the body{nearest(place, shared['places'])}; expected "
                f"{', '.join(shared['places'])}"
            )
        markers.append({"name": place, **_of_marker(known), **_entry(names)})
    for segment, names in data.get("clusters", {}).items():
        if segment not in shared["clusters"]:
            raise ValueError(
                f"clusters: {segment!r} is no segment{nearest(segment, shared['clusters'])}; expected "
                f"{', '.join(shared['clusters'])}"
            )
        for entry in names:
            given = _entry(entry)
            patterns = _patterns(entry)
            if not patterns and "name" not in given:
                raise ValueError(f"clusters: {segment}: a marker without names")
            name = _SIDED.sub("", patterns[0]).strip("._- ") if patterns else given["name"]
            markers.append({"name": name, "segment": segment, **_of_marker(shared["clusters"][segment]), **given})
    homes = list(dict.fromkeys(m.get("segment", "") for m in markers))
    clustered = [m for m in markers if m["name"] not in data["places"]]  # each after the places of its segment
    placed = [m for m in markers if m["name"] in data["places"]]
    for home in homes:
        last = max((k for k, m in enumerate(placed) if m.get("segment") == home), default=len(placed) - 1)
        placed[last + 1 : last + 1] = [m for m in clustered if m.get("segment") == home]
    rest["markers"] = [*placed, *rest.get("markers", ())]
    there = {marker["name"] for marker in rest["markers"] if isinstance(marker, dict) and "name" in marker}
    own = {key: rest.get(key, {}) for key in ("landmarks", "in_space")}
    plain = _possible({**shared["landmarks"], **own["landmarks"]}, there, own["landmarks"])
    both = _possible({**plain, **shared["in_space"], **own["in_space"]}, there, {**own["landmarks"], **own["in_space"]})
    rest["landmarks"] = plain
    rest["in_space"] = {name: both[name] for name in (*shared["in_space"], *own["in_space"]) if name in both}
    for key in ("heel_toe", "pelvis_back_front"):
        pair = next((pair for pair in shared[key] if set(pair) <= there), None)
        if pair is not None:
            rest.setdefault(key, pair)
    if shared["height_marker"] in there and "height_marker" not in rest:
        rest |= {key: shared[key] for key in ("height_marker", "height_fraction", "height_source")}
    return rest


def enlarged(data: Mapping[str, Any], more: Mapping[str, Any]) -> dict[str, Any]:
    """A marker set's file with further names of places and further markers of clusters, which come last."""
    data = _extended(data) if "extends" in data else data
    places, clusters = dict(data["places"]), dict(data.get("clusters", {}))
    for place, names in more["places"].items():
        places[place] = _with_names(places.get(place, ()), names)
    for segment, entries in more["clusters"].items():
        clusters[segment] = [*clusters.get(segment, ()), *entries]
    return {**data, "places": places, "clusters": clusters}


def _with_names(given: str | Iterable[str] | Mapping[str, Any], more: Mapping[str, list[str]]) -> dict[str, Any]:
    """What a file gives of a place, and more names by side."""
    entry = _entry(given)
    return entry | {side: [*entry.get(side, ()), *names] for side, names in more.items()}


def _extended(data: Mapping[str, Any]) -> dict[str, Any]:
    """A set's contents on top of those of the built-in one that it extends."""
    folder, base = _FOLDER / "sets", data["extends"]
    known = sorted(entry.name.removesuffix(".toml") for entry in folder.iterdir() if entry.name.endswith(".toml"))
    if base not in known:
        raise ValueError(
            f"extends: {base!r} is no built-in set{nearest(str(base), known)}; expected {', '.join(known)}"
        )
    below = read_toml(Path(str(folder / f"{base}.toml")))
    if "extends" in below:
        raise ValueError(f"extends: {base!r} extends another set itself; expected one that stands alone")
    own = {key: value for key, value in data.items() if key != "extends"}
    for key in ("places", "clusters"):
        merged = {**below.get(key, {}), **own.get(key, {})}
        own[key] = {name: names for name, names in merged.items() if names}
    return {**{key: value for key, value in below.items() if key not in ("description", "source")}, **own}


def _of_marker(about: Mapping[str, Any]) -> dict[str, Any]:
    """What a place or cluster says of a marker on it."""
    return {key: value for key, value in about.items() if key not in _NO_MARKERS}


def _entry(given: str | Iterable[str] | Mapping[str, Any]) -> dict[str, Any]:
    """Keys of a marker from its names, or from ``names`` and other numbers than the shared ones."""
    found = {key: value for key, value in given.items() if key != "names"} if isinstance(given, Mapping) else {}
    for pattern in _patterns(given):
        for side, name in sided(pattern).items():
            found.setdefault(side, []).append(name)
    return found


def _patterns(given: str | Iterable[str] | Mapping[str, Any]) -> tuple[str, ...]:
    """The name patterns of a place or of a cluster's marker."""
    names = given.get("names", ()) if isinstance(given, Mapping) else given
    return (names,) if isinstance(names, str) else tuple(names)


def _possible(landmarks: Mapping[str, Any], markers: set[str], own: Mapping[str, Any]) -> dict[str, Any]:
    """Recipes without those of the shared ones that need a place or landmark which the set does not have."""
    kept = {
        name: [(recipe, set() if name in own else _needs_of_shared()[id(recipe)]) for recipe in recipes]
        for name, recipes in landmarks.items()
    }
    while True:
        known = markers | set(kept)
        fits = {name: [each for each in recipes if each[1] <= known] for name, recipes in kept.items()}
        next_kept = {name: recipes for name, recipes in fits.items() if recipes}
        if sum(map(len, next_kept.values())) == sum(map(len, kept.values())):
            return {name: [recipe for recipe, _ in recipes] for name, recipes in next_kept.items()}
        kept = next_kept


@cache
def _needs_of_shared() -> dict[int, set[str]]:
    """By the recipe's identity: thirty sets and more are looked at for each recording, with the same recipes."""
    shared = anatomy()
    both = (*shared["landmarks"].values(), *shared["in_space"].values())
    return {id(recipe): _needs(recipe) for recipes in both for recipe in recipes}


def _needs(recipe: Any) -> set[str]:
    """Markers and landmarks that a recipe as read from TOML starts from; of one of another shape nothing is asked."""
    if not isinstance(recipe, dict):
        return set()
    names: set[str] = set(recipe.get("mean", ()))
    for way, keys in (
        ("pelvis", ("asis", "psis")),
        ("polar", ("origin", "along", "scale")),
        ("fraction", ("between",)),
        ("offset", ("origin", "along", "asis", "foot", "square_to", "bend", "scale")),
        ("corner", ("arms", "asis")),
    ):
        given = recipe.get(way, {})
        for key in keys if isinstance(given, dict) else ():
            value = given.get(key, ())
            names |= {value} if isinstance(value, str) else set(value)
    return names - {""}
