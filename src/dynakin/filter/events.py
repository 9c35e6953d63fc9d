"""What happened during a run that a reader should know: gaps and refusals, a lost motion, bounds reached; and forces
that follow from the motion and that no ground gives: what rests on them is no estimate."""

from __future__ import annotations

from collections.abc import Collection
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from dynakin.arrays import Array, Flags, runs, widened
from dynakin.bindings import _core
from dynakin.filter.contacts import ContactLoads
from dynakin.filter.sight import owners_of, root_of
from dynakin.messages import Message, warning
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.model.spec import free_names
from dynakin.recordings.feet.contact import NO_CONTACT, ON_PLATE
from dynakin.recordings.times import span, step_of
from dynakin.results.measures.sources import out_of_sight, taken_back
from dynakin.results.naming import listed
from dynakin.results.records import REFUSED, TRACKING, Event, EventKind, Parameter

if TYPE_CHECKING:
    import xarray as xr


FOUND_S = 0.05
"""While a segment that comes into sight again is found, markers beside it may be refused: of an arm in a squat both at
the wrist for 0.02 s."""

AT_LIMIT_S = 0.12
"""So long the filter must hold an angle at the end of its range for the range to be in the way: by truth forearms at
the end of theirs are held for 0.02 to 0.11 s, hips 10 deg beyond it for 0.18 to 0.35, an ankle 6 deg beyond for 0.3."""


def events_of(data: xr.Dataset, parameters: list[Parameter], initial: CalibratedModel, unseen_sd: float) -> list[Event]:
    """Events in the order of their times; one a stretch, not one a frame."""
    time = data["time"].values
    back, sought = _coming_back(data, initial.spec)
    events = [
        *_missing(data),
        *(_total_unknown(data) if initial.feet else ()),
        *_refused(data, back),
        *_tracking(data, sought),
        *_held(data, unseen_sd),
        *_coordinates_at_bounds(data, initial),
    ]
    last = len(time) - 1
    for p in parameters:
        if p.at_bound:
            text = f"ends on its bound ({p.value:.4g} {p.unit}, from {p.initial:.4g}; {p.lower:.4g} to {p.upper:.4g})"
            events.append(Event(float(time[last]), last, "at_bound", p.name, text))
    return sorted(events, key=lambda event: (event.frame, event.subject))


def _missing(data: xr.Dataset) -> list[Event]:
    seen_axes = data["marker_axes_modelled"].values
    lost = np.isnan(data["markers_measured"].values[:, :, seen_axes]).any(axis=2)
    names = [str(name) for name in data["marker"].values]
    return [
        event
        for k, name in enumerate(names)
        for event in _stretches(data["time"].values, lost[:, k], "missing", name, "not measured")
    ]


def _total_unknown(data: xr.Dataset) -> list[Event]:
    """Stretches in which the plates of a floating model do not give the total wrench, or were not used."""
    lost = np.isnan(data["wrench_measured"].values).all(axis=1)
    return _stretches(data["time"].values, lost, "missing", "plates", "total wrench not known, left out")


def _coming_back(data: xr.Dataset, spec: _core.ModelSpec) -> tuple[Flags, Flags]:
    """(T, M) markers that are refused because nobody knows where a segment is that comes into sight again; (T,) frames
    in which it is found, up to `FOUND_S` after the first of its markers is taken. Neither speaks against them."""
    time = data["time"].values
    seen = np.isfinite(data["markers_measured"].values).any(axis=2)
    taken, owners = taken_back(seen, data["verdict"].values[:, :-1] == REFUSED), owners_of(spec)
    hidden = out_of_sight(taken, owners, time, root_of(spec))
    sought = np.zeros(len(time), dtype=bool)
    for own in hidden.values():
        for _, end in runs(own):
            sought |= (time >= time[end - 1]) & (time <= time[end - 1] + FOUND_S)
    return sought[:, None] | (np.stack([hidden[owner] for owner in owners], axis=1) & seen & ~taken), sought


def _refused(data: xr.Dataset, back: Flags) -> list[Event]:
    """Markers and plates that the gate did not believe, but for those that come back (T, M)."""
    verdicts = data["verdict"].values.copy()
    verdicts[:, :-1][back] = 0
    names = [str(name) for name in data["sensor"].values]
    return [
        event
        for k, name in enumerate(names)
        for event in _stretches(
            data["time"].values,
            verdicts[:, k] == REFUSED,
            "gated",
            name,
            f"contradict{'s' * (name != 'plates')} all else, not used",
        )
    ]


def _tracking(data: xr.Dataset, sought: Flags) -> list[Event]:
    """Stretches in which the filter did not believe its markers, and what it did about them, but for what is found when
    it comes into sight again (T,)."""
    time, tracking = data["time"].values, data["tracking"].values.copy()
    lost = np.isin(tracking, [TRACKING.index(word) for word in ("lost", "doubtful")])
    for start, end in runs(sought):
        if not lost[max(start - 1, 0) : end].any():  # else the motion as a whole is found
            tracking[start:end][tracking[start:end] == TRACKING.index("found")] = TRACKING.index("following")
    kinds: tuple[tuple[str, EventKind, str], ...] = (
        ("doubtful", "gated", "most markers contradict the motion: nothing measured was used"),
        ("lost", "reset", "motion lost and held where it was"),
        ("found", "reset", "motion found again from the markers"),
        ("restarted", "reset", "numerical breakdown: the filter started again"),
    )
    events = [
        event
        for word, kind, text in kinds
        for event in _stretches(time, tracking == TRACKING.index(word), kind, "motion", text)
    ]
    unmet = data["constraints_met"].values == 0
    return events + _stretches(time, unmet, "note", "bounds", "not all kept at once, each kept by itself")


def _held(data: xr.Dataset, unseen_sd: float) -> list[Event]:
    """Coordinates that no marker observed for so long that the filter stopped carrying them on."""
    following = data["tracking"].values == TRACKING.index("following")
    unsure = data["coordinates_sd"].values > 0.4 * unseen_sd  # the plates say a little even of what is held
    return [
        event
        for k, name in enumerate(str(name) for name in data["coordinate"].values)
        for event in _stretches(
            data["time"].values, following & unsure[:, k], "note", name, "not seen for so long that it was held"
        )
    ]


def _coordinates_at_bounds(data: xr.Dataset, initial: CalibratedModel) -> list[Event]:
    """By what is reported, and by the filter's own frames: smoothed, an angle that these held lies inside, as frames
    before and after pull at it, and skin has what it may not."""
    time, state, events = data["time"].values, data["state"].values, list[Event]()
    least = AT_LIMIT_S / step_of(time) - 0.5  # frames; times are rounded
    for k, name in enumerate(free_names(initial.spec)):  # the state begins with them
        held = (state[:, k] <= initial.lower[k]) | (state[:, k] >= initial.upper[k])
        for first, end in runs(data["at_limit"].sel(coordinate=name).values):
            held[first:end] |= end - first > least
        events += _stretches(time, held, "at_bound", name, "held at its joint limit")
    return events


def _stretches(time: npt.NDArray[np.float64], flags: Flags, kind: EventKind, subject: str, what: str) -> list[Event]:
    events = []
    for first, end in runs(flags):
        n = end - first
        when = span(time, first, end) if n > 1 else f"at {time[first]:.2f} s"
        text = f"{what} for {n} frame{'s' if n > 1 else ''}, {when}"
        events.append(Event(float(time[first]), first, kind, subject, text))
    return events


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
