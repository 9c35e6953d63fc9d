"""Something heavy in the hands: what the plates give beyond what the motion of the body needs moves as the hands do, or
comes and stays; or there is more on the plates than the mass all the time, and the hands may hold it."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from dynakin.arrays import Array, Flags, mean_seen
from dynakin.filter.ground.closure import STATED
from dynakin.filter.ground.mass_centre import second_derivative
from dynakin.filter.ground.needed import Needed
from dynakin.filter.ground.plate_sum import UNSEEN_APART
from dynakin.filter.uncertainty.loads import HANDS
from dynakin.messages import Message, about, warnings_of
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.units import GRAVITY_M_S2

HEAVY_KG, FOLLOWS, JUDGED_S = 2.0, 0.8, 2.0
"""Mass in both hands, and the part of the excess' variance that its acceleration explains. Chosen on simulated squats
(0.6 to 1.6 kg, 0.3 to 0.7) and with 2.8 and 10 kg in the hands (4 and 12 kg, 0.92 and 0.99); 10 real recordings of
whole bodies, which did not choose, have 0 to 0.5."""
HELD_S = 1.0
"""Least time with, and without, a load that is taken up or put down: longer than a stance, and errors of accelerations
have no mean over it. The two limits above hold for it, too: one lift with nothing, 2.9 and 10 kg in the right hand has
0.2, 2.8 and 9.7 kg, which explain 0.33, 0.97 and 0.98. Some 90 other recordings, which did not choose, stay below 0.45,
but one of who stands (1 kg, 0.81) and a flywheel's cable, whose hands are not both marked (59 kg, 0.86)."""
SHIFT_M, SHIFTED = 0.03, 0.5
"""A load that would have the ground push so much farther towards the hands, on average, shifts it by at least this part
of that: a centre of mass is known to 0.02 m. A simulated squat with the arms held forward and nothing in them, which
chose, has 5.7 kg by 4 N of acceleration, 0.84 explained, and 0.9 kg by where the ground pushes; with 6 kg it would be
0.045 m. Four other squats, with nothing and with 3, 6 and 10 kg in the hands, judged."""
MORE = 0.02
"""Part of the weight that plates carry beyond the mass from which the hands may hold it: of less, deviations hold what
it does to L5/S1 (1.2 kg at half a metre are 6 N m). `truth3d`'s 31 trials, which chose it, have up to 0.008; those of
10 real recordings whose mass was weighed up to 0.006; box and mass of the attack that asked for it 0.041. Eight runs
and a landing, which did not choose, up to 0.010, one that is judged for 0.3 s 0.015."""
_EDGES = 600
"""Of stretches, at most: each pair of them is asked, of an hour too."""
_ARMS = ("hand", "forearm", "radius", "ulna")
"""Segments that show where the hands are, the nearest first."""


def carried_in_hands(needed: Needed, force: Array, pressed: Array) -> float | None:
    """Mass, kg, that moves with the hands and that the model does not have; None where nothing shows one.

    Args:
        force: (T, 3) N, the sum over the plates, NaN where it is not known. pressed: (T, 2) m, where that acts on the
            ground.
    """
    initial, markers = needed.initial, needed.markers
    owners = [marker.segment for marker in initial.spec.markers]
    hands, places = [], []
    for side in ("_r", "_l"):
        own = next((name + side for name in _ARMS if name + side in owners), None)
        path = mean_seen(markers[:, [k for k, owner in enumerate(owners) if owner == own]], axis=1)
        seen = np.isfinite(path).all(axis=1)
        if own is None or not seen.any() or not needed.judged_s(force) >= JUDGED_S:
            return None
        frames = np.arange(len(path))
        whole = np.stack([np.interp(frames, frames[seen], path[seen, axis]) for axis in range(3)], axis=1)
        hands.append(second_derivative(whole, needed.rate))
        places.append(whole)
    excess = force - needed.force
    # of 1 kg in both hands that was taken for a part of the body
    moves = np.mean(hands, axis=0) + np.array([0.0, GRAVITY_M_S2, 0.0]) - needed.force / initial.weighed_kg
    both = needed.smoothed(np.hstack([excess, moves]), force)
    both -= both.mean(axis=0)
    lacks, moved = both[:, :3].ravel(), both[:, 3:].ravel()
    if not moved.any():
        return None
    carried_kg = float(moved @ lacks / (moved @ moved))
    explained = 1.0 - np.sum((lacks - carried_kg * moved) ** 2) / max(float(lacks @ lacks), 1e-12)
    if carried_kg > HEAVY_KG and explained > FOLLOWS:
        at, moves = np.mean(places, axis=0), np.mean(hands, axis=0)
        return carried_kg if _presses_there(needed, needed.judged(force), pressed, at, moves, carried_kg) else None
    return _taken_up(needed.smoothed(excess[:, [1]], force)[:, 0], needed.rate)


