"""The wrench on each foot, and where the total wrench is known at all, once it is clear who stands where."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from dynakin.arrays import Array, Flags, filled, runs
from dynakin.messages import Message
from dynakin.recordings.feet.contact import COP_REFUSED_M
from dynakin.recordings.feet.soles import Soles
from dynakin.recordings.plates.ground_plate import GroundPlate
from dynakin.recordings.pushes import JUDGED_N, LOADED_N, UNLOADED_N
from dynakin.units import GRAVITY_M_S2

_HALF_SOLE_M = 0.15  # of a long shoe, from its middle to where its markers end at most
NOT_ITS_M = _HALF_SOLE_M + COP_REFUSED_M
"""So far from the middle of a foot's sole a load is not that foot's, wherever the plate's place is not refused."""
LACKS = 0.03
"""Part of the weight that plates may lack under a foot that bears nothing; the part of a movement is taken off by how
fast the markers rise. Pirouettes, a throw and a kick (simulated, one seed), which chose, lack -0.02 to 0.02; of others
a foot that hovers in `functional` 0.00 to 0.04, steps off the plates (12, real and simulated) 0.35 to 1."""
SHOWN_S, LEAST_S = 0.5, 0.2
"""How long the plates must bear the person for their load to be the weight, and a foot must rest for it to be judged:
the markers' rise is known to some cm/s."""
SWING, MEASURED, SHARED, OFF_PLATE, UNKNOWN = range(5)
REASONS = ("swing", "measured", "shared plate", "off the plates", "plate not measured")
"""Words for the numbers in `FootLoads.reason`."""


@dataclass(frozen=True, eq=False)
class FootLoads:
    """The plates' wrenches by foot.

    Attributes:
        feet: names of the F feet, ("right", "left") unless other foot markers were given.
        wrench: (T, F, 6) N and N m, ground on foot, ground frame, about the ground's origin; 0 in swing, NaN where it
            is not known. On a shared plate an estimate: see `reason`.
        reason: (T, F) index into `REASONS`. "shared plate": both feet stand on one plate; its wrench is divided by
            where the centre of pressure lies between them, and the sum is what was measured.
        total_known: (T,) frames in which all that the ground does to the person is measured: the sum over the plates
            is then the total external wrench (in flight: about 0).
        all_measured: (T,) frames in which that holds and no plate is shared: each foot's wrench is a measurement.
        elsewhere: (T,) frames in which something else may bear the person: no plate measures at all, a plate carries
            what no foot puts on it, or (`with_undeclared`) the motion needs what the plates do not have.
        aloft: (T, F) feet that are surely in the air: by their markers, and because no load that is nobody's is near.
        soles: where the feet's soles are, when they may bear load, and where it is expected.
        on: (T, F, P) which foot stands on which plate: the run's one assignment.
        given: number of a plate -> the declared contacts that bear on it, where it is no foot's: one, or several that
            share it.
        others: declared contact -> (T, 6) wrench of the plates that were given to it, as ``wrench``; of one that it
            shares an equal part.
        plates: P, in the ground frame, by which it was made.
        messages: sentences with times. reasons: those of them that say why something is not measured.
        turned_moments: why the plates' moments cannot be what the file says; "" where nothing speaks against them.
        misgiven: why a plate cannot be its declared owner's; "" where none is given to the wrong one.
    """

    feet: tuple[str, ...]
    wrench: Array
    reason: npt.NDArray[np.int8]
    total_known: Flags
    all_measured: Flags
    elsewhere: Flags
    aloft: Flags
    soles: Soles
    on: Flags
    given: Mapping[int, tuple[str, ...]] = field(default_factory=dict)
    others: Mapping[str, Array] = field(default_factory=dict)
    plates: tuple[GroundPlate, ...] = ()
    messages: tuple[Message, ...] = ()
    reasons: tuple[Message, ...] = ()
    turned_moments: str = ""
    misgiven: str = ""

    @property
    def sharing(self) -> list[tuple[str, ...]]:
        """Declared contacts of whose loads the sum alone is measured, because they share a plate."""
        groups = list[tuple[str, ...]]()
        for names in (each for each in self.given.values() if len(each) > 1):
            joined = [group for group in groups if set(group) & set(names)]
            groups = [group for group in groups if group not in joined]
            groups.append(tuple(dict.fromkeys(name for group in (*joined, names) for name in group)))
        return groups

    def with_undeclared(self, frames: Flags) -> FootLoads:
        """The same where something bears the person in these frames (T,) that no plate measures: the total is not
        known there, and a foot that is on no plate, or on one that reads nothing, may be what it bears, unless it is
        surely in the air."""
        reason = self.reason.copy()
        light = (reason == SWING) | (filled(self.wrench[..., 1]) < LOADED_N)
        reason[frames[:, None] & light & (reason <= SHARED) & ~self.aloft] = UNKNOWN
        return replace(self.with_borne(frames)._for(reason), elsewhere=self.elsewhere | frames)

    def with_borne(self, frames: Flags) -> FootLoads:
        """The same where contacts that are declared bear the person in these frames (T,) in addition to the plates."""
        return replace(self, total_known=self.total_known & ~frames, all_measured=self.all_measured & ~frames)

    def without(self, feet: Flags) -> FootLoads:
        """The same where these feet (T, F) may reach beyond their plates: what these measure is not all of them."""
        reason = np.where(feet, np.int8(UNKNOWN), self.reason)
        _alone_is_unknown(reason)
        return self.with_borne(np.asarray(feet.any(axis=1)))._for(reason)

    def _for(self, reason: npt.NDArray[np.int8]) -> FootLoads:
        return replace(self, wrench=np.where((reason == UNKNOWN)[..., None], np.nan, self.wrench), reason=reason)


