"""The paper's tuning: all combinations of some settings on logarithmic scales, each judged by several criteria."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from dynakin.arrays import Array
from dynakin.errors import ConfigError, DynakinError
from dynakin.progress import Progress
from dynakin.settings.effect import check_effect
from dynakin.settings.noise import Noise
from dynakin.studies.engine.build import build
from dynakin.studies.engine.journal import Journal
from dynakin.studies.engine.pools import Pool, work
from dynakin.studies.engine.tasks import Task
from dynakin.studies.tuning.score import CRITERIA, Shared, score_task
from dynakin.studies.tuning.settings import check_setting
from dynakin.units import COMPONENTS

PAPER_RANGE = (1e-6, 1e6, 13)
MOST_CELLS = 1_000_000
_MEANS = ("nis_per_row", "markers_mm", *COMPONENTS, "ahead_markers_mm", *(f"ahead_{name}" for name in COMPONENTS))


@dataclass(frozen=True)
class Axis:
    """One setting and the values that it takes, in rising order."""

    name: str
    values: tuple[float, ...]


def axis(name: str, low: float, high: float, steps: int) -> Axis:
    """A logarithmic scale from ``low`` to ``high``, both of them in it.

    Raises:
        ConfigError: a setting that cannot be varied, or a range that is none.
    """
    check_setting(name)
    if not (0.0 < low <= high < np.inf) or steps < 1 or (steps == 1 and low != high) or (steps > 1 and low == high):
        raise ConfigError(
            f"range of {name}: {low:g} to {high:g} in {steps} steps, expected 0 < from < to and 2 steps or more"
        )
    if steps > MOST_CELLS:
        raise ConfigError(f"range of {name}: {steps} steps, expected at most {MOST_CELLS}")
    exponents = np.linspace(np.log10(low), np.log10(high), steps)
    return Axis(name, tuple(float(f"{10.0**exponent:.12g}") for exponent in exponents))


def paper_axes() -> tuple[Axis, ...]:
    """The paper's three gains, 13 values each."""
    return tuple(
        axis(name, *PAPER_RANGE) for name in ("coordinate_variance", "speed_variance", "acceleration_variance")
    )


@dataclass(frozen=True, eq=False)
class Grid:
    """The outcome.

    Attributes:
        axes: the settings. base: all others.
        cells: one a combination, the last axis running fastest: the settings by name, ``diverged`` (in how many trials
            the filter was lost), ``why`` in the first, and each figure of `score_task` as its mean over the trials; a
            cell in which any trial diverged has none.
    """

    axes: tuple[Axis, ...]
    base: Noise
    trials: tuple[str, ...]
    cells: tuple[dict[str, Any], ...]

    def criterion(self, name: str) -> Array:
        """A criterion on the grid (one dimension an axis); NaN where the filter diverged."""
        values = [np.nan if cell[name] is None else cell[name] for cell in self.cells]
        return np.array(values, dtype=float).reshape([len(axis.values) for axis in self.axes])

    def criteria(self) -> list[str]:
        """Those that were computed somewhere."""
        return [name for name in CRITERIA if np.isfinite(self.criterion(name)).any()]

    def best(self, name: str) -> dict[str, Any]:
        """The cell with the least value of a criterion.

        Raises:
            DynakinError: the filter diverged everywhere.
        """
        values = self.criterion(name).ravel()
        if not np.isfinite(values).any():
            raise DynakinError(f"the filter diverged in all of the {len(self.cells)} combinations")
        return self.cells[int(np.nanargmin(values))]

    def settings(self, cell: Mapping[str, Any]) -> dict[str, float]:
        """The settings of a cell."""
        return {axis.name: cell[axis.name] for axis in self.axes}

    def at_edge(self, cell: Mapping[str, Any]) -> list[str]:
        """Settings of a cell that lie on an end of their range."""
        return [a.name for a in self.axes if len(a.values) > 1 and cell[a.name] in (a.values[0], a.values[-1])]


def check_size(axes: Sequence[Axis]) -> None:
    """
    Raises:
        ConfigError: more combinations than anyone can want.
    """
    cells = math.prod(len(axis.values) for axis in axes)
    if cells > MOST_CELLS:
        raise ConfigError(f"grid: {cells} combinations, expected at most {MOST_CELLS}")


def combinations(axes: Sequence[Axis]) -> list[dict[str, float]]:
    """All settings, the last axis running fastest.

    Raises:
        ConfigError: no axis, one twice, or more combinations than anyone can want.
    """
    names = [axis.name for axis in axes]
    if not names or len(set(names)) < len(names):
        raise ConfigError(f"grid: settings {', '.join(names) or 'none'}, expected at least one, each once")
    check_size(axes)
    return [dict(zip(names, values, strict=True)) for values in itertools.product(*(axis.values for axis in axes))]


def belongs_to(shared: Shared, axes: Sequence[Axis]) -> dict[str, Any]:
    """All that the rows of a grid depend on, for its journal."""
    return {
        "what": "grid",
        "version of dynakin": build(),
        "trials": [trial.identity() for trial in shared.trials],
        "settings": shared.base.model_dump(mode="json"),
        "--left-out": shared.left_out,
        "--vary": {axis.name: list(axis.values) for axis in axes},
    }


def run_grid(
    shared: Shared,
    axes: Sequence[Axis],
    pool: Pool,
    *,
    journal: Journal | None = None,
    progress: Progress | None = None,
) -> Grid:
    """Try every combination on every trial.

    Raises:
        ConfigError: a combination that the filter cannot take, or a setting without effect. DynakinError: a task that
            failed otherwise than by divergence.
    """
    settings = combinations(axes)
    check_effect([axis.name for axis in axes], shared.base, shared.floating)
    for axis in axes:
        for value in axis.values:
            shared.base.changed(**{axis.name: value})
    trials = range(len(shared.trials))
    tasks = [Task(f"{k:07d}/{trial:04d}", (trial, cell)) for k, cell in enumerate(settings) for trial in trials]
    outcomes = work(pool, score_task, shared, tasks, journal=journal, progress=progress)
    rows = []
    for outcome in outcomes:
        if outcome.row is None:
            assert outcome.failure is not None
            raise DynakinError(f"grid: a combination failed: {outcome.failure.message}")
        rows.append(outcome.row)
    count = len(shared.trials)
    cells = [cell | mean_row(rows[k * count : (k + 1) * count]) for k, cell in enumerate(settings)]
    return Grid(tuple(axes), shared.base, tuple(trial.name for trial in shared.trials), tuple(cells))


def mean_row(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Rows of the same setting on several trials as one: means, and the likelihood of all rows together."""
    diverged = [row["divergence"] for row in rows if row["divergence"] is not None]
    found: dict[str, Any] = {"diverged": len(diverged), "why": diverged[0] if diverged else None}
    for name in (*CRITERIA, *_MEANS):
        values = [row[name] for row in rows]
        whole = not diverged and all(value is not None for value in values)
        found[name] = float(np.mean(values)) if whole else None
    if not diverged:
        total = sum(row["n_rows"] for row in rows)
        found["nll"] = -sum(row["log_likelihood"] for row in rows) / total if total else None
    return found
