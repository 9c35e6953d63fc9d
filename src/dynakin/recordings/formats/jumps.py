"""Markers that jump: off their place and back, onto each other's, or off for good. What no skin does in one frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from dynakin.arrays import Array, by_neighbours, runs
from dynakin.messages import Message, warning
from dynakin.recordings.times import span, spans

_SHAPE = np.array([1.0, -4.0, 6.0, -4.0, 1.0]) / 6.0
"""What one step too many leaves of five steps once each is compared with the cubic through its neighbours."""
JUMP_M = 0.014
"""A jump is at least so large (the one back, `WHOLE` of it). In raw recordings (`functional`) markers flicker between
two places 13 mm apart; noise of 1.5 mm in each coordinate comes to 10."""
NOISE = 5.0
"""Times the median of what is left in the frames around: noise alone comes to 5, its shape is then mostly another."""
_ALONG = 3.0
"""Times the median of what is left along the jump: 2.28 where noise is alike in all directions. Cameras see depth
worst, and noise along one direction alone looks like a step more often (4 of 360 000 samples of 3 mm)."""
_SCATTER = 2.0
"""Times that, squared, of what a jump leaves of each frame by noise."""
ALONE = 3.0  # times what half of all markers jump by: frames that were dropped are another's to say
_LIKE = 0.95
"""Part of the squares of what is left that a single step explains: landings have 0.93 and less at 100 Hz, jumps of
15 mm in simulated noise 0.98."""
WHOLE = 0.6
"""Part of the jump by which its step stands out: a marker that flickers each frame has half of it."""
_FURTHER = 4  # frames before, for each behind that there is not (yet)
AROUND, BESIDE = 12, 2  # frames on either side, without those that the jump itself disturbs
RATE_HZ = 60.0
"""Below, a fast limb changes its speed within a frame as a jump does: by 66 mm in a run at 33 Hz."""
_NEAR = 3  # markers, by whose motion that of a marker is judged
_OPPOSITE, _AS_LARGE = -0.5, 2.0
"""A jump back is about as large and in the opposite direction, to the 60 deg that a shank turns in 0.2 s."""
BACK = 0.25  # of the jump, by which all distances to markers near are what they were for half of `START_S`
_EXCHANGED = 0.3  # part of the way between two places by which two that jump onto each other's miss them
_MOSTLY = 0.75
"""Part of the frames in which labels that are not those of the start are right (of `functional` 0.57, and wrong)."""
START_S = 0.25
"""Where a marker is for so long at the start is its place: the calibration and a standing trial know that one."""
_MOST = 4  # markers that a message lists
_FOR_GOOD = " and do not come back (slipped, or under another's label)"
_AS_TWO = "where one slipped run the part after by itself, with a standing trial of then"


@dataclass(frozen=True, eq=False)
class Jump:
    """Of a marker between frame - 1 and frame, by so much (3,) m more than it moves."""

    marker: int
    frame: int
    by_m: Array


@dataclass(frozen=True)
class _Stretch:
    """Frames [first, end) in which a marker is off its place, by so much."""

    marker: int
    first: int
    end: int
    by_m: float


def without_jumps(names: tuple[str, ...], markers: Array, time: Array, rate: float) -> tuple[Array, list[Message]]:
    """Markers (T, M, 3) whose exchanged labels are put right, without what lies between a jump and the jump back, and
    of one that does not return without all that follows; a warning of each kind."""
    if not rate >= RATE_HZ or len(markers) < 2 * AROUND:
        return markers, []
    markers = markers.copy()
    found = jumps(markers)
    exchanged = _exchanged(markers, found)
    for (a, b), frames in exchanged.items():
        markers[frames, a], markers[frames, b] = markers[frames, b], markers[frames, a]
    if exchanged:
        found = jumps(markers)
    stretches = _off_place(markers, found, round(START_S * rate))
    for off in stretches:
        markers[off.first : off.end, off.marker] = np.nan
    return markers, _in_words(names, time, exchanged, stretches)


def jumps(markers: Array) -> list[Jump]:
    """All jumps, in the order of time, and what is as large as a jump back alone."""
    step = np.diff(markers, axis=0)
    left = np.full(step.shape, np.nan)
    left[2:-2] = step[2:-2] - by_neighbours(step)
    size = np.linalg.norm(left, axis=2)
    seen = np.isfinite(size)
    with np.errstate(invalid="ignore"):
        suspects = np.argwhere(size > WHOLE * JUMP_M)
    of_all = np.linalg.norm(middle(np.where(seen[..., None], size[..., None], np.nan)), axis=1)
    candidates: dict[int, list[tuple[int, Array]]] = {}
    for m in np.unique(suspects[:, 1]).tolist():
        near = nearest(markers, m)
        own, alone = left[:, m] - middle(left[:, near]), step[:, m] - middle(step[:, near])
        for k in suspects[suspects[:, 1] == m, 0].tolist():
            by_m = _jump(alone, own, k)
            if by_m is not None and float(np.linalg.norm(by_m)) > ALONE * of_all[k]:
                candidates.setdefault(m, []).append((k, by_m))
    found = []
    for m, all_of_it in candidates.items():
        for k, by_m in all_of_it:
            beside = [float(np.linalg.norm(other)) for j, other in all_of_it if j != k and abs(j - k) <= BESIDE]
            if float(np.linalg.norm(by_m)) > max(beside, default=0.0):
                found.append(Jump(m, k + 1, by_m))
    return sorted(found, key=lambda jump: (jump.frame, jump.marker))


def nearest(markers: Array, m: int) -> npt.NDArray[np.intp]:
    """Those (K,) that are nearest to a marker in frames (T, M, 3)."""
    apart = np.linalg.norm(markers - markers[:, m : m + 1], axis=2)
    seen = np.isfinite(apart)
    mean = np.where(seen, apart, 0.0).sum(axis=0) / np.maximum(seen.sum(axis=0), 1)
    mean[~seen.any(axis=0)] = np.inf
    mean[m] = np.inf
    near = np.argsort(mean)[:_NEAR]
    return np.asarray(near[np.isfinite(mean[near])])


def _jump(steps: Array, left: Array, k: int) -> Array | None:
    """The jump (3,) m in step k of a marker, None where there is none. steps, left: (T - 1, 3) of its steps, and what a
    cubic through those beside each leaves of it, less those of the markers near to it."""
    beside = slice(k - BESIDE, k + BESIDE + 1)
    window = left[beside]
    by_m = np.asarray(_SHAPE @ window / (_SHAPE @ _SHAPE))
    size = float(np.linalg.norm(by_m))
    if not size >= WHOLE * JUMP_M:
        return None
    behind = left[beside.stop : k + AROUND][: len(left) - beside.stop - BESIDE]
    lacks = AROUND - BESIDE - 1 - len(behind)
    before = k - AROUND - _FURTHER * lacks
    around = np.concatenate([left[max(before, 0) : beside.start], behind])
    around = around[np.isfinite(around).all(axis=1)]
    if len(around) < AROUND // 2:
        return None
    along = _ALONG * float(np.median(np.abs(around @ by_m))) / size
    noise = max(float(np.median(np.linalg.norm(around, axis=1))), along)
    rest = float(((window - np.outer(_SHAPE, by_m)) ** 2).sum())
    like = rest <= (1.0 - _LIKE) * float((window**2).sum()) + _SCATTER * len(window) * noise**2
    stands_out = float(np.linalg.norm(steps[k] - np.median(np.delete(steps[beside], BESIDE, axis=0), axis=0)))
    return by_m if like and size > NOISE * noise and stands_out > WHOLE * size else None


def middle(values: Array) -> Array:
    """(T, n) medians over the markers (T, K, n) that are seen, 0 where none is."""
    ordered = np.sort(values, axis=1)  # NaN comes last
    n = np.isfinite(values).all(axis=2).sum(axis=1)
    if not values.shape[1]:
        return np.zeros((len(values), values.shape[2]))
    picked = [
        np.take_along_axis(ordered, np.maximum(at, 0)[:, None, None], axis=1)[:, 0] for at in ((n - 1) // 2, n // 2)
    ]
    return np.where(n[:, None] > 0, 0.5 * (picked[0] + picked[1]), 0.0)


def _exchanged(markers: Array, found: list[Jump]) -> dict[tuple[int, int], npt.NDArray[np.bool_]]:
    """Pairs of markers that jump onto each other's place in one frame, and the frames in which they bear each other's
    labels: those that are not as at the start, unless nearly all are."""
    at: dict[tuple[int, int], set[int]] = {}
    for jump in found:
        other = partner(markers[jump.frame - 2 : jump.frame + 1], jump.marker)
        if other is not None:
            at.setdefault((min(jump.marker, other), max(jump.marker, other)), set()).add(jump.frame)
    pairs = {}
    for pair, frames in at.items():
        other_way = np.zeros(len(markers), dtype=bool)
        for frame in sorted(frames):
            other_way[frame:] ^= True
        pairs[pair] = other_way if other_way.mean() <= _MOSTLY else ~other_way
    return pairs


def partner(frames: Array, m: int) -> int | None:
    """The marker with which marker m changes its place in the last of three frames (3, M, 3), where both would be had
    they gone on as before."""
    before, after = 2.0 * frames[1] - frames[0], frames[2]
    way = np.linalg.norm(before - before[m], axis=1)
    miss = np.maximum(np.linalg.norm(after[m] - before, axis=1), np.linalg.norm(after - before[m], axis=1))
    with np.errstate(invalid="ignore"):
        fits = np.where((way > JUMP_M) & (miss < _EXCHANGED * way), miss, np.inf)
    other = int(np.argmin(fits))
    return other if np.isfinite(fits[other]) else None


def _off_place(markers: Array, found: list[Jump], start: int) -> list[_Stretch]:
    """Between a jump and the jump back, or the next gap, after which a marker is found anew; else until it has crept
    back to its place, or to the end. A jump by which one comes to its place ends what began unseen."""
    stretches: list[_Stretch] = []
    for m in dict.fromkeys(jump.marker for jump in found):
        own = [jump for jump in found if jump.marker == m]
        gaps = [first for first, _ in runs(~np.isfinite(markers[:, m, 0]))]
        apart = np.linalg.norm(markers[:, nearest(markers, m)] - markers[:, m : m + 1], axis=2)
        after = 0
        for k, jump in enumerate(own):
            if jump.frame <= after or np.linalg.norm(jump.by_m) < JUMP_M:
                continue
            ends = [next((frame for frame in gaps if frame > jump.frame), len(markers))]
            ends.append(next((later.frame for later in own[k + 1 :] if is_back(jump.by_m, later.by_m)), len(markers)))
            first, before = jump.frame, after
            after = _crept_back(apart, jump, start, min(ends))
            if after == len(markers) and first < start:
                first, after = 0, first  # what lasts is its place
            elif after == len(markers) and _comes_home(apart, jump.frame, start):
                at = usual_distances(apart, range(start))
                home = within(apart, at, BACK * float(np.linalg.norm(jump.by_m)))[before:first]
                first, after = before + 1 + int(np.flatnonzero(home)[-1]) if home.any() else first, first
            if first < after:
                stretches.append(_Stretch(m, first, after, float(np.linalg.norm(jump.by_m))))
    return stretches


def usual_distances(apart: Array, frames: range) -> Array:
    """(K,) usual distances of a marker from those near it in some frames; NaN where they are not seen."""
    some = apart[frames.start : frames.stop]
    seen = np.isfinite(some).any(axis=0)
    return np.where(seen, np.nanmedian(np.where(seen, some, 0.0), axis=0), np.nan)


def within(apart: Array, usual: Array, by_m: float) -> npt.NDArray[np.bool_]:
    """(T,) whether all distances (T, K) are the usual ones (K,), of those that are known."""
    known = np.isfinite(usual)
    with np.errstate(invalid="ignore"):
        return np.asarray((np.abs(apart - usual)[:, known] < by_m).all(axis=1))


def _comes_home(apart: Array, frame: int, start: int) -> bool:
    """Whether a marker lies among those near to it as at the start rather after a jump than before."""
    parts = range(start), range(max(frame - start, 0), frame), range(frame, frame + start)
    home, before, behind = (usual_distances(apart, part) for part in parts)
    known = np.isfinite(home + before + behind)
    return bool(known.any() and np.linalg.norm((behind - home)[known]) < np.linalg.norm((before - home)[known]))


def _crept_back(apart: Array, jump: Jump, start: int, end: int) -> int:
    """The frame before ``end`` from which a marker is as far from those near to it (T, K) as before the jump, as far as
    these distances show the jump; ``end`` where it never is."""
    frame = jump.frame
    usual = np.median(apart[max(frame - start, 0) : frame], axis=0)
    if not np.isfinite(usual).any():
        return end
    there = within(apart[frame:end], usual, BACK * float(np.linalg.norm(jump.by_m)))
    if there[: BESIDE + 1].all():
        return end
    stays = [frame + first for first, past in runs(there) if first > 0 and past - first >= start // 2]
    return min(stays, default=end)


def is_back(by_m: Array, later_m: Array) -> bool:
    """Whether the second of two jumps (3,) m of a marker takes the first one back."""
    sizes = float(np.linalg.norm(by_m)), float(np.linalg.norm(later_m))
    cosine = float(by_m @ later_m) / (sizes[0] * sizes[1])
    return cosine < _OPPOSITE and max(sizes) < _AS_LARGE * min(sizes)


def _in_words(
    names: tuple[str, ...],
    time: Array,
    exchanged: dict[tuple[int, int], npt.NDArray[np.bool_]],
    stretches: list[_Stretch],
) -> list[Message]:
    said = []
    if exchanged:
        pairs = [
            f"{names[a]} and {names[b]} from {spans(time, runs(frames), _MOST)}" for (a, b), frames in exchanged.items()
        ]
        said.append(
            warning(
                "labels",
                f"the labels of {_listed(pairs)} are swapped: both markers jump within one frame, each to the place of "
                "the other. They are put right; correct them in the recording.",
            )
        )
    for kind, do in (("", "correct the labels, or delete what is no marker"), (_FOR_GOOD, _AS_TWO)):
        who = [
            f"{names[off.marker]} by {1000.0 * off.by_m:.0f} mm from {span(time, off.first, off.end)}"
            for off in stretches
            if (off.end == len(time)) is bool(kind)
        ]
        if who:
            said.append(
                warning(
                    "labels",
                    f"within one frame markers jump off their place{kind}: {_listed(who)}. They are taken as missing "
                    f"then; look at the film, and {do}.",
                )
            )
    return said


def _listed(items: list[str]) -> str:
    more = f" and {len(items) - _MOST} more" if len(items) > _MOST else ""
    return "; ".join(items[:_MOST]) + more
