"""Labels that are exchanged: which exchange would put the markers back where their names say, and from when on."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
import numpy.typing as npt

from dynakin.arrays import Array
from dynakin.model.markers.geometry import (
    Deviations,
    Expected,
    Found,
    body_height_m,
    cost_under_names,
    deviations,
    frames_of,
    places_of,
)
from dynakin.model.markers.match import MarkerKey, MarkerMatch
from dynakin.model.mirroring import OTHER_SIDE
from dynakin.recordings.recording import Recording

Order = npt.NDArray[np.intp]

_GAIN, _GAIN_OF_ONE = 8.0, 5.0
"""How much nearer to a body (`Deviations.cost`) several exchanges at once must bring it, and one alone. In the
recordings of ``shared/data``, labelled rightly, none brings more than 2.2, and on eight simulated persons with every
set one alone 2.0, two 6.1; exchanged neighbours on a leg mostly bring 15 and more, right for left 9, heel and ankle of
a foot 5.5."""
_STILL_WRONG = 4.0  # deviations of a distance
_ODD = 2.5
"""Deviations. Chosen on one simulated walk with Oxford feet (1.8 at most, labelled rightly; a trochanter exchanged with
a thigh's cluster 3.0), judged on two others and on all sets."""
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
_FEWEST_FRAMES = 2  # of those that are looked at
_FEWEST_OTHERS = 2  # markers on the segments of two, by which an exchange of them is seen
_RETURNS, _AS_NARROW_M = 0.4, 0.01  # of the frames; of a range of lengths
_AS_GOOD = 0.9  # of what the best account gains


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

    def at(self, time: Array) -> npt.NDArray[np.bool_]:
        """Whether it is so at some times (s)."""
        if self.span_s is None:
            return np.ones(len(time), dtype=bool)
        return np.asarray((time >= self.span_s[0]) & (time <= self.span_s[1]))


def find_swaps(
    recording: Recording, match: MarkerMatch, keys: Sequence[MarkerKey], found: Found, expected: Expected
) -> tuple[list[Swap], Found, Order]:
    """Labels that are exchanged, throughout or for a while; what the recording shows of the markers where they are not
    exchanged for a while; and the order of the markers that their names belong to.

    Whichever of both is looked for first, the other may be taken for it, and so may be what is the rule and what the
    exception: the account with the fewest exchanges counts. found: over all `frames_of` the recording.
    """
    frames = frames_of(recording)
    throughout, order = _swaps_throughout(match, keys, found, expected)
    shown = {key: match.names[keys[k]] for key, k in zip(keys, order, strict=True)}
    right = replace(match, names=shown) if throughout else match
    later = _swaps_for_a_while(recording, right, keys, found.ordered(order).distance, expected)
    accounts = [(_merged(throughout, later, recording), found, order)]
    returning = _returning(places_of(recording, match, keys, frames), expected.rigid)
    for usual in (found.distance, returning):
        known = usual is found.distance and not throughout  # asked already
        exceptions = later if known else _swaps_for_a_while(recording, match, keys, usual, expected)
        if exceptions:
            clean = _without(frames, recording, exceptions)
            without = Found.of(places_of(recording, match, keys, clean), expected)
            rule, order = _swaps_throughout(match, keys, without, expected)
            earlier = _swaps_for_a_while(recording, match, keys, without.distance, expected)
            accounts.append((_merged(rule, earlier, recording), without, order))
    return min((own for own in accounts if own[0]), key=lambda own: _n_labels(own[0]), default=accounts[0])


def _n_labels(swaps: Sequence[Swap]) -> int:
    return sum(len(swap.keys) for swap in swaps)


def _without(frames: Order, recording: Recording, swaps: Sequence[Swap]) -> Order:
    time = recording.time[frames]
    clean = np.ones(len(frames), dtype=bool)
    for swap in swaps:
        clean &= ~swap.at(time)
    return frames[clean] if clean.any() else frames


def _swaps_throughout(
    match: MarkerMatch, keys: Sequence[MarkerKey], found: Found, expected: Expected
) -> tuple[list[Swap], Order]:
    """Exchanges that mend what contradicts a body, the clearest first, and the order of the markers after them."""
    order = np.arange(len(keys))
    swaps: list[Swap] = []
    while len(swaps) < _MOST:
        own = found.ordered(order)
        height_m = body_height_m(own, expected)
        now = deviations(own, expected, height_m)
        best, gain = None, 0.0
        for pairs, what in _candidates(match, keys, _promise(own, expected, height_m, now)):
            exchanged = _exchanged(len(keys), pairs)
            after = deviations(own.ordered(exchanged), expected, height_m)
            own_gain = (now.cost - after.cost) / _weight(pairs)
            least = _GAIN_OF_ONE if len(pairs) == 1 else _GAIN
            if own_gain > max(gain, least) and _odd(now, expected, pairs) and not _nowhere(after, expected, pairs):
                best, gain = (pairs, what, exchanged, after), own_gain
        if best is None:
            break
        pairs, what, exchanged, after = best
        evidence = _evidence(match, keys, own, expected, height_m, now.total - after.total, pairs)
        swaps.append(Swap(tuple((keys[i], keys[j]) for i, j in pairs), what, evidence))
        order = order[exchanged]
    return swaps, order


def _odd(now: Deviations, expected: Expected, pairs: Sequence[tuple[int, int]]) -> bool:
    """Whether markers with a place lie oddly, where they would be exchanged with ones of a cluster: these may lie
    nearer to any place than whose it is, and many small deviations of one marker are one."""
    placed = expected.placed
    alone = [k if placed[k] else m for k, m in pairs if placed[k] != placed[m]]
    return bool(np.all(now.largest[alone] > _ODD))


def _nowhere(after: Deviations, expected: Expected, pairs: Sequence[tuple[int, int]]) -> bool:
    """Whether an exchange would put a marker where it is as wrong: then it is no exchange, but a marker in a wrong
    place."""
    own = [k for pair in pairs for k in pair]
    far = np.sum(np.abs(after.distance[own]) > _STILL_WRONG, axis=1)
    known = np.isfinite(expected.distance[own]).sum(axis=1)
    return bool(np.any(2 * far > known))


def _weight(pairs: Sequence[tuple[int, int]]) -> float:
    """An account of several exchanges must gain more than one of one."""
    return 1.0 + 0.25 * (min(len(pairs), 3) - 1)


def _merged(throughout: Sequence[Swap], at_times: Sequence[Swap], recording: Recording) -> list[Swap]:
    """All exchanges; two markers that are exchanged but for a while are so in the rest of the trial."""
    start_s, end_s = float(recording.time[0]), float(recording.time[-1])
    found = []
    for swap in throughout:
        for other in at_times:
            if other.keys == swap.keys and other.span_s is not None:
                first, last = other.span_s
                rest = (start_s, first) if end_s - last < first - start_s else (last, end_s)
                swap = replace(swap, span_s=rest, share=1.0 - other.share)
        found.append(swap)
    known = [swap.keys for swap in throughout]
    return [*found, *(swap for swap in at_times if swap.keys not in known)]


def _promise(found: Found, expected: Expected, height_m: float, now: Deviations) -> Array:
    """(n, n) about what the exchange of two markers gains, rather too much than too little."""
    cost = cost_under_names(found, expected, height_m)
    own = np.diag(cost)
    both = _SLACK + 2.0 * (now.uneven**2).sum(axis=1)
    promise = own[:, None] + own[None] - cost - cost.T + both[:, None] + both[None]
    known = np.asarray(expected.rigid.any(axis=1))
    return np.where(known[:, None] & known[None], promise, 0.0)


def _candidates(
    match: MarkerMatch, keys: Sequence[MarkerKey], promise: Array
) -> Iterator[tuple[list[tuple[int, int]], str]]:
    """Exchanges worth a trial: which with which, and words for them."""
    names = [match.names[key] for key in keys]
    spot = {key: k for k, key in enumerate(keys)}
    mirror = [spot.get((name, OTHER_SIDE.get(side, ""))) for name, side in keys]
    for i, j in np.argwhere(np.triu(promise > 0.5 * _GAIN, 1)).tolist():
        if promise[i, j] > _GAIN_OF_ONE:
            yield [(i, j)], f"{names[i]} and {names[j]}"
        k, m = mirror[i], mirror[j]
        if keys[i][1] == keys[j][1] == "right" and k is not None and m is not None:
            yield [(i, j), (k, m)], f"{names[i]} and {names[j]}, and {names[k]} and {names[m]},"
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


def _swaps_for_a_while(
    recording: Recording, match: MarkerMatch, keys: Sequence[MarkerKey], usual: Array, expected: Expected
) -> list[Swap]:
    """Exchanges in a part of the trial: a marker leaves its place on its segment, and it and another fit where each is
    at the other's place (of the other nothing may show it: a wand's only neighbour is the knee). usual: lengths (n, n)
    m between markers of a segment that are no exception."""
    frames = frames_of(recording)
    places = places_of(recording, match, keys, frames)
    partners = [{int(j) for j in np.flatnonzero(row)} for row in expected.rigid]
    swaps: list[Swap] = []
    while len(swaps) < _MOST:
        lengths = np.linalg.norm(places[:, None] - places[:, :, None], axis=3)
        off = _off(lengths, usual, expected.rigid)
        away, whole = off > _OFF_M, off.sum()
        accounts = []
        for i, j in combinations(range(len(keys)), 2):
            either = away[:, i] | away[:, j]
            if either.sum() < _FEWEST_FRAMES or len((partners[i] | partners[j]) - {i, j}) < _FEWEST_OTHERS:
                continue
            # An exchange makes no new lengths, only of others; it changes nothing for who is on neither's segment.
            order = np.arange(len(keys))
            order[[i, j]] = j, i
            where, both = np.flatnonzero(either), np.array([i, j])
            mended = either.copy()  # of most pairs nothing is: the others of their segments need not be asked
            left = _off(lengths[np.ix_(where, order[both])][:, :, order], usual[both], expected.rigid[both])
            mended[where] = left.max(axis=1) < _MENDED * off[np.ix_(where, both)].max(axis=1)
            if 2 * mended.sum() < either.sum():
                continue
            concerned = np.array(sorted({i, j} | partners[i] | partners[j]))
            after = off.copy()
            changed = lengths[np.ix_(where, order[concerned])][:, :, order]
            after[np.ix_(where, concerned)] = _off(changed, usual[concerned], expected.rigid[concerned])
            gain = float(whole - after.sum())
            if gain > 0.0:
                other = places.copy()
                other[either, i], other[either, j] = places[either, j], places[either, i]
                shorter = _way(places[:, [i, j]]) - _way(other[:, [i, j]])
                accounts.append((gain, shorter, i, j, mended, other))
        if not accounts:
            return swaps
        most = max(account[0] for account in accounts)
        # Right for left in front and behind look alike by distances: the ones that jump are it.
        _, _, i, j, mended, places = max(
            (account for account in accounts if account[0] > _AS_GOOD * most), key=lambda account: account[1]
        )
        start, stop = (int(frames[k]) for k in np.flatnonzero(mended)[[0, -1]])
        share = float(mended.mean())
        span = _span(recording, match, [keys[i], keys[j]], start, stop, int(np.diff(frames).max(initial=1)))
        one, other_name = match.names[keys[i]], match.names[keys[j]]
        far = float(off[mended][:, [i, j]].max())
        swaps.append(
            Swap(
                ((keys[i], keys[j]),),
                f"{one} and {other_name}",
                f"they jump by up to {far:.2f} m on their segments, each to the place of the other",
                span,
                share,
            )
        )
    return swaps


def _span(
    recording: Recording, match: MarkerMatch, keys: Sequence[MarkerKey], start: int, stop: int, step: int
) -> tuple[float, float]:
    """Times (s) of the jumps next to the first and the last of the frames that were looked at."""
    paths = np.stack([recording.marker(match.names[key]) for key in keys], axis=1)
    with np.errstate(invalid="ignore"):
        jump = np.nan_to_num(np.linalg.norm(np.diff(paths, axis=0), axis=2).min(axis=1))

    def largest(low: int, high: int) -> int:
        low, high = max(low, 0), min(high, len(jump))
        return low + int(np.argmax(jump[low:high])) if high > low and jump[low:high].max() > _OFF_M else -1

    before, after = largest(start - step, start), largest(stop, stop + step)
    first = before + 1 if before >= 0 else (0 if start < step else start)
    last = after if after >= 0 else (recording.n_frames - 1 if stop + step >= recording.n_frames else stop)
    return float(recording.time[first]), float(recording.time[last])


def _way(places: Array) -> float:
    """How long (m) the ways of markers (T, k, 3) are together, from each frame to the next as far as they are seen."""
    return float(np.nansum(np.linalg.norm(np.diff(places, axis=0), axis=2)))


def _returning(places: Array, rigid: npt.NDArray[np.bool_]) -> Array:
    """(n, n) m: the length between two markers (T, n, 3) of a segment that returns most often: the middle of the
    narrowest range that holds `_RETURNS` of them, of ranges about as narrow the one nearest to the median. A marker
    that is on the other leg for half of the trial is anywhere there, and draws the median away from both."""
    usual = np.full(rigid.shape, np.nan)
    for i, j in np.argwhere(np.triu(rigid)).tolist():
        lengths = np.sort(np.linalg.norm(places[:, i] - places[:, j], axis=1))
        lengths = lengths[np.isfinite(lengths)]
        if not len(lengths):
            continue
        held = max(int(_RETURNS * len(lengths)), 1)
        low, high = lengths[: len(lengths) - held + 1], lengths[held - 1 :]
        middle, narrow = 0.5 * (low + high), high - low <= (high - low).min() + _AS_NARROW_M
        usual[i, j] = usual[j, i] = middle[narrow][np.argmin(np.abs(middle[narrow] - np.median(lengths)))]
    return usual


def _off(lengths: Array, usual: Array, rigid: npt.NDArray[np.bool_]) -> Array:
    """How far (T, k) m markers are from where they usually are on their segments, by the mean over their distances
    (T, k, n) to the others there, ``rigid`` (k, n); 0 where none is seen."""
    wrong = np.abs(lengths - usual)
    seen = rigid & np.isfinite(wrong)
    return np.asarray(np.where(seen, wrong, 0.0).sum(axis=2) / np.maximum(seen.sum(axis=2), 1))
