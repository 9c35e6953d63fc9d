"""When a plate's centre of pressure says that two feet bear on it: it lies under neither; or something else, too: it
lies beyond both.

One foot's load lies under its sole; that of two between them, in a single frame as in all. How far beside both soles it
must lie grows with what is not known: of the sole, of the place of a light load, and of the plate's own place, which a
foot shows that bears alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from dynakin.arrays import Array, Flags, runs
from dynakin.recordings.feet.contact import ALONE_M, FootContact
from dynakin.recordings.feet.soles import shape_of
from dynakin.recordings.hull import distance_to_hull
from dynakin.recordings.plates.ground_plate import GroundPlate
from dynakin.recordings.pushes import JUDGED_N
from dynakin.recordings.recording import Recording

BETWEEN_M = ALONE_M
"""So far from the markers of two flat feet neither bears alone, where one of them has no other plate, or for most of a
press."""
BESIDE_M, PRESSURE_NM = 0.035, 1.5
"""How far from both soles a centre of pressure lies that neither foot bears alone, and what its plate's moments may be
off by besides, which tells less of a place the lighter the load: of 24 real recordings and 8 simulated walks and squats
none comes beyond these for `SHORTEST_S`, nor once its plates are moved by 30 mm."""
SHORTEST_S = 0.02
"""Of that: an impact that is low-passed sets down beside its foot for a frame."""
OUTSIDE_S, AROUND_S = 0.2, 0.5
"""What two feet bear presses between their soles, in 20 real recordings and 40 simulated ones all the time. A chair or
a hand on their plate draws it out, for so long at least, and bears less than shows (a fourth of the weight behind the
heels) so much longer. Chosen on one who rises from a chair and sits down; on three others, which did
not choose, 10 to 30 of 400 N of a chair are left, and 0 to 0.2 % of the frames are taken too many."""
BEYOND_M = 0.04
"""How far a touching marker may lie beyond the plates' edges: it sits on the shoe, not on its sole."""


@dataclass(frozen=True, eq=False)
class Sharing:
    """Where the centres of pressure of P plates lie between two feet.

    Attributes:
        beside: (T, P) under neither sole while both may bear load, and some of each is on the plate; or between the
            markers of two flat feet for most of a press.
        between: (T, P) between the markers of two flat feet.
        beyond: (T, P) not even between the soles: something else bears on that plate (`AROUND_S`).
    """

    beside: Flags
    between: Flags
    beyond: Flags

    @classmethod
    def of(
        cls, feet: Sequence[FootContact], plates: Sequence[GroundPlate], forward: Array, recording: Recording
    ) -> Sharing:
        """
        Args:
            feet: nothing is said unless they are two. forward: (2,) the way the person faces, X and Z of the ground.
        """
        n, rate = recording.n_frames, recording.rate
        beside, between, beyond = (np.zeros((n, len(plates)), dtype=bool) for _ in range(3))
        if len(feet) != 2:
            return cls(beside, between, beyond)
        markers = [foot.outline for foot in feet]
        soles = [shape_of(foot, forward, rate).reach(foot.outline) for foot in feet]
        all_markers, all_soles = (np.concatenate(each, axis=1) for each in (markers, soles))
        bear = np.stack([foot.bears(rate) for foot in feet])
        both, flat = bear.all(axis=0), np.all([foot.touching.all(axis=1) for foot in feet], axis=0)
        shortest, around = (SHORTEST_S * rate, round(AROUND_S * rate)) if n > 1 else (1, 0)  # one frame has no rate
        for p, plate in enumerate(plates):
            judged = plate.push > JUDGED_N
            from_soles = [distance_to_hull(plate.cop, sole) for sole in soles]
            off = _off_its_place(plate, np.where(both, np.nan, np.where(bear, from_soles, np.inf).min(axis=0)))
            within = distance_to_hull(plate.cop, all_soles)
            under_neither = both & lies_between(from_soles, within, beside_m(plate.push) + off)
            for first, end in runs(under_neither):
                beside[first:end, p] = end - first >= shortest
            for first, end in runs(within > beside_m(plate.push) + off):
                if end - first >= OUTSIDE_S * rate:
                    beyond[max(first - around, 0) : end + around, p] = True
            from_markers = [distance_to_hull(plate.cop, outline) for outline in markers]
            within = distance_to_hull(plate.cop, all_markers)
            between[:, p] = flat & judged & lies_between(from_markers, within, BETWEEN_M + off)
            for first, end in runs(plate.pressed):
                most = mostly(np.count_nonzero(between[first:end, p]), np.count_nonzero(judged[first:end]))
                beside[first:end, p] |= most & between[first:end, p]
            beside[:, p] &= partly_on(plate, feet[0]) & partly_on(plate, feet[1])
        return cls(beside, between, beyond)


def partly_on(plate: GroundPlate, foot: FootContact) -> Flags:
    """(T,) frames in which some of a foot is on a plate, as far as its edges are known."""
    if plate.corners is None:
        return np.ones(len(plate.push), dtype=bool)
    return np.asarray((plate.beyond(foot.outline) < BEYOND_M).any(axis=1))


def mostly(frames: ArrayLike, of: ArrayLike) -> Flags:
    """Whether so many frames are most of so many: a stance's with its plate under the foot, of those with a load; a
    press's between two feet, of those that are judged."""
    return np.asarray(2 * np.asarray(frames) > np.asarray(of))


def beside_m(push: Array) -> Array:
    """How far (m) from both soles a load (N) lies that neither foot bears alone; inf where it is too light to say."""
    return np.where(push > JUDGED_N, BESIDE_M + PRESSURE_NM / np.maximum(push, JUDGED_N), np.inf)


def lies_between(away: Sequence[Array] | Array, from_both: Array, limit_m: Array | float) -> Flags:
    """Whether centres of pressure lie further than that from both of two outlines, but not so far from the area that
    they span: by their distances from each, and from that."""
    with np.errstate(invalid="ignore"):
        return np.asarray((np.fmin(away[0], away[1]) > limit_m) & (from_both < limit_m))


def _off_its_place(plate: GroundPlate, away: Array) -> Array:
    """(T,) m: how far a plate presses beside the foot that alone bears it (T,), NaN elsewhere, by the median over a
    press: so far its place may be off."""
    found = np.zeros(len(away))
    for first, end in runs(plate.pressed):
        own = away[first:end][(plate.push[first:end] > JUDGED_N) & np.isfinite(away[first:end])]
        found[first:end] = np.median(own) if len(own) else 0.0
    return found
