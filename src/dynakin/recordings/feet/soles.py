"""Where the sole of each foot is, how large it is, and where on it the load is expected."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from dynakin.arrays import Array, Flags, mean_seen, runs
from dynakin.recordings.feet.contact import FootContact
from dynakin.recordings.feet.handover import BOTH_S, STEEPEST_STEP, Span, spans_of, stance_weights, supported

HALF_LENGTH_M, HALF_WIDTH_M = 0.13, 0.05
"""Of a grown person's shoe, where the markers do not show it."""
BACK_M, SIDE_M = 0.015, 0.015
"""How far a shoe reaches beyond the marker at its heel, and beyond those at its sides."""
TO_THE_BALL = 0.72
"""Part of a foot's length from its heel to the heads of the metatarsals, where most marker sets have their toe."""
LONGEST_M = 0.28
"""Markers that far apart, or nearly, are at the heel and at the tip of the toes."""
LEAST_M = 0.10
"""Markers nearer to each other than that do not show a foot's length."""
BRIDGED_S = 0.25
"""Gap in all of a foot's markers over which its sole is drawn on by a straight line."""
PRESSURE_REACH, ROLLED_M, FLAT_TILT_M = 0.55, 0.012, -0.006
"""The centre of pressure lies 0.55 of half the sole's length behind or before its middle once heel or toe are some
12 mm above the other, measured from their lowest places: plates of `walking1`, `squats1` and `DJ1`; the walks of three
other laboratories have 0.5 to 0.6 (0.7 of the simulated one in `truth3d`). `FLAT_TILT_M` is how much higher the
heel's marker lies than the toe's while the foot is flat, both over their lowest places, where no stance shows it
(`FootShape.flat_m`)."""
STILL_M_S, STILL_S = 0.05, 0.1
"""A foot is flat while heel and toe touch and neither rises against the other by more; a recording that has less of it
says nothing. By its own tilt the expected place is off by 0.09, not 0.20 of half the sole's length (`walking1`), 0.21,
not 0.34 (`squats1`)."""
ROLLED_SD, FLAT_SD, ACROSS_SD = 0.42, 0.52, 0.63
"""How far it may lie from there, as parts of half the sole's length once the foot has rolled, of that more while it is
flat, where some mm of skin decide, and of half its width. Three times what the plates of these recordings show: a foot
that is not of these keeps its say, and moments of a leg off the plates are best so (`truth3d`)."""
_LEAST_STANCE = 1e-9
_UNSEEN_SD = 0.6  # of half the length, where a foot's markers do not show how it lies


