"""NIS of every recording on the half that was not used to calibrate its noise.

    OMP_NUM_THREADS=1 .venv/bin/python benchmarks/nis.py [NAME...] [--model fullbody] [--write]

Each recording of ``../shared/data`` is prepared as `benchmarks/recordings.py` runs it (its own .osim, else
``fullbody``). Its noise is calibrated on every other stretch (`filter.adapt`) and judged on the others, of the first
20 s. A stretch is a second, or a tenth of a recording shorter than 10 s. Figures are kept in ``build/nis``, one file a
recording; ``--write`` puts the table of all that are kept into ``docs/validation/noise.md``.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np
from pages import put

from dynakin.arrays import Flags
from dynakin.errors import DynakinError
from dynakin.filter.adapt import calibrated_noise, nis_per_row
from dynakin.filter.alignment import run_in_step
from dynakin.filter.tracker import Tracker
from dynakin.settings.noise import JointGroup
from dynakin.settings.settings import Settings
from dynakin.validation.case import case_of
from recordings import DATA, ROOT, TRIALS, Array
from recordings import Trial as Known

KEPT = ROOT / "build" / "nis"
LONGEST_S = 20.0
GROUPS: tuple[JointGroup, ...] = ("pelvis", "trunk_rotation", "upper_body", "hips", "knees", "feet")
HEAD = (
    "| recording | NIS, declared | NIS, calibrated | of markers alone | of plates alone | variance scale "
    "| jerk scales: pelvis, trunk's rotation, upper body, hips, knees, feet |\n|---|---|---|---|---|---|---|"
)


def main() -> None:
    """One row a recording."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", help="parts of recordings' names; none: all")
    parser.add_argument("--model", default="own", choices=["own", "fullbody"], help="own: a recording's .osim")
    parser.add_argument("--write", action="store_true", help="put the table into docs/validation/noise.md")
    asked = parser.parse_args()
    KEPT.mkdir(parents=True, exist_ok=True)
    for trial in TRIALS:
        if not asked.names or any(name in trial.name for name in asked.names):
            found = figures_or_why(trial, asked.model)
            kept(trial, asked.model).write_text(json.dumps(found, indent=1), encoding="utf-8")
            print(row(trial, found), flush=True)
    if asked.write:
        put("validation/noise.md", "nis", table(asked.model))


def kept(trial: Known, wanted: str) -> Path:
    """Where the figures are kept."""
    return KEPT / f"{trial.name.replace('/', '_')}_{wanted}.json"


def table(wanted: str) -> list[str]:
    """Markdown of all that is kept."""
    files = [(trial, kept(trial, wanted)) for trial in TRIALS]
    rows = [row(trial, json.loads(file.read_text(encoding="utf-8"))) for trial, file in files if file.exists()]
    return [HEAD, *rows]


def figures_or_why(trial: Known, wanted: str) -> dict[str, Any]:
    """As `figures`; why there are none by the key ``refused``."""
    try:
        return figures(trial, wanted)
    except DynakinError as error:
        return {"refused": error.message.replace(str(DATA), "")[:120]}


def row(trial: Known, found: dict[str, Any]) -> str:
    """A line of the table, or why there is none."""
    if "refused" in found:
        return f"| `{trial.name}` | {found['refused']} | – | – | – | – | – |"
    jerk = ", ".join(f"{found['jerk_scale'].get(group, 1.0):.2g}" for group in GROUPS)
    cells = [_cell(found[key]) for key in ("declared", "calibrated", "markers", "plates", "variance_scale")]
    return f"| `{trial.name}` | {' | '.join(cells)} | {jerk} |"


def figures(trial: Known, wanted: str) -> dict[str, Any]:
    """NIS a row before and after, and the scales between them."""
    given: dict[str, str | None] = {"forces": trial.forces, "static": trial.static}
    keys: dict[str, object] = {key: DATA / value for key, value in given.items() if value}
    keys["mass_kg"] = trial.mass_kg
    keys |= {"trial": DATA / trial.path, "model": trial.model(wanted), "output": Path()}
    case = case_of(Settings.of(keys, "nis"))
    recording = case.recording.window(float(case.recording.time[0]), float(case.recording.time[0]) + LONGEST_S)
    ready = case.setup.estimator("default").prepare(recording, static=case.static)
    tracker, arrays, shift, _ = run_in_step(ready.tracker.fresh(), ready.measured)
    run = ready.measured.in_step(shift)
    chosen = halves(run.time)
    noise = calibrated_noise(tracker, arrays, run, chosen)
    if noise is None:
        return {"declared": nis_per_row(arrays, ~chosen), "calibrated": None, "markers": None, "plates": None,
                "variance_scale": None, "jerk_scale": {}}  # fmt: skip
    again = tracker.changed(noise).run_arrays(run)
    held = ~chosen
    return {
        "declared": nis_per_row(arrays, held),
        "calibrated": nis_per_row(again, held),
        "markers": squares(tracker, again, held, slice(None, -6)),
        "plates": squares(tracker, again, held, slice(-6, None)),
        **noise.scales(),
    }


def halves(time: Array) -> Flags:
    """(T,) frames of every other stretch, the first one among them."""
    length = time[-1] - time[0]
    return np.asarray(np.floor((time - time[0]) / min(1.0, 0.1 * length)) % 2 == 0)


def squares(tracker: Tracker, arrays: dict[str, Array], held: Flags, channels: slice) -> float | None:
    """Mean square of each channel's innovation over its own variance."""
    value, sd = arrays["innovation"][held, channels], arrays["innovation_sd"][held, channels]
    seen = np.isfinite(value) & (sd > 0.0)
    return float(np.mean((value[seen] / sd[seen]) ** 2)) if seen.any() else None


def _cell(value: object) -> str:
    return "–" if value is None else f"{value:.2g}"


if __name__ == "__main__":
    main()
