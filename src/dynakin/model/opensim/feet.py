"""The bodies of an OpenSim model on which the ground acts."""

from __future__ import annotations

from collections.abc import Mapping

from dynakin.errors import ModelError
from dynakin.model.markers.draft.by_name import on_foot, sided
from dynakin.model.mirroring import SIDES
from dynakin.model.opensim.description import GROUND, OpenSimModel
from dynakin.settings.strict import nearest

_HEEL = ("calcn", "calc", "hindfoot", "rearfoot", "heel")  # that has no other foot before it
_FOOT = ("foot", "talus")  # a forefoot, or what carries the heel: only where no marker tells better


def feet_of(source: OpenSimModel, declared: Mapping[str, str] | None = None) -> tuple[dict[str, str], list[str]]:
    """ "right" and "left" -> the body that stands on the ground: as declared, by its name as a heel, by the foot's
    markers that the file has on it, by its name as a foot; and a sentence where markers tell. Empty of a model that
    stands on its root.

    Raises:
        ModelError: the feet of a model that does not stand on its root cannot be told, or what is declared is no foot.
    """
    if declared:
        return _checked(source, dict(declared)), []
    heels, feet = _by_name(source, _HEEL), _by_name(source, _FOOT)
    marked = {} if len(heels) == 2 else _by_markers(source)
    found = {side: heels.get(side) or marked.get(side) or feet.get(side) for side in SIDES}
    known = {side: body for side, body in found.items() if body}
    if len(known) == 2 and not _problem(source, known):
        said = [f"{body} ({side})" for side, body in known.items() if side not in heels and side in marked]
        return known, [f"Feet: {' and '.join(said)}, by the markers on them."] if said else []
    if _stands_on_root(source):
        return {}, []
    names = ", ".join(f"{body} as the {side} foot" for side, body in known.items()) or "neither foot"
    raise ModelError(
        f"{source.path}: found {names} among the bodies {', '.join(b.name for b in source.bodies)}, expected both: "
        "where the ground acts decides every moment. Name them under [opensim] of a configuration (.toml): "
        'feet = { right = "BODY", left = "BODY" }'
    )


def _checked(source: OpenSimModel, feet: dict[str, str]) -> dict[str, str]:
    names = [body.name for body in source.bodies]
    for side in SIDES:
        if feet.get(side) not in names:
            found = repr(feet[side]) + nearest(feet[side], names) if side in feet else "none"
            raise ModelError(f"{source.path}: opensim.feet: {side}: found {found}, expected one of {', '.join(names)}")
    if problem := _problem(source, feet):
        raise ModelError(f"{source.path}: opensim.feet: {problem}, expected the ends of two legs")
    return {side: feet[side] for side in SIDES}


def _problem(source: OpenSimModel, feet: Mapping[str, str]) -> str:
    right, left, tree = feet["right"], feet["left"], source.tree
    if right in tree.up(left) or left in tree.up(right):
        return f"found {right} and {left} on one leg"
    return "".join(f"found {body}, which hangs on nothing" for body in feet.values() if body in tree.roots)


def _by_name(source: OpenSimModel, words: tuple[str, ...]) -> dict[str, str]:
    """Side -> body, by the first word that bodies of both sides have, else by any; the one nearest to the root, and
    with mass where there is one: export puts massless ones into long chains."""
    found: dict[str, str] = {}
    light = {body.name for body in source.bodies if body.mass == 0.0}
    bodies = sorted((joint.child for joint in source.joints), key=light.__contains__)  # parents before their children
    for word in words:
        pair: dict[str, str] = {}
        for body in bodies:
            side, rest = sided(body)
            if side is not None and word in rest:
                pair.setdefault(side, body)
        if len(pair) == 2:
            return pair
        found = pair | found
    return found


def _by_markers(source: OpenSimModel) -> dict[str, str]:
    """Side -> the body nearest to the root most of whose markers are of that foot."""
    found: dict[str, str] = {}
    for joint in source.joints:
        sides = [on_foot(marker.name) for marker in source.markers if marker.body == joint.child]
        for side in SIDES:
            if 2 * sides.count(side) > len(sides):
                found.setdefault(side, joint.child)
    return found


def _stands_on_root(source: OpenSimModel) -> bool:
    """Whether it is fixed in the ground by what stands on it: its root goes nowhere, and one chain goes up from it."""
    roots = [joint for joint in source.joints if joint.parent == GROUND]
    root = roots[0]
    moving = {axis.coordinate for axis in root.axes if axis.kind == "translation" and axis.coordinate}
    driven = {coupler.dependent for coupler in source.couplers}
    free = [c.name for c in root.coordinates if c.name in moving and not c.locked and c.name not in driven]
    carriers = {joint.parent for joint in source.joints}
    chains = [joint for joint in source.joints if joint.parent == root.child and joint.child in carriers]
    return len(roots) == 1 and not free and len(chains) <= 1