@dataclass(frozen=True, eq=False)
class Soles:
    """Of F feet over T frames, by markers and support alone.

    Attributes:
        middle: (T, F, 3) m, of the sole at the height of what the foot stands on, ground frame; NaN where it is not
            seen.
        half_m: (F, 2) half its length and half its width.
        bears: (T, F) the foot may bear load.
        stance: (T, F) from 0 at touch-down to 1, and to 0 at toe-off.
        support: (T,) the same of all feet together: it stays 1 while they take turns without flight (live, where nobody
            knows yet who comes next: their sum, 1 at most).
        pressure: (T, F, 3) m, where its centre of pressure is expected, by how far the foot has rolled.
        pressure_covariance: (T, F, 2, 2) m^2 of that along X and Z of the ground.
        rate: Hz, of the frames; 0 of a single one.
        share_before: (1, F) `share` in the frame before them, where it is known (live).
    """

    middle: Array
    half_m: Array
    bears: Flags
    stance: Array
    support: Array
    pressure: Array
    pressure_covariance: Array
    rate: float = 0.0
    share_before: Array | None = None

    @classmethod
    def of(cls, contacts: list[FootContact | None], forward: Array, rate: float, frames: int) -> Soles:
        """
        Args:
            contacts: of each foot; None: nobody sees it, so that it may bear load at any time.
            forward: (2,) the way the person faces, X and Z of the ground.
            rate: Hz.
        """
        F = len(contacts)
        middle, half = np.full((frames, F, 3), np.nan), np.tile([HALF_LENGTH_M, HALF_WIDTH_M], (F, 1))
        bears, stance = np.ones((frames, F), dtype=bool), np.ones((frames, F))
        pressure, covariance = middle.copy(), np.tile((_UNSEEN_SD * HALF_LENGTH_M) ** 2 * np.eye(2), (frames, F, 1, 1))
        stood = np.full(frames, None in contacts)
        spans: list[list[Span]] = [[] for _ in contacts]
        for k, foot in enumerate(contacts):
            if foot is None:
                continue
            stood |= foot.stands | ~foot.seen
            shape = shape_of(foot, forward, rate)
            spans[k] = spans_of(foot, shape.ends, rate)
            half[k] = shape.half_m
            place = _drawn_on(shape.middle(foot.outline), rate)
            ahead, covariance[:, k] = shape.rolled(foot.outline, foot.rise_m)
            middle[:, k] = np.stack([place[:, 0], foot.support_m, place[:, 1]], axis=1)
            pressure[:, k] = middle[:, k] + np.stack([ahead[:, 0], np.zeros(frames), ahead[:, 1]], axis=1)
            bears[:, k] = foot.bears(rate)
        weights = stance_weights(spans, rate, frames)
        for k, foot in enumerate(contacts):
            if foot is not None:
                stance[:, k] = np.where(foot.seen, weights[:, k], 1.0)  # unseen: it may bear all
        together = stance_weights([supported(stood, spans, rate)], rate, frames)[:, 0]
        support = np.maximum(together, np.minimum(stance.sum(axis=1), 1.0))
        return cls(middle, half, bears, stance, support, pressure, covariance, rate if frames > 1 else 0.0)

    @property
    def share(self) -> Array:
        """(T, F) part of the weight that each foot is expected to bear."""
        return np.asarray(self.stance * (self.support / np.maximum(self.stance.sum(axis=1), _LEAST_STANCE))[:, None])

    @property
    def passing(self) -> Array:
        """(T, F) 1/s: how fast that changes, no faster than in the shortest double support: where a foot is lost from
        view its share jumps. 0 of a single frame before which nothing is known."""
        share = self.share if self.share_before is None else np.vstack([self.share_before, self.share])
        if len(share) < 2:
            return np.zeros_like(share)
        passing = np.minimum(np.abs(np.gradient(share, axis=0)) * self.rate, STEEPEST_STEP / BOTH_S[0])
        return np.asarray(passing[-len(self.stance) :])


