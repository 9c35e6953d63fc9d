"""What no method has seen, on real recordings of whole bodies: markers left out, plates withheld, 100 ms ahead.

    OMP_NUM_THREADS=1 .venv/bin/python benchmarks/held_out.py [NAME...] [--model fullbody|osim] [--again] [--write]

`dynakin.validation.unseen_in_space` on parts of recordings of ``../shared/data``: the filter, smoothed, beside inverse
kinematics and dynamics on the same calibrated model. Figures are kept in ``build/held_out``, one file a recording;
``--write`` puts the table of all that are kept into ``docs/validation/held_out.md``.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import dataclass
from pathlib import Path

from pages import put

from dynakin.filter.estimator import Estimator
from dynakin.model.definition import load_model
from dynakin.recordings.read import read
from dynakin.settings.defaults import HORIZON_S
from dynakin.settings.subject import Subject
from dynakin.validation.case import Setup
from dynakin.validation.table2 import MARKERS
from dynakin.validation.unseen import unseen_figures
from dynakin.validation.yardsticks import LEFT_OUT, LINEAR, PERSISTENCE, WITHHELD, Figures, ahead
from recordings import DATA, ROOT, TRIALS

KEPT = ROOT / "build" / "held_out"
AHEAD = ahead(HORIZON_S)
FORCE, MOMENT = ("fx", "fy", "fz"), ("mx", "my", "mz")
ROWS = (
    (LEFT_OUT, (MARKERS,), "mm"),
    (WITHHELD, FORCE, "N"),
    (WITHHELD, MOMENT, "N m"),
    (AHEAD, (MARKERS,), "mm"),
    (AHEAD, FORCE, "N"),
    (AHEAD, MOMENT, "N m"),
)


@dataclass(frozen=True)
class Part:
    """Of a recording of `recordings.TRIALS`; ``weighed_kg``: by the plates, where that is not the declared mass."""

    name: str
    seconds: tuple[float, float] | None = None
    weighed_kg: float | None = None


PARTS = (
    Part("opencap_subject4/walking1", None, 63.3),
    Part("opencap_subject4/squats1", (2.0, 6.0)),
    Part("c3d_parser/FMC/MH0222_BP06", None, 78.0),
    Part("c3d_parser/RBWH/bfnd w1"),
    Part("c3d_parser/MH/MH_Dynamic_BF08"),
    Part("c3d_parser/FMC/MH0222_BP15", None, 78.0),
    Part("opencap_subject4/STS1", (5.4, 8.4)),
)


def figures(part: Part, model: str) -> Figures | None:
    """Of one part; None where there is no .osim of the person."""
    trial = next(each for each in TRIALS if each.name == part.name)
    if model == "osim" and trial.osim is None:
        return None
    recording = read(DATA / trial.path, DATA / trial.forces if trial.forces else None)
    if part.seconds is not None:
        recording = recording.window(*part.seconds)
    static = read(DATA / trial.static) if trial.static else None
    mass_kg = part.weighed_kg or trial.mass_kg
    return unseen_figures(
        recording, Setup(Estimator(load_model(trial.model(model), Subject(mass_kg=mass_kg)))), static=static
    )


def kept(part: Part, model: str) -> Path:
    """Where the figures are kept."""
    return KEPT / f"{part.name.replace('/', '_').replace(' ', '_')}_{model}.json"


def table() -> list[str]:
    """Markdown of all that is kept: by recording and yardstick, methods side by side."""
    found: dict[tuple[str, str], Figures] = {}
    for model in ("fullbody", "osim"):
        for part in PARTS:
            if (file := kept(part, model)).exists():
                content = json.loads(file.read_text(encoding="utf-8"))
                span = "" if part.seconds is None else f", {part.seconds[0]:g} to {part.seconds[1]:g} s"
                name = f"`{part.name.rsplit('/', 1)[1]}`{span}{'' if model == 'fullbody' else ', .osim'}"
                found[name, model] = {tuple(key.split("|")): value for key, value in content.items()}
    methods = list(dict.fromkeys(key[2] for figures in found.values() for key in figures))
    methods.sort(key=lambda name: (name in (PERSISTENCE, LINEAR), name.startswith("IK")))
    lines = [f"| recording | yardstick | {' | '.join(methods)} |", f"|---|---|{'---|' * len(methods)}"]
    for (name, _), figures in found.items():
        for yardstick, quantities, unit in ROWS:
            if not any((yardstick, quantities[0], method) in figures for method in methods):
                continue
            label = f"{yardstick}, {', '.join(q.upper() if q != MARKERS else q for q in quantities)}, {unit}"
            cells = [", ".join(_number(figures.get((yardstick, q, method))) for q in quantities) for method in methods]
            cells = ["" if set(cell) <= set("–, ") else cell for cell in cells]
            lines.append(f"| {name} | {label} | {' | '.join(cells)} |")
    return lines


def _number(value: float | None) -> str:
    return "–" if value is None else f"{value:.1f}"


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", help="parts of recordings' names; none: all")
    parser.add_argument("--model", default="fullbody", choices=["fullbody", "osim"])
    parser.add_argument("--again", action="store_true", help="also where figures are kept")
    parser.add_argument("--write", action="store_true", help="put the table into docs/validation/held_out.md")
    asked = parser.parse_args()
    KEPT.mkdir(parents=True, exist_ok=True)
    for part in PARTS:
        file = kept(part, asked.model)
        if (asked.names and not any(name in part.name for name in asked.names)) or (file.exists() and not asked.again):
            continue
        found = figures(part, asked.model)
        if found is not None:
            file.write_text(json.dumps({"|".join(key): value for key, value in found.items()}), encoding="utf-8")
            print(file.name, flush=True)
    lines = table()
    print("\n".join(lines))
    if asked.write:
        put("validation/held_out.md", "held out", lines)


if __name__ == "__main__":
    main()
