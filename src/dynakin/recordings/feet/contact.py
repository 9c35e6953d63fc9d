"""When each foot stands, from its markers and what may support it: near a support, and slow against it.

A support is the floor, a belt that moves (`belt`), or something higher: a step, a box. Higher ones are believed where a
plate that is loaded under the foot, or that nothing else bears the person, says so: a foot may also be held in the air.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from dynakin.arrays import Array, Flags, runs, widened
from dynakin.recordings.feet.belt import belt_velocities
from dynakin.recordings.feet.places import filled_by_others, flat_heights, foot_places, lowest_together
from dynakin.recordings.frame import GroundFrame
from dynakin.recordings.hull import distance_to_hull
from dynakin.recordings.plates.ground_plate import SAME_LEVEL_M, SHOE_M, UNDER_MARKERS_M, GroundPlate, floor_height
from dynakin.recordings.recording import Recording
from dynakin.recordings.standing import marker_velocities

NO_CONTACT, ON_PLATE, UNMEASURED, SHARED_PLATE = range(4)
"""Status of a contact, which is a segment that something may push (a foot), in a frame: nothing touches it and its
wrench is zero; plates bear it; it touches something that measures nothing. Codes of ``foot_contact``."""
NEAR_SUPPORT_M = 0.025
"""Height of a marker over its place when standing flat (its 5th percentile, raised by the support) up to which the skin
under it may touch the support."""
SLOW_M_S = 0.5
"""Speed against the support up to which a foot stands, of a marker, or of the point that the foot turns about
(`pivots`). A swinging toe passes the floor within 2 cm too, but at 1.5 to 5 m/s."""
GAP_S = 0.08
"""Shorter interruptions of a stance, or stances, are none: a foot takes 0.2 s and more for a step."""
ALOFT_M = 0.05
"""Height from which a moving foot touches no floor: twice what the skin of a standing foot rises by."""
BEFORE_S, AFTER_S = 0.05, 0.15
"""A foot may bear load that long before its markers are slow (heel strike), and after the last one has left the floor
(push-off: the toe rolls on while the marker over it rises)."""
SETS_DOWN_M_S, SETS_DOWN_S = 2.0, 0.12
"""Nearer than `NEAR_SUPPORT_M` and slower than that a foot may be setting down, so long before its markers are slow: of
truth's walks heels touch at 0.3 to 1.1 m/s, up to 0.09 s before (chosen), of quick ones at 0.5 to 1.5 (judged)."""
LEVEL_M_S, RESTS_S = 0.15, 0.15
"""A foot rests on something higher where it keeps its height to that speed, for so long: at the top of its swing, or of
a jump, it does for 0.05 s."""
ALONE_M = 0.03
"""How far from the markers of a flat foot a centre of pressure lies that it may bear alone, or what it turns about: of
feet on plates of their own it comes to 0.012."""
NEAR_M = 0.10
"""How far a centre of pressure may lie from the outline of a foot's markers: a shoe is some cm wider than these."""
COP_REFUSED_M = 0.30
"""Centre of pressure outside the outline of the markers of the nearest foot, from which the plate's place or unit must
be wrong. From `NEAR_M` on it is said."""


