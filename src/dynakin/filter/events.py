"""What happened during a run that a reader should know: gaps of markers, coordinates and parameters at their bounds."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import xarray as xr

from dynakin.model import InitialModel
from dynakin.results import Event, Parameter
from dynakin.results.records import EventKind


def events_of(data: xr.Dataset, parameters: list[Parameter], initial: InitialModel) -> list[Event]:
    """Events in the order of their times; one a stretch, not one a frame."""
    time = data["time"].values
    events = [*_missing(data), *_coordinates_at_bounds(data, initial)]
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


def _coordinates_at_bounds(data: xr.Dataset, initial: InitialModel) -> list[Event]:
    state = data["state"].values
    free = [coordinate.name for coordinate in initial.spec.coordinates if not coordinate.locked]
    events = []
    for k, name in enumerate(free):  # the state begins with them
        held = (state[:, k] <= initial.lower[k]) | (state[:, k] >= initial.upper[k])
        events += _stretches(data["time"].values, held, "at_bound", name, "held at its joint limit")
    return events


def _stretches(
    time: npt.NDArray[np.float64], flags: npt.NDArray[np.bool_], kind: EventKind, subject: str, what: str
) -> list[Event]:
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(int)))
    events = []
    for first, end in zip(edges[::2], edges[1::2], strict=True):
        n = int(end - first)
        text = f"{what} for {n} frame{'s' if n > 1 else ''}, {time[first]:.2f} to {time[end - 1]:.2f} s"
        events.append(Event(float(time[first]), int(first), kind, subject, text))
    return events
