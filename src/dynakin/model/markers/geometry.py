"""Whether matched markers lie where their names say: distances on a body, rigid segments, right and left, front and
back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
import numpy.typing as npt

from dynakin.arrays import Array
from dynakin.model.markers.anatomy import anatomy, standing_at
from dynakin.model.markers.match import MarkerKey, MarkerMatch
from dynakin.model.mirroring import OTHER_SIDE
from dynakin.recordings.recording import Recording

_HEIGHT_M = 1.75  # where nothing shows it
_PROPORTION_SD = 0.08  # of a distance: people are built differently
_FRAMES = 80  # looked at, spread over the trial
_FEWEST_FRAMES = 3  # in which both of two markers are seen, to judge them by their distance
_SKIN_SD_M, _SKIN_SHARE = 0.012, 0.05  # how far a distance on a segment varies over a trial
_ACROSS_SHARE, _ACROSS_SD_M = 0.5, 0.03
_UNEVEN_SHARE, _UNEVEN_SD_M = 0.7, 0.015
_ABOVE = 0.25  # of the height: places so far apart show where up is on the body
_SURE = 0.3
_CAP = 5.0  # deviations beyond this say no more
_CENTRAL = ("pelvis", "trunk", "head")
_FRONT_BACK = (
    ("ASI", "PSI"), ("ASI", "SACR"), ("TOE", "HEE"), ("TOE", "ANK"), ("MT1", "HEE"), ("MT5", "HEE"), ("STRN", "T10"),
    ("CLAV", "C7"), ("STRN", "C7"), ("CLAV", "T10"), ("FHD", "BHD"), ("SEL", "OCC"), ("NOS", "EAR"),
    ("TOE", "HEL"), ("HAL", "HEE"), ("TOE", "AJ"), ("HAL", "AJ"), ("TO2", "HEE"), ("MT1", "AJ"), ("MT5", "AJ"),
)  # fmt: skip
_ANYWHERE = ("", "FRM", "WRA", "WRB", "WRI", "WJ", "forearm")  # arms cross
_SIGN = {"right": 1.0, "left": -1.0, "centre": 1.0}


@cache
def _units(name: str) -> frozenset[str]:
    """Of a place or a cluster's segment, whose places keep their distances to it."""
    return frozenset(unit for unit, names in anatomy()["units"].items() if name in names or name == unit)


def _named(match: MarkerMatch, name: str) -> tuple[str, frozenset[str]]:
    """Where anatomy.toml places a marker of a set, "" where it does not, and its units: of a place its own, of others
    their segment."""
    if name in standing_at():
        return name, _units(name)
    marker = match.marker_set.marker(name)
    if marker.landmark_only or not marker.segment:
        return "", frozenset()
    segment = {"thorax": "trunk", "abdomen": "", "toes": "foot", "hand": ""}.get(marker.segment, marker.segment)
    return (segment if segment in standing_at() else ""), frozenset({segment} - {""})


@dataclass(frozen=True, eq=False)
class Expected:
    """What anatomy.toml says of some markers, all (n, n) over the height, NaN where it says nothing.

    Attributes:
        distance: between two markers on one segment. sd: how far it may be off.
        right, forward, up: how far the one lies to the right of, before or above the other, where that is known to be
            so.
        mirror: (n,) the marker of the other side, of a middle marker itself.
        even: (n, n) distances that are the same on both sides.
        rigid: markers of one segment, whether or not their places are known.
        placed: (n,) whether a marker's name says its place; one of a cluster may be anywhere on its segment.
    """

    distance: Array
    sd: Array
    right: Array
    forward: Array
    up: Array
    mirror: npt.NDArray[np.intp]
    even: npt.NDArray[np.bool_]
    rigid: npt.NDArray[np.bool_]
    placed: npt.NDArray[np.bool_]

    @classmethod
    def of(cls, match: MarkerMatch, keys: Sequence[MarkerKey]) -> Expected:
        """Of the markers of a match."""
        known, n = standing_at(), len(keys)
        at, place_sd = np.full((n, 3), np.nan), np.full(n, np.nan)
        units: list[set[str]] = []
        for k, (name, side) in enumerate(keys):
            own, parts = _named(match, name)
            units.append({unit if unit in _CENTRAL else f"{unit} {side}" for unit in parts})
            if own:
                at[k], place_sd[k] = known[own][0] * [1.0, 1.0, _SIGN[side]], known[own][1]
        rigid = np.array([[bool(a & b) for b in units] for a in units], dtype=bool).reshape(n, n)
        np.fill_diagonal(rigid, False)
        distance = np.linalg.norm(at[:, None] - at[None], axis=2)
        distance[~rigid] = np.nan
        sd = np.sqrt(place_sd[:, None] ** 2 + place_sd[None] ** 2 + (_PROPORTION_SD * distance) ** 2)
        right, forward = np.full((n, n), np.nan), np.full((n, n), np.nan)
        spot = {key: k for k, key in enumerate(keys)}
        for name in dict.fromkeys(name for name, _ in keys):
            if _named(match, name)[0] not in _ANYWHERE:
                _put(right, at[:, 2], spot.get((name, "right")), spot.get((name, "left")))
        for side in ("right", "left"):
            for front, back in _FRONT_BACK:
                _put(
                    forward, at[:, 0],
                    spot.get((front, side), spot.get((front, "centre"))),
                    spot.get((back, side), spot.get((back, "centre"))),
                )  # fmt: skip
        up = at[:, None, 1] - at[None, :, 1]
        up[np.abs(up) < _ABOVE] = np.nan
        other = {**OTHER_SIDE, "centre": "centre"}
        mirror = np.array([spot.get((name, other[side]), k) for k, (name, side) in enumerate(keys)], dtype=int)
        placed = np.array([name in known for name, _ in keys], dtype=bool)
        paired = placed & np.array([(name, other[side]) in spot for name, side in keys], dtype=bool)
        even = rigid & paired[:, None] & paired[None]
        return cls(distance, sd, right, forward, up, mirror, even, rigid, placed)