@dataclass(frozen=True, eq=False)
class FootContact:
    """What the markers show of one foot.

    Attributes:
        outline: (T, K, 2) m, horizontal places [X, Z of the ground] of its markers, NaN where not seen.
        rise_m: (T, K) height of each marker over its place when the foot stands flat on the floor, NaN where not seen.
        seen: (T,) one of its markers is, for more than one frame.
        under: (T, P) plates whose centre of pressure lies within or near its outline.
        support_m: (T,) height of what it stands on; in between, on the straight line from one to the next.
        support_velocity: (T, 2) m/s, horizontal: a belt's, else 0.
        touching: (T, K) markers that are near the support and slow against it.
        stands: (T,) in a stance; short gaps closed.
        stances: frames [first, end) of each stance, not padded.
        low: (T,) one of its markers is not high over its own lowest place.
        near: (T,) one of its markers is near the support and no faster than of a foot that sets down.
        moves: (T,) all of its markers seen move against the support.
        aloft: (T,) it moves, and all of its markers seen are high. A foot on a pedal is aloft too.
    """

    outline: Array
    rise_m: Array
    seen: Flags
    under: Flags
    support_m: Array
    support_velocity: Array
    touching: Flags
    stands: Flags
    stances: tuple[tuple[int, int], ...]
    low: Flags
    near: Flags
    moves: Flags
    aloft: Flags

    def padded(self, stance: tuple[int, int], rate: float) -> slice:
        """The frames in which this stance may bear load, as far as markers show."""
        before, after = round(BEFORE_S * rate), round(AFTER_S * rate)
        return slice(max(0, stance[0] - before), min(len(self.stands), stance[1] + after))

    def sets_down_from(self, frame: int, rate: float) -> int:
        """The first of the frames before this one from which on it may be setting down."""
        first, reach = frame, round(SETS_DOWN_S * rate) if len(self.near) > 1 else 0  # one frame has no rate
        while first > max(0, frame - reach) and self.near[first - 1]:
            first -= 1
        return first

    def bears(self, rate: float) -> Flags:
        """(T,) frames in which one of its stances may bear load, or nobody sees it, or just before or after that."""
        around = round(2.0 * BEFORE_S * rate) if len(self.seen) > 1 else 0  # one frame has no rate
        found: Flags = widened(~self.seen, around)
        for stance in self.stances:
            found[self.padded(stance, rate)] = True
        return found


def foot_contacts(
    recording: Recording,
    ground: GroundFrame,
    markers: Mapping[str, Sequence[str]],
    plates: Sequence[GroundPlate] = (),
) -> dict[str, FootContact]:
    """Contact of each foot, of those that the recording has markers of.

    Args:
        markers: foot -> names of its markers (heel, toe, ...).
        plates: what may say that a foot stands higher than the floor.
    """
    velocity = ground.vectors_to_ground(marker_velocities(recording))
    body = middle_velocity(velocity)
    floor = floor_height(recording, ground)
    seen = foot_places(recording, ground, markers)
    weighed = any(plate.loaded.any() for plate in plates)  # without them a foot may stand on a step all the time
    flats = flat_heights([places for _, places in seen.values()], NEAR_SUPPORT_M, ALOFT_M if weighed else np.inf)
    rests = RESTS_S * recording.rate if recording.n_frames > 1 else np.inf
    flats = [
        lowest_together(places, velocity[:, columns], flat, NEAR_SUPPORT_M, LEVEL_M_S, rests)
        for (columns, places), flat in zip(seen.values(), flats, strict=True)
    ]
    with np.errstate(invalid="ignore"):
        low = [
            (velocity[:, columns], places[:, :, 1] - flat < NEAR_SUPPORT_M)
            for (columns, places), flat in zip(seen.values(), flats, strict=True)
        ]
    belts = belt_velocities(low, body, recording.time)
    feet = {
        foot: _Foot(places, flat, velocity[:, columns], belt, recording, floor, plates)
        for (foot, (columns, places)), flat, belt in zip(seen.items(), flats, belts, strict=True)
    }
    _settle(list(feet.values()))
    return {name: foot.contact() for name, foot in feet.items()}


def pivots(places: Array, velocity: Array) -> Flags:
    """(T,) frames in which markers (T, K, 3) m turn about a point at or near them that is slow: a foot that turns on
    its ball, or on its heel, stands there, though none of its markers is slow."""
    seen = np.asarray(np.isfinite(places).all(axis=2) & np.isfinite(velocity).all(axis=2))
    count = np.maximum(seen.sum(axis=1), 1)[:, None]
    at, moves = (np.where(seen[..., None], values[..., [0, 2]], 0.0) for values in (places, velocity))
    climbs = np.abs(np.where(seen, velocity[..., 1], 0.0).sum(axis=1) / count[:, 0])
    middle, drift = at.sum(axis=1) / count, moves.sum(axis=1) / count
    at, moves = (np.where(seen[..., None], v - m[:, None], 0.0) for v, m in ((at, middle), (moves, drift)))
    turn = (at[..., 0] * moves[..., 1] - at[..., 1] * moves[..., 0]).sum(axis=1)
    turn = turn / np.maximum(np.square(at).sum(axis=(1, 2)), 1e-9)  # rad/s about the vertical
    turn = np.where(np.abs(turn) > 1e-6, turn, 1e-6)  # so slow a turn is about a point that is far off
    pivot = middle + np.stack([-drift[:, 1], drift[:, 0]], axis=1) / turn[:, None]
    away = distance_to_hull(pivot, np.where(seen[..., None], places[..., [0, 2]], np.nan))
    with np.errstate(invalid="ignore"):
        slow = np.hypot(turn * away, climbs) < SLOW_M_S
        return np.asarray((seen.sum(axis=1) > 1) & (away < ALONE_M) & slow)


