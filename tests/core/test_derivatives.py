"""Every derivative block equals central differences of the core and complex steps of the oracle."""

from __future__ import annotations

import numpy as np
import pytest
from oracle import measurement
from oracle.state import Layout

from core.bridge import model_of
from core.random_models import planar_model, random_state, spatial_model
from dynakin import _core

MODELS = [planar_model(s) for s in range(5)] + [spatial_model(s) for s in range(16)]
BLOCKS = ("coordinates", "speeds", "accelerations", "lengths", "markers", "inertia")


def central_differences(function, x):
    """Steps of 1e-5: truncation about 1e-10, rounding about 1e-11 of the function's size."""
    columns = []
    for i in range(x.size):
        h = 1e-5 * max(1.0, abs(x[i]))
        plus, minus = x.copy(), x.copy()
        plus[i] += h
        minus[i] -= h
        columns.append((function(plus) - function(minus)).ravel() / (plus[i] - minus[i]))
    return np.array(columns).T


def compare(name, actual, expected, relative, scale):
    """``scale``: size of the quantity itself, below which a derivative is as good as zero."""
    assert actual.shape == expected.shape, name
    tolerance = relative * max(scale, np.abs(expected).max(initial=0.0))
    np.testing.assert_allclose(actual, expected, rtol=0, atol=tolerance, err_msg=name)


@pytest.mark.parametrize("spec", MODELS, ids=lambda s: s.name)
def test_derivatives(spec):
    model, layout = model_of(spec), Layout(spec)
    rng = np.random.default_rng(21)
    for _ in range(2):
        x = random_state(layout, rng)
        markers, force = _core.marker_jacobian(model, x), _core.wrench_jacobian(model, x)
        size = max(1.0, np.abs(_core.wrench(model, x)).max())
        marker_differences = central_differences(lambda z: _core.marker_positions(model, z), x)
        wrench_differences = central_differences(lambda z: _core.wrench(model, z), x)
        exact = measurement.value_and_jacobian(layout, x)[1][:-1]
        for block in BLOCKS:
            b = layout.block(block)
            compare(f"markers/{block}", markers[:, b], marker_differences[:, b], 1e-6, 1.0)
            compare(f"markers/{block}", markers[:, b], exact[:-6, b], 1e-11, 1.0)
            compare(f"wrench/{block}", force[:, b], wrench_differences[:, b], 1e-6, size)
            compare(f"wrench/{block}", force[:, b], exact[-6:, b], 1e-11, 1.0)


@pytest.mark.parametrize("spec", MODELS[::4], ids=lambda s: s.name)
def test_markers_do_not_depend_on_speeds_accelerations_inertia(spec):
    model, layout = model_of(spec), Layout(spec)
    jacobian = _core.marker_jacobian(model, random_state(layout, np.random.default_rng(22)))
    for block in ("speeds", "accelerations", "inertia"):
        assert not jacobian[:, layout.block(block)].any()


@pytest.mark.parametrize("spec", MODELS[::4], ids=lambda s: s.name)
def test_wrench_is_linear_in_inertia_and_free_of_markers(spec):
    model, layout = model_of(spec), Layout(spec)
    x = random_state(layout, np.random.default_rng(23))
    jacobian = _core.wrench_jacobian(model, x)
    assert not jacobian[:, layout.block("markers")].any()
    inertia = layout.block("inertia")
    moved = x.copy()
    moved[inertia] += np.random.default_rng(24).normal(size=layout.blocks["inertia"][1])
    difference = _core.wrench(model, moved) - _core.wrench(model, x)
    expected = jacobian[:, inertia] @ (moved - x)[inertia]
    np.testing.assert_allclose(difference, expected, rtol=0, atol=1e-10 * max(1, np.abs(expected).max(initial=0)))
