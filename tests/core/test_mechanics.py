"""Positions, wrench and joint moments of the core equal Pinocchio's and the oracle's."""

from __future__ import annotations

import numpy as np
import pytest

from dynakin.bindings import _core
from support.core.bridge import close, model_of
from support.core.random_models import planar_model, random_state, spatial_model, with_functions, with_slow_errors
from support.oracle import measurement
from support.oracle.state import Layout, unpack

PLANAR = [planar_model(s) for s in range(6)] + [planar_model(50, n_segments=7)]
SPATIAL = [spatial_model(s) for s in range(20)]
IDENTITY = [spatial_model(s, nonlinear=False) for s in range(100, 108)]
SLOW = [with_slow_errors(spec, k) for k, spec in enumerate(PLANAR[::3] + SPATIAL[::3])]
CURVED = [with_functions(spatial_model(s), s) for s in range(20, 28)]
MODELS = PLANAR + SPATIAL + IDENTITY + SLOW + CURVED


def test_the_random_models_hold_what_they_should():
    """Whoever changes the generator must not lose a kind of model by accident."""
    segments = [s for spec in MODELS for s in spec.segments]
    axes = [a for s in segments for a in s.axes]
    assert any(not s.axes for s in segments)
    assert any(len(s.axes) >= 3 for s in segments)
    assert any(len(s.lengths) >= 2 for s in segments)
    assert any(a.scale for a in axes)
    assert any(len(a.coefficients) >= 4 for a in axes)
    assert {a.kind for a in axes} == {"rotation", "translation"}
    assert any(c.locked for spec in MODELS for c in spec.coordinates)
    assert any(not p.estimated for spec in MODELS for p in spec.parameters)
    for what in ("parent", "length", "coordinate"):
        assert any(_repeats(spec, what) for spec in MODELS), what


def _repeats(spec, what):
    if what == "parent":
        names = [s.parent for s in spec.segments if s.parent != "ground"]
    elif what == "length":  # in two different joints
        names = [p for s in spec.segments for p in {t.parameter for t in s.lengths}]
    else:
        names = [a.coordinate for s in spec.segments for a in s.axes]
    return len(set(names)) < len(names)


@pytest.mark.parametrize("spec", MODELS, ids=lambda s: s.name)
def test_layout_equals_the_oracles(spec):
    model, layout = model_of(spec), Layout(spec)
    assert model.layout.size == layout.size
    assert list(model.layout.names) == layout.names
    assert {k: tuple(v) for k, v in model.layout.blocks.items()} == layout.blocks
    assert list(model.layout.blocks) == list(layout.blocks)
    assert model.coordinate_names == [c.name for c in spec.coordinates]
    assert model.marker_names == [m.name for m in spec.markers]
    assert model.segment_names == [s.name for s in spec.segments]
    np.testing.assert_array_equal(model.initial_state(), layout.initial_state())


@pytest.mark.parametrize("spec", MODELS, ids=lambda s: s.name)
def test_equals_pinocchio(spec):
    from support.oracle import pinocchio_tree

    model, layout = model_of(spec), Layout(spec)
    rng = np.random.default_rng(11)
    for _ in range(5):
        x = random_state(layout, rng)
        expected = pinocchio_tree.solve(spec, unpack(layout, x))
        rotations, origins = _core.segment_poses(model, x)
        close(rotations, expected["rotations"], 1e-12)
        close(origins, expected["origins"], 1e-9)
        close(_core.marker_positions(model, x), expected["markers"], 1e-9)
        close(_core.wrench(model, x), expected["wrench"], 1e-9)
        close(_core.joint_moments(model, x), expected["moments"], 1e-9)


@pytest.mark.parametrize("spec", MODELS, ids=lambda s: s.name)
def test_equals_the_oracle(spec):
    model, layout = model_of(spec), Layout(spec)
    rng = np.random.default_rng(12)
    for _ in range(10):
        x = random_state(layout, rng)
        values = unpack(layout, x)
        for actual, expected in zip(_core.coordinates(model, x), (values.q, values.qd, values.qdd), strict=True):
            np.testing.assert_array_equal(actual, expected)
        close(_core.marker_positions(model, x), measurement.marker_positions(layout, x), 1e-11)
        close(_core.wrench(model, x), measurement.wrench(layout, x), 1e-11)
        close(_core.plates(model, x), measurement.plates(layout, x), 1e-11)
        close(_core.joint_moments(model, x), measurement.joint_moments(layout, x), 1e-11)
        assert _core.total_mass(model, x) == pytest.approx(measurement.total_mass(layout, x), rel=1e-14)


@pytest.mark.parametrize("spec", [PLANAR[0], SPATIAL[1], SPATIAL[4]], ids=lambda s: s.name)
def test_external_wrenches_are_taken_from_the_joint_moments(spec):
    """(1): wrenches about the ground's origin on the segments do J' F on the coordinates."""
    model, layout = model_of(spec), Layout(spec)
    rng = np.random.default_rng(13)
    x = random_state(layout, rng)
    external = rng.normal(size=(len(spec.segments), 6)) * 100
    expected = measurement.joint_moments(layout, x)
    values = unpack(layout, x)
    for j in range(len(spec.coordinates)):
        from support.oracle import mechanics

        unit = np.zeros(len(spec.coordinates))
        unit[j] = 1.0
        kin = mechanics.kinematics(spec, values.q, unit, 0 * unit, values.parameters)
        for body, applied in zip(kin.segments, external, strict=True):
            about_segment = applied[3:] - np.cross(body.o, applied[:3])
            expected[j] -= applied[:3] @ body.v + about_segment @ body.w
    close(_core.joint_moments(model, x, external), expected, 1e-10)


def test_results_are_copies():
    model = model_of(PLANAR[0])
    x = model.initial_state()
    first = _core.marker_positions(model, x)
    kept = first.copy()
    first[:] = 0.0
    model.initial_state()[:] = 7.0
    np.testing.assert_array_equal(_core.marker_positions(model, x), kept)
    np.testing.assert_array_equal(model.initial_state(), x)


@pytest.mark.parametrize("size", [0, -1, 1])
def test_a_state_of_another_size_is_an_error(size):
    model = model_of(PLANAR[0])
    n = model.layout.size
    wrong = np.zeros(0 if size == 0 else n + size)
    for function in (
        _core.marker_positions,
        _core.wrench,
        _core.joint_moments,
        _core.segment_poses,
        _core.coordinates,
        _core.marker_jacobian,
        _core.wrench_jacobian,
        _core.plates,
        _core.plates_jacobian,
        _core.moment_jacobian,
        _core.total_mass,
    ):
        with pytest.raises(ValueError, match=str(n)):
            function(model, wrong)
