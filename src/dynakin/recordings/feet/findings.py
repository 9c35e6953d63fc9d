"""What is wrong with plates that only the feet show: one off its place, two exchanged, a dead one, moments that have a
wrong sign or are exchanged, so that the centre of pressure moves against the foot on it.

Each is said in one sentence, with what to do. Nothing is put right here: a load that lies under no foot is left out.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from dynakin.arrays import Array, Flags, runs
from dynakin.messages import Message, together, warning
from dynakin.recordings.feet.contact import NEAR_M, FootContact
from dynakin.recordings.feet.soles import LONGEST_M, Soles, shape_of
from dynakin.recordings.feet.who_stands_where import WhoStandsWhere
from dynakin.recordings.hull import distance_to_hull
from dynakin.recordings.plates.ground_plate import SAME_LEVEL_M, GroundPlate
from dynakin.recordings.pushes import JUDGED_N, MOST_OFFSET_N, UNLOADED_N
from dynakin.recordings.times import span

OFF_PLACE_M = 0.06
"""Distance of centres of pressure from a foot's markers that is kept for three quarters of its load: no shoe is so
wide. Ours stay within 0.05, those with two markers a foot among them."""
TOGETHER = 0.7
"""Part of a press in which a foot must stand, and the other way round, for the two to belong together."""
FITS, MISFITS = 0.8, 0.3
"""Part of a plate's load that must lie under feet once plates are exchanged, and may at most before."""
STANDS_S = 0.5
"""How long a foot must stand on a plate that reads nothing for it to be said: one that hovers over it in a functional
trial does for a quarter of a second."""

MIRRORED: tuple[tuple[str, Array], ...] = (
    ("it is mirrored along the first axis (from corner 2 to 1), as by a wrong sign of My", np.diag([-1.0, 1.0])),
    ("it is mirrored along the second axis (from corner 4 to 1), as by a wrong sign of Mx", np.diag([1.0, -1.0])),
    ("it is turned by half a turn about the plate's middle, as by a wrong sign of all moments", -np.eye(2)),
    ("its coordinates are exchanged, as by exchanged Mx and My", np.array([[0.0, -1.0], [-1.0, 0.0]])),
)
"""What wrong moments do to a centre of pressure, along a plate's axes and about its middle."""
AWAY_M, LESS, JUDGED_S = 0.03, 0.4, 0.3
"""What presses is the part of a foot that touches: from it a centre of pressure lies so far on average, by load and
over so long at least, and mirrored within it and by so much less. Walks of `truth3d`, which chose: right 0.008 to 0.014
m, mirrored 0.03 to 0.07 (0.08 to 0.25 times that once put right). Of 25 plates in shared/data 5 lie as far off (0.036
to 0.157), and mirrored 0.5 times as far and more."""
OVER_M = 0.03
"""How far beyond its edges a marker may be that bears on a plate."""


def plate_findings(who: WhoStandsWhere, soles: Soles, swapped: Sequence[tuple[int, int]]) -> list[Message]:
    """Sentences on the feet's plates, of which pairs are exchanged (``swapped``), once all feet have markers."""
    if len(who.contacts) < len(who.feet):
        return []
    plates, own = who.plates, [p for p in range(len(who.plates)) if p not in who.given]
    swapped = [pair for pair in swapped if set(pair) <= set(own)]
    said = [
        warning(
            "plates",
            f"{plates[p].name} and {plates[q].name} have been exchanged: each one's load lies under a foot that "
            "stands once it is put at the other's place, and next to none of it at its own. Exchange the two in the "
            "file (their channels or their corners); their loads are left out.",
        )
        for p, q in swapped
    ]
    for p in own:
        if not any(p in pair for pair in swapped) and (text := _off_place(who, soles, p)):
            said.append(text)
        if text := _dead(who, plates[p]):
            said.append(text)
    return said


