"""What a run takes for granted, in words: `dynakin run` says it first, `dynakin check` with all that it rests on."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
from rich.console import Console
from rich.table import Table
from rich.text import Text

from dynakin.arrays import runs
from dynakin.errors import DynakinError
from dynakin.filter.prepared import Prepared
from dynakin.messages import Message, about, notes_of
from dynakin.recordings.companions import companion_forces, companion_static
from dynakin.recordings.feet.loads import MEASURED, REASONS, SHARED, SWING, FootLoads
from dynakin.recordings.recording import Recording
from dynakin.recordings.times import span
from dynakin.results.naming import listed, plural
from dynakin.settings.settings import Settings
from dynakin.validation.case import Case

Rows = list[tuple[str, str | Message]]
"""Topics and their sentences; rows of one topic stand together."""
_LONGEST_LIST, _KEPT = 8, 5
_MOST_SPANS = 6
_TOPIC = 11  # characters of the longest topic
_LEAST_S = 0.03
"""Spans of a foot that are shorter belong to what lies about them."""


def print_rows(console: Console, rows: Iterable[tuple[str, str | Message]]) -> None:
    """In two columns, warnings in yellow; a topic stands where it begins."""
    grid = Table.grid(padding=(0, 2))
    grid.add_column(style="bold", no_wrap=True, min_width=_TOPIC)
    grid.add_column(overflow="fold")
    before = ""
    for topic, said in rows:
        warns = isinstance(said, Message) and said.level == "warning"
        grid.add_row("" if topic == before else topic, Text(str(said), style="yellow" if warns else ""))
        before = topic or before
    console.print(grid)


def assumed(ready: Prepared, settings: Settings) -> Rows:
    """Model, marker set, subject, ground and plates of a run, a line or two each; no warnings."""
    calibrated, messages = ready.calibrated, ready.calibrated.messages
    default = "" if settings.model != Settings().model else " (the default; --model for another)"
    rows: Rows = [("Model", f"{settings.model}{default}.")]
    chosen = [message.text for message in about(messages, "marker set")]
    rows += [("Markers", text) for text in chosen or [f"{len(calibrated.spec.markers)} used."]]
    rows += [("Subject", in_a_row(about(messages, "mass", "height", "sex")))]
    rows += [
        ("Parameters", f"{settings.parameters}: {message.text}") for message in notes_of(about(messages, "identified"))
    ]
    ahead = ", ".join(f"{value:.2f}" for value in calibrated.ground.forward + 0.0)
    rows += [("Ground", f"{calibrated.ground.vertical} is up; the person faces ({ahead}); {_sides(ready)}.")]
    return [*rows, ("Plates", _plates(ready))]


def changed(ready: Prepared) -> Rows:
    """What was turned, left out or cut in the recording, a line each; warnings stand at the end of a run."""
    notes = notes_of(ready.recording.notes)
    return [("Note", short(message)) for message in notes if message.topic != "routine"]


def naming_static(refusal: DynakinError, case: Case) -> DynakinError:
    """A refusal that asks for a standing trial, with the one that lies next to the recording."""
    path = case.recording.path
    if refusal.asks_for != "static" or path is None or case.config.static is not None:
        return refusal
    static = companion_static(path, case.recording)
    return refusal if static is None else refusal.reworded(f"{refusal.message} Give --static {static.name}?")


def contacts(ready: Prepared) -> Rows:
    """When each foot stands where, and when a declared contact bears."""
    loads, time = ready.ground.loads, ready.recording.time
    if loads is None:
        return []
    rows: Rows = []
    names = [plate.name for plate in ready.recording.plates]
    for k, foot in enumerate(loads.feet):
        if foot in ready.calibrated.unmarked_feet:
            rows.append(("Contacts", f"{foot}: no markers, so when it stands is not known."))
            continue
        spans = _spans(loads, k, names, ready.recording.rate)
        said = [f"{what} {span(time, a, b)}" for a, b, what in spans]
        rest = len(said) - _MOST_SPANS
        text = "; ".join(said[:_MOST_SPANS]) + (f"; and {rest} more" if rest > 0 else "")
        rows.append(("Contacts", f"{foot}: {text or 'never on the ground'}."))
    for name, bears in zip(ready.calibrated.contacts, ready.ground.bears.T, strict=True):
        own = [names[p] for p, contacts in loads.given.items() if name in contacts]
        rows.append(("Contacts", f"{name} (declared): {listed(own) if own else _times(time, bears)}."))
    return rows


def in_a_row(messages: Iterable[Message]) -> str:
    """The notes among them."""
    return " ".join(message.text for message in notes_of(messages))


def short(message: Message) -> Message:
    """A sentence that ends with a long list, which is cut."""
    head, colon, tail = message.text.rstrip(".").rpartition(": ")
    parts = tail.split(", ")
    if len(parts) <= _LONGEST_LIST or ". " in tail:  # not in the middle of what is said
        return message
    return replace(message, text=f"{head}{colon}{', '.join(parts[:_KEPT])} and {len(parts) - _KEPT} more.")


def forces_beside(recording: Recording) -> str:
    """That a table of ground forces lies next to a recording; "" where there is none."""
    forces = None if recording.path is None else companion_forces(recording.path)
    return "" if forces is None else f"--forces {forces.name} lies next to the recording"


def _sides(ready: Prepared) -> str:
    side = ready.calibrated.side
    return (
        "both sides are modelled" if ready.calibrated.feet else f"limb markers of {side} side{'s' * (side == 'both')}"
    )


def _plates(ready: Prepared) -> str:
    plates, loads = ready.recording.plates, ready.ground.loads
    if not plates:
        beside = forces_beside(ready.recording)
        return f"none; {beside}." if beside else "none: ground reactions follow from the motion."
    if loads is None:
        return f"{plural(len(plates), 'plate')}, their sum is used."
    bears = [
        f"{names} under the {foot} foot"
        for k, foot in enumerate(loads.feet)
        if (names := listed([plate.name for p, plate in enumerate(plates) if loads.on[:, k, p].any()] or [""]))
    ]
    bears += [f"{plates[p].name} under the {' and the '.join(own)}" for p, own in loads.given.items()]
    used = f"{', '.join(bears)}" if bears else "no foot stands on any"
    return f"{len(plates)}: {used}."


def _spans(loads: FootLoads, k: int, names: Sequence[str], rate: float) -> list[tuple[int, int, str]]:
    """(first, end, where) of foot number k, swings left out."""
    reason, on = loads.reason[:, k], loads.on[:, k]
    words: dict[str, np.ndarray] = {}
    for code in np.unique(reason):
        of_code = reason == code
        if code in (MEASURED, SHARED):
            for row in np.unique(on[of_code], axis=0):
                here = " and ".join(name for name, stands in zip(names, row, strict=True) if stands)
                words[here + (" (shared)" if code == SHARED else "")] = of_code & (on == row).all(axis=1)
        elif code != SWING:
            where = REASONS[code] if names else "on the floor"
            words[where] = words.get(where, np.zeros(len(reason), dtype=bool)) | of_code
    least = _LEAST_S * rate
    found = [(a, b, what) for what, frames in words.items() for a, b in runs(frames) if b - a >= least]
    return sorted(found)


def _times(time: np.ndarray, frames: np.ndarray) -> str:
    found = [span(time, a, b) for a, b in runs(frames)]
    return listed(found, _MOST_SPANS) if found else "never"