def _presses_there(needed: Needed, judged: Flags, pressed: Array, at: Array, moves: Array, carried_kg: float) -> bool:
    """Whether the ground pushes towards the hands, (T, 3) m and m/s^2, as it does under such a load; so, too, where
    they are too near to the body's own middle to tell."""
    centre, mass_kg = needed.centre, needed.initial.weighed_kg
    if centre is None:
        return True
    body = _over(centre.path, centre.acceleration)
    shift, towards = pressed - body, _over(at, moves) - body
    known = judged & np.isfinite(shift).all(axis=1)
    if not known.any():
        return True
    square = float(np.mean(np.sum(towards[known] ** 2, axis=1)))
    if carried_kg * np.sqrt(square) < SHIFT_M * mass_kg:
        return True
    by_place_kg = mass_kg * float(np.mean(np.sum(shift[known] * towards[known], axis=1))) / square
    return by_place_kg > SHIFTED * carried_kg


def _over(at: Array, moves: Array) -> Array:
    """(T, 2) m where the ground pushes under a point at (T, 3) m that accelerates, m/s^2, and nothing else."""
    upward = (moves[:, [1]] + GRAVITY_M_S2).clip(1.0)
    return np.asarray((at - at[:, [1]] * moves / upward)[:, [0, 2]])


def _taken_up(excess: Array, rate: float) -> float | None:
    """Mass, kg, that is there for some of the time: the stretch over which the mean of the vertical excess (N,), N,
    differs most from that of the rest."""
    least, n = round(HELD_S * rate), len(excess)
    edges = np.arange(0, n + 1, max(round(0.1 * rate), n // _EDGES, 1))
    edges[-1] = n
    first, end = (edges[k] for k in np.triu_indices(len(edges), 1))
    fits = (end - first >= least) & (n - (end - first) >= least)
    first, end = first[fits], end[fits]
    if not len(first):
        return None
    sums, held = np.concatenate([[0.0], np.cumsum(excess)]), end - first
    during = sums[end] - sums[first]
    there, else_ = during / held, (sums[-1] - during) / (n - held)
    between = held * (n - held) / n * np.square(there - else_)
    best = int(np.argmax(between))
    carried_kg = float(abs(there[best] - else_[best])) / GRAVITY_M_S2
    explained = float(between[best]) / max(float(np.square(excess - excess.mean()).sum()), 1e-12)
    # else something bears the person for the rest of the time
    exceeds = there[best] + else_[best] > 0.0
    return carried_kg if carried_kg > HEAVY_KG and explained > FOLLOWS and exceeds else None


def more_than_the_mass(initial: CalibratedModel, load_ratio: float | None) -> float:
    """Mass, kg, that plates carry beyond the declared one and that the hands may hold; 0 where it is no more than
    plates and a body that is not marked whole explain, or the model has no hands.

    Args:
        load_ratio: as of `Ground`.
    """
    if load_ratio is None or not any(segment.name in HANDS for segment in initial.spec.segments):
        return 0.0
    more = load_ratio - 1.0
    usual = MORE + UNSEEN_APART * initial.unseen_kg / initial.weighed_kg
    return more * initial.weighed_kg if more > usual else 0.0


def unseen_in_hands(initial: CalibratedModel, contacts: Iterable[int]) -> float:
    """Mass, kg, whose weight declared contacts, by number, may bear at the hands without that it shows; 0 where none of
    them is at a hand."""
    segments = list(initial.contacts.values())
    return STATED * initial.weighed_kg if any(segments[c] in HANDS for c in contacts) else 0.0


def in_hands_in_words(more_kg: float) -> str:
    """What there is to say of it."""
    return (
        f"The plates carry {more_kg:.1f} kg more than the mass: if it is carried, declare it ([[loads]] in a "
        "configuration, docs/models.md), else correct the mass; until then deviations of moments of shoulders, elbows "
        "and L5/S1 hold such a load in the hands."
    )


def carried_in_words(carried_kg: float) -> str:
    """A warning."""
    return (
        f"the plates' force changes as if about {carried_kg:.0f} kg were carried in the hands, which the model does "
        "not have: moments of shoulders, elbows and back are wrong by that and not given, those of hips are less sure."
    )


def says_carried(notes: Iterable[Message]) -> bool:
    """Whether it is among what there is to say, so that what bears the load is wrong by it."""
    return bool(warnings_of(about(notes, "carried")))
