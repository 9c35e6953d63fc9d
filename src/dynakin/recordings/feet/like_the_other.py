"""Where a foot reaches whose heel or toe has no marker, by the other foot, which has one there.

Feet of one person are each other's mirror images. What is drawn in bounds the sole only: it neither touches nor rises.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import permutations

import numpy as np

from dynakin.arrays import Array, Flags, runs
from dynakin.recordings.feet.contact import NEAR_M, FootContact
from dynakin.recordings.hull import distance_to_hull
from dynakin.recordings.plates.ground_plate import GroundPlate

ALIKE_M = 0.03
"""By how much the distances of markers of two feet differ that sit at the same places, put there by hand: by up to 0.02
of nine real persons', 0.027 of six simulated ones (`truth3d`)."""
REACHES_M = 0.05
"""How far beyond a foot's other markers one must lie to be missed."""
SOONER_S = 0.15
"""How long a foot may bear load on a part that has no marker (a heel that sets down) before and after one that
has (chosen on walks of seeds 1 to 3 of `truth3d`, judged on 4)."""
_MOST = 6  # markers of a foot: more show it whole, and the ways to pair them are too many


def like_the_other(
    contacts: dict[str, FootContact], plates: Sequence[GroundPlate], forward: Array, rate: float
) -> dict[str, FootContact]:
    """The contacts of two feet, the one with fewer markers reaching as far as the other, and standing for as long as a
    load is there.

    Args:
        forward: (2,) the way the person faces, X and Z of the ground. rate: Hz.
    """
    if len(contacts) != 2:
        return contacts
    few, many = sorted(contacts, key=lambda name: contacts[name].outline.shape[1])
    foot = contacts[few]
    missed = _missed(foot, contacts[many], forward)
    if missed is None:
        return contacts
    outline, shape = np.concatenate([foot.outline, missed], axis=1), missed.shape[:2]
    under = [distance_to_hull(plate.cop, outline) < NEAR_M for plate in plates]
    whole = replace(
        foot,
        outline=outline,
        rise_m=np.hstack([foot.rise_m, np.full(shape, np.nan)]),
        touching=np.hstack([foot.touching, np.zeros(shape, dtype=bool)]),
        under=np.stack(under, axis=1) if under else foot.under,
    )
    sooner = round(SOONER_S * rate) if len(outline) > 1 else 0
    whole = _borne(whole, [near & plate.loaded for near, plate in zip(under, plates, strict=True)], sooner)
    return {name: whole if name == few else contact for name, contact in contacts.items()}


def _borne(foot: FootContact, loaded: Sequence[Flags], most: int) -> FootContact:
    """The foot with each stance as long as a plate goes on to be loaded (T,) under it, so many frames more at most."""
    stands = foot.stands.copy()
    for first, end in foot.stances:
        for under in loaded:
            start, stop = first, end
            while under[first] and start > max(0, first - most) and under[start - 1] and not foot.stands[start - 1]:
                start -= 1
            last = min(len(stands), end + most)
            while under[end - 1] and stop < last and under[stop] and not foot.stands[stop]:
                stop += 1
            stands[start:stop] = True
    more = stands & ~foot.stands
    return replace(
        foot,
        stands=stands,
        stances=tuple(runs(stands)),
        low=foot.low | more,
        moves=foot.moves & ~more,
        aloft=foot.aloft & ~more,
    )


def _missed(foot: FootContact, other: FootContact, forward: Array) -> Array | None:
    """(T, C, 2) m, markers that the other foot has, and where this one would have them; None where it is as long."""
    count, more = foot.outline.shape[1], other.outline.shape[1]
    own, others = (_flat(each) for each in (foot, other))
    if not 2 <= count < more <= _MOST or not len(own) or not len(others):
        return None
    apart, theirs = _apart(own), _apart(others)
    first, second = (int(k) for k in np.unravel_index(int(np.argmax(apart)), apart.shape))
    ways = [list(way) for way in permutations(range(more), count)]
    differ = [float(np.abs(apart - theirs[np.ix_(way, way)]).max()) for way in ways]
    if min(differ) > ALIKE_M:
        return None

    def ahead(points: Array, way: list[int], extra: Array) -> float:
        return float(np.median((extra.mean(axis=1) - points[:, way].mean(axis=1)) @ forward))

    found = []
    for way, differs in zip(ways, differ, strict=True):
        if differs > min(differ) + 1e-9:
            continue
        rest = [k for k in range(more) if k not in way]
        x, z = np.median(_within(others, way[first], way[second])[:, rest], axis=0).T  # (C,) each
        drawn = _drawn(foot.outline, first, second, x, -z)
        on_own = _drawn(own, first, second, x, -z)
        turned = abs(ahead(own, list(range(count)), on_own) - ahead(others, way, others[:, rest]))
        found.append((turned, drawn, on_own))
    _, drawn, on_own = min(found, key=lambda one: one[0])
    beyond = [float(np.median(distance_to_hull(on_own[:, k], own))) > REACHES_M for k in range(drawn.shape[1])]
    return drawn[:, beyond] if any(beyond) else None


def _flat(foot: FootContact) -> Array:
    """(N, K, 2) m of its markers where it stands with all of them seen and on the support; else where it stands."""
    seen = np.isfinite(foot.outline).all(axis=(1, 2)) & foot.stands
    flat = seen & foot.touching.all(axis=1)
    return foot.outline[flat if flat.any() else seen]


def _apart(points: Array) -> Array:
    """(K, K) m."""
    return np.asarray(np.median(np.linalg.norm(points[:, :, None] - points[:, None], axis=3), axis=0))


def _axes(points: Array, first: int, second: int) -> tuple[Array, Array]:
    """Unit vectors (N, 1, 2) along the way from one marker to another, and a quarter turn from it."""
    along = points[:, [second]] - points[:, [first]]
    with np.errstate(invalid="ignore"):
        along = along / np.linalg.norm(along, axis=2, keepdims=True)
    return along, np.stack([-along[..., 1], along[..., 0]], axis=2)


def _within(points: Array, first: int, second: int) -> Array:
    """Points (N, K, 2) from the first of two of them, along the way to the second and across it."""
    off, (along, across) = points - points[:, [first]], _axes(points, first, second)
    return np.stack([(off * along).sum(axis=2), (off * across).sum(axis=2)], axis=2)


def _drawn(points: Array, first: int, second: int, x: Array, z: Array) -> Array:
    """(N, C, 2) m of points that lie so far along the way between two markers, from the first, and across it."""
    along, across = _axes(points, first, second)
    return np.asarray(points[:, [first]] + x[:, None] * along + z[:, None] * across)
