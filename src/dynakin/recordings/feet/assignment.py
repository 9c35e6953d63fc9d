"""Which foot stands on which plate: the one assignment that a run has.

A plate belongs to a stance (`foot_contacts`) when its centre of pressure lies within or near the foot's outline for
most of its load, and the foot stands on its level. Wherever it lies under neither sole but between two, both feet stand
on it, from the first to the last frame that these stances and the press have in common: a foot that stands does not
move. A stance that no plate belongs to is off the plates: as long as it may bear load, the total external wrench is not
known. A foot that nobody sees for a while keeps its plate for as long as that is pressed; what it does afterwards is
not known.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from dynakin.arrays import Array, Flags, runs, widened
from dynakin.errors import ConfigError
from dynakin.messages import note
from dynakin.recordings.feet.contact import GAP_S, NEAR_SUPPORT_M, FootContact, foot_contacts, middle_velocity
from dynakin.recordings.feet.findings import exchanged, plate_findings, turned_moments
from dynakin.recordings.feet.handover import EARLY_S, LATE_S
from dynakin.recordings.feet.like_the_other import like_the_other
from dynakin.recordings.feet.loads import FootLoads, divided, plates_bear_all
from dynakin.recordings.feet.misgiven import Misgiven
from dynakin.recordings.feet.sharing import BEYOND_M, Sharing, mostly, partly_on
from dynakin.recordings.feet.soles import Soles
from dynakin.recordings.feet.who_stands_where import WhoStandsWhere
from dynakin.recordings.frame import GroundFrame
from dynakin.recordings.plates.ground_plate import SAME_LEVEL_M, GroundPlate
from dynakin.recordings.pushes import JUDGED_N
from dynakin.recordings.recording import Recording
from dynakin.recordings.standing import marker_velocities

STEP_S = 0.25
"""How long a foot may press a plate before its markers show that it stands, and after they show that it left."""
MOST = 0.8
"""Part of a press for which a moving foot must be low and near the centre of pressure to be what presses."""


def foot_loads(
    recording: Recording,
    ground: GroundFrame,
    foot_markers: Mapping[str, Sequence[str]],
    *,
    assigned: Mapping[str, str] | None = None,
    others: Sequence[str] = (),
    given: Mapping[str, tuple[str, ...]] | None = None,
    places: Mapping[str, Array] | None = None,
) -> FootLoads:
    """Give each plate's load to the foot that stands on it.

    Args:
        ground: the frame and origin of the wrenches.
        foot_markers: foot -> names of the markers on it, and on its toes.
        assigned: plate -> foot or declared contact, where the user knows better (the whole recording).
        others: names of the contacts that are declared. given: plate -> those of them that bear on it and share it, in
            the place of what `assigned` says. places: of declared contacts, (T, 3) m in the ground frame, against
            which `assigned` is held.

    Raises:
        ConfigError: `assigned` names a plate, foot or contact that there is not.
    """
    fixed = dict(assigned or {})
    check_assigned(fixed, recording, (*foot_markers, *others))
    plates = [GroundPlate.of(plate, ground) for plate in recording.plates]
    forward = ground.vectors_to_ground(ground.forward)[[0, 2]]
    contacts = foot_contacts(recording, ground, foot_markers, plates)
    contacts = like_the_other(contacts, plates, forward, recording.rate)
    owners = {name: (owner,) for name, owner in fixed.items() if owner not in foot_markers} | dict(given or {})
    return _Assignment(recording, ground, tuple(foot_markers), contacts, plates, fixed, owners, forward, places).loads()


def check_assigned(fixed: Mapping[str, str], recording: Recording, bearers: tuple[str, ...]) -> None:
    """
    Raises:
        ConfigError: plates are given, by name, that the recording has not, or to what is none of the bearers.
    """
    names = [plate.name for plate in recording.plates]
    for plate, foot in fixed.items():
        if plate not in names:
            raise ConfigError(f"plates: {plate!r} is not in {recording.name}; expected one of {', '.join(names)}")
        if foot not in bearers:
            raise ConfigError(
                f"plates: {plate!r} is given to {foot!r}, expected one of {', '.join(bearers)}, or a contact that is "
                "declared (contacts)"
            )


def to_the_end(owners: Flags, pressed: Flags, steps: list[list[tuple[int, int]]]) -> Flags:
    """Owners (T, F) of a plate, each kept from the first to the last frame of a press (T,) that has owners at all, as
    long as a step of that foot, frames [first, end), lasts.

    A centre of pressure is far off while a foot sets down or leaves; what the plate carries there is still that foot's.
    """
    owners = owners.copy()
    owned: Flags = np.asarray(owners.any(axis=1))
    for first, end in runs(pressed):
        inside = np.flatnonzero(owned[first:end]) + first
        if not len(inside):
            continue
        for k in range(owners.shape[1]):
            for start, stop in steps[k]:
                if start <= inside[0] < stop and owners[inside[0], k]:
                    owners[max(first, start) : inside[0], k] = True
                if start <= inside[-1] < stop and owners[inside[-1], k]:
                    owners[inside[-1] + 1 : min(end, stop), k] = True
    return owners


class _Assignment:
    def __init__(
        self,
        recording: Recording,
        ground: GroundFrame,
        feet: tuple[str, ...],
        contacts: dict[str, FootContact],
        plates: list[GroundPlate],
        fixed: dict[str, str],
        given: dict[str, tuple[str, ...]],
        forward: Array,
        places: Mapping[str, Array] | None,
    ) -> None:
        self.recording, self.ground, self.feet = recording, ground, feet
        self.contacts, self.plates, self.fixed = contacts, plates, fixed | {name: own[0] for name, own in given.items()}
        self.forward, self.sharing = forward, Sharing.of(list(contacts.values()), plates, forward, recording)
        n, F, P = recording.n_frames, len(feet), len(plates)
        self.step = round(STEP_S * recording.rate) if n > 1 else 0  # frames
        self.given = {p: given[plate.name] for p, plate in enumerate(plates) if plate.name in given}
        self.on = np.zeros((n, F, P), dtype=bool)  # this foot stands on this plate
        self.off = np.zeros((n, F), dtype=bool)  # it may stand off the plates
        self.hidden = np.zeros((n, F), dtype=bool)  # nobody sees it, and it may stand anywhere
        self.misgiven = {
            p: Misgiven.of(
                plate, fixed[plate.name], (places or {}).get(fixed[plate.name]), contacts, plates, recording.rate
            )
            for p, plate in enumerate(plates)
            if plate.name in fixed
        }
        self.under = self.under_feet()
        for k, foot in enumerate(feet):
            if foot in contacts:
                self.stances(k, contacts[foot])
        self.resting_on_nothing()
        self.aloft, steps = self.in_the_air(), self.steps()
        low = np.zeros((n, F), dtype=bool)
        for k, foot in enumerate(feet):
            if foot in contacts:
                low[:, k] = contacts[foot].low
        whole = np.zeros_like(self.on)
        for p, plate in enumerate(plates):
            self.presses(p, plate)
            self.on[:, :, p] &= ~self.aloft | (plate.push > JUDGED_N)[:, None]
            whole[:, :, p] = to_the_end(self.on[:, :, p], plate.pressed, steps)
        self.aloft &= ~(whole & low[:, :, None] & self.under).any(axis=2)  # a heel is loaded before it is slow
        for p, plate in enumerate(plates):  # by all plates' loads, in whatever order they are
            self.on[:, :, p] |= whole[:, :, p] & ~self.aloft
            self.passed_on(p, plate)
        for k, foot in enumerate(feet):
            if foot in contacts:
                self.unseen(k, contacts[foot])
        self.swapped = exchanged([contacts.get(foot) for foot in feet], plates)
        for p, plate in enumerate(plates):
            self.doubtful(p, plate)
            if any(p in pair for pair in self.swapped):
                self.on[:, :, p] = False
            if p in self.given:
                self.on[:, :, p] = False
            elif plate.name in fixed:
                self.on[:, :, p] = False
                self.on[:, feet.index(fixed[plate.name]), p] = plate.pressed & ~self.misgiven[p].presses

    def under_feet(self) -> Flags:
        """(T, F, P) plates whose centre of pressure lies under a foot. One on another level than the foot's own support
        counts only where no foot stands on its level, and the foot on no plate of its own: a box may stand on a plate.
        Nobody stands below one."""
        found = np.zeros_like(self.on)
        level = np.ones_like(self.on)
        for k, name in enumerate(self.feet):
            if (foot := self.contacts.get(name)) is None:
                continue
            found[:, k] = foot.under
            for p, plate in enumerate(self.plates):
                if plate.height_m is not None:
                    over = foot.support_m - plate.height_m
                    level[:, k, p] = (over > -NEAR_SUPPORT_M) & (over < SAME_LEVEL_M)
        own = found & level
        return np.asarray(found & (level | ~(own.any(axis=1, keepdims=True) | own.any(axis=2, keepdims=True))))

    def stances(self, k: int, foot: FootContact) -> None:
        """Which plates carry each stance of one foot."""
        for stance in foot.stances:
            inside, reach = slice(*stance), foot.padded(stance, self.recording.rate)
            mine, shares = [], []
            for p, plate in enumerate(self.plates):
                if self.fixed.get(plate.name, self.feet[k]) != self.feet[k]:
                    continue
                loaded = plate.loaded[inside]
                close = self.under[inside, k, p] | self.upon(plate, foot, inside)
                if (self.sharing.between[inside, p] & partly_on(plate, foot)[inside]).any():
                    shares.append(p)
                if self.sharing.beside[reach, p].any():
                    mine.append(p)
                    self.on[reach, k, p] |= self.sharing.beside[reach, p]
                if mostly(np.count_nonzero(close & loaded), np.count_nonzero(loaded)):
                    mine.append(p)
                    self.on[reach, k, p] |= plate.loaded[reach] & (self.under[reach, k, p] | foot.stands[reach])
                    self.on[inside, k, p] = True
            for p in [] if mine else shares:
                self.on[inside, :, p] |= self.sharing.between[inside, p, None]
            if not mine and not shares:
                self.off[foot.sets_down_from(stance[0], self.recording.rate) : stance[0], k] = True
                self.off[reach, k] = True
            else:
                self.off[inside, k] |= self.beyond_edges(foot, inside)
        self.off[self.at_the_end(k, foot), k] = True

    def at_the_end(self, k: int, foot: FootContact) -> slice:
        """The last frames, where a foot may be setting down in them beside the plates: whether it will stand, the
        recording no longer shows."""
        n, rate = len(self.off), self.recording.rate
        first = n if foot.stands[-1] else foot.sets_down_from(n, rate)
        frames = slice(first, n)
        leaves = any(first < foot.padded(stance, rate).stop for stance in foot.stances)
        over = [plate.beyond(foot.outline[-1:]).max() == 0.0 for plate in self.plates if plate.corners is not None]
        carried = any((self.under[frames, k, p] & plate.loaded[frames]).any() for p, plate in enumerate(self.plates))
        return slice(n, n) if leaves or carried or any(over) else frames

    def resting_on_nothing(self) -> None:
        """Feet off the plates stand on nothing while these bear the person."""
        if self.plates and self.off.any():
            body = middle_velocity(self.ground.vectors_to_ground(marker_velocities(self.recording)))
            self.off[plates_bear_all(self.plates, self.on, self.off, body[:, 1], self.recording.rate)] = False

    def presses(self, p: int, plate: GroundPlate) -> None:
        """Presses of a plate on which no foot stands still: they are the foot's that is low and near for most of the
        press."""
        for first, end in runs(plate.pressed):
            press = slice(first, end)
            loaded = plate.loaded[press]
            if plate.name in self.fixed or self.on[press, :, p].any() or not loaded.any():
                continue
            for k, name in enumerate(self.feet):
                if (foot := self.contacts.get(name)) is None:
                    continue
                near = self.under[press, k, p] & foot.low[press]
                if np.count_nonzero(near & loaded) > MOST * np.count_nonzero(loaded):
                    self.on[press, k, p] = widened(loaded, self.step)  # not what it reads by itself

    def passed_on(self, p: int, plate: GroundPlate) -> None:
        """A press that two feet bear one after the other bears both as long as either of them may: the centre of
        pressure leaves a foot before its load does."""
        for first, end in runs(plate.pressed):
            owners = np.flatnonzero(self.on[first:end, :, p].any(axis=0)).tolist()
            for k in owners if len(owners) > 1 else []:
                if (foot := self.contacts.get(self.feet[k])) is None:
                    continue
                for stance in foot.stances:
                    reach = foot.padded(stance, self.recording.rate)
                    if self.on[max(first, reach.start) : min(end, reach.stop), k, p].any():
                        before, after = round(EARLY_S * self.recording.rate), round(LATE_S * self.recording.rate)
                        self.on[max(first, reach.start - before) : min(end, stance[1] + after), k, p] = True

    def doubtful(self, p: int, plate: GroundPlate) -> None:
        """A press most of whose load is nobody's is nobody's at all: a foot that steps near its centre of pressure at
        its end is not what pressed."""
        for first, end in runs(plate.pressed):
            judged = plate.push[first:end] > JUDGED_N
            owned = np.asarray(self.on[first:end, :, p].any(axis=1) | self.hidden[first:end].any(axis=1))
            if judged.any() and owned[judged].mean() < 0.5:
                self.on[first:end, :, p] = False

    def unseen(self, k: int, foot: FootContact) -> None:
        """While nobody sees a foot: the plate that it stood on last, or stands on next, for as long as that is pressed
        without a break, and one that is pressed while all other feet are elsewhere. What else it does is not known, but
        in a gap too short for a step."""
        pressed = [runs(plate.pressed) for plate in self.plates]
        for first, end in runs(~foot.seen):
            held = np.zeros(end - first, dtype=bool)
            for p in range(len(self.plates)):
                for start, stop in pressed[p]:
                    before = start < first <= stop and self.on[first - 1, k, p]
                    after = start <= end < stop and self.on[end, k, p]
                    if before or after:
                        self.on[max(start, first) : min(stop, end), k, p] = True
                    elif stop > first and start < end and self.elsewhere(k, p, start, stop):
                        self.on[start:stop, k, p] = True
                held |= self.on[first:end, k, p]
            at_an_end = first == 0 or end == len(foot.seen)  # what lies beyond is not known either
            if at_an_end or end - first > GAP_S * self.recording.rate:
                self.hidden[first:end, k] |= ~held

    def elsewhere(self, k: int, p: int, start: int, stop: int) -> bool:
        """Whether a press that is nobody's is only to be had by a foot that nobody sees: it is judged, and all others
        are seen, and not at its centre of pressure."""
        press = slice(start, stop)
        if p in self.given or self.on[press, :, p].any() or not (self.plates[p].push[press] > JUDGED_N).any():
            return False
        here = self.contacts[self.feet[k]].seen[press] & self.plates[p].loaded[press]
        if (here & ~self.under[press, k, p]).any():
            return False
        seen = [foot.seen[press].all() for at, foot in self.contacts.items() if at != self.feet[k]]
        near = np.delete(self.under[press, :, p], k, axis=1)
        return len(seen) == len(self.feet) - 1 and all(seen) and not near.any()

    def steps(self) -> list[list[tuple[int, int]]]:
        """Frames [first, end) of each foot's stances with its setting down and leaving; all of them where nobody sees
        it, or where it never stands."""
        n, found = len(self.off), []
        for name in self.feet:
            foot = self.contacts.get(name)
            stances = () if foot is None else foot.stances
            unseen = [] if foot is None else runs(~foot.seen)
            found.append(
                [(max(0, a - self.step), min(n, b + self.step)) for a, b in (*stances, *unseen)]
                if stances
                else [(0, n)]
            )
        return found

    def upon(self, plate: GroundPlate, foot: FootContact, frames: slice) -> Flags:
        """Frames in which all touching markers of a foot lie within a plate's edges, on its level, or higher where no
        other foot stands on that: on a box; none where edges are not known."""
        touching = foot.touching[frames]
        if plate.corners is None or plate.height_m is None:
            return np.zeros(len(touching), dtype=bool)
        inside = plate.beyond(foot.outline[frames]) == 0.0
        level = np.abs(foot.support_m[frames] - plate.height_m) < SAME_LEVEL_M
        others = [
            other.stands[frames] & (np.abs(other.support_m[frames] - plate.height_m) < SAME_LEVEL_M)
            for other in self.contacts.values()
            if other is not foot
        ]
        level |= (foot.support_m[frames] > plate.height_m) & ~np.any([np.zeros_like(level), *others], axis=0)
        return np.asarray(level & touching.any(axis=1) & (inside | ~touching).all(axis=1))

    def beyond_edges(self, foot: FootContact, frames: slice) -> Flags:
        """Frames in which a touching marker lies beyond the edges of all plates; none where edges are not known, nor on
        a step, beyond whose edge nothing is."""
        touching = foot.touching[frames]
        heights = [plate.height_m for plate in self.plates if plate.height_m is not None and plate.corners is not None]
        if len(heights) < len(self.plates):
            return np.zeros(len(touching), dtype=bool)
        away = np.min([plate.beyond(foot.outline[frames]) for plate in self.plates], axis=0)
        raised = foot.support_m[frames] > min(heights) + 2.0 * SAME_LEVEL_M
        return np.asarray(((away > BEYOND_M) & touching).any(axis=1) & ~raised)

    def in_the_air(self) -> Flags:
        """(T, F) feet that are surely in the air: high and moving between two stances of their own, or moving while
        another one stands still. A pedal moves with the foot that presses it, and lets it stand nowhere."""
        found = np.zeros(self.off.shape, dtype=bool)
        for k, name in enumerate(self.feet):
            if (foot := self.contacts.get(name)) is None:
                continue
            others = [other.stands for at, other in self.contacts.items() if at != name]
            between = np.zeros(len(found), dtype=bool)
            if len(foot.stances) > 1:
                between[foot.stances[0][1] : foot.stances[-1][0]] = True
            bears = foot.bears(self.recording.rate)
            found[:, k] = (foot.aloft & between) | (np.any(others, axis=0) & foot.moves & ~bears)
        return found

    def loads(self) -> FootLoads:
        """The loads, and what there is to say of them."""
        contacts = [self.contacts.get(foot) for foot in self.feet]
        marked = np.array([contact is not None for contact in contacts], dtype=bool)
        soles = Soles.of(contacts, self.forward, self.recording.rate, self.recording.n_frames)
        loads = divided(self.feet, self.plates, soles, marked, self.on, self.off, self.hidden, self.aloft, self.given)
        who = WhoStandsWhere(
            self.recording.time, self.feet, self.contacts, self.plates, self.fixed, self.given, self.on, self.off,
            self.hidden,
        )  # fmt: skip
        reasons, said = who.reasons(), who.said()
        said += plate_findings(who, soles, self.swapped)
        for p, plate in enumerate(self.plates):
            beyond = self.sharing.beyond[:, p] & (self.on[:, :, p].sum(axis=1) > 1)
            if beyond.any() and plate.name not in self.fixed:
                loads = loads.without(self.on[:, :, p] & beyond[:, None]).with_undeclared(beyond)
                reasons.append(who.something_else(p, beyond))
        if missing := [foot for foot in self.feet if foot not in self.contacts]:
            said.append(
                note(
                    "plates",
                    f"No markers of the {' and '.join(missing)} foot: nobody sees whether it stands off the plates.",
                )
            )
        turned = turned_moments(who, self.recording.rate)
        why = next((each.why for each in self.misgiven.values() if each.why), "")
        return replace(loads, messages=(*said, *reasons), reasons=tuple(reasons), turned_moments=turned, misgiven=why)
