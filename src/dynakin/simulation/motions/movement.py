"""A motion as a function of time: what every motion, drawn or read from a file, gives to the simulator."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from dynakin.arrays import Array
from dynakin.simulation.jets import Jet
from dynakin.simulation.mechanics import Motion, TreeMotion
from dynakin.simulation.support import Footing, Support

STANDING_S = 1.5  # quiet standing before anything else: the filter's and the plates' start


@dataclass(frozen=True)
class Repetition:
    """One repetition of a movement: from start to end (s) the subject leaves and regains its standing; depth: 1 is
    full."""

    start_s: float
    end_s: float
    depth: float


@dataclass(frozen=True)
class Seat:
    """A chair on a plate of its own: it pushes up, without friction, as much as keeps the feet's centre of
    pressure from going behind ``feet_rear_x`` (m) on the floor at y = ``floor_m``.

    segment: that sits; point: (3,) m in the ground frame where the seat pushes.
    """

    segment: str
    point: Array
    feet_rear_x: float
    floor_m: float
    plate: str = "plate 3"


@dataclass(frozen=True)
class Hand:
    """What a hand takes: wrench (T, 6) about the ground origin, at point (T, 3) m."""

    wrench: Array
    point: Array


Reach = Callable[[Array, Motion], Motion]
"""Times (T,) s and a motion -> the motion with arms that reach for something."""


@dataclass(frozen=True)
class Movement:
    """Coordinates as functions of time that are at least twice differentiable.

    Attributes:
        name: of the motion, for the recording's name.
        at: times (T,) s -> `Motion`; the same times give the same motion.
        description: one sentence for the recording's notes.
        repetitions: where they are known.
        seat: what else than the feet carries the person.
        end_s: last time at which it is known, None where it has no end.
        support: times (T,) s -> how the feet stand; None: as the body's contacts say.
        footings: the plates below them, where ``support`` is given.
        held: times and the moving segments -> wrenches (T, 6) about the ground origin that hands take from what they
            hold, by contact.
        segments: of contacts that are no feet, by name.
        refitted: the same movement in balance with arms as somebody else leads them, for one whose balance is fitted.
        belt_m_s: speed at which what the feet stand on moves backward.
    """

    name: str
    at: Callable[[Array], Motion]
    description: str = ""
    repetitions: tuple[Repetition, ...] = ()
    seat: Seat | None = None
    end_s: float | None = None
    support: Callable[[Array], Support] | None = None
    footings: tuple[Footing, ...] = ()
    held: Callable[[Array, TreeMotion], Mapping[str, Hand]] | None = None
    segments: Mapping[str, str] = field(default_factory=dict)
    refitted: Callable[[Reach], Movement] | None = None
    belt_m_s: float = 0.0


def in_order(names: Sequence[str], jets: Mapping[str, Jet]) -> Motion:
    """Jets by coordinate as a motion with its coordinates in the order of ``names``."""
    ordered = [jets[name] for name in names]
    return Motion(
        tuple(names),
        np.stack([j.value for j in ordered], axis=1),
        np.stack([j.rate for j in ordered], axis=1),
        np.stack([j.second for j in ordered], axis=1),
    )
