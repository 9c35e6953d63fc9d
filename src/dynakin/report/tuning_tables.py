"""What a tuning found, as tables of words."""

from __future__ import annotations

from typing import Any

from dynakin.report.text_tables import TextTable
from dynakin.tuning import CRITERIA, Grid

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


def _number(value: Any) -> str:
    return "–" if value is None else f"{value:.3g}".replace("-", "−")