def _put(table: Array, along: Array, a: int | None, b: int | None) -> None:
    if a is not None and b is not None and a != b:
        table[a, b], table[b, a] = along[a] - along[b], along[b] - along[a]


@dataclass(frozen=True, eq=False)
class Found:
    """What a recording shows of some markers over some frames, (n, n) m, NaN where two are not seen together.

    Attributes:
        distance: median over the frames. spread: its robust standard deviation.
        right, forward: median of how far the one lies to the right of, or before, the other.
    """

    distance: Array
    spread: Array
    right: Array
    forward: Array

    @classmethod
    def of(cls, places: Array, expected: Expected) -> Found:
        """Of the places (T, n, 3) m of the markers."""
        n = places.shape[1]
        first, second = np.triu_indices(n, 1)
        squares = np.zeros((len(places), len(first)))
        for one in np.moveaxis(places, 2, 0):
            squares += (one[:, first] - one[:, second]) ** 2
        low, middle, high = (np.sqrt(level) for level in _quantiles(squares, (0.16, 0.5, 0.84)))
        forward = _majority(places, expected.forward)
        right = _sideways(forward, _majority(places, expected.up), _majority(places, expected.right))
        found = [middle, 0.5 * (high - low)]
        for axis in (right, forward):
            along = np.einsum("tnc,tc->tn", places, axis)
            found.append(_quantiles(along[:, first] - along[:, second], (0.5,))[0])
        tables = [np.full((n, n), np.nan) for _ in found]
        for table, values, sign in zip(tables, found, (1.0, 1.0, -1.0, -1.0), strict=True):
            table[first, second] = values
            table[second, first] = sign * values
        return cls(*tables)

    def ordered(self, order: npt.NDArray[np.intp]) -> Found:
        """The same with the k-th name on marker ``order[k]``."""
        pick = np.ix_(order, order)
        return Found(self.distance[pick], self.spread[pick], self.right[pick], self.forward[pick])


def _quantiles(values: Array, levels: Sequence[float]) -> list[Array]:
    """Quantiles (p,) along the first axis of values (T, p), of what is finite; NaN where too little is."""
    ordered = np.sort(values, axis=0)  # NaN comes last
    n = np.isfinite(values).sum(axis=0)
    columns = np.arange(values.shape[1])
    found = []
    for level in levels:
        at = np.clip(np.round(level * (n - 1)).astype(int), 0, None)
        one = ordered[at, columns] if len(ordered) else np.full(len(columns), np.nan)
        found.append(np.where(n >= min(_FEWEST_FRAMES, len(values)), one, np.nan))
    return found


