"""Which foot each plate carries at this moment, by what has been seen of stance and press so far."""

from __future__ import annotations

import numpy as np

from dynakin.arrays import Array, Flags
from dynakin.filter.live.stances import DT_S, LiveStances
from dynakin.recordings.feet.contact import ALONE_M, NEAR_M
from dynakin.recordings.feet.findings import OFF_PLACE_M
from dynakin.recordings.feet.misgiven import MOST, OFF_M
from dynakin.recordings.feet.sharing import BETWEEN_M, SHORTEST_S, beside_m, lies_between, mostly
from dynakin.recordings.hull import distance_to_hull
from dynakin.recordings.plates.ground_plate import GroundPlate
from dynakin.recordings.pushes import JUDGED_N, UNLOADED_N

WRONG_S = 0.3
"""So long must a plate's load have lain under another foot than the declared one: half a stance of a walk."""


class PlateOwners:
    """A plate is that foot's whose markers its force acts under in most of the frames of a stance, and both feet's
    where it presses between them, as offline (`recordings.feet.assignment`). A stance that no plate has carried yet is
    off the plates.

    Args:
        feet, plates: how many. assigned: plate -> foot, where it is declared. given: plates of declared contacts.

    Attributes:
        misgiven: plate -> (how far the declared foot was, m, the foot that stood on it), of plates that cannot be the
            declared foot's, until who says so takes them out; from then on nothing is declared of these.
    """

    def __init__(self, feet: int, plates: int, assigned: dict[int, int], given: list[int]) -> None:
        self._assigned, self._given = dict(assigned), given
        self.misgiven: dict[int, tuple[float, int]] = {}
        self._borne, self._elsewhere = np.zeros(plates), np.zeros((feet, plates))  # N s so far; of it under other feet
        self._wrong_s, self._before_s = np.zeros(plates), np.nan
        self._near, self._loaded = (np.zeros((feet, plates), dtype=int) for _ in range(2))  # frames of this stance
        self._between, self._judged = np.zeros(plates, dtype=int), np.zeros(plates, dtype=int)  # frames of this press
        self._beside = np.full(plates, np.inf)  # since when it presses between two soles
        self._shared = np.zeros((feet, plates), dtype=bool)  # it has, since this foot stands and this plate is pressed
        self._under, self._owners = (np.zeros((feet, plates), dtype=bool) for _ in range(2))

    @property
    def owners(self) -> Flags:
        """(F, P) of the plates that are pressed."""
        return self._owners

    @property
    def carried(self) -> Flags:
        """(F,) feet under which a plate is loaded."""
        return np.asarray((self._owners | self._under).any(axis=1))

    def look(self, plates: list[GroundPlate], stances: LiveStances, bears: Flags) -> Flags:
        """(F,) feet that bear on no plate, at the next moment.

        Args:
            bears: (F,) feet that may bear.
        """
        self._near[~bears], self._loaded[~bears] = 0, 0
        if not plates:
            self._owners[:] = False
            return bears
        self._assign(plates, stances, bears)
        loaded = np.array([plate.loaded[0] for plate in plates])
        return np.asarray(bears & ~(self._majority() | (self._owners & loaded)).any(axis=1))

    def _assign(self, plates: list[GroundPlate], stances: LiveStances, bears: Flags) -> None:
        touches, outlines = stances.stands, stances.outlines
        cops = np.concatenate([plate.cop for plate in plates])
        F, P = len(bears), len(plates)
        away = distance_to_hull(np.tile(cops, (F, 1)), np.repeat(outlines, P, axis=0)).reshape(F, P)
        away = np.where(np.isnan(away), np.inf, away)  # of a plate that is not loaded
        near = away < NEAR_M
        alone = touches[:, None] & (away < ALONE_M)  # who stands on one leg holds the other foot beside it
        self._under = near & (alone.sum(axis=0) == alone)
        loaded = np.array([plate.loaded[0] for plate in plates])
        self._shared[:, self._press_between(plates, cops, stances, bears, away)] = True
        self._shared &= bears[:, None] & np.array([plate.pressed[0] for plate in plates])
        shared = self._shared | (bears[:, None] & mostly(self._between, self._judged))
        self._doubt_what_is_declared(plates, stances, away, loaded)
        for p, foot in self._assigned.items():
            near[:, p] = np.arange(F) == foot
        near[:, self._given] = shared[:, self._given] = False
        self._loaded += touches[:, None] & loaded
        self._near += touches[:, None] & loaded & near
        mine = self._majority() & bears[:, None]
        for p, plate in enumerate(plates):
            push = float(plate.wrench[0, 1])  # not known: whose it was, as long as nobody knows better
            if push <= UNLOADED_N:
                self._owners[:, p] = False
                self._between[p] = self._judged[p] = 0
            elif p in self._assigned:
                self._owners[:, p] = near[:, p]
            elif (mine | shared)[:, p].any():
                self._owners[:, p] = (mine | shared)[:, p]
            elif not self._owners[:, p].any():  # a foot that sets down, before it stands
                nearest = int(np.argmin(away[:, p]))
                self._owners[nearest, p] = bool(near[nearest, p] and stances.low[nearest])

    def _doubt_what_is_declared(
        self, plates: list[GroundPlate], stances: LiveStances, away: Array, loaded: Flags
    ) -> None:
        """As `recordings.feet.misgiven`, by the load so far. Away: (F, P) m; loaded: (P,)."""
        dt = float(np.clip(stances.time_s - self._before_s, *DT_S)) if np.isfinite(self._before_s) else 0.0
        self._before_s = stances.time_s
        for p, foot in list(self._assigned.items()):
            push = float(plates[p].push[0])  # 0 where it is not known
            if push <= JUDGED_N:
                continue
            elsewhere = loaded & (np.arange(len(plates)) != p)  # who stands on another plate is no witness
            there = (stances.stands | stances.low) & (away[:, p] < NEAR_M)
            there &= ~((away < ALONE_M) & elsewhere).any(axis=1) & (away[foot, p] > OFF_M + OFF_PLACE_M)
            self._borne[p] += push * dt
            self._elsewhere[there, p] += push * dt
            self._wrong_s[p] += dt * there.any()
            other = int(np.argmax(self._elsewhere[:, p]))
            if self._wrong_s[p] > WRONG_S and self._elsewhere[other, p] > MOST * self._borne[p]:
                self.misgiven[p] = float(away[foot, p]), other
                del self._assigned[p]

    def _majority(self) -> Flags:
        """(F, P) plates that carry a stance, as far as it has gone."""
        return np.asarray(mostly(self._near, self._loaded))

    def _press_between(
        self, plates: list[GroundPlate], cops: Array, stances: LiveStances, bears: Flags, away: Array
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
        if len(bears) != 2 or not bears.all() or not stances.marked.all():
            under_neither[:] = between[:] = False
        if under_neither.any():
            soles = [shape.reach(stances.outline(f)) for f, shape in enumerate(stances.shapes)]
            corners = [np.repeat(sole, len(plates), axis=0) for sole in (*soles, np.concatenate(soles, axis=1))]
            *each, within = (distance_to_hull(cops, sole) for sole in corners)
            under_neither &= lies_between(each, within, beside)
        between &= stances.flat.all()
        if between.any():
            markers = stances.outlines.reshape(1, -1, 2)
            both = np.broadcast_to(markers, (len(plates), *markers.shape[1:]))
            between &= lies_between(away, distance_to_hull(cops, both), BETWEEN_M)
        self._between += between
        self._beside = np.where(under_neither, np.fmin(self._beside, stances.time_s), np.inf)
        return np.asarray(stances.time_s - self._beside >= SHORTEST_S)
