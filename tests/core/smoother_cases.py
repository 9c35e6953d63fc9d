"""Trials for the smoother's tests, with all blocks of the state, and the linear problem that a filter made of them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from oracle.filter import carried_to_origin
from oracle.smoother import Frame, transition
from oracle.state import Layout

from core.bridge import to_core
from core.random_models import Trial, settings, trial
from dynakin import _core

TISSUE_SD, TISSUE_S = 0.01, 0.5
PLATE_SD, PLATE_S = 3.0, 0.7


@dataclass
class Case:
    model: _core.Model
    data: Trial
    options: dict[str, Any]

    def filter(self, chunk_rows: int = 28, **changes: Any) -> _core.Filter:
        options = self.options | {"chunk_rows": chunk_rows} | changes
        return _core.Filter(self.model, _core.FilterSettings(**options), self.data.x0, self.data.P0)

    def smoothed(self, frames: int | None = None, stretch: int = 0, **changes: Any) -> dict[str, NDArray]:
        d = self.data
        return self.filter(**changes).run_smoothed(
            d.time[:frames], d.markers[:frames], d.wrench[:frames], output_sd=True, stretch=stretch
        )


def case(
    spec: Any, seed: int, frames: int, *, states: str = "", delay: bool = False, bounds: bool = False, **changes: Any
) -> Case:
    """A trial with gaps and uneven steps.

    ``states``: "all" adds soft tissue under every other marker and the plates' errors, and takes white jerk.
    """
    data = trial(spec, seed, frames)
    options = settings(spec, seed, bounds=bounds) | {"constraint": "none"}
    core = to_core(spec)
    if states == "all":
        markers = core.markers
        for marker in markers[::2]:
            marker.soft_tissue = list(marker.estimated)
        core.markers = markers
        core.wrench_offset = [bool(m) for m in spec.wrench_measured]
        core.wrench_delay = delay
    model = _core.Model(core)
    names = list(model.layout.names)
    there = [names.index(name) for name in Layout(spec).names]

    def carried(values: NDArray, otherwise: NDArray | float) -> NDArray:
        out = np.zeros(len(names)) + otherwise
        out[there] = values
        return out

    tissue = np.array([name.startswith("soft_tissue/") for name in names])
    plates = np.array([name.startswith("plates/") and name != "plates/delay" for name in names])
    late = np.array([name == "plates/delay" for name in names])
    for key, otherwise in (("process_variance", 0.0), ("lower", -np.inf), ("upper", np.inf)):
        options[key] = carried(options[key], otherwise)
    added_sd = TISSUE_SD * tissue + PLATE_SD * plates + 0.005 * late
    sd = carried(np.sqrt(np.diag(data.P0)), added_sd)
    data = replace(data, x0=carried(data.x0, 0.0), P0=np.diag(sd**2))
    options["decay_rate"] = tissue / TISSUE_S + plates / PLATE_S
    options["process_density"] = 2.0 * added_sd**2 * options["decay_rate"]
    if states == "all":
        offset, size = model.layout.blocks["accelerations"]
        options["process_variance"] = np.zeros(len(names))
        options["process_density"][offset : offset + size] = 100.0
    return Case(model, data, options | changes)


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
    """The filter step by step; linearised, like the filter, at its own predictions (without a delay of the plates)."""
    f, d = case.filter(**changes), case.data
    before, after, frames, reports = [], [], [], []
    for k in range(len(d.time)):
        dt = d.time[k] - d.time[k - 1] if k else 0.0
        if k:
            f.predict(dt)
        before.append((f.state, f.covariance))
        frames.append(linearised(case, f.state, k, dt))
        reports.append(f.update(d.markers[k], d.wrench[k]))
        after.append((f.state, f.covariance))
    return Walk(*(np.array(a) for pairs in (before, after) for a in zip(*pairs, strict=True)), frames, reports)


def linearised(case: Case, x: NDArray, k: int, dt: float) -> Frame:
    """F, Q of the step to frame k and H, R, z of what it measures, linear about x."""
    model, o = case.model, case.options
    spec = model.spec
    n_free = model.layout.blocks["coordinates"][1]
    F, Q = transition(n_free, o["decay_rate"], o["process_density"], dt)
    Q = Q + np.diag(o["process_variance"])
    J = _core.marker_jacobian(model, x)
    shown = _core.marker_positions(model, x)
    H, R, v = [], [], []
    for m, marker in enumerate(spec.markers):
        axes = np.flatnonzero(marker.measured)
        if np.isnan(case.data.markers[k, m, axes]).any():
            continue
        H += [J[3 * m + a] for a in axes]
        R.append(np.eye(len(axes)) * o["marker_variance"][m])
        v += list((case.data.markers[k, m] - shown[m])[axes])
    used = np.array(spec.wrench_measured) & ~np.isnan(case.data.wrench[k])
    JW, expected = _core.wrench_jacobian(model, x), _core.wrench(model, x)
    names = list(model.layout.names)
    for c, component in enumerate(("fx", "fy", "fz", "mx", "my", "mz")):
        if f"plates/{component}" in names:
            JW[c, names.index(f"plates/{component}")] = 1.0
            expected[c] += x[names.index(f"plates/{component}")]
    H += list(JW[used])
    R.append(carried_to_origin(o["wrench_covariance"], o["reference_point"])[np.ix_(used, used)])
    v += list((case.data.wrench[k] - expected)[used])
    if o["total_mass"] is not None:
        H.append(np.array([float(n.startswith("inertia/") and n.endswith("/mass")) for n in names]))
        R.append(np.array([[o["total_mass_variance"]]]))
        v.append(o["total_mass"] - _core.total_mass(model, x))
    H = np.array(H).reshape(-1, len(x))
    block, at = np.zeros((len(v), len(v))), 0
    for part in R:
        block[at : at + len(part), at : at + len(part)] = part
        at += len(part)
    return Frame(F, Q, H, block, np.array(v) + H @ x)
