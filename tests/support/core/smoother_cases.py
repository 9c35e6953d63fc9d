"""Trials for the smoother's tests, and the linear problem that a filter made of them."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dynakin.bindings import _core
from support.core.bridge import filter_of, model_of
from support.core.random_models import (
    Trial,
    continuous,
    planar_model,
    settings,
    spatial_model,
    trial,
    with_contacts,
    with_slow_errors,
)
from support.oracle import measurement, process, sensors
from support.oracle.smoother import Frame
from support.oracle.state import Layout


@dataclass
class Case:
    spec: Any
    data: Trial
    options: dict[str, Any]

    @property
    def model(self) -> _core.Model:
        return model_of(self.spec)

    def filter(self, **changes: Any) -> _core.Filter:
        return filter_of(self.spec, self.options | changes, self.data.x0, self.data.P0)

    def lagged(self, lag: int) -> dict[str, NDArray]:
        return self.data.run(self.filter().run_lagged, lag=lag)

    def smoothed(self, frames: int | None = None, stretch: int = 0, **changes: Any) -> dict[str, NDArray]:
        return self.data.first(frames).run(self.filter(**changes).run_smoothed, outputs=True, stretch=stretch)


def case(
    spec: Any, seed: int, frames: int, *, states: str = "", delay: bool = False, bounds: bool = False, **changes: Any
) -> Case:
    """A trial with gaps and uneven steps.

    ``states``: "all" adds soft tissue and the plates' errors, and takes white jerk; "contacts" those of contacts too.
    """
    if states:
        spec = with_slow_errors(spec, seed, delay)
        spec = with_contacts(spec) if states == "contacts" else spec
        options = continuous(spec, seed)
    else:
        options = settings(spec, seed)
        nothing = np.zeros(Layout(spec).size)
        options |= {"constraint": "none", "process_density": nothing, "decay_rate": nothing}
    if not bounds:
        n = Layout(spec).size
        options |= {"lower": np.full(n, -np.inf), "upper": np.full(n, np.inf)}
    return Case(spec, trial(spec, seed, frames), options | changes)


@dataclass
class Walk:
    """What a filter had in hand before and after each update, and the linear problem that it solved."""

    x_predicted: NDArray
    P_predicted: NDArray
    x: NDArray
    P: NDArray
    frames: list[Frame]
    reports: list[_core.StepReport]


def walk(case: Case, **changes: Any) -> Walk:
    """The filter step by step; linearised, like the filter, at its own predictions."""
    f, d = case.filter(**changes), case.data
    before, after, frames, reports = [], [], [], []
    for k in range(len(d.time)):
        dt = d.time[k] - d.time[k - 1] if k else 0.0
        if k:
            f.predict(dt)
        before.append((f.state, f.covariance))
        frames.append(linearised(case, f.state, k, dt))
        reports.append(f.update(*d.at(k)))
        after.append((f.state, f.covariance))
    (x_predicted, P_predicted), (x, P) = (map(np.array, zip(*pairs, strict=True)) for pairs in (before, after))
    return Walk(x_predicted, P_predicted, x, P, frames, reports)


def linearised(case: Case, x: NDArray, k: int, dt: float) -> Frame:
    """F, Q of the step to frame k and H, R, z of what it measures, linear about x."""
    layout, o = Layout(case.spec), case.options
    F, Q = process.transition(layout, o["process_density"], o["decay_rate"], dt)
    given = {name: values[k] for name, values in case.data.given.items()}
    h, H = measurement.value_and_jacobian(layout, x, given.get("wrench_effects"))
    markers, wrench = case.data.markers[k], case.data.wrench[k]
    z, R, present = sensors.rows(case.spec, SimpleNamespace(**o), markers, wrench, given.get("wrench_covariance"))
    z = (z - h + H @ x)[present]
    return Frame(F, Q + np.diag(o["process_variance"]), H[present], R[np.ix_(present, present)], z)


def deviations(covariances):
    return np.sqrt(np.diagonal(covariances, axis1=1, axis2=2))


def assert_equal(out, x, P, tolerance):
    sd = deviations(P)
    np.testing.assert_array_less(np.abs(out["smoothed_state"] - x) / sd, tolerance)
    np.testing.assert_array_less(np.abs(out["smoothed_state_sd"] / sd - 1.0), tolerance)


BOUNDED = {
    "planar": lambda: case(planar_model(50, n_segments=7), 31, 60, bounds=True, constraint="projection"),
    "spatial": lambda: case(spatial_model(6), 31, 60, bounds=True, constraint="projection"),
    "all blocks": lambda: case(
        planar_model(50, n_segments=4), 33, 60, bounds=True, constraint="projection", states="all"
    ),
}


def lost_and_found():
    """Markers gone for 0.3 s while the body moves on; back, they lie too far off to be believed without a search."""
    sought = _core.RecoverySettings(blind_s=0.06, coordinate_sd=0.01, speed_sd=2.0, acceleration_sd=20.0)
    c = case(planar_model(50, n_segments=4), 31, 80, states="all", recovery=sought, iterate_beyond=0.1)
    c.options |= {"marker_gate": [4.0] * 6, "wrench_needs_markers": True}
    c.data.markers[30:60] = np.nan
    return c


def impact():
    """At rest until the motion goes on at six times its speed: the filter expects an impact, and its noise grows."""
    sought = _core.RecoverySettings(blind_s=0.2, fit_m=1.0, coordinate_sd=0.01)
    c = case(planar_model(50, n_segments=9), 31, 40, states="all", recovery=sought)
    c.options |= {"marker_gate": [6.0] * 6}
    c.data.markers[:20] = c.data.markers[20]
    c.data.markers[20:] = c.data.markers[np.minimum(20 + 6 * np.arange(20), 39)]
    c.data.wrench[:] = np.nan
    return c
