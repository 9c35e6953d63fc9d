"""Which foot each plate carries at this moment, and whether the plates carry all of the person."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from dynakin.arrays import Array, Flags
from dynakin.bindings import _core
from dynakin.errors import ConfigError
from dynakin.filter.contacts import ContactLoads
from dynakin.filter.ground.declared import may_bear
from dynakin.filter.ground.expected import ContactPaths, expected_loads
from dynakin.filter.ground.ground import Ground
from dynakin.filter.ground.plate_errors import NO_ERRORS, VERTICAL_ONLY, PlateErrors
from dynakin.filter.ground.plate_noise import LiveNoise
from dynakin.filter.live.closure import DELAY_S, LiveClosure
from dynakin.filter.live.owners import PlateOwners
from dynakin.filter.live.stances import DT_S, LiveStances
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.recordings.feet.contact import (
    AFTER_S,
)
from dynakin.recordings.feet.handover import EARLY_S, PASSING_S, smooth_step
from dynakin.recordings.feet.loads import SHARED, FootLoads, divided
from dynakin.recordings.feet.misgiven import others_plate
from dynakin.recordings.feet.soles import Soles
from dynakin.recordings.plates.ground_plate import EndOfRange, GroundPlate
from dynakin.recordings.plates.pressure import pressed_at
from dynakin.recordings.plates.stuck import STILL_N
from dynakin.recordings.pushes import JUDGED_N
from dynakin.results.naming import sentence
from dynakin.settings.noise import Noise

_SEEN = 0.5  # part of the markers from which the motion of the centre of mass is seen
_LEAST_S = 0.001  # between frames of which a share's rate is taken


class LiveFeet:
    """Gives each plate to the feet that stand on it, frame by frame, from the estimate before the step.

    Offline (`recordings.feet.assignment`) whole stances are seen; here a stance is what has been seen of it so far
    (`LiveStances`), and for a while after (push-off); which plate carries it is what most of it says (`PlateOwners`).

    Args:
        plates: names, as far as they are known (`meet`).
        assigned: plate -> "right", "left" or a declared contact, where it is known.

    Attributes:
        whole: whether the sum of the plates was the total wrench in the last frame. claimed: whether it was by what
            feet and plates show, the motion not asked. seen: (M, 3) m, the markers of that frame as they were measured;
            None where these were not given.
    """

    def __init__(
        self, initial: CalibratedModel, noise: Noise, plates: tuple[str, ...], assigned: Mapping[str, str]
    ) -> None:
        self.initial, self.noise, self._assigned = initial, noise, assigned
        self.feet = tuple(initial.feet)
        self._stances = LiveStances(initial)
        self._paths = ContactPaths.of(initial)
        self._highest, self._lowest = -np.inf, np.inf  # of the root, and of all markers
        self._since = np.full(len(self.feet), np.nan)  # when the stance began
        self._share: tuple[float, Array] | None = None  # when soles were looked at last, and each foot's share then
        self._floor_m = float(initial.ground.points_to_ground(np.zeros(3))[1])  # streams put plates there, too
        self._closure: LiveClosure | None = None
        self.whole = self.claimed = False
        self.seen: Array | None = None
        self._sideways, self._vertical = False, False  # a plate has shown a horizontal force; loaded plates show none
        self._said: set[str] = set()
        self._to_say: list[str] = []
        self.meet(plates)

    def meet(self, plates: tuple[str, ...]) -> None:
        """From now on these are all plates that there are; which feet are on them is found anew.

        Raises:
            ConfigError: one of them is assigned to what is not there.
        """
        self.plates, assigned = plates, self._assigned
        known = (*self.feet, *self.initial.contacts)
        given = {p: assigned[name] for p, name in enumerate(plates) if name in assigned}
        if unknown := [name for name in given.values() if name not in known]:
            raise ConfigError(f"plates: {unknown[0]!r} is given a plate, expected one of {', '.join(known)}")
        contacts = [p for p, name in given.items() if name in self.initial.contacts]
        assigned_feet = {p: self.feet.index(name) for p, name in given.items() if name in self.feet}
        self._given = {p: (given[p],) for p in contacts}
        self._noise = LiveNoise(plates)
        self._owners = PlateOwners(len(self.feet), len(plates), assigned_feet, contacts)
        self._range = EndOfRange(len(plates))

    def look(
        self,
        model: _core.Model,
        state: Array,
        time_s: float,
        wrenches: Array | None,
        markers: Array | None = None,
    ) -> ContactLoads:
        """The feet's wrenches at a time (T = 1).

        Args:
            state: (n,) before the step. wrenches: (P, 6) N and N m, laboratory frame, or None. markers: (M, 3) m as
                measured, of the model, ground frame, NaN missing: without them nobody asks whether something undeclared
                bears the person.
        """
        dt = float(np.clip(time_s - self._stances.time_s, *DT_S))
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
        errors = self._errors(wrenches)
        self.claimed, self.seen = self._whole(loads, bears), markers
        if markers is not None and wrenches is not None:
            loads = self._closed(loads, time_s, markers, places, wrenches, bears)
        undeclared = loads.elsewhere & (wrenches is not None)
        self.whole = self._whole(loads, bears)
        ground = Ground(loads, undeclared, bears, wrenches is not None, errors)
        return expected_loads(ground, self.initial, self.noise, paths)

    def _whole(self, loads: FootLoads, bears: Flags) -> bool:
        return bool(loads.total_known[0] and not bears.any() and not self._vertical)

    def _errors(self, wrenches: Array | None) -> PlateErrors:
        """Whether the plates measure horizontal forces: noise alone shows that they do; and that noise."""
        if not self._sideways and wrenches is not None:
            force = np.abs(self.initial.ground.wrench_to_ground(wrenches)[:, :3])
            self._sideways = bool((force[:, [0, 2]] > STILL_N * force[:, [1]]).any())
            self._vertical = not self._sideways and bool((force[:, 1] > JUDGED_N).any())
        if self._vertical:
            self._say(sentence(VERTICAL_ONLY.text))
        errors = PlateErrors(unmeasured=True) if self._vertical else NO_ERRORS
        if wrenches is None:
            return errors
        return replace(errors, noise=self._noise.look(self.initial.ground.wrench_to_ground(wrenches)).noise)

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
        stances = self._stances
        stances.look(time_s, places, velocity, self._owners.carried)
        bears, stands = time_s - stances.touched <= AFTER_S, stances.stands
        aloft = stances.moves & ~bears & (stands.sum() > stands)  # high alone may be a pedal: no later stance is known
        plates = [] if wrenches is None else self._plates(wrenches)
        off = self._owners.look(plates, stances, bears)
        while self._owners.misgiven:
            p, (away_m, other) = self._owners.misgiven.popitem()
            owner = self._assigned[self.plates[p]]
            found = others_plate(self.plates[p], owner, f"the {owner} foot", away_m, self.feet[other])
            self._say(f"{found} From now on it is the foot's that stands on it; before, moments were wrong.")
        on = self._owners.owners[:, : len(plates)]
        soles = self._soles(bears, time_s, places)
        seen_none = np.zeros_like(off)  # the model shows all of them
        given = self._given if plates else {}
        loads = divided(
            self.feet, plates, soles, stances.marked, on[None], off[None], seen_none[None], aloft[None], given
        )
        for both in np.flatnonzero(on.sum(axis=0) > 1) if (loads.reason == SHARED).any() else ():
            self._say(
                f"Both feet stand on {self.plates[both]}: its wrench is divided between them by where each one's load "
                "is expected."
            )
        if plates and not loads.total_known[0]:
            self._say(
                "The plates do not carry all of the person (a foot off the plates, a load where nobody stands, a plate "
                "that hangs or is at the end of its range): what they do not carry is estimated for as long as that is "
                "so."
            )
        return loads

    def _soles(self, bears: Flags, time_s: float, places: Array) -> Soles:
        """Soles of this moment (T = 1). Their sizes and places among the markers are those that were seen first. When
        a stance that goes on will end is not known yet."""
        F, stances = len(self.feet), self._stances
        shapes, marked = stances.shapes, stances.marked
        self._since = np.where(bears, np.fmin(self._since, time_s), np.nan)
        middle, half = np.full((1, F, 3), np.nan), np.stack([shape.half_m for shape in shapes])
        pressure, covariance = middle.copy(), np.tile(np.eye(2), (1, F, 1, 1))
        for f in np.flatnonzero(marked).tolist():
            points = stances.outline(f)
            x, z = shapes[f].middle(points)[0]
            ahead, covariance[:, f] = shapes[f].rolled(points, stances.rise(f, places))
            middle[0, f] = x, self._floor_m + stances.stands_over(f), z
            pressure[0, f] = middle[0, f] + np.array([ahead[0, 0], 0.0, ahead[0, 1]])
        since, left = time_s - self._since, time_s - stances.touched
        weight = smooth_step(np.fmin((since + EARLY_S) / PASSING_S, 1.0 - left / AFTER_S))
        weight = np.where(marked, np.where(bears, weight, 0.0), 1.0)
        support = np.minimum(weight.sum(keepdims=True), 1.0)
        soles = Soles(middle, half, (bears | ~marked)[None], weight[None], support, pressure, covariance)
        if self._share is not None:
            before_s, share = self._share
            rate = 1.0 / max(time_s - before_s, _LEAST_S)
            soles = replace(soles, rate=rate, share_before=share)
        self._share = time_s, soles.share
        return soles

    def news(self) -> list[str]:
        """Sentences, each said once."""
        found, self._to_say = self._to_say, []
        return found

    def _say(self, text: str) -> None:
        if text not in self._said:
            self._said.add(text)
            self._to_say.append(text)

    def _plates(self, wrenches: Array) -> list[GroundPlate]:
        loads = self.initial.ground.wrench_to_ground(wrenches)
        known = np.isfinite(loads).all(axis=1) & ~self._range.at_end(loads[:, 1])
        cop = pressed_at(loads, self._floor_m)
        return [
            GroundPlate(name, loads[[p]], cop[[p]], known[[p]], None, self._floor_m)
            for p, name in enumerate(self.plates)
        ]
