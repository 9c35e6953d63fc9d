"""What one live step gives, and how sure it is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

import dynakin._core as _core

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class StepEstimate:
    """One frame's estimate: all coordinates of the model in order, and how well the sample was expected."""

    time_s: float
    coordinates: Array  # (C,) rad or m
    speeds: Array  # (C,)
    accelerations: Array  # (C,)
    moments: Array  # (C,) N m or N; of a floating model without feet those without ground reaction
    wrench: Array  # (6,) N, N m, about the model's ground origin
    markers: Array  # (M, 3) m, ground frame
    report: _core.StepReport | None  # None of a frame that was smoothed afterwards


def step_estimate(
    model: _core.Model,
    time_s: float,
    x: Array,
    report: _core.StepReport | None,
    feet: _core.FootLoads | None = None,
) -> StepEstimate:
    """Everything that a state x (n,) says of its frame; with one frame of feet the moments that these leave."""
    q, qd, qdd = _core.coordinates(model, x)
    moments = _core.joint_moments(model, x) if feet is None else _core.contact_moments(model, x, feet)["moments"]
    return StepEstimate(
        time_s,
        q,
        qd,
        qdd,
        moments,
        _core.wrench(model, x),
        _core.marker_positions(model, x),
        report,
    )


def deviations_of(
    model: _core.Model, x: Array, covariance: Array, feet: _core.FootLoads | None = None
) -> dict[str, Array]:
    """Standard deviations of a state's outputs: J P J' for moments and wrench.

    Args:
        x: (n,). covariance: (n, n). feet: one frame, whose wrenches the moments come from; NaN where these are unknown.

    Returns:
        coordinates, speeds, accelerations, moments (C,), 0 where a coordinate is locked (not its moment); wrench (6,).
    """
    variance = np.diagonal(covariance)
    free = [k for k, coordinate in enumerate(model.spec.coordinates) if not coordinate.locked]
    found: dict[str, Array] = {}
    for name in ("coordinates", "speeds", "accelerations"):
        offset, size = model.layout.blocks[name]
        found[name] = np.zeros(len(model.coordinate_names))
        found[name][free] = np.sqrt(variance[offset : offset + size])
    if feet is None:
        found["moments"] = _propagated(_core.moment_jacobian(model, x), covariance)
    else:
        found["moments"] = _core.contact_moments(model, x, feet, 0, covariance)["moments_sd"]
    found["wrench"] = _propagated(_core.wrench_jacobian(model, x), covariance)
    return found


def _propagated(jacobian: Array, covariance: Array) -> Array:
    used = np.flatnonzero(jacobian.any(axis=0))
    part = jacobian[:, used]
    return np.asarray(np.sqrt(((part @ covariance[np.ix_(used, used)]) * part).sum(axis=1)))
