"""Every derivative block equals central differences of the core and complex steps of the oracle."""

from __future__ import annotations

import numpy as np
import pytest

from dynakin.bindings import _core
from support.core.bridge import model_of
from support.core.differences import BLOCKS, central_differences, compare
from support.core.random_models import (
    planar_model,
    random_state,
    spatial_model,
    with_contacts,
    with_functions,
    with_slow_errors,
)
from support.oracle import measurement
from support.oracle.state import Layout

MODELS = [planar_model(s) for s in range(5)] + [spatial_model(s) for s in range(16)]
MODELS += [with_functions(spatial_model(s), s) for s in range(16, 26)]
SLOW = [with_slow_errors(spec, k) for k, spec in enumerate(MODELS)]
SLOW += [with_contacts(SLOW[2]), with_contacts(SLOW[8], ("right",))]
OFFSETS_ONLY = with_slow_errors(planar_model(3), 7, delay=False)


@pytest.mark.parametrize("spec", [*MODELS, *SLOW[::3]], ids=lambda s: s.name)
def test_derivatives(spec):
    model, layout = model_of(spec), Layout(spec)
    rng = np.random.default_rng(21)
    for _ in range(2):
        x = random_state(layout, rng)
        markers, force = _core.marker_jacobian(model, x), _core.wrench_jacobian(model, x)
        size = max(1.0, np.abs(_core.wrench(model, x)).max())
        marker_differences = central_differences(lambda z: _core.marker_positions(model, z), x)
        wrench_differences = central_differences(lambda z: _core.wrench(model, z), x)
        exact = np.vstack(
            [
                measurement.jacobian(lambda z: measurement.marker_positions(layout, z), x),
                measurement.jacobian(lambda z: measurement.wrench(layout, z), x),
            ]
        )
        for block in BLOCKS:
            b = layout.block(block)
            compare(f"markers/{block}", markers[:, b], marker_differences[:, b], 1e-6, 1.0)
            compare(f"markers/{block}", markers[:, b], exact[:-6, b], 1e-11, 1.0)
            compare(f"wrench/{block}", force[:, b], wrench_differences[:, b], 1e-6, size)
            compare(f"wrench/{block}", force[:, b], exact[-6:, b], 1e-11, 1.0)


@pytest.mark.parametrize("spec", [*SLOW, OFFSETS_ONLY], ids=lambda s: s.name)
def test_derivatives_of_what_the_plates_say(spec):
    """All columns, those of the motion too: the plates' delay mixes them."""
    model, layout = model_of(spec), Layout(spec)
    rng = np.random.default_rng(25)
    seen = np.array(spec.wrench_measured)
    for _ in range(3):
        x = random_state(layout, rng)
        rows = _core.plates_jacobian(model, x)
        size = max(1.0, np.abs(_core.plates(model, x)).max())
        differences = central_differences(lambda z: _core.plates(model, z), x)[seen]
        exact = measurement.jacobian(lambda z: measurement.plates(layout, z), x)[seen]
        assert not rows[~seen].any()
        for block in BLOCKS:
            b = layout.block(block)
            compare(f"plates/{block}", rows[seen][:, b], differences[:, b], 1e-6, size)
            compare(f"plates/{block}", rows[seen][:, b], exact[:, b], 1e-11, 1.0)
    assert exact[:, layout.block("plates")].any()


def test_plates_without_delay_or_error_say_the_wrench():
    model, layout = model_of(MODELS[0]), Layout(MODELS[0])
    x = random_state(layout, np.random.default_rng(26))
    np.testing.assert_array_equal(_core.plates(model, x), _core.wrench(model, x))
    slow = model_of(SLOW[0])
    there = np.array([list(slow.layout.names).index(name) for name in layout.names])
    y = slow.initial_state()
    y[there] = x
    np.testing.assert_allclose(_core.plates(slow, y), _core.wrench(model, x), rtol=1e-14)
    np.testing.assert_array_equal(_core.wrench(slow, y), _core.wrench(model, x))


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
