"""Which place a marker may have by where it lies on a person who stands, regardless of its name."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np
import numpy.typing as npt
import scipy

from dynakin.arrays import Array
from dynakin.model.markers.anatomy import anatomy, standing_at
from dynakin.model.markers.draft.by_name import places

Node = tuple[str, str]
"""(place, side)."""

_HEIGHT_M, _HEIGHT_SD_M = 1.70, 0.15
_FLOOR_SD_M = 0.05  # soles, and a laboratory's floor that is not at zero
_HEIGHTS_M = np.arange(1.1, 2.15, 0.07)
_NO_PLACE = 14.0
"""Squared distance, in standard deviations, beyond which a marker has no place of the list."""
_TURNS = 4
_MIRRORED = 0.05  # of the height: how far from the mirror image of the other side's a marker may lie
_NAMED_ODD, _ARM = 0.12, 0.28  # of the height: how far from its place a marker may lie that its name says; on an arm
_LEAN, _LEG_OUT, _ARM_OUT, _ELBOW_BENT = 0.022, 0.10, 0.25, 0.50
"""Angles (rad) by which people in laboratories stand otherwise than anatomy.toml has it, forward and outward: of five
persons of four laboratories. Arms are held anywhere: theirs are means."""


@dataclass(frozen=True, eq=False)
class Stature:
    """A person's frame: places (M, 3) forward, up and to the right over the height; what lies where; cost: of the fit.

    nodes: (place, side) of each marker or None; margins: by how much the next best place fits worse, standard
    deviations squared.
    """

    scaled: Array
    height_m: float
    nodes: tuple[Node | None, ...]
    margins: Array
    cost: float


def fit_person(up: Array, named: Mapping[int, Node], forward: Array | None) -> Stature | None:
    """The frame and the assignment that fit best.

    Args:
        up: (M, 3) m, standing, second axis up. named: markers whose names say their place. forward: (2,) of the first
            and third axis where it is known (a person who walks).
    """
    if len(up) < 5:
        return None
    nodes, at, sd, rare = _template()
    index = {node: k for k, node in enumerate(nodes)}
    anchors = {k: index[node] for k, node in named.items() if node in index}
    lowest = float(up[:, 1].min()) - 0.012
    flat = up[:, [0, 2]]
    middle = np.median(flat, axis=0)
    if forward is not None:
        turns = [float(np.arctan2(forward[1], forward[0]))]
    else:
        ahead = _mirror_plane(up)
        turns = [angle + half for angle in ahead for half in (0.0, np.pi)]
    best: Stature | None = None
    for start in turns:
        for height in _HEIGHTS_M:
            turn, size, origin, floor = start, float(height), middle, lowest
            for _ in range(_TURNS):
                scaled = _scaled(up, turn, size, origin, floor)
                cost = _costs(scaled, at, sd, rare, anchors)
                rows, columns = scipy.optimize.linear_sum_assignment(
                    np.hstack([cost, np.full((len(up),) * 2, _NO_PLACE)])
                )
                hit = columns < len(nodes)
                if np.count_nonzero(hit) < 4:
                    break
                turn, size, origin, floor = _refit(up, at, sd, rows[hit], columns[hit])
            total = float(np.where(hit, cost[rows, np.minimum(columns, len(nodes) - 1)], _NO_PLACE).sum())
            total += ((size - _HEIGHT_M) / _HEIGHT_SD_M) ** 2
            total += ((floor - lowest) / _FLOOR_SD_M) ** 2
            if not 1.0 < size < 2.3 or (best is not None and total >= best.cost):
                continue
            found = [nodes[j] if j < len(nodes) else None for j in columns]
            others = cost.copy()
            others[rows[hit], columns[hit]] = np.inf
            own = np.where(hit, cost[rows, np.minimum(columns, len(nodes) - 1)], _NO_PLACE)
            margins = np.minimum(others.min(axis=1), _NO_PLACE) - own
            best = Stature(scaled, size, tuple(found), margins, total)
    return best


def lies_at(stature: Stature, marker: int, place: str) -> tuple[bool, str]:
    """Whether a marker lies where that place usually is, and on which side it lies."""
    x, y, z = stature.scaled[marker]
    side = "centre" if abs(z) < 0.015 else "right" if z > 0.0 else "left"
    about = places().get(place)
    if about is None:
        return True, side
    apart = np.array([x, y, abs(z)]) - _worn_at(place)
    limit = _ARM if about.get("loose") else max(_NAMED_ODD, 2.5 * float(np.linalg.norm(about["sd"])))
    return float(np.linalg.norm(apart)) < limit, side


def alike_on_both_sides(stature: Stature, marker: int) -> bool:
    """Whether the other side has a marker for the same place, and it lies there too; a place in the middle has none."""
    node = stature.nodes[marker]
    if node is None or node[1] == "centre":
        return node is not None
    mate = (node[0], "left" if node[1] == "right" else "right")
    if mate not in stature.nodes:
        return False
    apart = stature.scaled[stature.nodes.index(mate)] * [1.0, 1.0, -1.0] - stature.scaled[marker]
    return bool(np.linalg.norm(apart) < _MIRRORED)


def mirrored_node(stature: Stature, marker: int, margin: float) -> Node | None:
    """The place of the other side's marker that lies where this one's mirror image does, if it fits better than the
    next by ``margin`` and this side's is not taken."""
    firm = {node: k for k, node in enumerate(stature.nodes) if node is not None and stature.margins[k] >= margin}
    image = stature.scaled[marker] * [1.0, 1.0, -1.0]
    for (place, side), other in firm.items():
        own = (place, "left" if side == "right" else "right")
        if side != "centre" and own not in firm and np.linalg.norm(stature.scaled[other] - image) < 0.5 * _MIRRORED:
            return own
    return None


