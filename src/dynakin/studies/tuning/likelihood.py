"""The likelihood of noise settings on a logarithmic scale, many points at a time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from dynakin.arrays import Array
from dynakin.errors import DynakinError
from dynakin.studies.engine.journal import Journal
from dynakin.studies.engine.pools import Pool, work
from dynakin.studies.engine.tasks import Row, Task
from dynakin.studies.tuning.grid import mean_row
from dynakin.studies.tuning.score import Shared, score_task
from dynakin.studies.tuning.settings import together, value_of

DECADE = float(np.log(10.0))
REACH = 3.0 * DECADE
"""A setting is sought within a factor 1000 of where it starts."""
PRIOR_SD = DECADE
"""Standard deviation of the weak prior about the start: it holds what the data leave open, and moves nothing else."""
SLIGHT = 1e-4
"""Share of that prior where the cost is no likelihood."""
LOST = 1e9
"""What a point costs at which the filter diverges: more than any that it does not."""


@dataclass(eq=False)
class Likelihood:
    """Minus the log posterior of settings, in nats, as a function of theta = ln(setting / start).

    Attributes:
        shared: trials and the settings from which it starts. names: those that are varied.
        pool: who works. journal: rows of points that were tried in an earlier run, and of new ones.
        trials: numbers of the trials that count; None: all.
        criterion: "nll", or another of `CRITERIA` that is to be small instead; no likelihood then, and no uncertainty.
        tried: points and their cost, in the order of their evaluation.
    """

    shared: Shared
    names: tuple[str, ...]
    pool: Pool
    journal: Journal | None = None
    trials: Sequence[int] | None = None
    criterion: str = "nll"
    tried: list[tuple[tuple[float, ...], float]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.start = np.array([value_of(self.shared.base, name) for name in self.names])

    def settings(self, theta: Array) -> dict[str, float]:
        """The settings at a point (k,)."""
        values = self.start * np.exp(theta)
        return {name: float(f"{value:.12g}") for name, value in zip(self.names, values, strict=True)}

    def costs(self, points: Sequence[Array]) -> Array:
        """Minus the log posterior (P,) at each point (k,): summed over the trials, with the prior."""
        rows = self.rows([together(self.shared.base, self.settings(theta)) for theta in points])
        found = []
        for theta, row in zip(points, rows, strict=True):
            prior = 0.5 * float(np.sum((theta / PRIOR_SD) ** 2))
            value = row[self.criterion]
            if value is None:
                found.append(LOST)
            elif self.criterion == "nll":
                found.append(value * row["n_rows"] + prior)
            else:
                found.append(value + SLIGHT * prior)
            self.tried.append((tuple(float(x) for x in theta), found[-1]))
        return np.array(found)

    def _part(self, number: int) -> str:
        """Which frames of which trial: whole trials and halves share a journal."""
        trial = self.shared.trials[number]
        return f"{number:04d} {trial.first} to {trial.end}"

    def rows(self, settings: Sequence[dict[str, float]]) -> list[Row]:
        """All figures of some settings, together over the trials (`mean_row`, with ``n_rows`` summed)."""
        numbers = list(range(len(self.shared.trials)) if self.trials is None else self.trials)
        tasks: dict[str, Task] = {}
        keys = []
        for point in settings:
            text = ",".join(f"{name}={value!r}" for name, value in point.items())
            keys.append([f"{text}/{self._part(number)}" for number in numbers])
            for key, number in zip(keys[-1], numbers, strict=True):
                tasks[key] = Task(key, (number, point))
        outcomes = {
            o.key: o for o in work(self.pool, score_task, self.shared, list(tasks.values()), journal=self.journal)
        }
        failed = next((o.failure for o in outcomes.values() if o.failure is not None), None)
        if failed is not None:
            raise DynakinError(f"tune: a setting failed: {failed.message}")
        found = []
        for of_point in keys:
            rows = [outcomes[key].row or {} for key in of_point]
            total = sum(row["n_rows"] or 0 for row in rows)
            found.append(mean_row(rows) | {"n_rows": total})
        return found
