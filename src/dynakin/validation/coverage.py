"""Does the filter know how wrong it is? Errors against simulated truth over the standard deviations that it reports.

The covariances between elements are not stored over time, so this is not the NEES of a block, e' P^-1 e, but the mean
of its elements' squared errors over their variances. Both have the mean 1 for a filter whose covariances are right; the
second does not see a wrong correlation.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
import scipy

from dynakin.arrays import Array, rms
from dynakin.results.measures.consistency import CONSISTENT, INSIDE, Judgement, judge, mean_interval_95
from dynakin.results.records import Parameter

if TYPE_CHECKING:
    import xarray as xr


Z_95 = 1.959964  # a standard normal number lies within in 95 % of cases

# Blocks of `Estimate.data` that are judged wherever their standard deviation is given.
BLOCKS = ("coordinates", "speeds", "accelerations", "moments")


@dataclass(frozen=True)
class Coverage:
    """How the errors of one block compare with the filter's own standard deviations.

    Attributes:
        block: which.
        names: its C elements.
        mean_square: mean squared z over frames and elements, z = error over standard deviation: 1 is right.
        dof: independent values of z in it: frames next to each other have nearly the same error (see `independent`).
        interval_95: where ``mean_square`` lies in 95 % of runs if the standard deviations are right and elements are
            independent of each other.
        inside: (C,) share of the frames in which the truth lies in the 95 % interval.
        inside_about_mean: (C,) the same with each element's mean error taken off (an angle's zero, mostly); None of a
            single frame.
        sd_over_error: (C,) RMS standard deviation over RMS error.
        judgement: overconfident, consistent or conservative.
    """

    block: str
    names: tuple[str, ...]
    mean_square: float
    dof: float
    interval_95: tuple[float, float]
    inside: Array
    inside_about_mean: Array | None
    sd_over_error: Array
    judgement: Judgement

    @property
    def pooled(self) -> float:
        """Share of all frames and elements that hold the truth in their 95 % interval."""
        return float(np.mean(self.inside))

    @property
    def pooled_about_mean(self) -> float | None:
        """The same with mean errors taken off."""
        return None if self.inside_about_mean is None else float(np.mean(self.inside_about_mean))

    @property
    def factor(self) -> float:
        """By how many times the standard deviations are too small (overconfident) or too large, above 1."""
        return float(np.sqrt(max(self.mean_square, 1.0 / max(self.mean_square, 1e-300))))

    @property
    def seldom(self) -> dict[str, float]:
        """Share of the frames of each element that has the truth in less than `INSIDE` of them."""
        every = dict(zip(self.names, self.inside.tolist(), strict=True))
        return {name: share for name, share in every.items() if share < INSIDE and self.inside_about_mean is not None}

    def sizes(self) -> str:
        """What the judgement says of the standard deviations: `20 times too large`, `right to a factor of 1.3`."""
        if self.judgement == "consistent":
            return f"right to a factor of {self.factor:.1f}"
        if self.judgement == "overconfident" and self.mean_square <= CONSISTENT[1]:
            return "too small for part of it"
        return f"{self.factor:.2g} times too {'small' if self.judgement == 'overconfident' else 'large'}"

    def verdict(self) -> str:
        """One sentence."""
        about_mean = self.pooled_about_mean
        more = "" if about_mean is None else f" ({100.0 * about_mean:.0f} % with mean offsets removed)"
        return (
            f"{self.block.capitalize()}: {self.judgement}. The truth is in the 95 % interval in "
            f"{100.0 * self.pooled:.0f} % of cases{more}; the standard deviations are {self.sizes()}."
        )


def block_coverage(data: xr.Dataset, truth: xr.Dataset, window: npt.NDArray[np.bool_]) -> list[Coverage]:
    """Each block of `BLOCKS` that has a standard deviation, over the frames ``window`` (T,).

    Args:
        data: as `Estimate.data`. truth: as `dynakin.simulation.Truth.data`, at the same frames.
    """
    found = []
    for block in BLOCKS:
        if block not in truth or f"{block}_sd" not in data:
            continue
        names = [str(name) for name in truth["coordinate"].values]
        given, sd, true = (
            dataset[name].sel(coordinate=names).transpose("time", "coordinate").values[window]
            for dataset, name in ((data, block), (data, f"{block}_sd"), (truth, block))
        )
        free = np.flatnonzero((sd > 0.0).all(axis=0))  # a locked coordinate claims nothing
        if len(free):
            free_names = [names[k] for k in free]
            found.append(coverage(block, free_names, (given - true)[:, free], sd[:, free]))
    return found


def parameter_coverage(parameters: Sequence[Parameter], truth: Mapping[str, float]) -> list[Coverage]:
    """Estimated lengths, and inertial numbers, at the end of the run: one frame.

    Args:
        truth: by the names of the filter's state, as `dynakin.simulation.Truth.parameters`.
    """
    found = []
    for kind, title in (("length", "lengths"), ("inertia", "inertial numbers")):
        group = [p for p in parameters if p.kind == kind and p.estimated and p.sd > 0.0 and p.name in truth]
        if group:
            error = np.array([[p.value - truth[p.name] for p in group]])
            sd = np.array([[p.sd for p in group]])
            found.append(coverage(title, [p.name for p in group], error, sd))
    return found


def coverage(block: str, names: Sequence[str], error: Array, sd: Array, *, own_model: bool = False) -> Coverage:
    """Judge errors by the standard deviations given with them.

    Args:
        error, sd: (T, C) estimate less truth, and one standard deviation (above 0), in the same unit.
        own_model: the data were drawn from the filter's own model, so the chi-square interval is strict; otherwise the
            verdict allows `CONSISTENT` besides (standard deviations of 0.5 to 2.5 times the errors), and is
            overconfident as well where less than `INSIDE` of the truth is in the 95 % interval, by more than chance.
    """
    z = error / sd
    about_mean = (error - error.mean(axis=0)) / sd
    mean_square, dof = float(np.mean(z**2)), float(sum(independent(z[:, k]) for k in range(z.shape[1])))
    low, high = mean_interval_95(dof)
    band = (low, high) if own_model else (min(low, CONSISTENT[0]), max(high, CONSISTENT[1]))
    inside = np.mean(np.abs(z) <= Z_95, axis=0)
    judgement = judge(mean_square, band)
    if not own_model and _too_seldom(float(inside.mean()), dof):
        judgement = "overconfident"
    rms_error, rms_sd = rms(error, axis=0), rms(sd, axis=0)
    with np.errstate(divide="ignore"):
        sd_over_error = rms_sd / rms_error
    return Coverage(
        block,
        tuple(names),
        mean_square,
        dof,
        (low, high),
        inside,
        np.mean(np.abs(about_mean) <= Z_95, axis=0) if len(z) > 1 else None,
        sd_over_error,
        judgement,
    )


def _too_seldom(inside: float, dof: float) -> bool:
    """Whether the truth is in less than `INSIDE` of the 95 % intervals, and 97.5 % of runs of ``dof`` independent
    values would have more."""
    return inside < INSIDE and float(scipy.stats.binom.cdf(np.floor(inside * dof), np.floor(dof), 0.95)) < 0.025


def independent(z: Array) -> float:
    """How many independent values a series (T,) is worth to the mean of its squares: T / (1 + 2 sum r_k²).

    r_k: autocorrelation at lag k about zero (a constant error repeats itself), up to its first zero; the squares of
    Gaussian numbers of correlation r have the correlation r².
    """
    frames = len(z)
    power = float(np.sum(z**2))
    if frames < 2 or power == 0.0:
        return 1.0
    size = 1 << (2 * frames - 1).bit_length()
    spectrum = np.abs(np.fft.rfft(z, size)) ** 2
    r = np.fft.irfft(spectrum, size)[1:frames] / power
    below = np.flatnonzero(r <= 0.0)
    r = r[: below[0]] if len(below) else r
    return max(1.0, frames / (1.0 + 2.0 * float(np.sum(r**2))))