@dataclass(frozen=True, eq=False)
class FootShape:
    """A sole among its foot's markers.

    Attributes:
        ends: the markers at its back and at its front; None: its markers do not show its length.
        ahead, aside: where its middle lies: that part of the way from the one to the other, that far to the right of it
            over that way.
        half_m: (2,) half its length and half its width.
        flat_m: how much higher the back's marker is than the front's, both over their lowest places, when it is flat.
    """

    ends: tuple[int, int] | None
    ahead: float
    aside: float
    half_m: Array
    flat_m: float = FLAT_TILT_M

    @classmethod
    def of(cls, points: Array, forward: Array) -> FootShape:
        """From places (T, K, 2) m of its markers while it stands flat, all seen; T may be 0."""
        default = cls(None, 0.0, 0.0, np.array([HALF_LENGTH_M, HALF_WIDTH_M]))
        if not len(points) or points.shape[1] < 2:
            return default
        apart = np.median(np.linalg.norm(points[:, :, None] - points[:, None], axis=3), axis=0)
        one, other = np.unravel_index(int(np.argmax(apart)), apart.shape)
        reach = float(apart[one, other])
        if reach < LEAST_M:
            return default
        faces = float(np.median((points[:, other] - points[:, one]) @ forward)) >= 0.0
        back, front = (int(one), int(other)) if faces else (int(other), int(one))
        along = points[:, front] - points[:, back]
        right = np.stack([-along[:, 1], along[:, 0]], axis=1) / np.linalg.norm(along, axis=1, keepdims=True)
        sides = np.median(np.einsum("tkc,tc->tk", points - points[:, [back]], right), axis=0)
        length = max(reach + 2.0 * BACK_M, min(reach / TO_THE_BALL, LONGEST_M))
        both = sides.min() < -SIDE_M and sides.max() > SIDE_M  # else the line from heel to toe is the middle
        aside = 0.5 * float(sides.max() + sides.min()) / reach if both else 0.0
        half_width = 0.5 * float(np.ptp(sides)) + SIDE_M if both else HALF_WIDTH_M
        ahead = (0.5 * length - BACK_M) / reach
        return cls((back, front), ahead, aside, np.array([0.5 * length, half_width]))

    def middle(self, points: Array) -> Array:
        """(T, 2) m of the sole among markers (T, K, 2), NaN where its own two are missing."""
        if self.ends is None:
            return mean_seen(points, axis=1)
        along = points[:, self.ends[1]] - points[:, self.ends[0]]
        right = np.stack([-along[:, 1], along[:, 0]], axis=1)
        return np.asarray(points[:, self.ends[0]] + self.ahead * along + self.aside * right)

    def reach(self, points: Array) -> Array:
        """(T, C, 2) m corners of where the sole may be among markers (T, K, 2): toes that go on to `LONGEST_M`, and as
        far around all markers where they do not show how it lies."""
        if self.ends is None:
            around = LONGEST_M * np.array([[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]])
            return np.asarray((points[:, :, None] + around).reshape(len(points), -1, 2))
        along = points[:, self.ends[1]] - points[:, self.ends[0]]
        with np.errstate(invalid="ignore"):
            along = along / np.linalg.norm(along, axis=1, keepdims=True)
        right = np.stack([-along[:, 1], along[:, 0]], axis=1)
        half, width = self.half_m
        middle, front = self.middle(points), max(half, LONGEST_M - half)
        corners = [middle + x * along + z * right for x in (-half, front) for z in (-width, width)]
        return np.concatenate([np.stack(corners, axis=1), points], axis=1)

    def rolled(self, points: Array, rise: Array) -> tuple[Array, Array]:
        """How far (T, 2) m from the middle of the sole the centre of pressure is expected; its covariance (T, 2, 2).

        Args:
            points: (T, K, 2) m of the markers. rise: (T, K) m, over their places when the foot stands flat.
        """
        frames, (half, width) = len(points), self.half_m
        if self.ends is None:
            return np.zeros((frames, 2)), np.tile((_UNSEEN_SD * half) ** 2 * np.eye(2), (frames, 1, 1))
        back, front = self.ends
        along = points[:, front] - points[:, back]
        with np.errstate(invalid="ignore"):
            along = along / np.linalg.norm(along, axis=1, keepdims=True)
            at = np.tanh((rise[:, back] - rise[:, front] - self.flat_m) / ROLLED_M)
        known = np.isfinite(at) & np.isfinite(along).all(axis=1)
        along, at = np.where(known[:, None], along, 0.0), np.where(known, at, 0.0)
        sd = half * np.where(known, ROLLED_SD + FLAT_SD * (1.0 - at**2), _UNSEEN_SD)
        across = np.where(known, ACROSS_SD * width, _UNSEEN_SD * half)
        outer = along[:, :, None] * along[:, None, :]
        covariance = across[:, None, None] ** 2 * np.eye(2) + (sd**2 - across**2)[:, None, None] * outer
        return PRESSURE_REACH * half * at[:, None] * along, covariance


def shape_of(foot: FootContact, forward: Array, rate: float) -> FootShape:
    """The sole among a foot's markers, as they lie while it stands flat.

    Args:
        forward: (2,) the way the person faces, X and Z of the ground.
    """
    seen = np.isfinite(foot.outline).all(axis=(1, 2))
    flat = seen & foot.stands if (seen & foot.stands).any() else seen
    shape = FootShape.of(foot.outline[flat], forward)
    return shape if shape.ends is None else replace(shape, flat_m=_flat_tilt(foot, shape.ends, rate))


def _flat_tilt(foot: FootContact, ends: tuple[int, int], rate: float) -> float:
    """By how much (m) the marker at the back of a foot is higher than that at its front while it is flat."""
    tilt = foot.rise_m[:, ends[0]] - foot.rise_m[:, ends[1]]
    if len(tilt) < 2:
        return FLAT_TILT_M
    with np.errstate(invalid="ignore"):
        still = np.abs(np.gradient(tilt)) * rate < STILL_M_S
    flat = foot.touching[:, ends].all(axis=1) & still
    return float(np.median(tilt[flat])) if np.count_nonzero(flat) >= STILL_S * rate else FLAT_TILT_M


def _drawn_on(middle: Array, rate: float) -> Array:
    """The same with short gaps bridged by straight lines; nothing is said before the first frame or after the last."""
    middle = middle.copy()
    known: Flags = np.asarray(np.isfinite(middle).all(axis=1))
    frames = np.arange(len(middle))
    for first, end in runs(~known):
        if first > 0 and end < len(middle) and end - first <= BRIDGED_S * rate:
            for c in (0, 1):
                middle[first:end, c] = np.interp(frames[first:end], frames[known], middle[known, c])
    return middle