def _alone_is_unknown(reason: npt.NDArray[np.int8]) -> None:
    """A foot that shares its plate with one that may also stand off it has no sum to share, in place (T, F)."""
    shared = reason == SHARED
    reason[shared & (shared.sum(axis=1, keepdims=True) == 1)] = UNKNOWN


def divided(
    feet: tuple[str, ...],
    plates: Sequence[GroundPlate],
    soles: Soles,
    marked: Flags,
    on: Flags,
    off: Flags,
    hidden: Flags,
    aloft: Flags,
    given: Mapping[int, tuple[str, ...]],
) -> FootLoads:
    """The plates' wrenches given to the feet that stand on them.

    Args:
        marked: (F,) the foot has markers.
        on: (T, F, P) this foot stands on this plate. off: (T, F) it may stand off the plates. hidden: (T, F) it may
            stand anywhere: nobody sees it. aloft: (T, F) it is in the air by its markers.
        given: as of `FootLoads`.
    """
    n, F = off.shape
    of_feet = [p for p in range(len(plates)) if p not in given]  # plates that only feet stand on
    owners = on[:, :, of_feet]  # (T, F, P)
    count = owners.sum(axis=1)
    known = np.stack([plate.known for plate in plates], axis=1) if plates else np.zeros((n, 0), dtype=bool)
    alone, both = owners & (count == 1)[:, None], owners & (count > 1)[:, None]
    wrench, reason = np.zeros((n, F, 6)), np.full((n, F), SWING, dtype=np.int8)
    nobodys, aloft = np.zeros(n, dtype=bool), aloft.copy()
    for k, p in enumerate(of_feet):
        wrench += np.where(alone[:, :, k, None], plates[p].wrench[:, None], 0.0)
        if both[:, :, k].any():
            shared = np.flatnonzero(count[:, k] > 1)
            wrench[shared] += _shares(plates[p], shared, owners[:, :, k], soles.middle)
        lost = (count[:, k] == 0) & (plates[p].push > JUDGED_N)
        if lost.any():
            away = np.linalg.norm(plates[p].cop[:, None] - soles.middle[:, :, [0, 2]], axis=2)
            aloft &= ~lost[:, None] | (away > NOT_ITS_M)
            nobodys |= lost
    others: dict[str, Array] = {}
    for p, names in given.items() if plates else ():
        bears = np.linalg.norm(filled(plates[p].wrench[:, :3]), axis=1) > UNLOADED_N
        share = np.where(bears[:, None], plates[p].wrench, 0.0) / len(names)
        for name in names:
            others[name] = others.get(name, 0.0) + np.where(known[:, p, None], share, np.nan)
    reason[alone.any(axis=2)] = MEASURED
    reason[both.any(axis=2)] = SHARED
    reason[(owners & ~known[:, None, of_feet]).any(axis=2)] = UNKNOWN
    may: Flags = hidden | ~marked
    reason[nobodys[:, None] & may & (reason == SWING)] = UNKNOWN  # a foot that nobody sees may be on it
    elsewhere: Flags = nobodys & marked.all() & ~hidden.any(axis=1) if plates else np.ones(n, dtype=bool)
    total_known = known.all(axis=1) & ~elsewhere
    reason[off] = OFF_PLATE
    reason[hidden & (reason == SWING)] = UNKNOWN
    _alone_is_unknown(reason)
    total_known &= ~off.any(axis=1) & ~hidden.any(axis=1)
    wrench[(reason == OFF_PLATE) | (reason == UNKNOWN)] = np.nan
    all_measured = total_known & ((reason != SHARED) & (reason != UNKNOWN)).all(axis=1)
    loads = FootLoads(
        feet,
        wrench,
        reason,
        total_known,
        all_measured,
        np.zeros(n, dtype=bool),
        aloft,
        soles,
        on,
        given,
        others,
        tuple(plates),
    )
    return loads.with_undeclared(elsewhere) if elsewhere.any() else loads


