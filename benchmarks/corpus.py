"""Every recording of ``../shared/data``, and of any folder given, through ``dynakin run`` without an option.

    OMP_NUM_THREADS=1 .venv/bin/python benchmarks/corpus.py [FOLDER...] [--jobs 2] [--out FILE.md] [--write]

A second row has a recording's companions (`recordings.companions`: ground forces, the same person standing). Then the
differences from what the files themselves hold: Vicon's angles, moments and powers, OpenSim's IK and ID. Runs are kept
in ``build/recordings`` by their inputs and the source. ``--write`` puts the tables into
``docs/validation/recordings.md``.
"""

from __future__ import annotations

import argparse
import json
import tomllib
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import xarray as xr
from corpus_references import Difference, Key, Theirs, differences, of_opensim, of_vicon
from pages import put

from dynakin.errors import DynakinError
from dynakin.messages import about, from_attributes, warnings_of
from dynakin.model.calibration.how import Calibration
from dynakin.recordings.companions import STANDING_WORDS, companion_forces, companion_static
from dynakin.recordings.landmarks import DEFAULT_PAIRS
from dynakin.recordings.read import read
from dynakin.recordings.recording import Recording
from dynakin.studies.engine.build import build
from recordings import DATA, kept

ANGLE_GOAL_DEG, MOMENT_GOAL = 5.0, 0.15
"""RMS after offset; N m/kg. One recording that Vicon processed twice differs by 0.10 to 0.17 N m/kg."""
_FROM = {
    "impulse": "plates' impulse",
    "assumed": "assumed",
    "from the plates": "plates, standing",
    "from the file": "file",
    "mean vertical force": "mean of a movement",
    ": given": "given",
}


@dataclass(frozen=True, eq=False)
class Row:
    """A recording, with nothing or with its companions, and what came of it."""

    path: Path
    extra: tuple[str, ...]
    recording: Recording | None
    code: int
    said: str
    seconds: float
    folder: Path

    @property
    def name(self) -> str:
        return str(self.path.relative_to(DATA)) if self.path.is_relative_to(DATA) else str(self.path)

    @property
    def pairs(self) -> list[tuple[str, str]]:
        return list(zip(self.extra[::2], self.extra[1::2], strict=True))

    @property
    def given(self) -> str:
        return " ".join(f"{option} {Path(value).name}" for option, value in self.pairs)


def rows_of(path: Path, source: str) -> list[Row]:
    """The run without an option, and that with its companions, if it has any."""
    try:
        recording = read(path)
    except DynakinError:
        recording = None
    extra: list[str] = []
    if (forces := companion_forces(path)) is not None:
        extra += ["--forces", str(forces)]
    if recording is not None and (static := companion_static(path, recording)) is not None:
        extra += ["--static", str(static)]
    made = []
    for options in ([], extra) if extra else ([],):
        inputs = [path, *(Path(value) for value in options[1::2])]
        made.append(Row(path, tuple(options), recording, *kept(path, options, inputs, source)))
    return made


def table(rows: list[Row]) -> Iterator[str]:
    """What ran, and why not."""
    ran = [sum(row.code == 0 for row in rows if bool(row.extra) == extra) for extra in (False, True)]
    count = [sum(bool(row.extra) == extra for row in rows) for extra in (False, True)]
    yield (
        f"{ran[0]} of {count[0]} recordings run without an option; of {count[1]} with something next to them "
        f"{ran[1]} run with it."
    )
    yield ""
    yield (
        "| recording | with | exit | s | frames | set | markers used, of | RMS, mm | mass from | held | right: "
        "measured / derived / prior / absent | left | why not, or what is doubted |"
    )
    yield f"|{'---|' * 13}"
    for row in rows:
        frames = "–" if row.recording is None else row.recording.n_frames
        cells: list[Any] = [f"`{row.name}`", row.given or "–", row.code, f"{row.seconds:.0f}", frames]
        yield f"| {' | '.join(map(str, [*cells, *_outcome(row)]))} |"


def _outcome(row: Row) -> list[Any]:
    file = row.folder / "metrics.json"
    if not file.exists():
        return [*["–"] * 7, row.said.replace("|", "\\|")]
    metrics = json.loads(file.read_text(encoding="utf-8"))
    with xr.open_dataset(row.folder / "estimate.nc") as data:
        messages = from_attributes(data.attrs)
    chosen = next((message.text.split(":")[0].split()[-1] for message in about(messages, "marker set")), "–")
    mass = " ".join(message.text for message in about(messages, "mass"))
    legs = metrics["moments"]["legs"] if metrics["moments"] else {}
    counts = [" / ".join(str(n) for n in legs[side].values()) if side in legs else "–" for side in ("right", "left")]
    said = row.said if row.code else "; ".join(_short(message.text) for message in warnings_of(messages))
    rms = metrics["markers"]["mean_rms_mm"] if metrics["markers"] else None
    assert row.recording is not None
    return [
        chosen,
        f"{len(metrics['markers']['rms_mm']) if metrics['markers'] else '–'} of {len(row.recording.marker_names)}",
        "–" if rms is None else f"{rms:.1f}",
        next((word for part, word in _FROM.items() if part in mass), "–"),
        sum(": locked to " in message.text for message in about(messages, "calibration")) or "–",
        *counts,
        said.replace("|", "\\|"),
    ]


