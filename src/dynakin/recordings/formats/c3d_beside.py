"""What a C3D file holds beside markers and plates: events, analog channels, and what it says of the person."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Literal

import numpy as np

from dynakin.arrays import Array
from dynakin.errors import RecordingError
from dynakin.messages import Message, note
from dynakin.recordings.formats.c3d_parameters import Parameters
from dynakin.recordings.recording import AnalogChannel, Event
from dynakin.units import PERSON_HEIGHT_M, PERSON_MASS_KG

_SIDES: dict[str, Literal["left", "right"]] = {"left": "left", "l": "left", "right": "right", "r": "right"}


def first_frame(parameters: Parameters, in_header: int, path: Path) -> int:
    """Number of the first frame in the capture, from 0; the header's word ends at 65535, TRIAL:ACTUAL_START_FIELD (low
    and high word, from 1) does not.

    Raises:
        RecordingError: a word is no whole number.
    """
    words = [float(word) for word in parameters.array("TRIAL", "ACTUAL_START_FIELD").ravel()[:2]]
    if len(words) < 2:
        return in_header
    if strange := [word for word in words if not word.is_integer()]:
        raise RecordingError(f"{path}: found {strange[0]:g} in TRIAL:ACTUAL_START_FIELD, expected whole numbers")
    low, high = (int(word) & 0xFFFF for word in words)
    return (high << 16) + low - 1 if high else in_header


def read_events(parameters: Parameters, start_s: float, time: Array) -> tuple[tuple[Event, ...], list[Message]]:
    """The EVENT group's events at the recording's times (T,) s, and notes.

    Args:
        start_s: of the first frame in the capture, from whose start the file counts its events.
    """
    numbers = parameters.array("EVENT", "TIMES").ravel(order="F")
    pairs = numbers[: len(numbers) // 2 * 2].reshape(-1, 2)  # minutes, seconds
    count = parameters.number("EVENT", "USED")
    pairs = pairs[: int(count)] if count is not None and 0 <= count < len(pairs) else pairs
    at = 60.0 * pairs[:, 0] + pairs[:, 1] - start_s
    labels = parameters.texts("EVENT", "LABELS")
    contexts = parameters.texts("EVENT", "CONTEXTS")
    notes = []
    step = float(time[1] - time[0]) if len(time) > 1 else np.inf
    first, last = time[0] - 0.5 * step, time[-1] + 0.5 * step
    inside = (at >= first) & (at <= last)
    if start_s and not inside.any() and len(at) and bool(((at + start_s >= first) & (at + start_s <= last)).all()):
        at, inside = at + start_s, np.ones(len(at), dtype=bool)
        notes.append(
            note("recording", "Events are counted from the file's first frame, not from the start of the capture.")
        )
    if count_out := int((~inside).sum()):
        notes.append(note("recording", f"{count_out} of {len(at)} events lie outside the file's frames: left out."))
    events = [
        Event(
            round(float(at[k]), 6),  # the file's seconds are of single precision
            labels[k] if k < len(labels) else "",
            _SIDES.get(contexts[k].casefold(), "") if k < len(contexts) else "",
        )
        for k in np.flatnonzero(inside)
    ]
    return tuple(sorted(events, key=lambda event: event.time_s)), notes


def read_analog(parameters: Parameters, analog: Array, time: Array) -> tuple[AnalogChannel, ...]:
    """All channels (C, samples), a whole number of samples a frame of the times (T,) s."""
    per_frame = analog.shape[1] // len(time)
    if not per_frame:
        return ()
    step = float(time[1] - time[0]) if len(time) > 1 else 1.0
    names, units = parameters.texts("ANALOG", "LABELS"), parameters.texts("ANALOG", "UNITS")
    with np.errstate(over="ignore"):
        values = analog.astype(np.float32)
    values[~np.isfinite(values)] = np.nan
    return tuple(
        AnalogChannel(
            name=names[k] if k < len(names) else f"channel {k + 1}",
            unit=units[k] if k < len(units) else "",
            start_s=float(time[0]),
            rate_hz=per_frame / step,
            values=channel,
        )
        for k, channel in enumerate(values)
    )


_GROUPS = ("PROCESSING", "SUBJECTS", "SUBJECT", "SUBJECT_PARAMETERS", "ANTHROPOMETRY", "ANALYSIS")
_MASS = ("bodymass", "mass", "bodyweight", "weight")
_HEIGHT = ("height", "bodyheight", "stature")
# Of each leg, with what it can measure in m: ranges that no other unit of length brings a person into, too
_OF_A_LEG = {
    "leg_length": (("leglength",), (0.2, 1.4)),
    "knee_width": (("kneewidth",), (0.04, 0.25)),
    "ankle_width": (("anklewidth",), (0.025, 0.15)),
}
_LENGTH_UNITS = (1.0, 1e-2, 1e-3)
_OF_SIDE = {"r": ("right", "r"), "l": ("left", "l")}


def read_subject(parameters: Parameters) -> dict[str, float]:
    """``Recording.subject``: the first plausible value of each; lengths from m, cm or mm by their size."""
    found: dict[str, float] = {}
    for word, value in _entries(parameters):
        if word in _MASS and PERSON_MASS_KG[0] < value < PERSON_MASS_KG[1]:
            found.setdefault("mass_kg", value)
        elif word in _HEIGHT:
            _put(found, "height_m", value, PERSON_HEIGHT_M)
        else:
            for key, (stems, limits) in _OF_A_LEG.items():
                for side, spelled in _OF_SIDE.items():
                    if any(word in (f"{s}{stem}", f"{stem}{s}") for s in spelled for stem in stems):
                        _put(found, f"{key}_m_{side}", value, limits)
    return found


def _put(found: dict[str, float], key: str, value: float, limits: tuple[float, float]) -> None:
    metres = next((value * f for f in _LENGTH_UNITS if limits[0] < value * f < limits[1]), None)
    if metres is not None:
        found.setdefault(key, round(metres, 9))


def _entries(parameters: Parameters) -> Iterator[tuple[str, float]]:
    """Names without case, separators, unit and the subject's name, and their numbers."""
    people = [_letters(name) for name in parameters.texts("SUBJECTS", "NAMES")]
    for group in _GROUPS:
        for name in parameters.names(group):
            value = parameters.number(group, name)
            if value is not None:
                yield _word(name, people), value
        values = parameters.array(group, "VALUES").ravel()
        for name, value in zip(parameters.texts(group, "NAMES"), values, strict=False):
            yield _word(name, people), float(value)


def _word(name: str, people: list[str]) -> str:
    word = _letters(name.rpartition(":")[2])
    for person in filter(None, people):
        if len(word) > len(person):
            word = word.removeprefix(person).removesuffix(person)
    return re.sub(r"(mass|weight)kg$|(length|width|height)(mm|cm|m)$", lambda m: m[1] or m[2], word)


def _letters(name: str) -> str:
    return re.sub(r"[^a-z0-9]", "", name.casefold())
