"""Landmarks (joint centres and the ends of segments) from markers, by the recipes of a marker set."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from dynakin.arrays import Array, cross
from dynakin.errors import ModelError
from dynakin.model.markers.match import MarkerKey, MarkerMatch
from dynakin.model.markers.schema import Offset, PelvisRegression, PolarRegression, Recipe, by_sex
from dynakin.model.mirroring import OTHER_SIDE, SIDES, SUFFIXES
from dynakin.settings.subject import Sex

Positions = dict[MarkerKey, Array]
"""Marker positions (3,) m in the ground frame, by marker and side."""


def _sides(recipe: Recipe, side: str) -> tuple[str, ...]:
    """The sides whose markers a recipe takes when it is asked for one side."""
    return {"own": (side,), "both": SIDES}.get(recipe.sides, (recipe.sides,))


_NOWHERE: Array = np.full(3, np.nan)
_FLOOR = ("floor", "over_floor")


@dataclass
class LandmarkFinder:
    """Evaluates the landmarks of one side ("right", "left", or "both": the middle of the two).

    A recipe is chosen by what the recording has at all, not frame by frame, so that a landmark never jumps
    between two definitions within a trial.
    """

    match: MarkerMatch
    side: str
    sex: Sex | None
    planar: bool
    in_space: bool = False  # the recipes of models in space, each side apart
    height_m: float | None = None  # for joint widths
    widths_m: Mapping[str, float] = field(default_factory=dict)  # of joints as somebody measured them: "knee_r"
    sole: Mapping[str, float] = field(default_factory=dict)  # side -> slope (rad) of heel to toe on a flat foot
    supposed_axes: set[str] = field(default_factory=set)  # joints whose axis is laid between pelvis and foot
    usual_widths: set[str] = field(default_factory=set)  # joints whose width is that of an adult of this height
    _chosen: dict[tuple[str, str], Recipe | None] = field(default_factory=dict)

    @property
    def _recipes(self) -> dict[str, tuple[Recipe, ...]]:
        return self.match.marker_set.recipes(not self.in_space)

    def _key(self, marker: str, side: str) -> MarkerKey | None:
        return next((key for key in ((marker, side), (marker, "centre")) if key in self.match.names), None)

    def _available(self, source: str, sides: tuple[str, ...]) -> bool:
        if source in self._recipes:
            return all(self.recipe(source, side) is not None for side in sides)
        return any(self._key(source, side) is not None for side in sides)

    def _possible(self, recipe: Recipe, side: str) -> bool:
        if recipe.pelvis is not None:
            both = all(self._key(recipe.pelvis.asis, s) for s in SIDES)
            return both and any(self._key(recipe.pelvis.psis, s) for s in SIDES)
        if not all(self._key(name, s) for name in recipe.across for s in SIDES):
            return False
        return all(self._available(source, _sides(recipe, side)) for source in recipe.inputs)

    def recipe(self, name: str, side: str) -> Recipe | None:
        """The first recipe of a landmark whose markers the recording has, None where there is none."""
        if (name, side) not in self._chosen:
            recipes = self._recipes.get(name, ())
            self._chosen[name, side] = next((r for r in recipes if self._possible(r, side)), None)
        return self._chosen[name, side]

    def _sides_of(self, name: str) -> list[str]:
        wanted = SIDES if self.side == "both" else (self.side,)
        return [side for side in wanted if self.recipe(name, side) is not None]

    def has_recipe(self, name: str) -> bool:
        """Whether the marker set has the places that this landmark follows from, marked in the recording or not."""
        return name.startswith(_FLOOR) or name in self._recipes

    def known(self, name: str) -> bool:
        """Whether the recording has the markers for this landmark."""
        return name.startswith(_FLOOR) or bool(self._sides_of(name))

    def require(self, wanted: Mapping[str, str]) -> None:
        """Refuse, in one line, a recording without the markers for these landmarks.

        Args:
            wanted: landmark -> what needs it.

        Raises:
            ModelError: names each landmark that lacks, its marker, the aliases tried, and what the recording has.
        """
        marker_set = self.match.marker_set
        side = SIDES[0] if self.side == "both" else self.side
        lacking: dict[str, list[str]] = {}
        for name, why in wanted.items():
            if not self.known(name):
                how = self._first_absent(name, side) if name in self._recipes else "no recipe for it"
                lacking.setdefault(how, []).append(f"landmark {name!r} ({why})")
        if lacking:
            raise ModelError(
                f"{self.match.where}, marker set {marker_set.name}: "
                + "; ".join(f"{how}, expected for {', '.join(names)}" for how, names in lacking.items())
                + f"; it has {', '.join(self.match.recorded)}"
            )

    def _first_absent(self, name: str, side: str) -> str:
        recipe = self._recipes[name][0]
        for source in recipe.inputs:
            if source in self._recipes:
                if self.recipe(source, side) is None:
                    return self._first_absent(source, side)
            elif any(self._key(source, s) is None for s in (SIDES if source in recipe.across else (side,))):
                return self.match.absent(source)
        raise AssertionError(f"landmark {name} is there")  # callers ask only for what is lacking

    def touched(self, name: str, side: str) -> bool:
        """Whether the recording has a marker of its own for a landmark, which alone may not be enough for it."""
        recipes = self._recipes.get(name, ())
        own = {source for recipe in recipes for source in recipe.inputs if source not in recipe.across}
        return any(self._key(source, side) is not None for source in own - self._recipes.keys())

    def lacking(self, name: str, side: str) -> list[frozenset[str]]:
        """The fewest markers, by their first names in the set, with which a landmark would be known; each way to it,
        none where the set has no names for it."""
        if name not in self._recipes:
            if self._key(name, side) is not None:
                return [frozenset()]
            marker = self.match.marker_set.marker(name)
            names = marker.centre or marker.aliases(side)
            return [frozenset(names[:1])] if names else []  # a set of one's own may have a place on one side only
        if self.recipe(name, side) is not None:
            return [frozenset()]
        ways: list[frozenset[str]] = []
        for recipe in self._recipes[name]:
            own = [frozenset[str]()]
            back = recipe.pelvis.psis if recipe.pelvis is not None else ""
            for source in recipe.inputs:
                if source == back:  # of either side
                    own = [a | b for a in own for s in SIDES for b in self.lacking(source, s)]
                    continue
                for s in SIDES if source in recipe.across else _sides(recipe, side):
                    own = [a | b for a in own for b in self.lacking(source, s)]
            ways += own
        fewest = min((len(way) for way in ways), default=0)
        return list(dict.fromkeys(way for way in ways if len(way) == fewest))

    def markers_of(self, name: str) -> set[MarkerKey]:
        """Every marker that the landmark's value depends on."""
        keys: set[MarkerKey] = set()
        for side in self._sides_of(name) if not name.startswith(_FLOOR) else ():
            keys |= self._markers_of(name, side)
        return keys

    def _markers_of(self, name: str, side: str) -> set[MarkerKey]:
        recipe = self.recipe(name, side)
        assert recipe is not None
        keys: set[MarkerKey] = set()
        for source in recipe.inputs:
            if source in self._recipes:
                for s in _sides(recipe, side):
                    keys |= self._markers_of(source, s)
            else:
                sides = SIDES if source in recipe.across else _sides(recipe, side)
                keys |= {key for s in sides if (key := self._key(source, s)) is not None}
        return keys

    def find(self, positions: Positions) -> dict[str, Array]:
        """Every landmark that can be had, (3,) m in the ground frame (z = 0 where the model is planar)."""
        found: dict[str, Array] = {}
        for name in self._recipes:
            values = [self._value(name, side, positions) for side in self._sides_of(name)]
            values = [value for value in values if np.isfinite(value).all()]
            if values:
                point = _middle(values)
                found[name] = np.array([point[0], point[1], 0.0]) if self.planar else point
        return found

    def find_in_space(self, positions: Positions) -> dict[str, Array]:
        """Every landmark in space, (3,) m, ground frame: its middle under its name, each side's with _r and _l.

        ``floor`` and ``over_floor``: a line at right angles to the sole.
        """
        found: dict[str, Array] = {}
        for name in self._recipes:
            values = {s: self._value(name, s, positions) for s in SIDES if self.recipe(name, s) is not None}
            values = {s: value for s, value in values.items() if np.isfinite(value).all()}
            found |= {f"{name}{SUFFIXES[s]}": value for s, value in values.items()}
            if len(values) == len(SIDES):
                found[name] = _middle(list(values.values()))
        for side, suffix in SUFFIXES.items():
            ends = [found.get(f"{name}{suffix}") for name in ("heel", "toe")]
            up = np.array([0.0, 1.0, 0.0])
            if ends[0] is not None and ends[1] is not None:
                up = off_sole(ends[1] - ends[0], self.sole.get(side))
            found |= {f"floor{suffix}": np.zeros(3), f"over_floor{suffix}": up}
        return found

    def of_side(self, name: str) -> tuple[LandmarkFinder, str]:
        """The finder and the plain name for a landmark that is asked for with its side (hip_r)."""
        for side, suffix in SUFFIXES.items():
            if self.in_space and name.endswith(suffix) and name not in self._recipes:
                return replace(self, side=side, _chosen=dict(self._chosen)), name.removesuffix(suffix)
        return self, name

    def _value(self, name: str, side: str, positions: Positions) -> Array:
        recipe = self.recipe(name, side)
        assert recipe is not None

        def point(source: str) -> Array:
            sides = _sides(recipe, side)
            if source in self._recipes:
                return _middle([self._value(source, s, positions) for s in sides])
            keys = {key for s in sides if (key := self._key(source, s)) is not None}
            return _middle([positions.get(key, _NOWHERE) for key in sorted(keys)])

        if recipe.mean is not None:
            return _middle([point(source) for source in recipe.mean])
        if recipe.pelvis is not None:
            return self._pelvis(recipe.pelvis, _sides(recipe, side)[0], positions)
        if recipe.polar is not None:
            return self._polar(recipe.polar, [point(source) for source in recipe.inputs])
        if recipe.offset is not None:
            return self._offset(recipe.offset, side, point, positions)
        if recipe.corner is not None:
            return corner(
                [point(name) for name in recipe.corner.arms], self._apart(recipe.corner.asis, side, positions)
            )
        assert recipe.fraction is not None
        start, end = (point(source) for source in recipe.fraction.between)
        return start + by_sex(recipe.fraction.male, recipe.fraction.female, self.sex) * (end - start)

    def _pelvis(self, regression: PelvisRegression, side: str, positions: Positions) -> Array:
        right, left = (positions.get((regression.asis, s), _NOWHERE) for s in SIDES)
        back = _middle([
            positions.get(k, _NOWHERE) for s in SIDES if (k := self._key(regression.psis, s)) is not None
        ])  # fmt: skip
        front = 0.5 * (right + left)
        width, depth = float(np.linalg.norm(right - left)), float(np.linalg.norm(front - back))
        z = (right - left) / width
        y = cross(z, front - back)
        y /= np.linalg.norm(y)
        axes = np.column_stack([cross(y, z), y, z])  # ISB pelvis frame in the ground
        male, female = (
            np.array(c.width) * width + np.array(c.depth) * depth + np.array(c.constant_m)
            for c in (regression.male, regression.female)
        )
        local = male if self.sex == "male" else female if self.sex == "female" else 0.5 * (male + female)
        if side == "left":
            local = local * np.array([1.0, 1.0, -1.0])
        return np.asarray(front + axes @ local)

    def _polar(self, regression: PolarRegression, points: list[Array]) -> Array:
        origin, start, end, scale_from, scale_to = points
        direction = np.array([end[0] - start[0], end[1] - start[1], end[2] - start[2] if self.in_space else 0.0])
        direction /= np.linalg.norm(direction)
        angle = np.deg2rad(by_sex(regression.male.angle_deg, regression.female.angle_deg, self.sex))
        turned = np.array([
            np.cos(angle) * direction[0] - np.sin(angle) * direction[1],
            np.sin(angle) * direction[0] + np.cos(angle) * direction[1],
            direction[2],
        ])  # fmt: skip
        coefficient = by_sex(regression.male.coefficient, regression.female.coefficient, self.sex)
        return np.asarray(origin + coefficient * np.linalg.norm(scale_to - scale_from) * turned)

    @staticmethod
    def _apart(marker: str, side: str, positions: Positions) -> Array:
        """From the other side's to one's own (3,) m."""
        other = OTHER_SIDE[side]
        return np.asarray(positions.get((marker, side), _NOWHERE) - positions.get((marker, other), _NOWHERE))

    def _offset(self, offset: Offset, side: str, point: Callable[[str], Array], positions: Positions) -> Array:
        foot = [point(name) for name in offset.foot] if offset.foot else None
        across = lateral(self._apart(offset.asis, side, positions), foot, side) if offset.inward else None
        if offset.inward and offset.width:
            self.supposed_axes.add(f"{offset.width}{SUFFIXES[side]}")
        scale = offset.scale
        width_m = self.widths_m.get(f"{offset.width}{SUFFIXES[side]}")
        if width_m is not None:
            return offset_point(offset, point, across, side, 0.5 * width_m)
        size = self.height_m if scale is None else float(np.linalg.norm(self._apart(scale, side, positions)))
        if size is None:
            raise ModelError(f"{self.match.where}: height_m is needed: the joint under {offset.origin} has one marker")
        self.usual_widths.add(f"{offset.width}{SUFFIXES[side]}")
        fraction = offset.per_height if offset.per_height is not None else offset.per_scale
        assert fraction is not None
        return offset_point(offset, point, across, side, fraction * size)


