"""What the filter measures (5), h(x) = [markers; wrench; total mass], and its complex-step Jacobian."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from support.oracle import mechanics
from support.oracle.state import Layout, unpack

COMPLEX_STEP = 1e-30


def _kinematics(layout: Layout, x: NDArray, late: bool = False) -> tuple:
    """``late``: as it was a delay of the plates ago, at constant acceleration."""
    values = unpack(layout, x)
    if late:
        d = values.delay[..., None]
        values.q, values.qd = values.q - d * values.qd + d**2 / 2 * values.qdd, values.qd - d * values.qdd
    kin = mechanics.kinematics(layout.spec, values.q, values.qd, values.qdd, values.parameters)
    return values, kin


def marker_positions(layout: Layout, x: NDArray) -> NDArray:
    """(..., M, 3) m, ground frame."""
    values, kin = _kinematics(layout, x)
    return mechanics.marker_positions(layout.spec, kin, values.markers + values.soft_tissue)


def wrench(layout: Layout, x: NDArray) -> NDArray:
    """(..., 6) N, N m about the ground's origin, ground on person."""
    values, kin = _kinematics(layout, x)
    return mechanics.total_wrench(layout.spec, kin, values.inertia)


def plates(layout: Layout, x: NDArray, effects: NDArray | None = None) -> NDArray:
    """(..., 6) N, N m: what the plates should say, the body's wrench of a delay ago and their slow error, less what the
    contacts' states add to what was expected of them: effects (6, 6 C), without them nothing."""
    values, kin = _kinematics(layout, x, late=True)
    moved = np.cross(layout.spec.wrench_offset_point, values.offset[..., :3])
    slow = values.offset + np.concatenate([np.zeros_like(moved), moved], axis=-1)
    said = mechanics.total_wrench(layout.spec, kin, values.inertia) + slow
    if effects is None:
        return said
    return said - values.contacts.reshape(*x.shape[:-1], -1) @ np.swapaxes(effects, -1, -2)


def joint_moments(layout: Layout, x: NDArray) -> NDArray:
    """(..., coordinates) N m or N."""
    values, kin = _kinematics(layout, x)
    return mechanics.joint_moments(layout.spec, kin, values.inertia)


def total_mass(layout: Layout, x: NDArray) -> NDArray:
    """(...) kg."""
    return unpack(layout, x).inertia[..., :, 0].sum(axis=-1)


def everything(layout: Layout, x: NDArray, effects: NDArray | None = None) -> NDArray:
    """[3 M marker numbers, 6 of the plates, total mass], (..., 3 M + 7), measured or not."""
    markers = marker_positions(layout, x)
    flat = markers.reshape(*markers.shape[:-2], 3 * markers.shape[-2])
    return np.concatenate([flat, plates(layout, x, effects), total_mass(layout, x)[..., None]], axis=-1)


def value_and_jacobian(layout: Layout, x: NDArray, effects: NDArray | None = None) -> tuple[NDArray, NDArray]:
    """``everything`` at x (n,) and its (rows, n) Jacobian: one batch of n complex steps."""
    f = jacobian(lambda z: everything(layout, z, effects), x)
    return everything(layout, x, effects), f


def jacobian(function: Callable[[NDArray], NDArray], x: NDArray) -> NDArray:
    """(rows, n) Jacobian of a batched function of (..., n) at x (n,), df = Im f(x + i h) / h."""
    x = np.asarray(x, float)
    if x.size == 0:
        return np.zeros((np.size(function(x)), 0))
    steps = function(x + 1j * COMPLEX_STEP * np.eye(x.size))
    return np.ascontiguousarray(steps.reshape(x.size, -1).imag.T) / COMPLEX_STEP
