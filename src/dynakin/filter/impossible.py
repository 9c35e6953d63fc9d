"""Forces that follow from the motion and that no ground gives: what rests on them is no estimate."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from dynakin.arrays import Array, Flags, runs, widened
from dynakin.filter.contacts import ContactLoads
from dynakin.messages import Message, warning
from dynakin.recordings.feet.contact import NO_CONTACT, ON_PLATE
from dynakin.recordings.times import span, step_of
from dynakin.results.naming import listed

PUSH, LANDING = 3.5, 6.0
"""Most that a foot takes, times the weight, and within `ALOFT_S` of a flight (one that is as short as a run's does not
show). Without plates walks reach 1.6 (simulated, also with 5 mm of noise), stairs 2.2, drop landings 2.6, a run
3.1; a walk whose file has a rate that is 2.5 times too high 4.2."""
PULL = 0.3
"""Most that a foot may seem to pull at the ground, times the weight: it cannot, and around landings without plates does
by up to 0.22 (the same recordings)."""
ALOFT_S = 0.5
AROUND_S = 0.05
"""What is wrong in a frame spreads over its neighbours, by as much as the filter knows accelerations."""
MANY = 0.1
"""Part of the frames with derived forces from which on none of them is believed: then a rate, unit or mass is wrong."""


def impossible(feet: ContactLoads, wrench: Array, time: Array, weight: float, soles: Collection[str]) -> Flags:
    """(T,) frames in which a foot whose force no plate measures would take more, or pull more, than the ground gives.

    Args:
        wrench: (T, C, 6) of the contacts, as estimated. soles: segments on which the ground acts.
    """
    grounded = _grounded(feet, soles)
    derived = _derived(feet, soles)
    step = step_of(time) if len(time) > 1 else np.inf
    flies = widened((feet.contact[:, grounded] == NO_CONTACT).all(axis=1), int(ALOFT_S / step))
    size = np.linalg.norm(wrench[..., :3], axis=2) / weight
    beyond = (size > np.where(flies, LANDING, PUSH)[:, None]) | (wrench[..., 1] < -PULL * weight)
    found = (derived & beyond).any(axis=1)
    some = derived.any(axis=1)
    if found.sum() > MANY * some.sum():
        return np.asarray(some)
    return np.asarray(widened(found, round(AROUND_S / step)) & some)


def impossible_in_words(
    frames: Flags, feet: ContactLoads, wrench: Array, time: Array, weight: float, soles: Collection[str]
) -> Message:
    """A warning on these frames (T,), some of which there are; it names no plate, because none is to blame."""
    derived = frames[:, None] & _derived(feet, soles)
    push = np.where(derived, wrench[..., 1], 0.0) / weight
    spans = listed([span(time, a, b) for a, b in runs(frames)], 4)
    return warning(
        "recording",
        f"no ground gives a foot the force that follows from the motion ({push.min():.1f} to "
        f"{push.max():.1f} times the weight): from {spans} such forces, and the moments that rest on them, are absent. "
        "Look there for markers that jump, and check the recording's rate and the mass.",
    )


def _grounded(feet: ContactLoads, soles: Collection[str]) -> Flags:
    """(C,) contacts on which the ground acts."""
    return np.array([segment in soles for segment in feet.segments], dtype=bool)


def _derived(feet: ContactLoads, soles: Collection[str]) -> Flags:
    """(T, C) feet whose force no plate measures."""
    return np.asarray(~np.isin(feet.contact, (NO_CONTACT, ON_PLATE)) & _grounded(feet, soles))