def _middle(points: Sequence[Array]) -> Array:
    """Of a few points (3,): as `np.mean`, which takes ten times as long, and each frame of a trial has some hundred."""
    found = points[0]
    for point in points[1:]:
        found = found + point
    return found / len(points)


def slope(heel_to_toe: Array) -> Array:
    """Elevation (rad) of lines (..., 3) over the horizontal."""
    return np.asarray(np.arctan2(heel_to_toe[..., 1], np.hypot(heel_to_toe[..., 0], heel_to_toe[..., 2])))


def corner(ends: Sequence[Array], outward: Array) -> Array:
    """Where three arms of one length at right angles meet (3,) m, on the far side of the plane through their ends.

    Args:
        ends: (3,) m each. outward: (3,), roughly the direction in which the arms point away from the body.
    """
    a, b, c = ends
    edge = np.mean([np.linalg.norm(b - a), np.linalg.norm(c - b), np.linalg.norm(a - c)])
    normal = cross(b - a, c - a)
    normal *= np.sign(normal @ outward) / np.linalg.norm(normal)
    return np.asarray(np.mean(ends, axis=0) - edge / np.sqrt(6.0) * normal)


def off_sole(heel_to_toe: Array, flat: float | None) -> Array:
    """Direction (3,) at right angles to the sole, from the line between its markers and that line's slope when flat.

    Without a slope the foot is taken to be flat.
    """
    pitch = 0.0 if flat is None else float(slope(heel_to_toe)) - flat
    ahead = heel_to_toe * np.array([1.0, 0.0, 1.0])
    ahead = ahead / np.linalg.norm(ahead)
    return np.asarray(np.cos(pitch) * np.array([0.0, 1.0, 0.0]) - np.sin(pitch) * ahead)


