"""The joint moments' derivatives equal complex steps of the oracle and central differences of the core."""

from __future__ import annotations

import numpy as np
import pytest

from dynakin.bindings import _core
from support.core.bridge import close, model_of
from support.core.differences import BLOCKS, central_differences, compare
from support.core.random_models import planar_model, random_state, spatial_model, with_functions, with_slow_errors
from support.oracle import measurement, mechanics
from support.oracle.state import Layout, unpack

MODELS = [planar_model(s) for s in range(6)] + [planar_model(50, n_segments=7)] + [spatial_model(s) for s in range(30)]
MODELS += [with_functions(spatial_model(s), s) for s in range(30, 40)]
MODELS += [with_slow_errors(spec, k) for k, spec in enumerate(MODELS[::8])]


def moments_less_external(layout, x, external):
    """(..., coordinates) of the oracle; wrenches (S, 6) about the ground's origin do their power on each coordinate."""
    spec, values = layout.spec, unpack(layout, x)
    result = measurement.joint_moments(layout, x)
    for j in range(len(spec.coordinates)):
        unit = np.zeros_like(values.q)
        unit[..., j] = 1.0
        moving = mechanics.kinematics(spec, values.q, unit, 0 * unit, values.parameters)
        for body, applied in zip(moving.segments, external, strict=True):
            about_segment = applied[3:] - mechanics.cross(body.o, applied[:3] + 0 * body.o)
            result[..., j] -= mechanics.dot(applied[:3], body.v) + mechanics.dot(about_segment, body.w)
    return result


def test_the_random_models_hold_what_they_should():
    axes = [(spec, a) for spec in MODELS for s in spec.segments for a in s.axes]
    fixed = {(spec.name, p.name) for spec in MODELS for p in spec.parameters if not p.estimated}
    locked = {(spec.name, c.name) for spec in MODELS for c in spec.coordinates if c.locked}
    assert any(a.scale and (spec.name, a.scale) in fixed for spec, a in axes)
    assert any(a.scale and (spec.name, a.scale) not in fixed for spec, a in axes)
    assert any((spec.name, a.coordinate) in locked for spec, a in axes)
    kinds = {f.kind for _, a in axes for f in a.functions}
    assert kinds == {"polynomial", "spline", "piecewise_linear"}
    assert any(len(a.functions) > 1 and a.scale for _, a in axes)
    across = [[{a.coordinate for a in s.axes} for s in spec.segments] for spec in MODELS]
    assert any(a & b for chains in across for k, a in enumerate(chains) for b in chains[k + 1 :])


@pytest.mark.parametrize("spec", MODELS, ids=lambda s: s.name)
def test_equals_complex_steps_and_differences(spec):
    model, layout = model_of(spec), Layout(spec)
    rng = np.random.default_rng(31)
    for _ in range(3):
        x = random_state(layout, rng)
        jacobian = _core.moment_jacobian(model, x)
        exact = measurement.jacobian(lambda z: measurement.joint_moments(layout, z), x)
        differences = central_differences(lambda z: _core.joint_moments(model, z), x)
        size = max(1.0, np.abs(_core.joint_moments(model, x)).max())
        assert jacobian.shape == (len(spec.coordinates), layout.size)
        for name in BLOCKS:
            b = layout.block(name)
            compare(name, jacobian[:, b], exact[:, b], 1e-11, 1.0)
            compare(name, jacobian[:, b], differences[:, b], 1e-6, size)


@pytest.mark.parametrize("spec", MODELS, ids=lambda s: s.name)
def test_external_wrenches_stay_while_the_axes_move(spec):
    model, layout = model_of(spec), Layout(spec)
    rng = np.random.default_rng(32)
    x = random_state(layout, rng)
    external = rng.normal(size=(len(spec.segments), 6)) * 100
    close(_core.joint_moments(model, x, external), moments_less_external(layout, x, external), 1e-11)
    jacobian = _core.moment_jacobian(model, x, external)
    exact = measurement.jacobian(lambda z: moments_less_external(layout, z, external), x)
    for name in BLOCKS:
        compare(name, jacobian[:, layout.block(name)], exact[:, layout.block(name)], 1e-11, 1.0)
    np.testing.assert_array_equal(_core.moment_jacobian(model, x, 0 * external), _core.moment_jacobian(model, x))


@pytest.mark.parametrize("spec", MODELS[::4], ids=lambda s: s.name)
def test_the_mass_matrix_is_symmetric_and_not_negative(spec):
    """d moments / d accelerations, of the free coordinates, is twice the kinetic energy's quadratic form."""
    model, layout = model_of(spec), Layout(spec)
    jacobian = _core.moment_jacobian(model, random_state(layout, np.random.default_rng(33)))
    free = [i for i, c in enumerate(spec.coordinates) if not c.locked]
    mass = jacobian[np.ix_(free, np.arange(layout.size)[layout.block("accelerations")])]
    close(mass, mass.T, 1e-12)
    assert np.linalg.eigvalsh((mass + mass.T) / 2).min() > -1e-10 * np.abs(mass).max()


@pytest.mark.parametrize("spec", MODELS[::4], ids=lambda s: s.name)
def test_moments_do_not_depend_on_markers_and_are_linear_in_inertia(spec):
    model, layout = model_of(spec), Layout(spec)
    x = random_state(layout, np.random.default_rng(34))
    jacobian, inertia = _core.moment_jacobian(model, x), layout.block("inertia")
    assert not jacobian[:, layout.block("markers")].any()
    moved = x.copy()
    moved[inertia] += np.random.default_rng(35).normal(size=moved[inertia].size)
    difference = _core.joint_moments(model, moved) - _core.joint_moments(model, x)
    expected = jacobian[:, inertia] @ (moved - x)[inertia]
    np.testing.assert_allclose(difference, expected, rtol=0, atol=1e-10 * max(1, np.abs(expected).max(initial=0)))


@pytest.mark.parametrize("shape", [(1, 6), (7, 3)])
def test_external_wrenches_of_another_shape_are_an_error(shape):
    model = model_of(planar_model(50, n_segments=7))
    with pytest.raises(ValueError, match=r"\(7, 6\)"):
        _core.moment_jacobian(model, model.initial_state(), np.zeros(shape))
