"""What `dynakin check` says of a recording: its rows, and what would give more."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from dynakin.cli.prepared import Rows, assumed, contacts, in_a_row, short
from dynakin.errors import DynakinError
from dynakin.filter.prepared import Prepared
from dynakin.messages import Message, about, notes_of, warnings_of
from dynakin.model.markers.fit import fits
from dynakin.pipeline.stages import prepare_case
from dynakin.recordings.companions import companion_forces, companion_static
from dynakin.recordings.plates.pressure import main_push
from dynakin.recordings.pushes import LOADED_N
from dynakin.recordings.recording import Recording
from dynakin.results.naming import plural, sentence, words
from dynakin.settings.settings import Settings
from dynakin.validation.case import Case

_LISTED, _SETS = 6, 3
_MARKER_S, _PLANAR_FRAME_S = 0.25e-3, 1.5e-3
"""Processor time that a frame of a run takes, all passes, files and the report: of a whole body by the marker (73:
18 ms, in 12 s at 250 Hz), and in the plane."""


_SOME_KG = 70.0
"""To see what else there is where a mass is all that is missing; nothing that depends on it is said then."""


def rehearsed(case: Case) -> tuple[Prepared | None, DynakinError | None]:
    """The trial as a run prepares it, or what it would refuse it with; both where only the mass, or somebody who stands
    for the zero, is missing."""
    try:
        return next(iter(prepare_case(case).values())), None
    except DynakinError as error:
        refusal = error
    setup = replace(case.setup, zero="model")
    if lacks_mass(refusal) and case.config.mass_kg is None:
        somebody = case.config.changed(mass_kg=_SOME_KG).subject()
        setup = replace(setup, common=replace(setup.common, model=setup.definition.with_subject(somebody)))
    elif case.setup.zero == setup.zero:
        return None, refusal
    try:
        return next(iter(prepare_case(replace(case, setup=setup)).values())), refusal
    except DynakinError:
        return None, refusal


def lacks_mass(refusal: DynakinError | None) -> bool:
    """Whether a run is refused for the mass."""
    return refusal is not None and refusal.asks_for == "mass_kg"


def recording_rows(recording: Recording) -> Rows:
    """What is in the file: frames, markers, gaps, what it says of the subject, plates."""
    seconds = recording.time[-1] - recording.time[0]
    plates = plural(len(recording.plates), "force plate")
    rows: Rows = [
        (
            "Recording",
            f"{recording.n_frames} frames at {recording.rate:.6g} Hz, {seconds:.4g} s from {recording.time[0]:g} s; "
            f"{len(recording.marker_names)} markers in {recording.length_unit}; {plates}.",
        ),
        ("Gaps", _gaps(recording)),
    ]
    subject = [_measure(key, value) for key, value in recording.subject.items()]
    rows += [("In the file", f"{', '.join(subject)}.")] if subject else []
    if recording.events:
        kinds = list(dict.fromkeys(f"{event.side} {event.label}".strip().casefold() for event in recording.events))
        rows.append(("In the file", f"{plural(len(recording.events), 'event')} ({', '.join(kinds)})."))
    up = main_push(recording.plates)
    for plate in recording.plates:
        push = plate.force @ up
        if not np.isfinite(push).any():
            rows.append(("Plates", f"{plate.name}: not measured."))
            continue
        across = np.linalg.norm(plate.force - np.outer(push, up), axis=1)
        load = np.where(across > np.abs(push), across, push)  # of a handle, too; what pulls along it is none
        loaded = 100.0 * float(np.mean(np.nan_to_num(load) > LOADED_N))
        text = f"{plate.name}: up to {np.nanmax(load):.0f} N, mean {np.nanmean(push):.1f} N, loaded {loaded:.0f} %."
        rows.append(("Plates", text))
    return [*rows, *(("Note", short(message)) for message in recording.notes)]


def _gaps(recording: Recording) -> str:
    """Markers with gaps, the worst first."""
    seen = np.isfinite(recording.markers).all(axis=2)
    share = {name: float(part) for name, part in zip(recording.marker_names, seen.mean(axis=0), strict=True)}
    gappy = sorted((part, name) for name, part in share.items() if part < 1.0)
    if not gappy:
        return "none: every marker is seen in every frame."
    listed = [
        f"{name} {'never seen' if part == 0.0 else f'seen in {np.floor(1000 * part) / 10:.1f} %'}"
        for part, name in gappy
    ]
    rest = f" and {len(listed) - _LISTED} more" if len(listed) > _LISTED else ""
    return f"{len(gappy)} of {len(share)} markers have gaps: {', '.join(listed[:_LISTED])}{rest}."


def model_rows(
    ready: Prepared, settings: Settings, refusal: DynakinError | None, above: Sequence[Message] = ()
) -> Rows:
    """What `run` says first, with what it rests on, and what will come out.

    Args:
        above: what was said of the recording (`recording_rows`), which is not doubted a second time.
    """
    calibrated = ready.calibrated
    said = calibrated.messages
    subject = about(said, "mass", "height", "sex")
    massless = lacks_mass(refusal)
    doubted = [] if massless else warnings_of(about(said, "calibration", "labels"))
    elsewhere = {*about(said, "marker set", "ground", "details"), *subject, *doubted}  # a run's report has the details
    more: dict[str, list[str | Message]] = {
        "Model": [*_held(ready)],
        "Markers": [
            f"{len(calibrated.spec.markers)} of {len(ready.recording.marker_names)} are used.",
            *(short(message) for message in said if message not in elsewhere),
        ],
        "Ground": [*about(said, "ground")],
        "Subject": [*warnings_of(about(subject, "height") if massless else subject)],
    }
    rows: Rows = []
    for topic, text in assumed(ready, settings):
        if topic == "Subject" and massless:
            text = f"The mass is missing. {in_a_row(about(subject, 'height', 'sex'))}"
        rows += [(topic, row) for row in (text, *more.get(topic, []))]
    rows += contacts(ready)
    if massless:
        return rows
    if refusal is not None:
        rows.append(("Zero", "Nobody stands still for it (zero = 'standing')."))
    figures = ready.moment_figures()
    doubts = [m for m in warnings_of(ready.messages) if m not in (*said, *above) or m in doubted]
    there = [sentence(message.text) for message in doubts]  # with what to do
    rows += [("Results", text) for text in (figures["verdict"], *figures["reasons"]) if text not in there]
    rows += [("Results", message.text) for message in notes_of(about(ready.messages, "carried"))]
    rows += [("Doubts", message) for message in doubts]
    return rows + [("Time", text) for text in _time(ready)]


def _time(ready: Prepared) -> list[str]:
    """How long a run takes about, where that is more than a minute."""
    spec, n_frames = ready.calibrated.spec, ready.recording.n_frames
    frame_s = _PLANAR_FRAME_S if not all(spec.markers[0].measured) else _MARKER_S * len(spec.markers)
    minutes = n_frames * frame_s / 60.0
    if minutes < 1.0:
        return []
    return [f"A run takes about {minutes:.0f} min ({n_frames} frames), on a busy machine more."]


def _held(ready: Prepared) -> list[str]:
    """A sentence on the coordinates that are not estimated; those of both sides once."""
    locked = [coordinate.name for coordinate in ready.calibrated.spec.coordinates if coordinate.locked]
    stems = [name.removesuffix("_r").removesuffix("_l") for name in locked]
    held = {
        stem: f"{words(stem)} (both sides)" if stems.count(stem) == 2 else words(name)
        for stem, name in zip(stems, locked, strict=True)
    }
    return [f"Held: {', '.join(held.values())}."] if held else []


def nearest_sets(recording: Recording) -> list[str]:
    """The marker sets that the recording's names fit best, and what each lacks at least."""
    rows = []
    for fit in fits(recording.seen_names)[:_SETS]:
        lacks = f"; lacks markers {', '.join(fit.lacking)}" if fit.lacking else ""
        rows.append(f"{fit.marker_set.name}: {fit.explained_n} of its {fit.expected_n} markers by name{lacks}.")
    return rows