def _settle(feet: list[_Foot]) -> None:
    """Believe that feet rest on what is higher than the floor: where a plate carries one, also if the recording cuts
    that off; then, the longest first, where no other one stands for a while, or one stands that is on a level with
    it."""
    for cut_off in (False, True):
        for foot in feet:
            others = [other for other in feet if other is not foot]
            rests = foot.cut_off if cut_off else foot.waiting
            for rest in [one for one in rests if foot.carried(one, others, on_its_level=cut_off)]:
                foot.believe(rest)
    while True:
        waiting = [(rest[0].stop - rest[0].start, k, rest) for k, foot in enumerate(feet) for rest in foot.waiting]
        for _, k, rest in sorted(waiting, key=lambda one: -one[0]):
            others = [foot for at, foot in enumerate(feet) if at != k]
            if feet[k].alone(rest[0], others) or feet[k].level_with(rest, others):
                feet[k].believe(rest)
                break
        else:
            return


def middle_velocity(velocity: Array) -> Array:
    """(T, 3) m/s: the median over markers (T, M, 3), NaN where none is seen."""
    found = np.full((len(velocity), 3), np.nan)
    seen = np.asarray(np.isfinite(velocity)).any(axis=(1, 2))
    if seen.any():
        found[seen] = np.nanmedian(velocity[seen], axis=1)
    return found


