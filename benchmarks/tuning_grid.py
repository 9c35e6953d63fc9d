"""The paper's tuning, all 2197 combinations of its gains, on a real trial: how long it takes, and what wins.

    python benchmarks/tuning_grid.py [-o FOLDER] [--backend processes] [--jobs 2]

Trial: `squats1` of ../shared/data with `sagittal7`, lengths from `static1`.
"""

from __future__ import annotations

import argparse
import os
import time
from pathlib import Path

import dynakin
from dynakin.filter.estimator import Estimator
from dynakin.settings import presets
from dynakin.studies.engine.journal import ROWS, Journal, open_folder
from dynakin.studies.engine.pools import open_pool
from dynakin.studies.tuning.grid import belongs_to, paper_axes, run_grid
from dynakin.studies.tuning.output import write_grid
from dynakin.studies.tuning.score import Shared
from dynakin.studies.tuning.trial import prepare

ROOT = Path(__file__).resolve().parents[1]


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("-o", "--output", type=Path, default=Path("out/tuning_grid"))
    parser.add_argument("--backend", default="processes")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--scheduler")
    asked = parser.parse_args()
    data = Path(os.environ.get("DYNAKIN_TEST_DATA", ROOT.parent / "shared" / "data")) / "opencap_subject4"
    trial = dynakin.read(data / "squats1.trc", data / "squats1_grf.mot")
    static = dynakin.read(data / "static1.trc")
    estimator = Estimator(dynakin.load_model("sagittal7", dynakin.Subject()), presets.paper())
    shared = Shared((prepare(trial, estimator, static=static),), estimator.noise)
    axes = paper_axes()
    folder = open_folder(asked.output, ("grid.", "preset_", "figure3_"))
    journal = Journal(folder / ROWS, belongs_to(shared, axes))
    before = len(journal.rows)
    start = time.perf_counter()
    with open_pool(asked.backend, asked.jobs, asked.scheduler) as pool:
        grid = run_grid(shared, axes, pool, journal=journal)
    seconds = time.perf_counter() - start
    write_grid(folder, grid, "paper")
    frames = sum(row["done"] for row in journal.rows.values())
    print(f"{len(grid.cells) - before} runs of {trial.n_frames} frames, {frames} frames in all: {seconds:.0f} s")
    print(f"load average {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
    print(f"diverged: {sum(cell['diverged'] > 0 for cell in grid.cells)}")
    for name in grid.criteria():
        best = grid.best(name)
        print(f"{name}: {best[name]:.4g} at {grid.settings(best)}, on an edge: {grid.at_edge(best)}")


if __name__ == "__main__":
    main()
