"""Labels that are exchanged: which exchange would put the markers back where their names say, and from when on."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import numpy.typing as npt

from dynakin.arrays import runs
from dynakin.model.markers.geometry import Deviations, Expected, Found, cost_under_names, deviations
from dynakin.model.markers.match import MarkerKey, MarkerMatch
from dynakin.recordings.recording import Recording

Array = npt.NDArray[np.float64]
Order = npt.NDArray[np.intp]

_GAIN = 8.0
"""How much nearer to a body (`Deviations.cost`) an exchange must bring it. In the recordings of ``shared/data``,
labelled rightly, none brings more than 2.2; exchanged neighbours on a leg mostly 15 and more, right for left 9."""
_MOST = 6  # exchanges in one recording
_GROUPS = (
    ("leg", ("thigh", "shank", "foot", "toes")),
    ("shank and foot", ("shank", "foot", "toes")),
    ("foot", ("foot", "toes")),
    ("arm", ("upper_arm", "forearm", "hand")),
    ("forearm", ("forearm", "hand")),
    ("pelvis", ("pelvis",)),
    ("trunk", ("thorax", "abdomen")),
    ("head", ("head",)),
)
_SLACK = 4.0  # of a marker, in the quick estimate of what its exchange gains
_OFF_M = 0.03  # a marker so far from its place on its segment is not where it was
_MENDED = 0.5  # of that, at most, is left after the exchange
_SHORTEST_S = 0.1


@dataclass(frozen=True)
class Swap:
    """Markers that bear each other's names.

    Attributes:
        pairs: which with which. what: words for them.
        evidence: what shows it, found and expected.
        span_s: from when to when; None: throughout.
        share: of the trial.
    """

    pairs: tuple[tuple[MarkerKey, MarkerKey], ...]
    what: str
    evidence: str
    span_s: tuple[float, float] | None = None
    share: float = 1.0

    @property
    def keys(self) -> set[MarkerKey]:
        """All markers that take part."""
        return {key for pair in self.pairs for key in pair}


def swaps_throughout(
    match: MarkerMatch, keys: Sequence[MarkerKey], found: Found, expected: Expected, height_m: float
) -> tuple[list[Swap], Order]:
    """Exchanges that mend what contradicts a body, the clearest first, and the order of the markers after them."""
    order = np.arange(len(keys))
    swaps: list[Swap] = []
    while len(swaps) < _MOST:
        own = found.ordered(order)
        now = deviations(own, expected, height_m)
        best, gain = None, _GAIN
        for pairs, what in _candidates(match, keys, _promise(own, expected, height_m, now)):
            exchanged = _exchanged(len(keys), pairs)
            after = deviations(own.ordered(exchanged), expected, height_m)
            if now.cost - after.cost > gain:
                best, gain = (pairs, what, exchanged, after), now.cost - after.cost
        if best is None:
            break
        pairs, what, exchanged, after = best
        evidence = _evidence(match, keys, own, expected, height_m, now.total - after.total, pairs)
        swaps.append(Swap(tuple((keys[i], keys[j]) for i, j in pairs), what, evidence))
        order = order[exchanged]
    return swaps, order


def _promise(found: Found, expected: Expected, height_m: float, now: Deviations) -> Array:
    """(n, n) about what the exchange of two markers gains, rather too much than too little."""
    cost = cost_under_names(found, expected, height_m)
    own = np.diag(cost)
    uneven = 2.0 * (now.uneven**2).sum(axis=1)
    both = _SLACK + uneven
    return np.asarray(own[:, None] + own[None] - cost - cost.T + both[:, None] + both[None])


def _candidates(
    match: MarkerMatch, keys: Sequence[MarkerKey], promise: Array
) -> Iterator[tuple[list[tuple[int, int]], str]]:
    """Exchanges worth a trial: which with which, and words for them."""
    names = [match.names[key] for key in keys]
    spot = {key: k for k, key in enumerate(keys)}
    for i, j in np.argwhere(np.triu(promise > _GAIN, 1)).tolist():
        yield [(i, j)], f"{names[i]} and {names[j]}"
    for what, segments in _GROUPS:
        own = [name for name, side in keys if side == "right" and match.marker_set.marker(name).segment in segments]
        pairs = [(spot[name, "right"], spot[name, "left"]) for name in own if (name, "left") in spot]
        if len(pairs) > 1:
            yield (
                pairs,
                f"all right and left labels of the {what} ({', '.join(names[i] for i, _ in pairs)}, ...)",
            )


def _exchanged(n: int, pairs: Sequence[tuple[int, int]]) -> Order:
    other = np.arange(n)
    for i, j in pairs:
        other[[i, j]] = other[[j, i]]
    return other


def _evidence(
    match: MarkerMatch, keys: Sequence[MarkerKey], found: Found, expected: Expected, height_m: float, gained: Array,
    pairs: Sequence[tuple[int, int]],
) -> str:  # fmt: skip
    """The relation that the exchange mends most, in words."""
    own = sorted({k for pair in pairs for k in pair})
    i, j = np.unravel_index(int(np.argmax(gained[own])), (len(own), len(keys)))
    a, b = own[int(i)], int(j)
    one, other = (match.names[keys[k]] for k in (a, b))
    for table, wanted, positive, negative in (
        (found.right, expected.right, "to the right", "to the left"),
        (found.forward, expected.forward, "in front", "behind"),
    ):
        value = float(table[a, b])
        if np.isfinite(wanted[a, b]) and np.isfinite(value) and value * wanted[a, b] < 0.0 and abs(value) > 0.02:
            return f"{one} lies {abs(value):.2f} m {positive if value > 0 else negative} of {other}".replace(
                "in front of", "before"
            ).replace("behind of", "behind")
    return distance_words(one, other, float(found.distance[a, b]), float(expected.distance[a, b]) * height_m)


def distance_words(one: str, other: str, found_m: float, usual_m: float) -> str:
    """How far two markers are apart and should be."""
    usual = f", expected about {usual_m:.2f} m" if np.isfinite(usual_m) else ", and not always as far"
    return f"{one} and {other} are {found_m:.2f} m apart{usual}"


def swaps_for_a_while(
    recording: Recording, match: MarkerMatch, keys: Sequence[MarkerKey], places: Array, found: Found, expected: Expected
) -> list[Swap]:
    """Exchanges in a part of the trial: two markers leave their places on their segments at the same time, and each is
    found at the other's.

    Args:
        places: (T, n, 3) m on some frames, spread over the trial.
    """
    partners = _partners(expected)
    off = np.stack([_off(places, places[:, k], k, partners[k], found) for k in range(len(keys))], axis=1)
    suspicious = np.flatnonzero((off > _OFF_M).sum(axis=0) >= 2)
    swaps: list[Swap] = []
    taken: set[int] = set()
    scored = []
    for i, j in combinations((int(k) for k in suspicious), 2):
        both = (off[:, i] > _OFF_M) & (off[:, j] > _OFF_M)
        if both.sum() < 2:
            continue
        mended = _mends(places, i, j, partners, found, off[:, i], off[:, j])
        if mended.sum() >= max(2, 0.5 * both.sum()):
            scored.append((int(mended.sum()), i, j))
    columns = [recording.marker_names.index(match.names[key]) for key in keys]
    for _, i, j in sorted(scored, reverse=True):
        if {i, j} & taken:
            continue
        needed = sorted({i, j, *partners[i], *partners[j]})
        every = np.full((recording.n_frames, len(keys), 3), np.nan)
        every[:, needed] = recording.markers[:, [columns[k] for k in needed]]
        own = [_off(every, every[:, k], k, partners[k], found) for k in (i, j)]
        mended = _mends(every, i, j, partners, found, *own)
        spans = [(a, b) for a, b in runs(mended) if recording.time[b - 1] - recording.time[a] >= _SHORTEST_S]
        if not spans:
            continue
        taken |= {i, j}
        span = float(recording.time[spans[0][0]]), float(recording.time[spans[-1][1] - 1])
        one, other = match.names[keys[i]], match.names[keys[j]]
        worst = max(float(np.nanmax(np.where(mended, values, np.nan))) for values in own)
        swaps.append(
            Swap(
                ((keys[i], keys[j]),),
                f"{one} and {other}",
                f"each jumps by up to {worst:.2f} m on its segment, to the place of the other",
                span,
                sum(b - a for a, b in spans) / recording.n_frames,
            )
        )
    return swaps


def _partners(expected: Expected) -> list[list[int]]:
    return [[int(j) for j in np.flatnonzero(row)] for row in expected.rigid]


def _off(places: Array, own: Array, k: int, partners: Sequence[int], found: Found) -> Array:
    """How far (T,) m a marker at ``own`` (T, 3) is from where the k-th usually is on its segment: the median over the
    distances to the others there, 0 where none is seen."""
    if not partners:
        return np.zeros(len(places))
    lengths = np.linalg.norm(places[:, partners] - own[:, None], axis=2)
    wrong = np.abs(lengths - found.distance[k, partners])
    n = np.isfinite(wrong).sum(axis=1)
    ordered = np.sort(wrong, axis=1)
    middle = ordered[np.arange(len(wrong)), np.maximum((n - 1) // 2, 0)]
    return np.where(n > 0, middle, 0.0)


def _mends(
    places: Array, i: int, j: int, partners: Sequence[Sequence[int]], found: Found, off_i: Array, off_j: Array
) -> npt.NDArray[np.bool_]:
    """(T,) frames in which both are off, and neither is when they change places."""
    there = [
        _off(places, places[:, b], a, [k for k in partners[a] if k not in (i, j)], found) for a, b in ((i, j), (j, i))
    ]
    was = np.maximum(off_i, off_j)
    off = (was > _OFF_M) & (np.minimum(off_i, off_j) > 0.5 * _OFF_M)
    return np.asarray(off & (np.maximum(*there) < _MENDED * was))
