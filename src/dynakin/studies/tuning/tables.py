"""What a tuning found, as tables of words."""

from __future__ import annotations

from typing import Any

from dynakin.report.text_tables import TextTable
from dynakin.settings.noise import SCALES
from dynakin.studies.tuning.fit import Fit
from dynakin.studies.tuning.grid import Grid
from dynakin.studies.tuning.score import CRITERIA

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
