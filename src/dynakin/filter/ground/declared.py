"""When declared contacts bear or pull the person: where the plates lack something, or nobody can say."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from dynakin.arrays import Array, Flags, runs, widened
from dynakin.filter.ground.closure import Closure
from dynakin.filter.ground.expected import ContactPaths
from dynakin.filter.uncertainty.loads import HANDS
from dynakin.messages import Message, note
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.recordings.feet.contact import ALONE_M
from dynakin.recordings.feet.loads import FootLoads
from dynakin.recordings.feet.places import foot_places
from dynakin.recordings.hull import distance_to_hull
from dynakin.recordings.plates.ground_plate import GroundPlate
from dynakin.recordings.pushes import JUDGED_N
from dynakin.recordings.recording import Recording
from dynakin.recordings.times import span
from dynakin.settings.contacts import SEAT

LOW = 0.85
"""Part of its greatest height over the floor below which a pelvis may be on a seat: standing on one's toes is above, a
bar stool below."""
STANDING = 0.53
"""Height of the middle of the pelvis' markers over that of the person, of who is seen seated only."""
MARGIN_S = 0.15
"""How long before and after the excess is seen the contact comes and goes: it is smoothed over that."""

UNDER_M, ALWAYS = 0.3, 0.95
"""A plate is a contact's of its own where it presses within so much of it, horizontally, by the median: a seat is as
large as that. And where the contact may bear for that part of its load: a foot's plate is loaded while somebody stands,
too."""
LOW_M = 0.2
"""Height of a contact's markers over a plate up to which it, and not the foot beside it, may press there: those of a
hand on the floor are 0.08 to 0.1 m above it."""
BETWEEN, OFTEN = 0.2, 0.1
"""A plate bears a second contact, too, where it presses that part of the way towards it, within `UNDER_M` of the line
between them, for that part of its load: of hands on plates of their own it is 0.03 to 0.15 of the way (a wrist lies
behind its palm), of two on one plate 0.45 to 0.55. Chosen on planks and push-ups of one simulated person; hands and
knees on all fours did not choose."""
AT_PLATE = 0.25
"""Ratio of `acts_at` below which something acts at the plates, and above whose inverse at a contact: twice as near."""


def plates_of_their_own(
    recording: Recording,
    initial: CalibratedModel,
    loads: FootLoads,
    paths: Array,
    may: Flags,
    assigned: Mapping[str, str],
) -> dict[str, tuple[str, ...]]:
    """Plate -> the declared contacts that press it, where nobody said so: one on which no foot ever stands, or that
    presses nearer to a contact that is low over it than to any foot. Also where somebody did, but it presses between
    that contact and another one: they share it.

    Args:
        loads: of the feet, by all plates. paths: (T, 1 + C, 3) m, of `ContactPaths`. may: (T, C) of `may_bear`.
        assigned: plate -> foot or contact, as given.
    """
    names = list(initial.contacts)
    feet = [places for _, places in foot_places(recording, initial.ground, initial.foot_markers).values()]
    pressed = {
        p: _Pressed.of(plate, paths[:, 1:], may, bool(loads.on[:, :, p].any()), feet)
        for p, plate in enumerate(loads.plates)
        if assigned.get(plate.name) not in initial.feet
    }
    found = dict[str, tuple[str, ...]]()
    for p, each in pressed.items():
        plate = loads.plates[p].name
        if each is None:
            continue
        elsewhere = [other for at, other in pressed.items() if other is not None and at != p]
        free = [
            c
            for c, name in enumerate(names)
            if name not in assigned.values()
            and not any(other.owned[c] and other.away[c] < each.away[c] for other in elsewhere)
        ]
        given = assigned.get(plate)
        own = [c for c in free if each.owned[c]] if given is None else [names.index(given)]
        if not own:
            continue
        first = own[int(np.argmin(each.away[own]))]
        others = [c for c in free if c != first and each.presses_towards(first, c)]
        if given is None or others:
            found[plate] = tuple(names[c] for c in (first, *others))
    return found