def exchanged(contacts: Sequence[FootContact | None], plates: Sequence[GroundPlate]) -> list[tuple[int, int]]:
    """Pairs of plates each of whose data were measured where the other lies, by feet all of which have markers."""
    feet = [contact for contact in contacts if contact is not None]
    if not feet or len(feet) < len(contacts):
        return []
    pairs = combinations(range(len(plates)), 2)
    return [(p, q) for p, q in pairs if _are_exchanged(plates[p], plates[q], feet)]


def _are_exchanged(one: GroundPlate, other: GroundPlate, feet: Sequence[FootContact]) -> bool:
    """Whether two feet that step on them one after the other say so."""
    if one.corners is None or other.corners is None:
        return False
    parts = []
    for plate, place in ((one, other), (other, one)):
        if not (plate.push > JUDGED_N).any() or _under_feet(plate, plate.cop, feet) > MISFITS:
            return False
        (middle, rows), (at, turned) = plate.axes, place.axes
        there = np.asarray((plate.cop - middle) @ rows.T @ turned + at)  # at the same place of the other one
        parts.append(_under_feet(plate, there, feet))
    return min(parts) > FITS


def _under_feet(plate: GroundPlate, cop: Array, feet: Sequence[FootContact]) -> float:
    """Part of a plate's load that lies under feet that stand, were its centres of pressure at (T, 2) m."""
    under = [(distance_to_hull(cop, foot.outline) < NEAR_M) & foot.stands for foot in feet]
    return float(np.any(under, axis=0)[plate.push > JUDGED_N].mean())


def _off_place(who: WhoStandsWhere, soles: Soles, p: int) -> Message | None:
    """Whether a plate's load comes and goes with a foot, but lies off it."""
    plate, on, offsets = who.plates[p], who.on, dict[int, list[Array]]()
    for first, end in runs(plate.push > JUDGED_N):
        press = slice(first, end)
        if plate.push[press].max() < MOST_OFFSET_N:
            continue
        for k, name in enumerate(who.feet):
            foot = who.contacts[name]
            elsewhere = np.asarray(np.delete(on[press], p, axis=2).any(axis=2))  # (T, F)
            others = elsewhere[:, k].mean() > 1.0 - TOGETHER
            shared = np.delete(on[press, :, p] & ~elsewhere, k, axis=1).any(axis=1).mean() > 1.0 - TOGETHER
            with_it = foot.stands[press]
            if others or shared or with_it.mean() < TOGETHER or not _covers(foot, first, end):
                continue
            away = distance_to_hull(plate.cop[press], foot.outline[press])[with_it]
            if np.isfinite(away).any() and np.nanpercentile(away, 25.0) > reach_m(foot, soles.rate):
                offsets.setdefault(k, []).append((plate.cop[press] - soles.middle[press, k][:, [0, 2]])[with_it])
    if len(offsets) != 1:
        return None
    k, found = next(iter(offsets.items()))
    x, z = np.nanmedian(np.concatenate(found), axis=0)
    return warning(
        "plates",
        f"{plate.name} lies off its place: its centre of pressure is {np.hypot(x, z):.2f} m (X {x:+z.2f}, Z {z:+z.2f} "
        f"m of the ground frame) from the middle of the {who.feet[k]} foot's sole while its load comes and goes "
        "with that foot. Correct the plate's place (its corners or origin) in the file.",
    )


def reach_m(foot: FootContact, rate: float) -> float:
    """How far (m) a foot reaches beyond its markers, at most."""
    return LONGEST_M if shape_of(foot, np.ones(2), rate).ends is None else OFF_PLACE_M


def _covers(foot: FootContact, first: int, end: int) -> bool:
    """Whether one stance of a foot goes on for about as long as a press."""
    inside = [min(b, end) - max(a, first) for a, b in foot.stances if min(b, end) > max(a, first)]
    lengths = [b - a for a, b in foot.stances if min(b, end) > max(a, first)]
    return bool(inside) and max(inside) > TOGETHER * max(lengths)


