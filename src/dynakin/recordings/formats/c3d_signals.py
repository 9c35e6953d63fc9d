"""Events and analog channels of a C3D file."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np

from dynakin.errors import RecordingError
from dynakin.messages import Message, note
from dynakin.recordings.formats.c3d_parameters import Parameters
from dynakin.recordings.recording import Array
from dynakin.recordings.signals import AnalogChannel, Event

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