def _shares(plate: GroundPlate, frames: npt.NDArray[np.intp], owners: Flags, middle: Array) -> Array:
    """(K, F, 6) of a plate under two feet: force by the lever between the feet, each at its own middle; in equal parts
    where one of them is not seen."""
    found = np.zeros((len(frames), owners.shape[1], 6))
    for row, t in enumerate(frames):
        own = np.flatnonzero(owners[t])[:2]
        points = middle[t, own]
        along = (points[1] - points[0])[[0, 2]]
        lever = (plate.cop[t] - points[0, [0, 2]]) @ along / max(float(along @ along), 1e-9)
        if not np.isfinite(lever):
            found[row, own] = 0.5 * plate.wrench[t]
            continue
        part = float(np.clip(lever, 0.0, 1.0))
        F, M = plate.wrench[t, :3], plate.wrench[t, 3:]
        parts = (1.0 - part, part)
        rest = M - np.sum([s * np.cross(c, F) for s, c in zip(parts, points, strict=True)], axis=0)
        for k, s, c in zip(own, parts, points, strict=True):
            found[row, k] = s * np.concatenate([F, np.cross(c, F) + rest])
    return found


def plates_bear_all(plates: Sequence[GroundPlate], on: Flags, off: Flags, rises: Array, rate: float) -> Flags:
    """Those of the frames (T,) in which a foot seems to stand off the plates through whose run these carry as much, in
    every half second, as in any in which none does: a foot that is held still, its toes near the floor, looks like one
    that stands beside the plates, but what it would bear, these lack.

    Args:
        on: (T, F, P) this foot stands on this plate: what is nobody's may be the foot's that seems to stand beside.
        off: (T, F) feet that seem to stand off the plates. rises: (T,) m/s upwards, of the body.
    """
    found = np.zeros(len(off), dtype=bool)
    known: Flags = np.asarray(np.all([plate.known for plate in plates], axis=0) & np.isfinite(rises))
    if not np.isfinite(rate) or not round(LEAST_S * rate) > 1:
        return found
    push = (np.stack([plate.push for plate in plates], axis=1) * on.any(axis=1)).sum(axis=1)
    window = round(SHOWN_S * rate)

    def steady(first: int, end: int) -> list[float]:
        """What the plates would carry of who does not rise or fall, N on average over each half second, or all."""
        loads = []
        for at in range(first, max(end - window, first) + 1, max(window // 5, 1)):
            to = min(at + window, end)
            gains = (rises[to - 1] - rises[at]) * rate / (to - 1 - at) / GRAVITY_M_S2
            loads.append(float(push[at:to].mean() / max(1.0 + gains, 0.5)))
        return loads

    alone = [load for a, b in runs(known & ~off.any(axis=1)) if b - a >= window for load in steady(a, b)]
    weight = max(alone, default=np.inf)
    for first, end in runs(np.asarray(off.any(axis=1))):
        start = first if end < len(off) else min(first, max(0, end - round(LEAST_S * rate)))  # it may just set down
        if end - start >= LEAST_S * rate and known[start:end].all():
            loads = steady(start, end)
            found[first:end] = min(loads) > (1.0 - LACKS) * weight
    return found