@dataclass(frozen=True)
class _Pressed:
    """Where a plate presses while it is judged (K frames): cop (K, 2) m; places (K, C, 2) m of the contacts; away (C,)
    m by the median; owned (C,) it may be that contact's."""

    cop: Array
    places: Array
    away: Array
    owned: Flags

    @classmethod
    def of(
        cls, plate: GroundPlate, places: Array, may: Flags, stood_on: bool, feet: Sequence[Array]
    ) -> _Pressed | None:
        """None of a plate on which there is no load to judge."""
        judged = (plate.push > JUDGED_N) & np.isfinite(plate.cop).all(axis=1)
        if not judged.any():
            return None
        cop = plate.cop[judged]
        apart = np.linalg.norm(cop[:, None] - places[judged][..., [0, 2]], axis=2)
        away = np.median(apart, axis=0)
        owned = (away < UNDER_M) & (may[judged].mean(axis=0) > ALWAYS)
        if stood_on:
            low = places[judged, :, 1] - (plate.height_m or 0.0) < LOW_M
            soles = np.stack([distance_to_hull(cop, each[judged][..., [0, 2]]) for each in feet], axis=1)
            from_feet = np.where(np.isfinite(soles), soles, np.inf).min(axis=1)[:, None]
            owned &= (low & (apart < from_feet) & (from_feet > ALONE_M)).mean(axis=0) > ALWAYS
        return cls(cop, places[judged][..., [0, 2]], away, np.asarray(owned))

    def presses_towards(self, first: int, second: int) -> bool:
        """Whether some of the load is the second contact's, too, and not the first one's alone."""
        between = self.places[:, second] - self.places[:, first]
        length = np.maximum(np.linalg.norm(between, axis=1), 1e-9)
        along = between / length[:, None]
        off = self.cop - self.places[:, first]
        way = (off * along).sum(axis=1) / length
        beside = np.abs(off[:, 0] * along[:, 1] - off[:, 1] * along[:, 0])
        return bool(((way > BETWEEN) & (way < 1.0 + BETWEEN) & (beside < UNDER_M)).mean() > OFTEN)


def low_beside_feet(
    initial: CalibratedModel, time: Array, loads: FootLoads, places: Array, bears: Flags, which: list[int]
) -> tuple[FootLoads, Flags]:
    """The same without the feet on whose plate declared hands may press as well, because they are low over it and near
    where it presses, and while they are the plates lack nothing that they bear beside it; and (T, C) when.

    Args:
        places: (T, K, 3) m of those contacts, by number (``which``), that no plate measures. bears: (T, C) as judged.
    """
    feet, found, reasons = np.zeros(loads.on.shape[:2], dtype=bool), np.zeros_like(bears), list[Message]()
    names, segments = list(initial.contacts), list(initial.contacts.values())
    for p, own in enumerate(loads.plates):
        for place, c in zip(places.swapaxes(0, 1), which, strict=True):
            if segments[c] not in HANDS:  # a shank is low while its own foot stands
                continue
            near = np.linalg.norm(place[:, [0, 2]] - own.cop, axis=1) < UNDER_M
            low = np.asarray(own.loaded & near & (place[:, 1] - (own.height_m or 0.0) < LOW_M))
            for k, foot in enumerate(loads.feet):
                for first, end in runs(low & loads.on[:, k, p]):
                    if bears[first:end, c].any():
                        continue
                    feet[first:end, k] = found[first:end, c] = True
                    text = (
                        f"The {names[c]} is low over {own.name}, on which the {foot} foot stands, from "
                        f"{span(time, first, end)}: what each of them bears is not known there."
                    )
                    reasons.append(note("plates", text))
    return (replace(loads.without(feet), reasons=(*loads.reasons, *reasons)) if reasons else loads), found


def may_bear(initial: CalibratedModel, paths: Array, floor_m: float, tallest_m: float) -> Flags:
    """(T, C) frames in which each declared contact may bear, by the markers alone: a seat where the pelvis is low.

    Args:
        paths: (T, 1 + C, 3) m, of `ContactPaths`. floor_m: height of the floor. tallest_m: greatest height of the
            root over it.
    """
    tallest = max(tallest_m, STANDING * (initial.height_m or 0.0))
    low = paths[:, 0, 1] - floor_m < LOW * tallest
    every = np.ones(len(paths), dtype=bool)
    return (
        np.stack([low if name == SEAT else every for name in initial.contacts], axis=1)
        if initial.contacts
        else (np.zeros((len(paths), 0), dtype=bool))
    )


