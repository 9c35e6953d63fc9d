"""Postures in balance, from standing to the lowest point of a motion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from dynakin.arrays import Array, wrapped
from dynakin.errors import ConfigError
from dynakin.simulation.jets import Jet, polynomial
from dynakin.simulation.mechanics import Segment, at_rest

_DEGREE = 4  # of the balanced coordinate's polynomial: 0.1 deg from the exact balance over the whole path


@dataclass(frozen=True)
class PosturePath:
    """Angles as functions of a level, 0 standing and 1 lowest; one coordinate follows from balance.

    standing_deg, added_deg: angles while standing, and what the lowest posture adds, of all coordinates but the
    balanced one. arms: coordinates that follow a signal of their own. over_foot: where the centre of mass is
    kept at level 0 and at level 1, as a part of the way from the toe landmark (0) to the ankle (1).
    """

    standing_deg: Mapping[str, float]
    added_deg: Mapping[str, float]
    arms: frozenset[str] = frozenset({"shoulder", "elbow"})
    balanced: str = "hip"
    over_foot: tuple[float, float] = (0.65, 0.65)


def posture_jets(path: PosturePath, balanced: Array, level: Jet, arms: Jet) -> dict[str, Jet]:
    """Every coordinate of a path over time, from its level (T,) and the arms' own (T,); ``balanced``: the
    coefficients of `balance`."""
    jets = {path.balanced: polynomial(level, balanced)}
    for name, standing in path.standing_deg.items():
        signal = arms if name in path.arms else level
        jets[name] = float(np.deg2rad(path.added_deg[name])) * signal + float(np.deg2rad(standing))
    return jets


def full_change(tree: Sequence[Segment], path: PosturePath) -> dict[str, float]:
    """How far each coordinate goes (rad) from standing to the lowest posture."""
    change = {name: float(np.deg2rad(value)) for name, value in path.added_deg.items()}
    change[path.balanced] = float(np.sum(balance(tree, path)[1:]))
    return change


def balance(tree: Sequence[Segment], path: PosturePath) -> Array:
    """Coefficients of the balanced angle (rad) as a polynomial of the level that keeps the centre of mass over
    the foot.

    Raises:
        ConfigError: no angle brings the centre of mass over the foot.
    """
    levels = np.linspace(0.0, 1.0, 9)
    start, end = path.over_foot
    target = (start + (end - start) * levels) * ankle_x(tree)
    angle = balanced_angle(tree, path, levels, target)
    return np.asarray(np.polynomial.polynomial.polyfit(levels, angle, _DEGREE), dtype=float)


def balanced_angle(tree: Sequence[Segment], path: PosturePath, levels: Array, target: Array) -> Array:
    """The balanced angle (K,) rad that brings the centre of mass to x = ``target`` (K,) m at ``levels`` (K,).

    All that hangs above one hinge turns with it, so the centre of mass lies at x = a + b cos q + c sin q: three
    angles give a, b and c, and of the two solutions that one is taken where flexing brings the trunk forward.

    Raises:
        ConfigError: no angle does.
    """
    ahead, sideways, behind = (_com_x(tree, path, levels, angle) for angle in (0.0, 0.5 * np.pi, np.pi))
    a, b = 0.5 * (ahead + behind), 0.5 * (ahead - behind)
    c = sideways - a
    reach = (target - a) / np.hypot(b, c)
    if np.abs(reach).max() > 1.0:
        raise ConfigError(
            f"simulation: no {path.balanced} angle balances this subject over its feet; expected a subject nearer to "
            "the table (a smaller spread, or another seed)"
        )
    angle = np.arctan2(c, b) - np.arccos(reach)
    return wrapped(angle)


def ankle_x(tree: Sequence[Segment]) -> float:
    """Where the ankle lies while the foot is flat, m from the toe landmark (negative: behind it)."""
    return float(next(s for s in tree if s.name == "shank").placement[0])


def _com_x(tree: Sequence[Segment], path: PosturePath, levels: Array, balanced: float) -> Array:
    names = tuple(dict.fromkeys(axis.coordinate for segment in tree for axis in segment.axes))
    angles = {name: np.deg2rad(path.standing_deg[name] + path.added_deg[name] * levels) for name in path.standing_deg}
    angles[path.balanced] = np.full_like(levels, balanced)
    q = np.stack([angles[name] for name in names], axis=1)
    moving = at_rest(tree, names, q)
    weighted = sum(s.mass * moving.segments[s.name].point(s.com)[:, 0] for s in tree)
    return np.asarray(weighted / sum(s.mass for s in tree))
