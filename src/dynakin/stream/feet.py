"""Which foot each plate carries at this moment, and whether the plates carry all of the person."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from dynakin.bindings import _core
from dynakin.errors import ConfigError
from dynakin.filter.contacts import ContactLoads
from dynakin.filter.ground.declared import may_bear
from dynakin.filter.ground.expected import ContactPaths, expected_loads
from dynakin.filter.ground.shear import NO_SHEAR, VERTICAL_ONLY, Shear
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.recordings.feet.belt import WINDOW_S, velocities
from dynakin.recordings.feet.contact import (
    AFTER_S,
    ALOFT_M,
    ALONE_M,
    LEVEL_M_S,
    NEAR_M,
    NEAR_SUPPORT_M,
    RESTS_S,
    SLOW_M_S,
    pivots,
)
from dynakin.recordings.feet.handover import EARLY_S, PASSING_S, smooth_step
from dynakin.recordings.feet.loads import SHARED, FootLoads, divided
from dynakin.recordings.feet.sharing import BETWEEN_M, SHORTEST_S, beside_m, lies_between, mostly
from dynakin.recordings.feet.soles import FootShape, Soles
from dynakin.recordings.hull import distance_to_hull
from dynakin.recordings.plates.ground_plate import GroundPlate, level_pressure
from dynakin.recordings.plates.pressure import JUDGED_N, UNLOADED_N
from dynakin.recordings.plates.stuck import STILL_N
from dynakin.results.naming import sentence
from dynakin.settings.noise import Noise
from dynakin.stream.closure import DELAY_S, LiveClosure
from dynakin.stream.plate_samples import EndOfRange

Array = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]

_RISE_M_S = 0.0025  # how fast a marker's lowest place is forgotten, so that one bad moment does not stay
_BELT_STEP_S, _BELT_EVERY_S = 0.018, 0.5  # a belt is looked for twice a second, in 50 moments a second
_DT_S = (0.001, 0.05)  # how far ahead the feet are predicted
_SEEN = 0.5  # part of the markers from which the motion of the centre of mass is seen
_LEAST_S = 0.001  # between frames of which a share's rate is taken


class LiveFeet:
    """Gives each plate to the feet that stand on it, frame by frame, from the estimate before the step.

    Offline (`recordings.feet.assignment`) whole stances are seen; here a stance is what has been seen of it so far,
    with the same thresholds: a foot stands where a marker is near its lowest place, or keeps a height that something
    must hold it at, and is slow against the floor, or the belt of the last seconds; and for a while after (push-off). A
    stance that no plate has carried yet is off the plates.

    Args:
        assigned: plate -> "right", "left" or a declared contact, where it is known.
    """

    def __init__(
        self, initial: CalibratedModel, noise: Noise, plates: tuple[str, ...], assigned: Mapping[str, str]
    ) -> None:
        self.initial, self.noise, self.plates = initial, noise, plates
        self.feet = tuple(initial.feet)
        given = {p: assigned[name] for p, name in enumerate(plates) if name in assigned}
        if unknown := [name for name in given.values() if name not in (*self.feet, *initial.contacts)]:
            expected = ", ".join((*self.feet, *initial.contacts))
            raise ConfigError(f"plates: {unknown[0]!r} is given a plate, expected one of {expected}")
        self._assigned = {p: self.feet.index(name) for p, name in given.items() if name in self.feet}
        self._given = {p: name for p, name in given.items() if name in initial.contacts}
        segments = [marker.segment for marker in initial.spec.markers]
        self._paths = ContactPaths.of(initial)
        self._highest, self._lowest = -np.inf, np.inf  # of the root, and of all markers
        own = [np.flatnonzero([s == initial.feet[foot] for s in segments]) for foot in self.feet]
        F, P, M = len(self.feet), len(plates), len(segments)
        self._own = np.full((F, max(map(len, own), default=0)), M)  # markers of each foot, filled up with M: none
        for f, markers in enumerate(own):
            self._own[f, : len(markers)] = markers
        self._marked = np.array([len(markers) > 0 for markers in own], dtype=bool)
        self._standing, self._floor = np.full(M, np.inf), np.full(M, np.inf)
        self._time = -np.inf
        self._belts = _Belts(F)
        self._level = np.zeros(F)  # of what each foot rests on, over its lowest place, m
        self._kept, self._kept_since = np.full(F, np.inf), np.full(F, np.inf)
        self._alone_since = np.full(F, np.inf)
        self._under = np.zeros((F, P), dtype=bool)
        self._time_before = -np.inf
        self._shapes: list[FootShape] = []
        self._since = np.full(F, np.nan)  # when the stance began
        self._share: tuple[float, Array] | None = None  # when soles were looked at last, and each foot's share then
        self._forward = initial.ground.vectors_to_ground(initial.ground.forward)[[0, 2]]
        self._floor_m = float(initial.ground.points_to_ground(np.zeros(3))[1])  # streams put plates there, too
        self._touched = np.full(F, -np.inf)  # when the foot last stood
        self._near, self._loaded = np.zeros((F, P), dtype=int), np.zeros((F, P), dtype=int)  # frames of this stance
        self._flat = np.zeros(F, dtype=bool)  # all of its markers touch
        self._between, self._judged = np.zeros(P, dtype=int), np.zeros(P, dtype=int)  # frames of this press
        self._beside = np.full(P, np.inf)  # since when it presses between two soles
        self._shared = np.zeros((F, P), dtype=bool)  # it has, since this foot stands and this plate is pressed
        self._owners = np.zeros((F, P), dtype=bool)  # of the plates that are pressed
        self._range = EndOfRange(P)
        self._closure: LiveClosure | None = None
        self.claimed = False
        """Whether in the last frame the plates carried all of the person by what feet and plates show."""
        self._sideways, self._vertical = False, False  # a plate has shown a horizontal force; loaded plates show none
        self._said: set[str] = set()
        self._to_say: list[str] = []

    def look(
        self,
        model: _core.Model,
        state: Array,
        time_s: float,
        wrenches: Array | None,
        markers: Array | None = None,
    ) -> tuple[ContactLoads, bool]:
        """The feet's wrenches at a time (T = 1), and whether the sum of the plates is the total wrench.

        Args:
            state: (n,) before the step. wrenches: (P, 6) N and N m, laboratory frame, or None. markers: (M, 3) m as
                measured, of the model, ground frame, NaN missing: without them nobody asks whether something undeclared
                bears the person.
        """
        dt = float(np.clip(time_s - self._time, *_DT_S))
        offset, size = model.layout.blocks["coordinates"]
        speeds, _ = model.layout.blocks["speeds"]
        ahead = state.copy()
        ahead[offset : offset + size] += dt * state[speeds : speeds + size]
        before, places = _core.marker_positions(model, state), _core.marker_positions(model, ahead)
        loads = self.loads(time_s, places, (places - before) / dt, wrenches)
        paths = self._paths.at(places[None])
        self._lowest = min(self._lowest, float(places[:, 1].min()))
        self._highest = max(self._highest, float(paths[0, 0, 1]))
        bears = may_bear(self.initial, paths, self._lowest, self._highest - self._lowest)
        bears &= ~np.array([name in loads.others for name in self.initial.contacts], dtype=bool)
        shear = self._shear(wrenches)
        self.claimed = self._whole(loads, bears)
        if markers is not None and wrenches is not None:
            loads = self._closed(loads, time_s, markers, places, wrenches, bears)
        undeclared = loads.elsewhere & (wrenches is not None)
        whole = self._whole(loads, bears)
        return expected_loads(loads, self.initial, self.noise, paths, undeclared, bears, shear), whole

    def _whole(self, loads: FootLoads, bears: Flags) -> bool:
        return bool(loads.total_known[0] and not bears.any() and not self._vertical)

    def _shear(self, wrenches: Array | None) -> Shear:
        """Whether the plates measure horizontal forces: noise alone shows that they do."""
        if not self._sideways and wrenches is not None:
            force = np.abs(self.initial.ground.wrench_to_ground(wrenches)[:, :3])
            self._sideways = bool((force[:, [0, 2]] > STILL_N * force[:, [1]]).any())
            self._vertical = not self._sideways and bool((force[:, 1] > JUDGED_N).any())
        if not self._vertical:
            return NO_SHEAR
        self._say(sentence(VERTICAL_ONLY.text))
        return Shear(unmeasured=True)

    def _closed(
        self, loads: FootLoads, time_s: float, markers: Array, places: Array, wrenches: Array, bears: Flags
    ) -> FootLoads:
        """The same where the plates do not carry what the motion of the centre of mass needs, `DELAY_S` ago."""
        if self._closure is None:
            self._closure = LiveClosure(self.initial)
        whole = self._whole(loads, bears)
        seen = np.isfinite(markers)
        judged = whole and bool(seen.mean() >= _SEEN)  # what the filter expects shows no force
        force = self.initial.ground.wrench_to_ground(wrenches)[:, :3].sum(axis=0) if judged else None
        if not self._closure.look(time_s, np.where(seen, markers, places), force):
            return loads
        self._say(
            f"Something that no plate measures bears or pulls the person (a seat, a rail, a box): noticed {DELAY_S:g} "
            "s after the motion shows it. What it can reach is absent for as long as that is so."
        )
        return loads.with_undeclared(np.ones(1, dtype=bool))

    def loads(self, time_s: float, places: Array, velocity: Array, wrenches: Array | None) -> FootLoads:
        """The same as loads (T = 1).

        Args:
            places: (M, 3) m of the model's markers, ground frame. velocity: (M, 3) m/s. wrenches: as above.
        """
        outlines, low, moves = self._move(places, velocity, time_s)
        bears = time_s - self._touched <= AFTER_S
        stands = self._touched == time_s
        aloft = moves & ~bears & (stands.sum() > stands)  # high alone may be a pedal: no later stance is known yet
        self._near[~bears], self._loaded[~bears] = 0, 0
        plates = [] if wrenches is None else self._plates(wrenches)
        given = self._given if plates else {}
        if plates:
            self._assign(plates, outlines, bears, low)
            loaded = np.array([plate.loaded[0] for plate in plates])
            off = bears & ~(self._majority() | (self._owners & loaded)).any(axis=1)
        else:
            self._owners[:], off = False, bears
        on = self._owners[:, : len(plates)]
        soles = self._soles(outlines, bears, time_s, places)
        seen_none = np.zeros_like(off)  # the model shows all of them
        loads = divided(
            self.feet, plates, soles, self._marked, on[None], off[None], seen_none[None], aloft[None], given
        )
        for p in np.flatnonzero(on.sum(axis=0) > 1) if (loads.reason == SHARED).any() else ():
            self._say(
                f"Both feet stand on {self.plates[p]}: its wrench is divided between them by where each one's load "
                "is expected."
            )
        if plates and not loads.total_known[0]:
            self._say(
                "The plates do not carry all of the person (a foot off the plates, a load where nobody stands, a plate "
                "that hangs or is at the end of its range): what they do not carry is estimated for as long as that is "
                "so."
            )
        return loads

    def _soles(self, outlines: Array, bears: Flags, time_s: float, places: Array) -> Soles:
        """Soles of this moment (T = 1). Their sizes and places among the markers are those that were seen first. When
        a stance that goes on will end is not known yet."""
        F = len(self.feet)
        shapes = self._soles_among(outlines)
        self._since = np.where(bears, np.fmin(self._since, time_s), np.nan)
        lowest = float(np.append(self._standing, np.inf)[self._own].min(initial=np.inf))
        middle, half = np.full((1, F, 3), np.nan), np.stack([shape.half_m for shape in shapes])
        pressure, covariance = middle.copy(), np.tile(np.eye(2), (1, F, 1, 1))
        for f in np.flatnonzero(self._marked).tolist():
            own = self._seen(f)
            points = outlines[[f]][:, own]
            x, z = shapes[f].middle(points)[0]
            rise = places[self._own[f][own], 1] - self._floor[self._own[f][own]]
            ahead, covariance[:, f] = shapes[f].rolled(points, rise[None])
            over = float(self._floor[self._own[f][own]].min()) - lowest  # steps down are below where the feet began
            middle[0, f] = x, self._floor_m + over + self._level[f], z
            pressure[0, f] = middle[0, f] + np.array([ahead[0, 0], 0.0, ahead[0, 1]])
        since, left = time_s - self._since, time_s - self._touched
        weight = smooth_step(np.fmin((since + EARLY_S) / PASSING_S, 1.0 - left / AFTER_S))
        weight = np.where(self._marked, np.where(bears, weight, 0.0), 1.0)
        support = np.minimum(weight.sum(keepdims=True), 1.0)
        soles = Soles(middle, half, (bears | ~self._marked)[None], weight[None], support, pressure, covariance)
        if self._share is not None:
            before_s, share = self._share
            rate = 1.0 / max(time_s - before_s, _LEAST_S)
            soles = replace(soles, rate=rate, share_before=share)
        self._share = time_s, soles.share
        return soles

    def _seen(self, f: int) -> Flags:
        """(K,) which rows of a foot's outline are its markers."""
        return np.asarray(self._own[f] < len(self._floor))

    def _soles_among(self, outlines: Array) -> list[FootShape]:
        """Each foot's sole among its markers, as these were seen first."""
        if not self._shapes:
            seen = [outlines[[f]][:, self._seen(f)] for f in range(len(self.feet))]
            self._shapes = [FootShape.of(points, self._forward) for points in seen]
        return self._shapes

    def news(self) -> list[str]:
        """Sentences, each said once."""
        found, self._to_say = self._to_say, []
        return found

    def _say(self, text: str) -> None:
        if text not in self._said:
            self._said.add(text)
            self._to_say.append(text)

    def _move(self, places: Array, velocity: Array, time_s: float) -> tuple[Array, Flags, Flags]:
        """Outlines (F, K, 2) of the feet, whether each is low, and whether all of it moves; keeps when it stood."""
        if not np.isfinite(self._time):
            self._standing = places[:, 1].copy()
        dt = float(np.clip(time_s - self._time, *_DT_S))
        self._floor = np.minimum(np.minimum(self._floor + _RISE_M_S * dt, self._standing), places[:, 1])
        self._time = time_s
        height = places[:, 1] - self._floor
        self._belts.look(time_s, velocity, height < NEAR_SUPPORT_M, self._own)
        own_height = np.append(height, np.inf)[self._own]  # (F, K)
        against = np.vstack([velocity, np.full(3, np.inf)])[self._own]
        against[:, :, [0, 2]] -= self._belts.velocity[:, None]
        with np.errstate(invalid="ignore"):
            slow = np.linalg.norm(against, axis=2) < SLOW_M_S
        at = np.vstack([places, np.full(3, np.nan)])[self._own]
        slow |= pivots(at, against)[:, None] & (self._own < len(places))
        self._rest(time_s, own_height, slow)
        touching = slow & (np.abs(own_height - self._level[:, None]) < NEAR_SUPPORT_M)
        touching |= slow & (own_height < NEAR_SUPPORT_M)
        self._touched[touching.any(axis=1)] = time_s
        self._flat = (touching | (self._own == len(places))).all(axis=1) & self._marked
        low = ((own_height < ALOFT_M) | (np.abs(own_height - self._level[:, None]) < ALOFT_M)).any(axis=1)
        moves = self._marked & ~slow.any(axis=1)
        return at[:, :, [0, 2]], low, moves

    def _rest(self, time_s: float, height: Array, slow: Flags) -> None:
        """Which feet rest on something higher than their lowest place: they keep a height, and no other foot stands or
        a plate is loaded under them."""
        stands = self._touched == self._time_before
        for f in range(len(self.feet)):
            lift = float(height[f].min(initial=np.inf))
            keeps = bool(slow[f].any()) and abs(lift - self._kept[f]) < LEVEL_M_S * RESTS_S
            if not keeps:
                self._kept[f], self._kept_since[f], self._level[f] = lift, time_s, 0.0
            others = np.delete(stands, f).any()
            self._alone_since[f] = time_s if others else min(self._alone_since[f], time_s)
            carried = bool((self._owners[f] | (self._under[f])).any())
            since = self._kept_since[f] if carried else max(self._kept_since[f], self._alone_since[f])
            if keeps and lift > NEAR_SUPPORT_M and time_s - since > RESTS_S:
                self._level[f] = lift
        self._time_before = time_s

    def _plates(self, wrenches: Array) -> list[GroundPlate]:
        loads = self.initial.ground.wrench_to_ground(wrenches)
        known = np.isfinite(loads).all(axis=1) & ~self._range.at_end(loads[:, 1])
        cop = level_pressure(loads, self._floor_m)
        return [
            GroundPlate(name, loads[[p]], cop[[p]], known[[p]], None, self._floor_m)
            for p, name in enumerate(self.plates)
        ]

    def _majority(self) -> Flags:
        """(F, P) plates that carry a stance, as far as it has gone."""
        return np.asarray(mostly(self._near, self._loaded))

    def _assign(self, plates: list[GroundPlate], outlines: Array, bears: Flags, low: Flags) -> None:
        touches = self._touched == self._time
        cops = np.concatenate([plate.cop for plate in plates])
        F, P = len(self.feet), len(plates)
        away = distance_to_hull(np.tile(cops, (F, 1)), np.repeat(outlines, P, axis=0)).reshape(F, P)
        away = np.where(np.isnan(away), np.inf, away)  # of a plate that is not loaded
        near = away < NEAR_M
        alone = touches[:, None] & (away < ALONE_M)  # who stands on one leg holds the other foot beside it
        self._under = near & (alone.sum(axis=0) == alone)
        loaded = np.array([plate.loaded[0] for plate in plates])
        self._shared[:, self._press_between(plates, cops, outlines, bears, away)] = True
        self._shared &= bears[:, None] & np.array([plate.pressed[0] for plate in plates])
        shared = self._shared | (bears[:, None] & mostly(self._between, self._judged))
        for p, foot in self._assigned.items():
            near[:, p] = np.arange(F) == foot
        near[:, list(self._given)] = shared[:, list(self._given)] = False
        self._loaded += touches[:, None] & loaded
        self._near += touches[:, None] & loaded & near
        mine = self._majority() & bears[:, None]
        for p, plate in enumerate(plates):
            push = float(plate.wrench[0, 1])
            if push <= UNLOADED_N:
                self._owners[:, p] = False
                self._between[p] = self._judged[p] = 0
            elif p in self._assigned:
                self._owners[:, p] = near[:, p]
            elif (mine | shared)[:, p].any():
                self._owners[:, p] = (mine | shared)[:, p]
            elif not self._owners[:, p].any():  # a foot that sets down, before it stands
                nearest = int(np.argmin(away[:, p]))
                self._owners[nearest, p] = bool(near[nearest, p] and low[nearest])

    def _press_between(
        self, plates: list[GroundPlate], cops: Array, outlines: Array, bears: Flags, away: Array
    ) -> Flags:
        """(P,) plates that have pressed under neither sole of two feet that may bear, for `SHORTEST_S`; counts frames
        of their presses, and those of them that lie between the markers of two flat feet (`Sharing`).

        Args:
            away: (F, P) m from the markers of each foot, whose sole is no further away.
        """
        push, nearest = np.concatenate([plate.push for plate in plates]), away.min(axis=0)
        judged, beside = push > JUDGED_N, beside_m(push)
        self._judged += judged
        under_neither, between = np.isfinite(nearest) & (nearest > beside), judged & (nearest > BETWEEN_M)
        if len(bears) != 2 or not bears.all() or not self._marked.all():
            under_neither[:] = between[:] = False
        if under_neither.any():
            shapes = self._soles_among(outlines)
            soles = [shapes[f].reach(outlines[[f]][:, self._seen(f)]) for f in range(2)]
            corners = [np.repeat(sole, len(plates), axis=0) for sole in (*soles, np.concatenate(soles, axis=1))]
            *each, within = (distance_to_hull(cops, sole) for sole in corners)
            under_neither &= lies_between(each, within, beside)
        between &= self._flat.all()
        if between.any():
            both = np.broadcast_to(outlines.reshape(1, -1, 2), (len(plates), outlines.size // 2, 2))
            between &= lies_between(away, distance_to_hull(cops, both), BETWEEN_M)
        self._between += between
        self._beside = np.where(under_neither, np.fmin(self._beside, self._time), np.inf)
        return np.asarray(self._time - self._beside >= SHORTEST_S)


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
