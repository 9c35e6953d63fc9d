"""`dynakin check`: what is in a recording, what is missing, and what `run` would do with it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.console import Console
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from dynakin.cli.console import out, table
from dynakin.cli.options import OF_A_MODEL, OF_THE_LABORATORY, Given, with_settings
from dynakin.errors import DynakinError
from dynakin.filter.build import definition_of
from dynakin.model.definition import available_models
from dynakin.model.markers.marker_set import available_marker_sets, load_marker_set
from dynakin.model.markers.recognise import foot_markers_of
from dynakin.model.markers.schema import MarkerSetFile
from dynakin.recordings.checks import check_plates
from dynakin.recordings.frame import GroundFrame, find_ground_frame
from dynakin.recordings.landmarks import plain_name
from dynakin.recordings.read import read
from dynakin.recordings.recording import Recording
from dynakin.recordings.standing import standing_window
from dynakin.settings.settings import Settings


@with_settings("forces", *OF_A_MODEL, *OF_THE_LABORATORY, model="Model that is to be used; else all built-in ones.")
def check(
    trial: Annotated[Path, typer.Argument(help="Recording: .c3d, .trc or .csv.")],
    *,
    given: Given,
) -> None:
    """Say what is in a recording, what is missing, and what `run` would do with it."""
    console = out()
    names = [given["model"]] if "model" in given else available_models()
    settings = Settings.of({"trial": trial, "model": names[0]}, "check", given=given, needed=())
    recording = read(trial, settings.forces)
    still = None if settings.static is None else read(settings.static)
    _print_recording(console, recording)
    console.print(_marker_table(recording))
    _print_plates(console, recording)
    ground = _print_ground(console, recording, settings.vertical, settings.forward)
    if ground is not None:
        _print_plate_check(console, recording, ground, settings.mass_kg)
    console.print(_marker_set_table(recording))
    for name in names:
        definition = definition_of(settings.changed(model=name))
        console.print(f"What `run --model {name}` would do", style="bold")
        try:
            if definition.planar and not recording.plates:
                raise DynakinError("no force plates, expected at least one (give --forces)")
            found = definition.calibrate(
                recording,
                static=still,
                side=settings.side,
                vertical=settings.vertical,
                forward=settings.forward,
            )
            plates = check_plates(
                recording, found.ground, found.mass_kg if definition.planar else None, found.foot_markers
            )
            if recording.plates and plates.refusal:
                raise DynakinError(plates.refusal)
        except DynakinError as error:
            console.print(Padding(Text(f"Refuse it: {error.message}", style="red"), (0, 0, 0, 2)))
        else:
            # how the ground frame was found is said above
            _sentences(console, [text for text in found.messages if text not in found.ground.how])
        console.print()


def _print_recording(console: Console, recording: Recording) -> None:
    seconds = recording.time[-1] - recording.time[0]
    console.print(f"{recording.path or recording.name}", style="bold", soft_wrap=True)
    console.print(
        f"  {recording.n_frames} frames at {recording.rate:.6g} Hz, {seconds:.4g} s from {recording.time[0]:g} s; "
        f"{len(recording.marker_names)} markers in {recording.length_unit}; {len(recording.plates)} force plates"
    )
    subject = [f"{key.replace('_', ' in ')} {value:g}" for key, value in recording.subject.items()]
    _sentences(console, ([f"Subject in the file: {', '.join(subject)}."] if subject else []) + list(recording.notes))
    window = standing_window(recording)
    if window is None:
        console.print("  Standing still: nowhere for half a second.")
    else:
        start, end = recording.time[window.start], recording.time[window.stop - 1]
        console.print(f"  Standing still: {start:.4g} to {end:.4g} s.")
    console.print()


def _marker_table(recording: Recording) -> Table:
    """Markers with gaps one by one, complete ones in one row."""
    seen = np.asarray(np.isfinite(recording.markers).all(axis=2))
    share = np.asarray(seen.mean(axis=0))
    rows = table("markers", "seen", "gaps", numbers=(1, 2), title="Markers")
    complete = [name for name, part in zip(recording.marker_names, share, strict=True) if part == 1.0]
    if complete:
        rows.add_row(", ".join(complete), "100 %", "0")
    for name, part, column in zip(recording.marker_names, share, seen.T, strict=True):
        if part < 1.0:
            gaps = int(np.sum(np.diff(np.concatenate([[1], column.astype(int)])) == -1))
            rows.add_row(name, "never" if part == 0.0 else f"{np.floor(1000 * part) / 10:.1f} %", str(gaps))
    return rows


def _print_plates(console: Console, recording: Recording) -> None:
    if not recording.plates:
        console.print("Force plates: none (--forces GRF.mot). Models in the plane need them.\n")
        return
    rows = table("plate", "mean force, N", "greatest, N", "loaded", numbers=(1, 2, 3), title="Force plates")
    for plate in recording.plates:
        size = np.linalg.norm(plate.force, axis=1)
        loaded = f"{100 * np.mean(np.isfinite(plate.cop).all(axis=1)):.0f} %"
        rows.add_row(plate.name, f"{np.nanmean(size):.1f}", f"{np.nanmax(size):.1f}", loaded)
    console.print(rows)


def _print_ground(
    console: Console, recording: Recording, vertical: str, forward: str | tuple[float, ...]
) -> GroundFrame | None:
    console.print("Ground frame", style="bold")
    try:
        ground = find_ground_frame(recording, vertical=vertical, forward=forward)
    except DynakinError as error:
        console.print(f"  {error.message}\n  Give --vertical and --forward.\n", style="red")
        return None
    _sentences(console, list(ground.how))
    console.print()
    return ground


def _print_plate_check(console: Console, recording: Recording, ground: GroundFrame, mass: float | None) -> None:
    if not recording.plates:
        return
    found = check_plates(recording, ground, mass, foot_markers_of(recording))
    console.print("Plates' check", style="bold")
    _sentences(console, list(found.messages))
    if found.refusal:
        console.print(f"  Refused: {found.refusal}", style="red")
    console.print()


def _marker_set_table(recording: Recording) -> Table:
    rows = table("marker set", "found", "missing", title="Marker sets")
    present = np.asarray(np.isfinite(recording.markers).all(axis=2).any(axis=0))
    names = {plain_name(name) for name, seen in zip(recording.marker_names, present, strict=True) if seen}
    for name in available_marker_sets():
        found, missing = _fit(load_marker_set(name), names)
        shown = ", ".join(missing[:8]) + (f" and {len(missing) - 8} more" if len(missing) > 8 else "")
        rows.add_row(name, f"{found} of {found + len(missing)}", shown if found else "all")
    return rows


def _fit(marker_set: MarkerSetFile, names: set[str]) -> tuple[int, list[str]]:
    """How many of the set's markers (each side counts) are among plain names, and which are not."""
    sites = [marker.aliases(side) for marker in marker_set.usual for side in ("right", "left", "centre")]
    sites = [aliases for aliases in sites if aliases]
    missing = [aliases[0] for aliases in sites if not any(plain_name(alias) in names for alias in aliases)]
    return len(sites) - len(missing), missing


def _sentences(console: Console, sentences: list[str]) -> None:
    for text in sentences:
        console.print(Padding(Text(text, style="yellow" if text.startswith("Warning") else ""), (0, 0, 0, 2)))