BENT = 10.0
"""How much the plane of a bent limb counts against the body's middle plane: it takes over from 6 deg of bend."""


def lateral(asis: Array, foot: Sequence[Array] | None, side: str) -> Array:
    """Horizontal unit vector (3,) away from the body's middle, of a person who stands.

    Args:
        asis: from the other side's ASIS to one's own. foot: heel and toe. Feet point outward by more than knees do, the
            pelvis by less; the mean of both is taken.
    """
    directions = [asis]
    if foot is not None:
        ahead = foot[1] - foot[0]
        right = np.array([-ahead[2], 0.0, ahead[0]])  # ahead x up
        directions.append(right if side == "right" else -right)
    flat = [d * np.array([1.0, 0.0, 1.0]) for d in directions]
    mean = np.sum([d / np.linalg.norm(d) for d in flat], axis=0)
    return np.asarray(mean / np.linalg.norm(mean))


def offset_point(
    offset: Offset, point: Callable[[str], Array], across: Array | None, side: str, half_width_m: float
) -> Array:
    """The point (3,) m that an `Offset` describes.

    Args:
        point: a marker's or landmark's place. across: `lateral`, for one that goes inward. half_width_m: the
            distance without ``add_m``.
    """
    origin = point(offset.origin)
    distance = half_width_m + offset.add_m
    if offset.along is not None:
        start, end = (point(name) for name in offset.along)
        direction = end - start
    else:
        assert across is not None and offset.square_to is not None
        outward = across
        if offset.bend is not None:
            upper, middle, lower = (point(name) for name in offset.bend)
            a, b = lower - middle, upper - middle
            plane = cross(a, b) / (np.linalg.norm(a) * np.linalg.norm(b))  # to the right of a flexed arm
            outward = across + BENT * (plane if side == "right" else -plane)
        start, end = (point(name) for name in offset.square_to)
        line = (end - start) / np.linalg.norm(end - start)
        direction = -(outward - line * float(outward @ line))
    return np.asarray(origin + distance * direction / np.linalg.norm(direction))