def _dead(who: WhoStandsWhere, plate: GroundPlate) -> Message | None:
    """Whether a plate reads nothing although a foot stands wholly on it and no other plate carries that. Of one that is
    not measured there, who left it out says why."""
    if plate.corners is None or (plate.push > UNLOADED_N).any():
        return None
    time = who.time
    for k, name in enumerate(who.feet):
        foot = who.contacts[name]
        for first, end in foot.stances:
            own = slice(first, end)
            if time[end - 1] - time[first] < STANDS_S or who.on[own, k].any() or not plate.known[own].any():
                continue
            beyond = plate.beyond(foot.outline[own])
            if np.isfinite(beyond).any() and np.nanmax(beyond) == 0.0:
                return warning(
                    "plates",
                    f"{plate.name} reads nothing although the {name} foot stands on it from "
                    f"{span(time, first, end)}. Look whether its channels were connected, and leave "
                    "it out of the file if not.",
                )
    return None


def turned_moments(who: WhoStandsWhere, rate_hz: float) -> str:
    """A sentence on the feet's plates, all together or one, whose centre of pressure lies under what touches of the
    feet once it is mirrored, and not as it is; "" where none does, or nothing can be said."""
    feet = [who.contacts[name] for name in who.feet if name in who.contacts]
    plates = [plate for p, plate in enumerate(who.plates) if p not in who.given]
    pressed = {plate.name: found for plate in plates if (found := _Pressed.of(plate, feet)) is not None}
    every = list(pressed)
    for names in (every, *([name] for name in every if len(every) > 1)):
        chosen = [pressed[name] for name in names]
        if not sum(len(each.push) for each in chosen) >= max(JUDGED_S * rate_hz, 1.0):  # one frame has no rate
            continue
        now = _away(chosen, np.eye(2))
        if not now > AWAY_M:
            continue
        least, words = min((_away(chosen, turn), words) for words, turn in MIRRORED)
        if least < min(LESS * now, AWAY_M):
            return (
                f"the centre of pressure of {together(names)} does not go with the feet: it lies {now:.2f} m on "
                f"average from what of them touches the ground, and {least:.2f} m once {words}"
            )
    return ""


class _Pressed:
    """A plate while something of a foot touches it: its centre of pressure (K, 2) m along its axes and about its
    middle, those markers (K, M, 2) likewise, NaN where they do not touch, and its load (K,) N."""

    def __init__(self, cop: Array, markers: Array, push: Array) -> None:
        self.cop, self.markers, self.push = cop, markers, push

    @staticmethod
    def of(plate: GroundPlate, feet: Sequence[FootContact]) -> _Pressed | None:
        """None where it has no corners, or nobody touches it."""
        if plate.corners is None or not feet:
            return None
        middle, rows = plate.axes
        touching = [foot.touching & (plate.beyond(foot.outline) < OVER_M) & _level(foot, plate) for foot in feet]
        markers = np.concatenate(
            [np.where(on[:, :, None], foot.outline, np.nan) for on, foot in zip(touching, feet, strict=True)], axis=1
        )
        seen = np.isfinite(markers).all(axis=2).any(axis=1) & np.isfinite(plate.cop).all(axis=1)
        on: Flags = np.asarray(seen & plate.known & (plate.push > JUDGED_N))
        if not on.any():
            return None
        return _Pressed((plate.cop[on] - middle) @ rows.T, (markers[on] - middle) @ rows.T, plate.push[on])


def _level(foot: FootContact, plate: GroundPlate) -> Flags:
    """(T, 1) frames in which a foot stands on the level of a plate: under a seat that is one, it does not."""
    height = np.nan if plate.height_m is None else plate.height_m
    with np.errstate(invalid="ignore"):
        return np.asarray(np.abs(foot.support_m - height) < SAME_LEVEL_M)[:, None]


def _away(plates: Sequence[_Pressed], turn: Array) -> float:
    """How far centres of pressure lie from the feet once turned, m, on average by load."""
    away = np.concatenate([distance_to_hull(each.cop @ turn.T, each.markers) for each in plates])
    return float(np.average(away, weights=np.concatenate([each.push for each in plates])))
