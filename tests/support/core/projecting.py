"""One projection through a filter in which nothing is measured: x0 and P0 in, the constrained state out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from support.core.bridge import filter_of
from support.core.random_models import settings
from support.oracle.spec import Spec
from support.oracle.state import Layout


@dataclass
class Projected:
    x: NDArray
    P: NDArray
    active: int
    met: bool
    status: str


def project(spec: Spec, x: NDArray, P: NDArray, **changes) -> Projected:
    """``changes`` of the settings: lower, upper, equality, equality_value."""
    n = Layout(spec).size
    unbounded = {"lower": np.full(n, -np.inf), "upper": np.full(n, np.inf), "total_mass": None}
    options = settings(spec, 1) | {"constraint": "projection"} | unbounded | changes
    f = filter_of(spec, options, x, P)
    report = f.update(np.full((len(spec.markers), 3), np.nan), np.full(6, np.nan))
    return Projected(f.state, f.covariance, report.constrained, report.constraints_met, report.status)


def covariance(n: int, rng: Generator, low: float = -8.0, high: float = 4.0, common: int = 0) -> NDArray:
    """Variances of 10**low to 10**high, correlated."""
    root = rng.normal(size=(n, common or 2 * n))
    P = root @ root.T + 0.01 * np.eye(n)
    sd = np.sqrt(10 ** rng.uniform(low, high, n) / np.diag(P))
    return P * np.outer(sd, sd)