def _short(text: str) -> str:
    return text if len(text) <= 90 else f"{text[: text.rfind(' ', 0, 90)]} ..."


def compared(rows: list[Row]) -> Iterator[str]:
    """The differences, a row each recording, source and joint; what is beyond the goals is bold."""
    yield (
        "| recording | with | against | joint | angle, deg: offset, RMS right | left | moment, N m/kg: RMS (stance, "
        "swing; frames) right | left | the same loads about their joint: right | left | centres apart, mm: right, left "
        "| power, W/kg: right, left |"
    )
    yield f"|{'---|' * 12}"
    for row in rows:
        file = row.folder / "estimate.nc"
        if row.recording is None or not file.exists():
            continue
        config = tomllib.loads((row.folder / "config.toml").read_text(encoding="utf-8"))
        with xr.open_dataset(file) as opened:
            data = opened.load()
        mass_kg = _their_mass(row) or config["mass_kg"]
        for theirs in _references(row, mass_kg):
            how = Calibration(vertical=config["ground"]["vertical"])
            ground = how.find_ground(row.recording, DEFAULT_PAIRS, None, floating=True)
            found = differences(data, ground, mass_kg, theirs)
            for joint in dict.fromkeys(joint for _, joint in found):
                yield f"| `{row.name}` | {row.given or '–'} | {theirs.what} | {' | '.join(_cells(found, joint))} |"


def _their_mass(row: Row) -> float | None:
    """By which the file's own moments are divided: its person's, or that of the standing trial's file."""
    assert row.recording is not None
    files = [row.recording, *(read(Path(value)) for name, value in row.pairs if name == "--static")]
    return next((file.subject["mass_kg"] for file in files if "mass_kg" in file.subject), None)


def _references(row: Row, mass_kg: float) -> list[Theirs]:
    assert row.recording is not None
    if row.path.suffix.casefold() == ".c3d":
        vicon = of_vicon(row.path, row.recording.time)
        return [] if vicon is None else [vicon]
    trials = [path for path in row.path.parent.glob("*.trc") if not set(path.stem.split("_")) & STANDING_WORDS]
    return of_opensim(row.path, mass_kg, len(trials) == 1)


def _cells(found: dict[Key, Difference], joint: str) -> list[str]:
    right, left = (found.get((side, joint), Difference()) for side in ("right", "left"))
    both = (right, left)
    angles = [
        "–" if d.rms_deg is None else f"{d.offset_deg:+.0f}, {_judged(d.rms_deg, ANGLE_GOAL_DEG, 1)}" for d in both
    ]
    moments = [
        "–"
        if d.moment is None
        else f"{_judged(d.moment, MOMENT_GOAL, 2)} ({_number(d.stance, 2)}, {_number(d.swing, 2)}; {d.frames})"
        for d in both
    ]
    about = ["–" if d.about_theirs is None else _judged(d.about_theirs, MOMENT_GOAL, 2) for d in both]
    apart = ", ".join(_number(d.centre_mm, 0) for d in both)
    return [joint, *angles, *moments, *about, apart, ", ".join(_number(d.power, 2) for d in both)]


def _judged(value: float, goal: float, digits: int) -> str:
    return f"**{value:.{digits}f}**" if value > goal else f"{value:.{digits}f}"


def _number(value: float | None, digits: int) -> str:
    return "–" if value is None else f"{value:.{digits}f}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="*", type=Path, help="further folders, or single recordings")
    parser.add_argument("--only", action="append", default=[], help="part of the names of recordings; all else is left")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--out", type=Path, help="also write the tables here (.md)")
    parser.add_argument("--write", action="store_true", help="put the tables into docs/validation/recordings.md")
    asked = parser.parse_args()
    paths = [
        path.absolute()
        for folder in [DATA, *asked.folders]
        for path in ([folder] if folder.is_file() else sorted(folder.rglob("*")))
        if path.suffix.casefold() in (".c3d", ".trc") and all(part in str(path) for part in asked.only)
    ]
    source = build()
    with ThreadPoolExecutor(asked.jobs) as pool:
        rows = [row for each in pool.map(lambda path: rows_of(path, source), paths) for row in each]
    lines = [*table(rows), "", *compared(rows)]
    print("\n".join(lines))
    if asked.out is not None:
        asked.out.write_text("\n".join(lines) + "\n", encoding="utf-8")
    if asked.write:
        put("validation/recordings.md", "corpus", lines)


if __name__ == "__main__":
    main()