def to_add(case: Case, ready: Prepared | None, refusal: DynakinError | None) -> list[str]:
    """What would give more, with what lies next to the recording."""
    recording, settings = case.recording, case.config
    path, found = recording.path, list[str]()
    forces = None if path is None or settings.forces is not None else companion_forces(path)
    if forces is not None:
        found.append(f"--forces {forces.name} (found next to the recording): the plates' forces.")
    elif not recording.plates:
        found.append("--forces FILE.mot: nothing measures the ground's reaction.")
    if settings.static is None and path is not None and (static := companion_static(path, recording)) is not None:
        found.append(f"--static {static.name} (found next to the recording): lengths and marker places of standing.")
    massless = lacks_mass(refusal)
    if massless and ready is not None:
        found.append("--mass KG: neither plates nor file show it.")
    if ready is None:
        return found
    said = ready.calibrated.messages
    if not massless and warnings_of(about(said, "mass")):
        found.append("--mass KG: it is only estimated (Subject, above).")
    if settings.height_m is None and ready.calibrated.height_m is not None and "height_m" not in _in_files(case):
        found.append("--height M: it is only estimated (Subject, above).")
    if about(said, "sex"):
        found.append("--sex female or male: else the table's mean of both.")
    if not massless and ready.ground.undeclared.any() and not settings.contacts:
        found.append("--contact seat (hand_right, ...): if that is what bears the person where no plate does.")
    return found


def _in_files(case: Case) -> set[str]:
    """What the recordings say of the person, by its keys."""
    return {key for recording in (case.recording, case.static) if recording is not None for key in recording.subject}


def _measure(key: str, value: float) -> str:
    """ "mass_kg" -> "mass 85 kg", "knee_width_m_r" -> "right knee width 0.139 m"."""
    side = {"_r": "_r", "_l": "_l"}.get(key[-2:], "")
    stem, _, unit = key.removesuffix(side).rpartition("_")
    return f"{words(stem + side)} {value:g} {unit}"