def segment_at(stature: Stature, marker: int) -> str | None:
    """The segment on which a marker lies, by its height and how far out it is."""
    _, y, z = stature.scaled[marker]
    out = abs(z)
    if y > 0.87:
        return "head"
    if y > 0.62:
        return "thorax" if out < 0.105 else "upper_arm" if y > 0.68 else "forearm"
    if y > 0.53:
        return "pelvis" if out < 0.115 else "forearm"
    if out > 0.19 and y > 0.35:
        return "hand" if y < 0.50 else "forearm"
    return "thigh" if y > 0.29 else "shank" if y > 0.055 else "foot"


@cache
def _worn_at(place: str) -> Array:
    """Where a place (3,) of the right side is on people as they stand: feet apart, arms away from the body."""
    known, units = standing_at(), anatomy()["units"]
    at = known[place][0]
    leg = any(place in units[unit] for unit in ("thigh", "shank", "foot"))
    arm = any(place in units[unit] for unit in ("upper_arm", "forearm"))
    if leg and place not in units["pelvis"]:
        at = _outward(at, known["HJC"][0], _LEG_OUT)
    if arm and place not in units["trunk"]:
        if place not in units["upper_arm"]:
            (x, y, z), c, s = at - known["EJC"][0], np.cos(_ELBOW_BENT), np.sin(_ELBOW_BENT)
            at = known["EJC"][0] + np.array([c * x - s * y, s * x + c * y, z])
        at = _outward(at, known["SJC"][0], _ARM_OUT)
    return np.asarray(at + np.array([_LEAN * at[1], 0.0, 0.0]))


def _outward(at: Array, joint: Array, angle: float) -> Array:
    """A place (3,) of the right side where a limb is held away from the body by an angle (rad)."""
    (x, y, z), c, s = at - joint, np.cos(angle), np.sin(angle)
    return np.asarray(joint + np.array([x, c * y + s * z, c * z - s * y]))


def _template() -> tuple[list[Node], Array, Array, Array]:
    nodes: list[Node] = []
    at, sd, rare = [], [], []
    for place, about in places().items():
        if about.get("by_name_only"):
            continue
        x, y, z = _worn_at(place)
        for side, sign in (("centre", 0.0),) if z == 0.0 else (("right", 1.0), ("left", -1.0)):
            nodes.append((place, side))
            at.append([x, y, sign * z])
            sd.append(about["sd"])
            rare.append(about.get("rare", 0.0))
    return nodes, np.array(at), np.array(sd), np.array(rare)


def _scaled(up: Array, turn: float, size: float, origin: Array, floor: float) -> Array:
    ahead = np.array([np.cos(turn), np.sin(turn)])
    flat = up[:, [0, 2]] - origin
    return np.stack([flat @ ahead, up[:, 1] - floor, flat @ np.array([-ahead[1], ahead[0]])], axis=1) / size


def _costs(scaled: Array, at: Array, sd: Array, rare: Array, anchors: Mapping[int, int]) -> Array:
    cost = np.asarray((((scaled[:, None] - at) / sd) ** 2).sum(axis=2) + rare)
    for marker, node in anchors.items():
        own = min(cost[marker, node], 0.5 * _NO_PLACE)
        cost[marker], cost[:, node] = 1e3, 1e3
        cost[marker, node] = own
    return cost


def _refit(
    up: Array, at: Array, sd: Array, rows: npt.NDArray[np.intp], columns: npt.NDArray[np.intp]
) -> tuple[float, float, Array, float]:
    """Turn (rad), size (m), origin (2,) m and height of the floor (m) by least squares of what is assigned."""
    weight = 1.0 / np.linalg.norm(sd[columns], axis=1) ** 2
    weight = weight / weight.sum()
    ours, theirs = up[rows], at[columns]
    p = ours[:, 0] + 1j * ours[:, 2]  # forward is 1, right is i
    q = theirs[:, 0] + 1j * theirs[:, 2]
    p_mean, q_mean = weight @ p, weight @ q
    turn = float(np.angle(np.sum(weight * (p - p_mean) * np.conj(q - q_mean))))
    flat = float(np.sum(weight * np.real((p - p_mean) * np.conj(q - q_mean) * np.exp(-1j * turn))))
    up_mean, at_mean = float(weight @ ours[:, 1]), float(weight @ theirs[:, 1])
    upward = theirs[:, 1] - at_mean
    size = (flat + float(weight @ ((ours[:, 1] - up_mean) * upward))) / float(
        np.sum(weight * np.abs(q - q_mean) ** 2) + weight @ upward**2
    )
    origin = p_mean - size * np.exp(1j * turn) * q_mean
    return turn, size, np.array([origin.real, origin.imag]), up_mean - size * at_mean


def _mirror_plane(up: Array) -> list[float]:
    """Directions (rad) along the planes about which the markers are most alike on both sides."""
    scores = []
    angles = np.deg2rad(np.arange(0.0, 180.0, 4.0))
    flat = up[:, [0, 2]]
    for angle in angles:
        along = np.array([np.cos(angle), np.sin(angle)])
        side = flat @ np.array([-along[1], along[0]])
        points = np.stack([flat @ along, up[:, 1], side], axis=1)
        alike: list[float] = []
        for offset in np.median(side) + np.arange(-0.05, 0.051, 0.0125):
            mirrored = points * [1.0, 1.0, -1.0] + [0.0, 0.0, 2.0 * offset]
            apart = np.linalg.norm(points[:, None] - mirrored[None], axis=2).min(axis=1)
            alike.append(float(np.minimum(apart, 0.10).mean()))
        scores.append(min(alike))
    first = int(np.argmin(scores))
    return [float(angles[first]), float(angles[first] + 0.5 * np.pi)]
