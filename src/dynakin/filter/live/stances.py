"""Which feet stand at this moment, by what has been seen of the stance so far."""

from __future__ import annotations

from collections import deque

import numpy as np
import numpy.typing as npt

from dynakin.arrays import Array, Flags
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.recordings.feet.belt import WINDOW_S, velocities
from dynakin.recordings.feet.contact import ALOFT_M, LEVEL_M_S, NEAR_SUPPORT_M, RESTS_S, SLOW_M_S, pivots
from dynakin.recordings.feet.soles import FootShape

DT_S = (0.001, 0.05)
"""Least and most that frames are taken to be apart."""
_RISE_M_S = 0.0025  # how fast a marker's lowest place is forgotten, so that one bad moment does not stay
_BELT_STEP_S, _BELT_EVERY_S = 0.018, 0.5  # a belt is looked for twice a second, in 50 moments a second


class LiveStances:
    """Offline (`recordings.feet.contact`) whole stances are seen; here a foot stands where a marker is near its lowest
    place, or keeps a height that something must hold it at, and is slow against the floor, or the belt of the last
    seconds. Thresholds are the same; that a foot may bear a moment before it stands, or never comes down, is known
    offline alone.

    Attributes:
        marked: (F,) feet that have markers. time_s: of the moment that was looked at last, and of it:
        outlines: (F, K, 2) m of the feet on the ground, NaN where one has fewer markers.
        touched: (F,) s, when each foot last stood.
        flat: (F,) all of its markers touch. low: it is near what it stands on. moves: all of it does.
    """

    def __init__(self, initial: CalibratedModel) -> None:
        segments = [marker.segment for marker in initial.spec.markers]
        own = [np.flatnonzero([s == segment for s in segments]) for segment in initial.feet.values()]
        F, M = len(own), len(segments)
        self._own = np.full((F, max(map(len, own), default=0)), M)  # markers of each foot, filled up with M: none
        for f, markers in enumerate(own):
            self._own[f, : len(markers)] = markers
        self.marked = np.array([len(markers) > 0 for markers in own], dtype=bool)
        self._first, self._lowest = np.full(M, np.inf), np.full(M, np.inf)  # heights of the markers
        self.time_s = -np.inf
        self._belts = _Belts(F)
        self._level = np.zeros(F)  # of what each foot rests on, over its lowest place, m
        self._kept, self._kept_since = np.full(F, np.inf), np.full(F, np.inf)
        self._alone_since = np.full(F, np.inf)
        self._shapes: list[FootShape] = []
        self._forward = initial.ground.vectors_to_ground(initial.ground.forward)[[0, 2]]
        self.touched = np.full(F, -np.inf)
        self.outlines = np.zeros((F, 0, 2))
        self.flat, self.low, self.moves = (np.zeros(F, dtype=bool) for _ in range(3))

    @property
    def stands(self) -> Flags:
        """(F,) feet that stand."""
        return np.asarray(self.touched == self.time_s)

    def look(self, time_s: float, places: Array, velocity: Array, carried: Flags) -> None:
        """The next moment.

        Args:
            places: (M, 3) m of the model's markers, ground frame. velocity: (M, 3) m/s. carried: (F,) feet under which
                a plate was loaded before.
        """
        if not np.isfinite(self.time_s):
            self._first = places[:, 1].copy()
        stood, dt = self.stands, float(np.clip(time_s - self.time_s, *DT_S))
        self._lowest = np.minimum(np.minimum(self._lowest + _RISE_M_S * dt, self._first), places[:, 1])
        self.time_s = time_s
        height = places[:, 1] - self._lowest
        self._belts.look(time_s, velocity, height < NEAR_SUPPORT_M, self._own)
        own_height = np.append(height, np.inf)[self._own]  # (F, K)
        against = np.vstack([velocity, np.full(3, np.inf)])[self._own]
        against[:, :, [0, 2]] -= self._belts.velocity[:, None]
        with np.errstate(invalid="ignore"):
            slow = np.linalg.norm(against, axis=2) < SLOW_M_S
        at = np.vstack([places, np.full(3, np.nan)])[self._own]
        slow |= pivots(at, against)[:, None] & (self._own < len(places))
        self._rest(stood, own_height, slow, carried)
        touching = slow & (np.abs(own_height - self._level[:, None]) < NEAR_SUPPORT_M)
        touching |= slow & (own_height < NEAR_SUPPORT_M)
        self.touched[touching.any(axis=1)] = time_s
        self.flat = (touching | (self._own == len(places))).all(axis=1) & self.marked
        self.low = ((own_height < ALOFT_M) | (np.abs(own_height - self._level[:, None]) < ALOFT_M)).any(axis=1)
        self.moves = self.marked & ~slow.any(axis=1)
        self.outlines = at[:, :, [0, 2]]

    def _rest(self, stood: Flags, height: Array, slow: Flags, carried: Flags) -> None:
        """Which feet rest on something higher than their lowest place: they keep a height, and no other foot stood or
        a plate was loaded under them."""
        for f in range(len(stood)):
            lift = float(height[f].min(initial=np.inf))
            keeps = bool(slow[f].any()) and abs(lift - self._kept[f]) < LEVEL_M_S * RESTS_S
            if not keeps:
                self._kept[f], self._kept_since[f], self._level[f] = lift, self.time_s, 0.0
            others = np.delete(stood, f).any()
            self._alone_since[f] = self.time_s if others else min(self._alone_since[f], self.time_s)
            since = self._kept_since[f] if carried[f] else max(self._kept_since[f], self._alone_since[f])
            if keeps and lift > NEAR_SUPPORT_M and self.time_s - since > RESTS_S:
                self._level[f] = lift

    def outline(self, f: int) -> Array:
        """(1, K, 2) m of one foot, its own markers alone."""
        return np.asarray(self.outlines[[f]][:, self._own[f] < len(self._lowest)])

    @property
    def shapes(self) -> list[FootShape]:
        """Each foot's sole among its markers, as these were seen first."""
        if not self._shapes:
            self._shapes = [FootShape.of(self.outline(f), self._forward) for f in range(len(self.marked))]
        return self._shapes

    def rise(self, f: int, places: Array) -> Array:
        """(1, K) m, how far a foot's markers are over their lowest places."""
        own = self._own[f][self._own[f] < len(self._lowest)]
        return np.asarray(places[None, own, 1] - self._lowest[own])

    def stands_over(self, f: int) -> float:
        """How far what a foot stands on, m, is over where the feet began: steps down are below."""
        own = self._own[f][self._own[f] < len(self._lowest)]
        began = float(np.append(self._first, np.inf)[self._own].min(initial=np.inf))
        return float(self._lowest[own].min()) - began + float(self._level[f])