def _majority(places: Array, expected: Array) -> Array:
    """Unit vectors (T, 3) along which most of the pairs that are expected to lie apart do so; NaN without any."""
    first, second = np.nonzero(np.triu(np.isfinite(expected) & (np.abs(np.nan_to_num(expected)) > 0.01)))
    if not len(first):
        return np.full((len(places), 3), np.nan)
    apart = (places[:, first] - places[:, second]) * np.sign(expected[first, second])[:, None]
    total = np.nansum(apart, axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(total / np.linalg.norm(total, axis=1, keepdims=True))


def _sideways(forward: Array, up: Array, most: Array) -> Array:
    """To the right (T, 3) of who stands along up and faces forward, however left and right are named.

    As most of the names have it where one of these is unknown, or nearly all are named the other way round: that the
    person is seen in a mirror is another's to say.
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        right = np.cross(forward, up)
        size = np.linalg.norm(right, axis=1, keepdims=True)
        right = np.where(size > _SURE, right / size, np.nan)
        agree = np.nanmedian(np.sum(right * most, axis=1)) if np.isfinite(right * most).any() else np.nan
    return right if agree > -_SURE else most


@dataclass(frozen=True, eq=False)
class Deviations:
    """Deviations in units of what is usual, (n, n), 0 where nothing is known: of distances, from those of the other
    side, of their constancy, of the order from right to left and from front to back."""

    distance: Array
    uneven: Array
    spread: Array
    right: Array
    forward: Array

    @property
    def largest(self) -> Array:
        """(n,) of each marker, of all kinds and to all others."""
        parts = (self.distance, self.uneven, self.spread, self.right, self.forward)
        return np.asarray(np.max(np.abs(parts), axis=(0, 2), initial=0.0))

    @property
    def total(self) -> Array:
        """(n, n) of all kinds together, squared, each as far as it says something."""
        parts = (self.distance, self.uneven, self.spread, self.right, self.forward)
        return np.asarray(sum(np.minimum(np.abs(part), _CAP) ** 2 for part in parts))

    @property
    def cost(self) -> float:
        """How far it all is from a body, counted once a pair."""
        return 0.5 * float(self.total.sum())


def deviations(found: Found, expected: Expected, height_m: float) -> Deviations:
    """Deviations of what is found from what is expected of a person of this height."""
    mirror = np.ix_(expected.mirror, expected.mirror)
    with np.errstate(invalid="ignore"):
        uneven = found.distance - found.distance[mirror]
        uneven = uneven / (_UNEVEN_SHARE * expected.sd * height_m + _UNEVEN_SD_M)
    uneven[~expected.even] = 0.0
    others = _deviations(found, expected, height_m, slice(None))
    return Deviations(np.nan_to_num(others[0]), np.nan_to_num(uneven), *(np.nan_to_num(part) for part in others[1:]))


def _deviations(found: Found, expected: Expected, height_m: float, own: slice | int) -> list[Array]:
    """Of distance, spread, right and forward, against the expectations of all markers or of one."""
    usual = expected.distance[own] * height_m
    distance = (found.distance - usual) / (expected.sd[own] * height_m)
    allowed = _SKIN_SD_M + _SKIN_SHARE * np.where(np.isfinite(usual), usual, found.distance)
    spread = np.where(expected.rigid[own], found.spread / allowed, 0.0)
    tables = []
    for seen, wanted in ((found.right, expected.right[own]), (found.forward, expected.forward[own])):
        apart = wanted * height_m
        short = np.sign(apart) * (apart - seen)
        tables.append(np.maximum(short, 0.0) / np.maximum(_ACROSS_SHARE * np.abs(apart), _ACROSS_SD_M))
    return [distance, spread, *tables]


def cost_under_names(found: Found, expected: Expected, height_m: float) -> Array:
    """(n, n) what marker k would add to the cost under the name of i, all others keeping theirs; the evenness of both
    sides is left aside."""
    n = len(expected.distance)
    cost = np.empty((n, n))
    for i in range(n):
        parts = _deviations(found, expected, height_m, i)
        cost[i] = sum((np.minimum(np.abs(np.nan_to_num(part)), _CAP) ** 2).sum(axis=1) for part in parts)
    return cost


def body_height_m(found: Found, expected: Expected) -> float:
    """The height (m) of a person with these distances; that of the usual person where none is known."""
    known = np.isfinite(found.distance) & np.isfinite(expected.distance) & (np.nan_to_num(expected.distance) > 0.06)
    ratio = found.distance[known] / expected.distance[known]
    return float(np.median(ratio)) if len(ratio) else _HEIGHT_M


def frames_of(recording: Recording) -> npt.NDArray[np.intp]:
    """Frames that are looked at, spread over the trial."""
    n = min(_FRAMES, recording.n_frames)
    return np.unique(np.linspace(0, recording.n_frames - 1, n).round().astype(np.intp))


def places_of(
    recording: Recording, match: MarkerMatch, keys: Sequence[MarkerKey], frames: npt.NDArray[np.intp]
) -> Array:
    """Places (T, n, 3) m of markers on some frames."""
    columns = [recording.marker_names.index(match.names[key]) for key in keys]
    return np.asarray(recording.markers[frames][:, columns])
