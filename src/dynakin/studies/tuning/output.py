"""What a tuning leaves in its folder: the table, the presets that `run` takes, a summary."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from dynakin.files import write_csv, write_json
from dynakin.results.files.config import versions
from dynakin.settings.noise import SCALES
from dynakin.settings.presets import write_preset
from dynakin.studies.engine.journal import writing
from dynakin.studies.tuning.fit import Fit
from dynakin.studies.tuning.grid import Grid
from dynakin.studies.tuning.score import CRITERIA

PAPER = "paper"


def write_grid(folder: Path, grid: Grid, base: str) -> None:
    """``grid.csv`` (a row a combination), ``grid.json`` and ``preset_CRITERION.toml`` for each criterion.

    Args:
        base: name of the preset from which the grid started.

    Raises:
        OutputError: a file cannot be written.
    """
    with writing(folder):
        write_csv(folder / "grid.csv", [_line(grid, cell) for cell in grid.cells])
    summary: dict[str, Any] = {
        "versions": versions(),
        "trials": list(grid.trials),
        "base": base,
        "axes": {axis.name: list(axis.values) for axis in grid.axes},
        "diverged": sum(cell["diverged"] > 0 for cell in grid.cells),
        "optimum": {},
    }
    for name in grid.criteria():
        best = grid.best(name)
        title, unit = CRITERIA[name]
        at = ", ".join(f"{key} {value:g}" for key, value in grid.settings(best).items())
        remarks = [
            f"Written by `dynakin tune grid` on {', '.join(grid.trials)}.",
            f"Least {title} ({best[name]:.6g}{'' if unit == '1' else ' ' + unit}): {at}.",
        ]
        write_preset(folder / f"preset_{name}.toml", grid.base.changed(**grid.settings(best)), base, remarks)
        summary["optimum"][name] = {**best, "at_edge": grid.at_edge(best)}
    with writing(folder):
        write_json(folder / "grid.json", summary)


def write_fit(folder: Path, fit: Fit, base: str, advice: Sequence[str]) -> None:
    """``fit.csv`` (a row a setting), ``fit.json`` (all of it) and ``preset_fit.toml``.

    Args:
        base: name of the preset from which the fit started. advice: its recommendation.

    Raises:
        OutputError: a file cannot be written.
    """
    rows = [asdict(s) | {"unit": SCALES[s.name].unit, "known": s.known} for s in fit.settings]
    names = [trial.name for trial in fit.shared.trials]
    with writing(folder):
        write_csv(folder / "fit.csv", rows)
        write_json(
            folder / "fit.json",
            {
                "versions": versions(),
                "trials": names,
                "base": base,
                "criterion": fit.criterion,
                "settings": rows,
                "figures": fit.figures,
                "held_out": [asdict(fold) for fold in fit.folds],
                "hessian": None if fit.hessian is None else fit.hessian.tolist(),
                "evaluations": fit.optimum.evaluations,
                "converged": fit.optimum.converged,
                "recommendation": list(advice),
            },
        )
    remarks = [f"Written by `dynakin tune fit` on {', '.join(names)}.", *advice]
    write_preset(folder / "preset_fit.toml", fit.noise, base, remarks)


def _line(grid: Grid, cell: Mapping[str, Any]) -> dict[str, Any]:
    """A row of the table; ``criterion`` is the paper's, under the name that `run --sensitivity` reads."""
    settings = grid.settings(cell)
    logs = {f"log10_{name}": round(math.log10(value), 9) for name, value in settings.items()}
    rest = {name: value for name, value in cell.items() if name not in settings}
    return {**settings, **logs, "criterion": cell[PAPER], **rest}
