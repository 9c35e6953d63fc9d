"""Limbs that a model file writes once and that a person has twice: ``mirrored = true``.

An entry so marked stands for two, ``_r`` and ``_l``. It is written for the right side; on the left, places and
translations turn their z, rotation axes their x and y, and axes of frames along z run the other way (lateral is -Z).
"""

from __future__ import annotations

from typing import Any

SIDES = ("right", "left")
OTHER_SIDE = {"right": "left", "left": "right"}
SUFFIXES = {"right": "_r", "left": "_l"}


def mirrored(data: dict[str, Any]) -> dict[str, Any]:
    """A model file's content with each mirrored coordinate, length and segment written out for both sides.

    What is not of the expected shape is left as it is: the schema's own checks say so.
    """
    lists = ("lengths", "coordinates", "segments")
    entries = {key: [e for e in data.get(key, ()) if isinstance(e, dict)] for key in lists}
    if not any(entry.get("mirrored") for found in entries.values() for entry in found):
        return data
    twice = {key: {str(e.get("name")) for e in found if e.get("mirrored")} for key, found in entries.items()}
    result = dict(data)
    for key in lists:
        written: list[Any] = []
        for entry in data.get(key, ()):
            if not isinstance(entry, dict) or "mirrored" not in entry:
                written.append(entry)
                continue
            plain = {k: v for k, v in entry.items() if k != "mirrored"}
            if entry["mirrored"] is not True:
                written.append(plain)
                continue
            written += [_ONE_SIDE[key](plain, side, twice) for side in SUFFIXES]
        result[key] = written
    return result


def _named(entry: dict[str, Any], side: str) -> dict[str, Any]:
    return {**entry, "name": f"{entry.get('name')}{SUFFIXES[side]}"}


def _coordinate(entry: dict[str, Any], side: str, twice: dict[str, set[str]]) -> dict[str, Any]:
    return _named(entry, side)


def _length(entry: dict[str, Any], side: str, twice: dict[str, set[str]]) -> dict[str, Any]:
    own = _named(entry, side)
    if isinstance(own.get("between"), list):
        own["between"] = [f"{name}{SUFFIXES[side]}" for name in own["between"]]
    return own


def _segment(entry: dict[str, Any], side: str, twice: dict[str, set[str]]) -> dict[str, Any]:
    suffix, left = SUFFIXES[side], side == "left"

    def own(name: Any, kind: str) -> Any:
        return f"{name}{suffix}" if name in twice[kind] else name

    found = {**_named(entry, side), "side": side}
    if "parent" in found:
        found["parent"] = own(found["parent"], "segments")
    if isinstance(found.get("origin"), str):
        found["origin"] += suffix
    if isinstance(found.get("frame"), dict):
        found["frame"] = {k: _pair(k, v, suffix, left) for k, v in found["frame"].items()}
    if isinstance(found.get("without_markers"), dict):
        rule = found["without_markers"]
        found["without_markers"] = {**rule, "lock_to": own(rule.get("lock_to"), "segments")}
    for key in ("translation", "straight"):
        if key in found and left:
            found[key] = _place(found[key])
    if "rotation" in found and left:
        found["rotation"] = [
            [(-v if (i == 2) != (j == 2) else v) for j, v in enumerate(row)] for i, row in enumerate(found["rotation"])
        ]
    found["placement"] = [
        {**term, "length": own(term.get("length"), "lengths")}
        | ({"direction": _place(term["direction"])} if left and "direction" in term else {})
        for term in found.get("placement", ())
    ]
    found["axes"] = [
        {
            **axis,
            "coordinate": own(axis.get("coordinate"), "coordinates"),
            "scale": own(axis.get("scale", ""), "lengths"),
        }
        | ({"direction": _axis(axis)} if left else {})
        for axis in found.get("axes", ())
    ]
    return found


_ONE_SIDE = {"coordinates": _coordinate, "lengths": _length, "segments": _segment}


def _pair(axis: str, pair: Any, suffix: str, left: bool) -> Any:
    if axis == "main" or not isinstance(pair, list):
        return pair
    names = [f"{name}{suffix}" for name in pair]
    return names[::-1] if left and axis == "z" else names


def _place(vector: Any) -> Any:
    return [vector[0], vector[1], -vector[2]] if isinstance(vector, list) and len(vector) == 3 else vector


def _axis(axis: dict[str, Any]) -> Any:
    """A rotation is turned by the mirror as a pseudo-vector, a translation as a place."""
    direction = axis.get("direction", [0.0, 0.0, 1.0])
    if axis.get("kind", "rotation") == "translation":
        return _place(direction)
    if isinstance(direction, list) and len(direction) == 3:
        return [-direction[0], -direction[1], direction[2]]
    return direction
