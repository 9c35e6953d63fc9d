"""Which criterion finds the gains with the smallest true error: the paper's grid on simulated squats.

    python benchmarks/tuning_truth.py [-o FOLDER] [--steps 7] [--duration 8] [--jobs 2]

Seeds 1 to 5 choose the gains, the error is that of seeds 6 to 10. Errors after 2 s: angles about their mean error,
mean over coordinates; moments of ankle, knee and hip. Also draws Figure 3 by each criterion and by the true errors.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import dynakin
from dynakin.files import write_csv
from dynakin.filter.core_filter import core_filter
from dynakin.filter.estimator import Estimator
from dynakin.model.spec import free_names
from dynakin.report.paper_figures.figures import save_sensitivity_figures
from dynakin.report.paper_figures.sensitivity import Sensitivity
from dynakin.settings import presets
from dynakin.settings.noise import Noise
from dynakin.simulation.trial import simulate
from dynakin.studies.engine.journal import ROWS, Journal, open_folder
from dynakin.studies.engine.pools import open_pool, work
from dynakin.studies.engine.tasks import Task
from dynakin.studies.tuning.grid import axis, combinations, mean_row
from dynakin.studies.tuning.score import CRITERIA, LOST_M, figures_from
from dynakin.studies.tuning.trial import TuningTrial, prepare, undoubting
from dynakin.validation.truth import LEG

SEEDS = range(1, 11)
CHOOSE = 5
ERRORS = {"angles": ("true error of the angles", "deg"), "moments": ("true error of the moments", "N m")}
Array = np.ndarray


@dataclass(frozen=True, eq=False)
class WithTruth:
    """A trial, and its true coordinates and moments (T, C); names of the coordinates."""

    trial: TuningTrial
    coordinates: Array
    moments: Array
    names: tuple[str, ...]


def trial_of(seed: int, duration: float, rate: float = 100.0, noise: Noise | None = None) -> WithTruth:
    made = simulate("sagittal7", "squat", seed, duration, rate)
    subject = dynakin.Subject(mass_kg=70.0, height_m=1.75, sex="male")
    definition = dynakin.load_model("sagittal7", subject=subject, markers="opencap")
    trial = prepare(made.recording, Estimator(definition, noise or presets.paper()))
    names = tuple(free_names(trial.initial.spec))
    truth = made.truth.data.sel(coordinate=list(names))
    values = (truth[key].transpose("time", "coordinate").values for key in ("coordinates", "moments"))
    return WithTruth(trial, *values, names)


def score(trials: list[WithTruth], payload: tuple[int, dict[str, Any], str]) -> dict[str, Any]:
    number, changes, base = payload
    told = trials[number]
    noise = undoubting(presets.preset(base, changes))
    trial = told.trial
    _, _, core = core_filter(trial.initial, noise, trial.estimate)
    sums = core.score(
        trial.time, trial.markers, trial.wrench, trial.first, trial.end, ahead=trial.ahead, lost_m=LOST_M, trace=True
    )
    found = figures_from(sums, trial, presets.paper())
    window = slice(trial.first, trial.end)
    angle = np.degrees(sums["state"][window, : len(told.names)] - told.coordinates[window])
    all_names = [c.name for c in told.trial.initial.spec.coordinates]
    leg = [told.names.index(name) for name in LEG]
    moment = sums["moments"][window][:, [all_names.index(name) for name in LEG]] - told.moments[window][:, leg]
    whole = found["divergence"] is None
    errors = {"angles": angle.std(axis=0).mean(), "moments": np.sqrt((moment**2).mean(axis=0)).mean()}
    return found | {key: float(value) if whole else None for key, value in errors.items()}


def means(rows: list[dict[str, Any]]) -> dict[str, Any]:
    found = mean_row(rows)
    whole = not found["diverged"]
    return found | {key: float(np.mean([row[key] for row in rows])) if whole else None for key in ERRORS}


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("-o", "--output", type=Path, default=Path("out/tuning_truth"))
    parser.add_argument("--steps", type=int, default=7)
    parser.add_argument("--duration", type=float, default=8.0)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--backend", default="threads")
    asked = parser.parse_args()
    folder = open_folder(asked.output, ("cells", "figure3_"))
    axes = [
        axis(name, 1e-6, 1e6, asked.steps)
        for name in ("coordinate_variance", "speed_variance", "acceleration_variance")
    ]
    cells = combinations(axes)
    gains = [{"coordinate_variance": 1e3, "speed_variance": 1e2, "acceleration_variance": 1e3}]
    settings = [(cell, "paper") for cell in [*cells, *gains]] + [({}, "default")]
    trials = [trial_of(seed, asked.duration) for seed in SEEDS]
    tasks = [
        Task(f"{k:05d}/{n:02d}", (n, cell, base)) for k, (cell, base) in enumerate(settings) for n in range(len(trials))
    ]
    journal = Journal(folder / ROWS, [[t.trial.identity() for t in trials], asked.steps])
    start = time.perf_counter()
    with open_pool(asked.backend, asked.jobs) as pool:
        outcomes = work(pool, score, trials, tasks, journal=journal)
    print(f"{len(tasks)} runs: {time.perf_counter() - start:.0f} s")
    rows = [outcome.row for outcome in outcomes]
    split = [rows[k : k + len(trials)] for k in range(0, len(rows), len(trials))]
    chosen, judged = ([means(part[a:b]) for part in split] for a, b in ((0, CHOOSE), (CHOOSE, len(trials))))
    write_csv(folder / "cells.csv", [cell | row for cell, row in zip(cells, chosen, strict=False)])
    shape = [len(a.values) for a in axes]
    figures = {}
    for name, (title, unit) in {**CRITERIA, **ERRORS}.items():
        values = np.array([np.nan if row[name] is None else row[name] for row in chosen[: len(cells)]], dtype=float)
        if not np.isfinite(values).any():
            continue
        figures[f"figure3_{name}"] = Sensitivity(
            tuple(np.log10(a.values) for a in axes), values.reshape(shape), title, unit
        )
        tell(name, int(np.nanargmin(values)), cells, judged)
    save_sensitivity_figures(figures, folder, ("png",))
    for name in ERRORS:
        values = [np.nan if row[name] is None else row[name] for row in judged[: len(cells)]]
        tell(f"(smallest {name} of seeds 6 to 10)", int(np.nanargmin(values)), cells, judged)
    tell("(the paper's gains)", len(cells), [*cells, *gains], judged)
    tell("(preset default)", len(cells) + 1, [*cells, *gains, {}], judged)
    print(
        f"diverged for one of seeds 1 to 5: {sum(row['diverged'] > 0 for row in chosen[: len(cells)])} of {len(cells)}"
    )


def tell(name: str, k: int, cells: list[dict[str, float]], judged: list[dict[str, Any]]) -> None:
    row = judged[k]
    at = ", ".join(f"1e{np.log10(value):.0f}" for value in cells[k].values())
    errors = ", ".join("diverged" if row[e] is None else f"{e} {row[e]:.2f} {ERRORS[e][1]}" for e in ERRORS)
    more = ", ".join(
        f"{key} {row[key]:.3g}" for key in ("markers_mm", "fy", "ahead", "nis_per_row") if row[key] is not None
    )
    print(f"{name:40s} ({at}): {errors}; {more}")


if __name__ == "__main__":
    main()