def acts_at(found: Closure, frames: Flags, pressed: Array, places: Array, *, mean: bool = False) -> float:
    """What the excess leaves of the moments about the ground's origin if it acts where plates are pressed, (T, 2) m,
    over what it leaves at the nearest of some contacts at (T, C, 3) m (squares): less than 1 at the plates.

    Args:
        mean: all of the time, by the mean over the frames (T,).
    """
    known = np.isfinite(np.column_stack([found.excess, found.moment, pressed])).all(axis=1)
    frames = frames & known
    if not frames.any():
        return 1.0
    force, about = found.excess[frames], found.moment[frames]

    def left(place: Array) -> float:  # of a force at (K, 3) m
        lacks = about - np.cross(place, force)[:, [0, 2]]
        return float(np.square(lacks.mean(axis=0) if mean else lacks).sum())

    plates = left(np.insert(pressed[frames], 1, 0.0, axis=1))
    return plates / max(min(left(places[frames, c]) for c in range(places.shape[1])), 1e-9)


def held_in_words(what: str, initial: CalibratedModel, touched: Flags) -> str:
    """That something is laid to some of the declared contacts (C,)."""
    held = [name for name, own in zip(initial.contacts, touched, strict=True) if own]
    names = f"{' and the '.join(held)} {'bears' if len(held) == 1 else 'bear'}"
    return (
        f"{what}: that is taken as what the {names}, and the total wrench is not measured there. If nobody holds on to "
        "anything, do not declare it."
    )


def taken_in_words(plate: str, contacts: tuple[str, ...]) -> str:
    """That a plate is taken as declared contacts'."""
    if len(contacts) > 1:
        names = " and the ".join(contacts)
        return (
            f"{plate} is taken as that of the {names}, because it presses between them: how they divide its load is "
            "assumed."
        )
    return (
        f"{plate} is taken as the {contacts[0]}'s: it presses where the {contacts[0]} is, and no foot stands there. If "
        f'it is not, name whose it is in a configuration: plates = {{ "{plate}" = "right" }}.'
    )


def declared_contacts(initial: CalibratedModel, markers: Array) -> tuple[Array, Flags]:
    """(T, 1 + C, 3) m where the root and the declared contacts are, NaN where none is declared; (T, C) frames in which
    each of these may bear."""
    if not initial.contacts:
        return np.full((len(markers), 1, 3), np.nan), np.zeros((len(markers), 0), dtype=bool)
    paths = ContactPaths.of(initial).at(markers)
    floor = float(np.nanmin(markers[..., 1]))
    return paths, may_bear(initial, paths, floor, float(paths[:, 0, 1].max()) - floor)


def bearing(found: Closure, may: Flags, names: list[str], measured: list[bool], claimed: Flags, rate: float) -> Flags:
    """(T, C) frames in which each declared contact bears, of those (``measured``) that no plate measures.

    What the plates lack is taken for theirs, as far as they can: a seat pushes upwards, where the pelvis is low. Where
    nobody can judge, they bear where they may.

    Args:
        may: (T, C) of `may_bear`. claimed: (T,) frames in which the plates' sum was compared with the motion.
    """
    bears = np.zeros_like(may)
    if all(measured):
        return bears
    judged = np.isfinite(found.excess[:, 1])
    nearest = scipy.ndimage.distance_transform_edt(~judged, return_distances=False, return_indices=True)[0]
    for c, name in enumerate(names):
        if measured[c]:
            continue
        for first, end in runs(found.undeclared):
            excess = found.excess[first:end, 1]
            upwards = not np.isfinite(excess).any() or float(np.nanmean(excess)) > 0.0
            if name != SEAT or (upwards and may[first:end, c].mean() > 0.5):
                bears[first:end, c] = True
        bears[:, c] = widened(bears[:, c], round(MARGIN_S * rate)) & (may[:, c] | bears[:, c])
        bears[:, c] = np.where(judged, bears[:, c], np.where(claimed, bears[nearest, c], may[:, c]))
    return bears