class _Foot:
    """One foot while its contact is worked out."""

    def __init__(
        self,
        places: Array,
        flat: Array,
        velocity: Array,
        belt: Array,
        recording: Recording,
        floor_m: float,
        plates: Sequence[GroundPlate],
    ) -> None:
        self.places, self.plates, self.floor_m = places, plates, floor_m
        self.rate, n = recording.rate, recording.n_frames
        self.frames = (lambda seconds: max(1, round(seconds * self.rate))) if n > 1 else (lambda seconds: 1)
        self.flat, self.belt = flat, belt  # (K,) heights of the markers, standing flat
        self.rise = places[:, :, 1] - flat
        with np.errstate(invalid="ignore"):
            against = velocity - np.stack([self.belt[:, 0], np.zeros(n), self.belt[:, 1]], axis=1)[:, None]
            self.speed = np.linalg.norm(against, axis=2)
            self.slow = (self.speed < SLOW_M_S) | (pivots(places, against)[:, None] & np.isfinite(self.speed))
            base = (self.rise < NEAR_SUPPORT_M) & self.slow
        lowest = np.where(np.isfinite(self.rise), self.rise, np.inf).min(axis=1)
        self.lift = np.where(np.isfinite(lowest), lowest, np.nan)  # (T,) of the foot's lowest part
        self.outline = filled_by_others(places[:, :, [0, 2]])
        self.away = [distance_to_hull(plate.cop, self.outline) for plate in plates]
        self.near = [away < NEAR_M for away in self.away]
        # of what is seen for one frame alone nobody knows whether it stands
        self.seen = np.asarray(np.isfinite(self.speed).any(axis=1)) if n > 1 else np.isfinite(self.lift)
        self.touching, self.level = np.zeros_like(base), np.full(n, np.nan)
        self.waiting: list[tuple[slice, float]] = []  # frames in which it may rest, and its lift there
        if float(np.min(self.flat)) - floor_m < SHOE_M:
            self.touching, self.level = base, np.where(base.any(axis=1), 0.0, np.nan)
        else:
            self.waiting += [(slice(*run), 0.0) for run in runs(_closed(base.any(axis=1), self.frames(GAP_S)))]
        higher = self._higher()
        self.waiting += [rest for rest in higher if self._lasts(rest[0])]
        self.cut_off = [rest for rest in higher if not self._lasts(rest[0])]

    @property
    def stands(self) -> Flags:
        return _closed(np.asarray(self.touching.any(axis=1)), self.frames(GAP_S), self.seen)

    def _higher(self) -> list[tuple[slice, float]]:
        """Stretches in which the foot keeps a height over its lowest place, slow; shorter ones (`RESTS_S`) only where
        the recording cuts them off."""
        if len(self.lift) < 2:
            return []
        half = self.frames(0.05)
        at = np.arange(len(self.lift))
        after, before = np.minimum(at + half, len(at) - 1), np.maximum(at - half, 0)
        with np.errstate(invalid="ignore"):
            climbs = np.abs(self.lift[after] - self.lift[before]) * self.rate / (after - before)
            level = self.slow.any(axis=1) & (self.lift > NEAR_SUPPORT_M) & (climbs < LEVEL_M_S)
        found = []
        for first, end in runs(_closed(np.asarray(level), self.frames(GAP_S))):
            if self._lasts(slice(first, end)) or first == 0 or end == len(self.lift):
                found.append((slice(first, end), float(np.nanpercentile(self.lift[first:end], 10.0))))
        return found

    def _lasts(self, frames: slice) -> bool:
        return bool(frames.stop - frames.start >= RESTS_S * self.rate)

    def believe(self, rest: tuple[slice, float]) -> None:
        """That it stands in these frames, so much higher than its lowest place."""
        self.waiting = [one for one in self.waiting if one is not rest]
        frames, lift = rest
        with np.errstate(invalid="ignore"):
            on = self.slow & (np.abs(self.rise - lift) < NEAR_SUPPORT_M)
        grown = _around(np.asarray(on.any(axis=1)), frames)
        self.touching[grown] |= on[grown]
        self.level[grown] = np.where(on[grown].any(axis=1), lift, self.level[grown])

    def alone(self, frames: slice, others: Sequence[_Foot]) -> bool:
        """Whether no other foot stands for a while in these frames."""
        stand = np.any([foot.stands[frames] for foot in others], axis=0) if others else np.zeros(1, dtype=bool)
        lasts = [end - first for first, end in runs(np.asarray(~stand))]
        return not others or max(lasts, default=0) >= RESTS_S * self.rate

    def level_with(self, rest: tuple[slice, float], others: Sequence[_Foot]) -> bool:
        """Whether a foot that stands in these frames does so at the same height."""
        own = float(np.min(self.flat)) + rest[1]
        heights = [float(np.min(foot.flat)) + foot.level[rest[0]] for foot in others]
        return any(bool((np.abs(height - own) < SAME_LEVEL_M).any()) for height in heights)

    def carried(self, rest: tuple[slice, float], others: Sequence[_Foot], *, on_its_level: bool) -> bool:
        """Whether a plate, or one of that height, is loaded under the foot for most of these frames, where no other
        foot that stands may bear it alone: who stands on one leg holds the other foot beside it."""
        frames, lowest = rest[0], float(np.min(self.flat)) + rest[1]
        for p, plate in enumerate(self.plates):
            if on_its_level and plate.height_m is not None and not self._on(lowest, plate.height_m):
                continue
            own = self.near[p][frames] & plate.loaded[frames]
            for other in others:
                own &= ~(other.stands & (other.away[p] < ALONE_M))[frames]
            if np.count_nonzero(own) > 0.5 * (frames.stop - frames.start):
                return True
        return False

    def contact(self) -> FootContact:
        """What was found."""
        stands = self.stands
        stances = tuple(runs(stands))
        levels = [self._level(first, end) for first, end in stances]
        base, heights = self._heights(stances, levels)
        with np.errstate(invalid="ignore"):
            over = self.rise - self._between(stances, levels)[:, None]
            high, fast = over > ALOFT_M, (self.speed > SLOW_M_S) & ~self.slow
            least = np.minimum(np.minimum(over, self.rise), self._over_plates(base))
            low = np.asarray((least < ALOFT_M).any(axis=1))
            near = np.asarray(((least < NEAR_SUPPORT_M) & (self.speed < SETS_DOWN_M_S)).any(axis=1))
        unseen = ~np.isfinite(self.rise)
        moves = np.asarray(self.seen & (fast | unseen).all(axis=1))
        aloft = np.asarray(moves & (high | unseen).all(axis=1))
        under = np.stack(self.near, axis=1) if self.near else np.zeros((len(stands), 0), dtype=bool)
        support = self._between(stances, heights)
        return FootContact(
            self.outline, self.rise, self.seen, under, support, self.belt, self.touching, stands, stances, low, near,
            moves, aloft,
        )  # fmt: skip

    def _level(self, first: int, end: int) -> float:
        """How much higher than its lowest place the foot stands in a stance, m."""
        own = self.level[first:end]
        return float(np.nanmedian(own)) if np.isfinite(own).any() else 0.0

    def _between(self, stances: Sequence[tuple[int, int]], values: Sequence[float]) -> Array:
        """(T,) the stances' own values, and straight lines from one to the next."""
        if not stances:
            return np.full(len(self.lift), values[0] if len(values) else 0.0)
        at = [edge for first, end in stances for edge in (first, end - 1)]
        return np.asarray(np.interp(np.arange(len(self.lift)), at, np.repeat(values, 2)))

    def _over_plates(self, base_m: float) -> Array:
        """(T, K) m, as `rise`, over a loaded plate that the foot is not below, where one is under it; inf elsewhere: of
        one that has just set down on the next step no stance shows that. Its lowest place stands on ``base_m``."""
        found = np.full_like(self.rise, np.inf)
        for near, plate in zip(self.near, self.plates, strict=True):
            if plate.height_m is not None:
                over = self.rise - (plate.height_m - base_m)
                here = (near & plate.loaded)[:, None] & (over > -NEAR_SUPPORT_M)
                found = np.where(here, np.minimum(found, over), found)
        return found

    def _heights(self, stances: Sequence[tuple[int, int]], levels: Sequence[float]) -> tuple[float, list[float]]:
        """Heights (m) of what its lowest place stands on, and of what each stance does: of the plate that carries it,
        or by its level over the others; the former alone, where there is no stance."""
        least = float(np.min(self.flat))
        plates: list[float | None] = []
        for (first, end), level in zip(stances, levels, strict=True):
            found = None
            for near, plate in zip(self.near, self.plates, strict=True):
                carries = np.count_nonzero(near[first:end] & plate.loaded[first:end]) > 0.5 * (end - first)
                if carries and plate.height_m is not None and self._on(least + level, plate.height_m):
                    found = plate.height_m
            plates.append(found)
        known = [height - level for height, level in zip(plates, levels, strict=True) if height is not None]
        if known:
            base = float(np.median(known))
        else:
            base = self.floor_m if self._on(least, self.floor_m) else least - UNDER_MARKERS_M
        if not stances:
            return base, [base]
        own = [base + level for level in levels]
        return base, [
            plate if plate is not None and abs(plate - height) < SAME_LEVEL_M else height
            for plate, height in zip(plates, own, strict=True)
        ]

    @staticmethod
    def _on(lowest_m: float, surface_m: float) -> bool:
        """Whether a foot whose lowest marker is so high may stand on a surface."""
        return -UNDER_MARKERS_M < lowest_m - surface_m < SHOE_M


def _around(flags: Flags, frames: slice) -> slice:
    """These frames, grown to both sides for as long as flags (T,) hold."""
    first, end = frames.start, frames.stop
    while first > 0 and flags[first - 1]:
        first -= 1
    while end < len(flags) and flags[end]:
        end += 1
    return slice(first, end)


def _closed(flags: Flags, gap: int, seen: Flags | None = None) -> Flags:
    """Flags with short gaps closed, and then short stretches dropped, but for those at either end, or next to frames
    that are not seen (T,)."""
    flags = flags.copy()
    for value in (True, False):
        for first, end in runs(flags != value):
            whole = first > 0 and end < len(flags) and (seen is None or value or bool(seen[first - 1] and seen[end]))
            if end - first < gap and whole:
                flags[first:end] = value
    return flags
