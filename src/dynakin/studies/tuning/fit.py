"""Noise settings of greatest likelihood, how sure they are, and whether they hold where they were not fitted."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from dynakin.arrays import Array
from dynakin.errors import ConfigError
from dynakin.progress import Progress
from dynakin.settings.effect import check_effect, without_effect
from dynakin.settings.noise import Noise
from dynakin.studies.engine.build import build
from dynakin.studies.engine.journal import Journal
from dynakin.studies.engine.pools import Pool
from dynakin.studies.tuning.likelihood import REACH, Likelihood
from dynakin.studies.tuning.optimise import SETTLED, Optimum, curvature, deviations, minimise
from dynakin.studies.tuning.score import CRITERIA, Shared
from dynakin.studies.tuning.settings import check_setting, together, value_of

# What is fitted where nothing is named, as far as the settings have it.
USUAL = (
    "coordinate_variance",
    "speed_variance",
    "acceleration_variance",
    "marker_place_variance_m2",
    "jerk_density_rad2_s5",
    "translation_jerk_density_m2_s5",
    "floating_jerk_density_rad2_s5",
    "floating_translation_jerk_density_m2_s5",
    "soft_tissue_sd_fraction",
    "soft_tissue_time_s",
    "floating_soft_tissue_time_s",
    "marker_sd_m",
    "marker_variance_scale",
    "force_variance_n2",
    "moment_variance_n2_m2",
    "plate_force_sd_n",
    "plate_moment_sd_nm",
)
SETTLED_RELATIVE = 1e-5
"""Relative change of another criterion than the likelihood at which the search ends."""
KNOWN_WITHIN = 3.0
"""A setting is known where its 95 % interval is within this factor either way."""


@dataclass(frozen=True)
class Fitted:
    """One setting. value: the likeliest; low, high: its 95 % interval, None where there is none.

    halved, doubled: what half and twice the value cost, nats of log-likelihood (with another criterion: in its unit).
    """

    name: str
    start: float
    value: float
    low: float | None
    high: float | None
    at_limit: bool
    halved: float
    doubled: float

    @property
    def known(self) -> bool:
        """Whether the recordings identify it."""
        return not self.at_limit and self.low is not None and self.value / self.low < KNOWN_WITHIN


@dataclass(frozen=True)
class Fold:
    """Settings fitted without a trial (or without a half of it), judged on that.

    figures: criteria (`CRITERIA`), ``nis_per_row``, ``markers_mm`` and more of the held-out part, by whose settings:
    "fitted", "start", and the names of other presets.
    """

    held_out: str
    settings: dict[str, float]
    figures: dict[str, dict[str, Any]]


@dataclass(frozen=True, eq=False)
class Fit:
    """The outcome. figures: of all trials, as in `Fold`. hessian: second derivatives in ln(setting), None with another
    criterion than the likelihood."""

    shared: Shared
    criterion: str
    settings: tuple[Fitted, ...]
    figures: dict[str, dict[str, Any]]
    folds: tuple[Fold, ...]
    optimum: Optimum
    hessian: Array | None

    @property
    def noise(self) -> Noise:
        """The fitted settings."""
        return self.shared.base.changed(**together(self.shared.base, {s.name: s.value for s in self.settings}))


def usual_names(noise: Noise, floating: Collection[bool] = (False,)) -> tuple[str, ...]:
    """What is fitted where nothing is named: what these settings use.

    Args:
        floating: whether the model is fixed nowhere, of each trial.
    """
    unused = "marker_variance_scale" if noise.marker_sd_m is not None else "marker_sd_m"
    names = [name for name in USUAL if name != unused and (getattr(noise, name) or 0.0) > 0.0]
    idle = without_effect(names, noise, floating)
    return tuple(
        n for n in names if n not in idle and not (n.endswith("tissue_time_s") and noise.soft_tissue_sd_fraction == 0.0)
    )


def belongs_to_fit(shared: Shared) -> dict[str, Any]:
    """All that the rows of a fit depend on in addition to their settings, for its journal."""
    return {
        "what": "fit",
        "version of dynakin": build(),
        "trials": [trial.identity() for trial in shared.trials],
        "settings": shared.base.model_dump(mode="json"),
    }


@dataclass(eq=False)
class Fitter:
    """`fit` in steps.

    Args:
        others: further presets to be judged with the fitted settings and the start, by name.
    """

    shared: Shared
    names: tuple[str, ...]
    pool: Pool
    journal: Journal | None = None
    criterion: str = "nll"
    others: Mapping[str, Noise] = field(default_factory=dict)
    progress: Progress | None = None

    def __post_init__(self) -> None:
        if not self.names or len(set(self.names)) < len(self.names):
            raise ConfigError(f"fit: settings {', '.join(self.names) or 'none'}, expected at least one, each once")
        if self.criterion not in CRITERIA or self.criterion == "left_out":
            raise ConfigError(f"fit: criterion {self.criterion!r}, expected one of nll, ahead, sigma, paper, nis")
        for name in self.names:
            value_of(self.shared.base, check_setting(name))
        check_effect(self.names, self.shared.base, self.shared.floating)

    def run(self) -> Fit:
        """Fit on everything, then on all but a part, each part in turn.

        A single trial is held out by halves: the filter runs through both, and only the frames of one count.

        Raises:
            ConfigError: a setting that cannot be varied. DynakinError: the filter diverges with the settings from which
                it starts.
        """
        shared = self.shared
        parts = shared.trials if len(shared.trials) > 1 else shared.trials[0].halves()
        folded = replace(shared, trials=tuple(parts))
        steps = 3 + len(parts)
        self._report(0, steps)
        everything = self._likelihood(shared)
        optimum = self._minimise(everything, np.zeros(len(self.names)))
        self._report(1, steps)
        hessian = curvature(everything.costs, optimum.point) if self.criterion == "nll" else None
        self._report(2, steps)
        settings = self._settings(everything, optimum, hessian)
        fitted = {s.name: s.value for s in settings}
        figures = self._figures(everything, fitted)
        self._report(3, steps)
        folds = []
        for k, part in enumerate(parts):
            rest = self._likelihood(folded, [n for n in range(len(parts)) if n != k])
            found = rest.settings(self._minimise(rest, optimum.point).point)
            folds.append(Fold(part.name, found, self._figures(self._likelihood(folded, [k]), found)))
            self._report(4 + k, steps)
        return Fit(shared, self.criterion, settings, figures, tuple(folds), optimum, hessian)

    def only(self) -> tuple[Optimum, Noise]:
        """The optimum on all trials and its settings, and nothing else of `run`."""
        everything = self._likelihood(self.shared)
        optimum = self._minimise(everything, np.zeros(len(self.names)))
        return optimum, self.shared.base.changed(**together(self.shared.base, everything.settings(optimum.point)))

    def _likelihood(self, shared: Shared, trials: Sequence[int] | None = None) -> Likelihood:
        return Likelihood(shared, self.names, self.pool, self.journal, trials, self.criterion)

    def _minimise(self, cost: Likelihood, start: Array) -> Optimum:
        settled = SETTLED if self.criterion == "nll" else SETTLED_RELATIVE * abs(float(cost.costs([start])[0]))
        return minimise(cost.costs, start, REACH, settled=settled)

    def _settings(self, cost: Likelihood, optimum: Optimum, hessian: Array | None) -> tuple[Fitted, ...]:
        k = len(self.names)
        sd = np.full(k, np.nan) if hessian is None else deviations(hessian)
        point, step = optimum.point, np.log(2.0) * np.eye(k)
        moved = cost.costs([point, *(point - step), *(point + step)]) - optimum.cost
        values = cost.settings(point)
        found = []
        for n, name in enumerate(self.names):
            factor = float(np.exp(1.959964 * sd[n])) if sd[n] < 10.0 else None
            value = values[name]
            low, high = (None, None) if factor is None else (value / factor, value * factor)
            changes = float(moved[1 + n]), float(moved[1 + k + n])
            found.append(Fitted(name, float(cost.start[n]), value, low, high, bool(optimum.at_limit[n]), *changes))
        return tuple(found)

    def _figures(self, where: Likelihood, fitted: Mapping[str, float]) -> dict[str, dict[str, Any]]:
        asked: dict[str, dict[str, Any]] = {"fitted": together(self.shared.base, fitted), "start": {}}
        # the total mass as a row at each frame would count as likelihood: all are judged on the recordings alone
        mass = {
            "total_mass_use": where.shared.base.total_mass_use,
            "total_mass_variance_kg2": where.shared.base.total_mass_variance_kg2,
        }
        asked |= {name: noise.model_dump(mode="json") | mass for name, noise in self.others.items()}
        return dict(zip(asked, where.rows(list(asked.values())), strict=True))

    def _report(self, done: int, total: int) -> None:
        if self.progress is not None:
            self.progress(done, total)