class _Belts:
    """How a belt under each foot moves, by the last seconds, as `recordings.feet.belt` finds it afterwards."""

    def __init__(self, feet: int) -> None:
        self.velocity = np.zeros((feet, 2))  # m/s, X and Z of the ground
        self._kept: deque[tuple[float, Array, Flags]] = deque()
        self._looked = -np.inf

    def look(self, time_s: float, velocity: Array, low: Flags, own: npt.NDArray[np.intp]) -> None:
        """The next moment: velocities (M, 3) m/s of all markers, which of them are low, and each foot's own (F, K)."""
        if self._kept and time_s - self._kept[-1][0] < _BELT_STEP_S:
            return
        self._kept.append((time_s, velocity, low))
        while self._kept[0][0] < time_s - WINDOW_S:
            self._kept.popleft()
        if time_s - self._looked < _BELT_EVERY_S or len(self._kept) < 10:
            return
        self._looked = time_s
        time = np.array([at for at, _, _ in self._kept])
        every, lows = np.stack([v for _, v, _ in self._kept]), np.stack([b for _, _, b in self._kept])
        body = np.median(every, axis=1)
        there = [markers[markers < every.shape[1]] for markers in own]
        feet = [(every[:, markers], lows[:, markers]) for markers in there]
        for f, found in enumerate(velocities(feet, body, time)):
            if found is not None:
                self.velocity[f] = found
