"""Observability in one trial: posterior against prior, and movements that would identify more."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from dynakin.filter.augment import variance_scales
from dynakin.filter.tracker import Tracker
from dynakin.identification.observability.advice import advice_in_words, gains_of
from dynakin.identification.observability.excitation import Bench, Excitation
from dynakin.identification.observability.structure import Structure, base_of, base_spread, structure_of
from dynakin.progress import Progress
from dynakin.results.estimate import Estimate
from dynakin.results.measures.posterior import judged, posterior_figures, share_of
from dynakin.settings.noise import Noise

_MOST_FRAMES = 1000  # of the trial's motion for its condition number


@dataclass(frozen=True, eq=False)
class BasePosterior:
    """One base parameter, its value and its standard deviations before and after the trial, in its unit."""

    name: str
    words: str
    value: float
    prior_sd: float
    sd: float

    @property
    def share(self) -> float:
        """Standard deviation at the end over that before the first frame."""
        return self.sd / self.prior_sd if self.prior_sd > 0.0 else 1.0


@dataclass(frozen=True, eq=False)
class Identifiability:
    """Observability of the constants in one trial.

    Attributes:
        structure: what the model's measurements can identify at all.
        condition: of the base parameters over the trial's motion.
        base: posterior of the base parameters. posterior: the block of `dynakin.results.measures.posterior`.
        tried: motions that were tried in place of the trial's; None: none were to be. gains: factors on standard
            deviations (motion -> name).
        advice: sentences.
    """

    structure: Structure
    condition: float
    base: tuple[BasePosterior, ...]
    posterior: dict[str, Any]
    tried: tuple[Excitation, ...] | None
    gains: dict[str, dict[str, float]]
    advice: tuple[str, ...]

    def in_words(self) -> list[str]:
        """The trial's figures in sentences."""
        known = [entry for entry in self.base if judged(entry.share) == "known"]
        nothing = [entry for entry in self.base if judged(entry.share) == "nothing"]
        return [
            self.posterior["verdict"],
            f"Of {len(self.base)} base parameters {len(known)} are known from the data, "
            f"{len(self.base) - len(known) - len(nothing)} in part, and of {len(nothing)} the data say nothing; "
            f"condition number {self.condition:.2g} over this motion, {self.structure.base.condition:.2g} over random "
            "motion.",
        ]

    def as_dict(self) -> dict[str, Any]:
        """The block ``identifiability`` of ``metrics.json``."""
        structure = self.structure.as_dict()
        gauges = structure.pop("gauges")
        base = {
            entry.name: {
                "words": entry.words,
                "value": entry.value,
                "prior_sd": entry.prior_sd,
                "sd": entry.sd,
                "share": entry.share,
                "judgement": judged(entry.share),
            }
            for entry in self.base
        }
        return {
            **self.posterior,
            "base_parameters": {
                **structure,
                "condition_random": structure["condition"],
                "condition": self.condition,
                "parameters": base,
            },
            "gauges": gauges,
            "excitation": {
                "what": "factor by which a motion would shrink a standard deviation, each under its best motion",
                "tried": None if self.tried is None else {e.name: e.words for e in self.tried},
                "gains": self.gains,
            },
            "advice": list(self.advice),
        }


def identifiability(
    tracker: Tracker,
    estimate: Estimate,
    progress: Progress | None = None,
    *,
    motions: bool = True,
    structure: Structure | None = None,
) -> Identifiability:
    """Posterior of a trial's constants against their prior, and movements that would identify more.

    Args:
        tracker, estimate: as `Estimator.track` gave them.
        progress: called with (motions tried, in all).
        motions: whether to try any; all else follows from the estimate and the model alone.
        structure: `structure_of` the tracker or the one before the estimate, where that has been looked at.
    """
    structure, bench = structure or structure_of(tracker), Bench(tracker, estimate)
    shares = {p.name: share for p in estimate.parameters if (share := share_of(p)) is not None}
    tried: list[Excitation] | None = None
    gains: dict[str, dict[str, float]] = {}
    if motions:
        now, tried = bench.try_all(progress)
        ended = np.sqrt(np.diag(estimate.data["final_covariance"].values))  # by the filter's own noise, as the bench
        gains = gains_of(bench.measured.names, ended, now, tried, shares)
    states = bench.states(bench.trial)
    return Identifiability(
        structure=structure,
        condition=base_of(bench.measured, states[:: max(1, len(states) // _MOST_FRAMES)]).condition,
        base=_base_posterior(structure, tracker.noise, estimate),
        posterior=posterior_figures(estimate),
        tried=None if tried is None else tuple(tried),
        gains=gains,
        advice=tuple(advice_in_words(bench, tried, gains, shares, structure.alone)),
    )


def _base_posterior(structure: Structure, noise: Noise, estimate: Estimate) -> tuple[BasePosterior, ...]:
    base, over = structure.base, list(structure.base.over)
    values = base.K @ estimate.data["state"].isel(time=-1).sel(element=over).values
    root = np.sqrt(variance_scales(over, noise))  # by the declared variances, as the constants' own deviations
    prior, after = (
        base_spread(
            base.K, estimate.data[f"{when}_covariance"].sel(element=over, element_=over).values / np.outer(root, root)
        )
        for when in ("initial", "final")
    )
    return tuple(
        BasePosterior(*entry[:2], *(float(number) for number in entry[2:]))
        for entry in zip(base.names, structure.base_in_words, values, prior, after, strict=True)
    )
