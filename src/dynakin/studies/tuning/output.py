"""What a tuning found, in tables of words and in sentences, and what it leaves in its folder: the table, the presets
that `run` takes, a summary."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from dynakin.files import write_csv, write_json
from dynakin.report.text_tables import TextTable
from dynakin.results.files.config import versions
from dynakin.results.measures.consistency import judge
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


_SHOWN = {"markers_mm": "mm", "fy": "FY, N", "nll": "nll", "ahead": "ahead", "nis_per_row": "NIS"}


def grid_text(grid: Grid) -> TextTable:
    """A row a criterion: its optimum, and what else is true there. A * marks a value on the end of its range."""
    rows = []
    for name in grid.criteria():
        best = grid.best(name)
        edge = grid.at_edge(best)
        unit = CRITERIA[name][1]
        settings = [f"{best[axis.name]:.3g}{'*' if axis.name in edge else ''}" for axis in grid.axes]
        value = f"{best[name]:.4g}{'' if unit == '1' else ' ' + unit}"
        rows.append((name, value, *settings, *(_number(best[key]) for key in _SHOWN)))
    headings = ("least", "", *(axis.name for axis in grid.axes), *_SHOWN.values())
    title = f"Optimum by each criterion: {', '.join(grid.trials)} (*: end of the range)"
    return TextTable(title, headings, rows, tuple(range(2, len(headings))))


def criteria_text(grid: Grid) -> list[str]:
    """What the names of the criteria mean, a line each."""
    units = {name: unit for name, (_, unit) in CRITERIA.items()}
    return [
        f"{name}: {CRITERIA[name][0]}" + ("" if units[name] == "1" else f" ({units[name]})") for name in grid.criteria()
    ]


def settings_text(fit: Fit) -> TextTable:
    """What each setting does: where it started, where it ended and how sure that is, and what half and twice cost."""
    rows: list[tuple[str, ...]] = []
    for s in fit.settings:
        interval = "–" if s.low is None or s.high is None else f"{s.low:.3g} to {s.high:.3g}"
        value = f"{s.value:.3g}{'*' if s.at_limit else ''}"
        known = "yes" if s.known else "no"
        words = (s.name, SCALES[s.name].unit, _number(s.start), value, interval, known)
        rows.append((*words, _signed(s.halved), _signed(s.doubled), SCALES[s.name].effect))
    unit = "nat" if fit.criterion == "nll" else fit.criterion
    headings = ("setting", "unit", "start", "fitted", "95 %", "known", f"half, {unit}", f"twice, {unit}", "")
    title = f"Fitted on {', '.join(t.name for t in fit.shared.trials)} (*: end of the range)"
    return TextTable(title, headings, rows, (2, 3, 6, 7))


def figures_text(fit: Fit) -> list[TextTable]:
    """Criteria with the fitted settings and other presets: on all, and held out."""
    parts = [("All", fit.figures), *((f"Held out: {fold.held_out}", fold.figures) for fold in fit.folds)]
    keys = {"nll": "nll", "ahead": "ahead", "nis_per_row": "NIS", "markers_mm": "mm"}
    keys |= {"ahead_markers_mm": "ahead, mm", "ahead_fy": "ahead FY, N"}
    return [
        TextTable(
            title,
            ("settings", *keys.values()),
            [(name, *(_number(row[key], 4) for key in keys)) for name, row in figures.items()],
            tuple(range(1, 1 + len(keys))),
        )
        for title, figures in parts
    ]


def _signed(value: float) -> str:
    return f"{value:+.3g}".replace("-", "−")


def _number(value: Any, digits: int = 3) -> str:
    return "–" if value is None else f"{value:.{digits}g}".replace("-", "−")


WORSE = 1.05
"""A prediction that is this much worse counts as worse."""
NIS = (0.5, 2.0)
"""Of a row, as fitted settings should have it: the likelihood's best scale has 1, and half of it says otherwise."""


def recommendation(fit: Fit) -> list[str]:
    """Sentences: whether to use the fitted settings, which of them the recordings do not identify, what to look at."""
    found = []
    limit = [s.name for s in fit.settings if s.at_limit]
    if limit:
        rest = " ".join(f"--vary {s.name}" for s in fit.settings if not s.at_limit)
        found.append(
            f"Do not use the fitted settings as they are: at the end of its range: {', '.join(limit)}. Such a setting "
            "stands for something else, mostly for recordings that were smoothed before; fit again without it"
            f"{f' ({rest})' if rest else ''}. Held out, still: "
        )
        found[-1] += _whether(fit)[0].lower() + _whether(fit)[1:]
    else:
        found.append(_whether(fit))
    unknown = [s.name for s in fit.settings if not s.known and not s.at_limit and s.low is not None]
    if unknown:
        found.append(f"Not identified by these recordings (interval wider than a factor 3): {', '.join(unknown)}.")
    nis = fit.figures["fitted"]["nis_per_row"]
    if nis is not None and (kind := judge(nis, NIS)) != "consistent":
        found.append(f"With the fitted settings the filter is {kind}: its NIS is {nis:.2g} a row, expected about 1.")
    if len(fit.shared.trials) == 1:
        found.append(
            "One trial was held out by halves: the same person, markers and movement. Judge on another trial before "
            "you use these settings for a laboratory."
        )
    return found


def _whether(fit: Fit) -> str:
    name, unit = ("log-likelihood", " nats a row") if fit.criterion == "nll" else (f"criterion {fit.criterion}", "")
    pairs = [(f.figures["fitted"][fit.criterion], f.figures["start"][fit.criterion]) for f in fit.folds]
    if any(fitted is None for fitted, _ in pairs):
        return "Keep the settings that you started from: with the fitted ones the filter diverges where it is held out."
    gains = [float("inf") if start is None else start - fitted for fitted, start in pairs]
    listed_gains = ", ".join(f"{gain:+.3g}" for gain in gains).replace("-", "−")
    if min(gains) <= 0.0:
        return (
            f"Keep the settings that you started from: the fitted ones are not better in each held-out part ({name}: "
            f"{listed_gains}{unit})."
        )
    ahead = [(f.figures["fitted"]["ahead"], f.figures["start"]["ahead"]) for f in fit.folds]
    worse = [a / b for a, b in ahead if a is not None and b is not None and a > WORSE * b]
    if worse:
        return (
            f"Do not use the fitted settings without a look: they are better in each held-out part by {name} "
            f"({listed_gains}{unit}), but 100 ms ahead up to {100.0 * (max(worse) - 1.0):.0f} % worse."
        )
    return f"Use the fitted settings: they are better in each held-out part ({name}: {listed_gains}{unit})."
