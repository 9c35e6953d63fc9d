"""Markers as they come, without what is no measurement: frames that repeat, places that are held, jumps off their
place; labels that are swapped meanwhile are put right. The rules of `recordings.formats` by the frames until now."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from dynakin.arrays import Array, Flags
from dynakin.messages import Message, warning
from dynakin.recordings.formats.filled import held_so_far, repeated_so_far
from dynakin.recordings.formats.jumps import (
    ALONE,
    AROUND,
    BACK,
    BESIDE,
    JUMP_M,
    NOISE,
    RATE_HZ,
    START_S,
    WHOLE,
    is_back,
    jumps,
    middle,
    nearest,
    partner,
    usual_distances,
    within,
)

_KEPT = 4 * AROUND + 4 * BESIDE
_DECIDED = 2 * BESIDE
"""So many frames after a leap the offline rule says whether it was a jump; until then the marker is left out."""
_LEAP, _LANDS = 0.8, 2.0
"""Part of a jump, and times what half of those near it leap by, from which a marker is left out until it is decided. On
real recordings 1 of 8000 samples is, for nothing (a third of them in a drop jump's landing and a foot's turns), of
jumps of 20 and 30 mm as many are found as of a file (81 and 100 %, 88 and 99)."""
_LEAST = 4  # frames before one that can be judged
_CONTINUES = 0.5
"""Of what two markers leap by, at most, is left where each goes on as the other: their labels have changed places."""
_CLEARLY = 0.5
"""Whether labels still are exchanged is told where one way misses the distances to those near by at most so large a
part of what the other way does."""
_STAYS_M = 0.001  # by which the distance of two markers on one segment changes
_AGAIN_S = 60.0  # the same of the same marker is said once in so long


@dataclass(eq=False)
class _Off:
    """A marker off its place since a frame, by so much (3,) m, if it is a jump at all.

    Attributes:
        near: (K,) markers by which its place is known, usual: (K,) m, as far as it was from them before.
        sure: whether it is a jump. age: frames since. back: frames in which it has been as far from them, in a row.
        shows: whether these distances show the jump.
    """

    by_m: Array
    near: npt.NDArray[np.intp]
    usual: Array
    sure: bool = False
    age: int = 0
    back: int = 0
    shows: bool = False


@dataclass(eq=False)
class _Doubt:
    """Exchanged labels that may have changed back while one of them was not seen.

    Attributes:
        near: for each of them, (K,) markers by which its place is known. usual: (K,) m, as far as it was from them.
        by: (K,) how much each counts, more where the distance stays what it is.
    """

    near: list[npt.NDArray[np.intp]]
    usual: list[Array]
    by: list[Array]

    def misses_m(self, positions: Array, places: Array) -> Array:
        """How far each place (G, 3) is from being theirs, by what is seen near them (M, 3); NaN where nothing is."""
        found = np.full(len(places), np.nan)
        for k, (near, usual, by) in enumerate(zip(self.near, self.usual, self.by, strict=True)):
            miss = np.abs(np.linalg.norm(positions[near] - places[k], axis=1) - usual)
            if (known := np.isfinite(miss)).any():
                found[k] = np.average(miss[known], weights=by[known])
        return found


class LiveMarkers:
    """Takes each frame of a stream, in order, and says which of its samples are none.

    Args:
        names: of the stream's markers. rate_hz: of its frames; below 60 Hz nobody tells a jump from a fast limb.
    """

    def __init__(self, names: tuple[str, ...], rate_hz: float) -> None:
        self._names, self._rate = names, rate_hz
        self._kept: deque[Array] = deque(maxlen=_KEPT)  # labels put right, without what repeats and is held
        self._last = np.full((len(names), 3), np.nan)  # with it
        self._begun: list[Array] = []  # the first frames: where markers belong
        self._order = np.arange(len(names))
        self._doubts: dict[tuple[int, ...], _Doubt] = {}  # of labels that are exchanged
        self._unclear: set[int] = set()
        self._off: dict[int, _Off] = {}
        self._held: set[int] = set()
        self._time, self._same, self._repeats = -np.inf, 0, False
        self._news: list[Message] = []
        self._said: dict[tuple[str, int], float] = {}
        self.left_out = 0
        """Frames so far in which some marker was left out, or all."""

    def news(self) -> list[Message]:
        """What there is to say since it was asked last."""
        found, self._news = self._news, []
        return found

    def look(self, time_s: float, positions: Array) -> Array:
        """The next frame (M, 3) m, NaN where it is no measurement; the same array where all of it is one."""
        if not 0.0 < time_s - self._time < 1.5 / self._rate:
            for group in self._exchanged():
                self._doubt(group)
            self._kept.clear()  # what lies between is not known: after a gap markers are found anew, as in a file
            self._off.clear()
            self._last = np.full_like(self._last, np.nan)
        self._time = time_s
        self._unclear.clear()
        if not (self._order[1:] > self._order[:-1]).all():
            positions = self._put_right(time_s, positions)
        last, self._last = self._last, positions
        still = (positions == last).all(axis=1)
        if still.any():
            if self._all_repeat(time_s, positions, last, still):
                self._kept.append(np.full_like(positions, np.nan))
                self.left_out += 1
                return self._kept[-1]
            self._hold(time_s, positions, still)
        elif self._held or self._same:
            self._held.clear()
            self._same, self._repeats = 0, False
        if self._held:
            positions = positions.copy()
            positions[sorted(self._held)] = np.nan
        if len(self._kept) >= _LEAST and self._rate >= RATE_HZ:
            bends = positions - 2.0 * self._kept[-1] + self._kept[-2]
            size = np.einsum("ij,ij->i", bends, bends)
            if np.fmax.reduce(size, initial=0.0) > (WHOLE * JUMP_M) ** 2:
                positions = self._leap(time_s, positions, np.flatnonzero(size > (WHOLE * JUMP_M) ** 2))
        self._kept.append(positions)
        if len(self._begun) < START_S * self._rate:
            self._begun.append(positions)
        if self._off:
            self._follow(time_s, positions)
        return self._without(positions)

    def _exchanged(self) -> list[tuple[int, ...]]:
        """Markers that have each other's labels: pairs, or more."""
        groups = []
        for m in range(len(self._order)):
            group = [m]
            while self._order[group[-1]] > m:
                group.append(int(self._order[group[-1]]))
            if len(group) > 1 and self._order[group[-1]] == m:
                groups.append(tuple(group))
        return groups

    def _doubt(self, group: tuple[int, ...]) -> None:
        """Labels may change back from now on: where they were among those near is what tells."""
        if group in self._doubts:
            return
        kept = np.stack(self._kept)
        others = kept.copy()
        others[:, group] = np.nan
        doubt = _Doubt([], [], [])
        for m in group:
            others[:, m] = kept[:, m]
            near = nearest(others, m)
            apart = np.linalg.norm(kept[:, near] - kept[:, m : m + 1], axis=2)
            off = np.abs(apart - (usual := usual_distances(apart, range(len(kept)))))
            doubt.near.append(near)
            doubt.usual.append(usual)
            doubt.by.append(1.0 / (_STAYS_M + usual_distances(off, range(len(off)))))
            others[:, m] = np.nan
        self._doubts[group] = doubt

    def _put_right(self, time_s: float, came: Array) -> Array:
        """The frame with labels put right. Of those that were not seen for a while, or after a gap, the distances to
        others say whether they still are exchanged; until these do, they are missing."""
        groups = self._exchanged()
        self._doubts = {group: doubt for group, doubt in self._doubts.items() if group in groups}
        for group in groups:
            if not np.isfinite(came[list(group), 0]).all():
                self._doubt(group)
        sure = came[self._order]
        sure[[m for group in self._doubts for m in group]] = np.nan
        for group, doubt in list(self._doubts.items()):
            own = list(group)
            seen = np.isfinite(came[own, 0])
            other_way, as_it_comes = (doubt.misses_m(sure, came[which]) for which in (self._order[own], own))
            known = (np.isfinite(as_it_comes) == seen).all() and np.isfinite(other_way).sum() == seen.sum()
            a, b = float(np.nansum(other_way)), float(np.nansum(as_it_comes))
            if known and a < _CLEARLY * b:
                if seen.all():
                    del self._doubts[group]
                continue
            never = not all(np.isfinite(usual).any() for usual in doubt.usual)
            if never or (known and seen.any() and (b < _CLEARLY * a or seen.all())):
                self._order[own] = own
                del self._doubts[group]
                if never or b >= _CLEARLY * a:
                    names = " and ".join(self._names[m] for m in own)
                    self._say(
                        time_s, "as they come", own[0], f"whether the labels of {names} still are exchanged cannot be "
                        f"told after a gap, at {time_s:.2f} s. They are taken as they come; look at them.",
                    )  # fmt: skip
                continue
            self._unclear.update(m for m in own if np.isfinite(came[self._order[m], 0]))
        positions = came[self._order]
        positions[sorted(self._unclear)] = np.nan
        return positions

    def _without(self, positions: Array) -> Array:
        gone = self._held | self._off.keys() | self._unclear
        if not gone:
            return positions
        self.left_out += 1
        positions = positions.copy()
        positions[sorted(gone)] = np.nan
        return positions

    def _all_repeat(self, time_s: float, positions: Array, last: Array, still: Flags) -> bool:
        """Whether the frame is the one before to the last bit while the person moves."""
        seen = np.isfinite(positions[:, 0])
        if not (still == seen).all() or np.isfinite(last[~seen]).any():
            self._same, self._repeats = 0, False
            return False
        self._same += 1
        if self._same == 1:
            self._repeats = repeated_so_far(np.stack(self._kept), self._rate, len(self._kept) - 1)
        if self._repeats:
            self._say(
                time_s, "repeats", -1, "frames repeat the one before to the last digit while the person moves, first "
                f"at {time_s:.2f} s. They are taken as missing; look whether the capture system fills frames.",
            )  # fmt: skip
        return self._repeats

    def _hold(self, time_s: float, positions: Array, still: Flags) -> None:
        """Which markers are held where they were."""
        self._held &= set(np.flatnonzero(still).tolist())
        for m in np.flatnonzero(still).tolist():
            if m in self._held:
                continue
            first = len(self._kept) - 1
            while first > 0 and (self._kept[first - 1][m] == positions[m]).all():
                first -= 1
            if held_so_far(np.stack([*self._kept, positions]), m, first):
                self._held.add(m)
                for frame in range(first + 1, len(self._kept)):
                    self._kept[frame] = self._kept[frame].copy()
                    self._kept[frame][m] = np.nan
                self._say(
                    time_s, "held", m, f"{self._names[m]} stays where it was to the last digit while all near it goes "
                    f"on, first at {time_s:.2f} s: a gap that was filled. It is taken as missing then; turn off gap "
                    "filling in the capture system.",
                )  # fmt: skip

    def _leap(self, time_s: float, positions: Array, suspects: npt.NDArray[np.intp]) -> Array:
        """The frame with labels put right; markers that leap are off their place from now on, those that leap back are
        not any more."""
        window = np.stack([*self._kept, positions])
        of_all = float(np.linalg.norm(middle(_leaps(window[-5:]))))
        leaps: dict[int, Array] = {}
        for m in suspects.tolist():
            near = nearest(window[-2:-1], m)
            own = _leaps(window[-2 * AROUND :, [m, *near]])
            beside = own[:, 1:]
            alone = own[:, 0] - middle(beside)
            if (off := self._off.get(m)) is not None:
                if is_back(off.by_m, alone[-1]):
                    del self._off[m]
                continue
            usual = np.linalg.norm(alone[-AROUND - 1 : -1], axis=1)
            usual = usual[np.isfinite(usual)]
            size = float(np.linalg.norm(alone[-1]))
            noise = float(np.median(usual)) if len(usual) >= AROUND // 2 else np.inf
            lands = float(np.median(np.linalg.norm(beside[-1], axis=1)))
            if size > max(_LEAP * JUMP_M, NOISE * noise, ALONE * of_all, _LANDS * lands):
                leaps[m] = alone[-1]
        for m in list(leaps):
            other = partner(window[-3:], m) if m in leaps else None
            if other in leaps and other is not None and self._changed_places(window, m, other):
                positions = positions.copy()
                positions[[m, other]] = positions[[other, m]]
                self._order[[m, other]] = self._order[[other, m]]
                del leaps[m], leaps[other]
                a, b = self._names[m], self._names[other]
                self._say(
                    time_s, "swapped", min(m, other), f"the labels of {a} and {b} change places at {time_s:.2f} s: "
                    "both markers jump within one frame, each to the place of the other. They are put right; correct "
                    "them in the capture system.",
                )  # fmt: skip
        for m, by_m in leaps.items():
            if (window[-2, m] == window[-3, m]).all() or self._home(window, m, len(window) - 1, by_m):
                continue
            near = nearest(window[:-1], m)
            apart = np.linalg.norm(window[:-1, near] - window[:-1, m : m + 1], axis=2)[-round(START_S * self._rate) :]
            self._off[m] = _Off(by_m, near, np.median(apart, axis=0))
        return positions

    def _home(self, window: Array, m: int, frame: int, by_m: Array) -> bool:
        """Whether a marker comes to its place by a leap in a frame of the last ones (T, M, 3): it was off it before,
        unseen (`recordings.formats.jumps`)."""
        every = np.concatenate([np.stack(self._begun), window])
        apart = np.linalg.norm(every[:, nearest(every, m)] - every[:, m : m + 1], axis=2)
        begun = len(self._begun)
        usual, apart = usual_distances(apart, range(begun)), apart[begun:]
        size = float(np.linalg.norm(by_m))
        off = ~within(apart[max(frame - BESIDE, 0) : frame], usual, 2.0 * BACK * size)
        return bool(off.all() and within(apart[frame:], usual, BACK * size).all())

    @staticmethod
    def _changed_places(window: Array, a: int, b: int) -> bool:
        """Whether two markers that leap in the last frame (T, M, 3) go on smoothly, each as the other."""
        bends = window[-1] - 2.0 * window[-2] + window[-3]
        put_right = bends[[a, b]] + window[-1, [b, a]] - window[-1, [a, b]]
        sizes = np.linalg.norm(put_right, axis=1), np.linalg.norm(bends[[a, b]], axis=1)
        return bool((sizes[0] < _CONTINUES * sizes[1]).all())

    def _follow(self, time_s: float, positions: Array) -> None:
        """Markers off their place: whether it is a jump, and whether they are back."""
        for m, off in list(self._off.items()):
            off.age += 1
            if not np.isfinite(positions[m]).all():  # found anew after a gap
                del self._off[m]
                continue
            apart = np.linalg.norm(positions[off.near] - positions[m], axis=1)
            there = bool(within(apart[None], off.usual, BACK * float(np.linalg.norm(off.by_m)))[0])
            off.shows |= off.age <= BESIDE + 1 and not there and bool(np.isfinite(off.usual).any())
            off.back = off.back + 1 if there else 0
            if off.age == _DECIDED + 1:
                frame = len(self._kept) - 1 - _DECIDED
                found = [jump for jump in jumps(np.stack(self._kept)) if jump.marker == m and jump.frame == frame]
                off.sure = bool(found) and float(np.linalg.norm(found[0].by_m)) > JUMP_M
                off.sure = off.sure and not self._home(np.stack(self._kept), m, frame, off.by_m)
                if not off.sure:
                    del self._off[m]
                    continue
                by_mm = 1000.0 * float(np.linalg.norm(found[0].by_m))
                since = time_s - _DECIDED / self._rate
                self._say(
                    time_s, "jumps", m, f"within one frame {self._names[m]} jumps off its place, by {by_mm:.0f} mm at "
                    f"{since:.2f} s. It is taken as missing until it is back; look at it, and where it slipped "
                    "stand again (recalibrate).",
                )  # fmt: skip
            if off.sure and off.shows and off.back >= round(START_S * self._rate) // 2:
                del self._off[m]

    def _say(self, time_s: float, what: str, m: int, text: str) -> None:
        if not 0.0 <= time_s - self._said.get((what, m), -np.inf) < _AGAIN_S:
            self._said[what, m] = time_s
            self._news.append(warning("recording" if what in ("repeats", "held") else "labels", text))


def _leaps(frames: Array) -> Array:
    """(T - 4, M, 3) by what each step to a frame (T, M, 3) is more than the middle one of the three before it."""
    steps = np.diff(frames, axis=0)
    a, b, c = steps[:-3], steps[1:-2], steps[2:-1]
    return np.asarray(steps[3:] - np.maximum(np.minimum(a, b), np.minimum(np.maximum(a, b), c)))
