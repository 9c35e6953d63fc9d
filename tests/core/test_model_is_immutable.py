"""A model is built once from its specification, never changes, and pickles by it."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

from dynakin.bindings import _core
from support.core.bridge import filter_of, model_of, to_core
from support.core.random_models import (
    planar_model,
    random_state,
    settings,
    spatial_model,
    trial,
    with_functions,
    with_slow_errors,
)
from support.oracle.state import Layout

SPECS = [planar_model(1), *(spatial_model(s) for s in (2, 5, 6, 9)), with_slow_errors(planar_model(2), 2)]
SPECS += [with_functions(spatial_model(5), 5)]
each_spec = pytest.mark.parametrize("spec", SPECS, ids=lambda s: s.name)


def as_data(thing):
    """A specification of either kind as nested plain data, for comparison."""
    fields = {
        "coordinates": ("name", "value", "locked"),
        "parameters": ("name", "value", "estimated"),
        "markers": ("name", "segment", "position", "measured", "estimated", "soft_tissue"),
        "segments": ("name", "parent", "rotation", "translation", "inertia", "inertia_estimated"),
    }
    parts = {
        key: [[_plain(getattr(item, f)) for f in names] for item in getattr(thing, key)]
        for key, names in fields.items()
    }
    parts["lengths"] = [[(t.parameter, _plain(t.direction)) for t in segment.lengths] for segment in thing.segments]
    parts["axes"] = [
        [
            (a.coordinate, a.kind, _plain(a.direction), _plain(a.coefficients), a.scale, _functions(a))
            for a in segment.axes
        ]
        for segment in thing.segments
    ]
    return parts | {
        "name": thing.name,
        "gravity": _plain(thing.gravity),
        "wrench_measured": _plain(thing.wrench_measured),
        "wrench_offset": _plain(thing.wrench_offset),
        "wrench_offset_point": _plain(thing.wrench_offset_point),
        "wrench_delay": thing.wrench_delay,
    }


def _functions(axis):
    return [(f.kind, _plain(f.coefficients), _plain(f.x), _plain(f.y)) for f in axis.functions]


def _plain(value):
    return np.asarray(value).tolist() if isinstance(value, (list, tuple, np.ndarray)) else value


@each_spec
def test_specification_keeps_what_it_is_given(spec):
    assert as_data(to_core(spec)) == as_data(spec)
    assert as_data(model_of(spec).spec) == as_data(spec)


@each_spec
def test_specification_and_model_survive_pickling(spec):
    model = model_of(spec)
    layout = Layout(spec)
    x = random_state(layout, np.random.default_rng(51))
    assert as_data(pickle.loads(pickle.dumps(to_core(spec)))) == as_data(spec)
    for protocol in range(2, pickle.HIGHEST_PROTOCOL + 1):
        again = pickle.loads(pickle.dumps(model, protocol))
        assert as_data(again.spec) == as_data(spec)
        assert again.layout.names == model.layout.names
        np.testing.assert_array_equal(_core.wrench(again, x), _core.wrench(model, x))
        np.testing.assert_array_equal(_core.marker_positions(again, x), _core.marker_positions(model, x))
        np.testing.assert_array_equal(_core.joint_moments(again, x), _core.joint_moments(model, x))


def test_each_part_of_a_specification_survives_pickling():
    spec = to_core(SPECS[2])
    segment = next(s for s in spec.segments if s.axes)
    function = _core.FunctionSpec("spline", x=[0.0, 1.0, 2.0], y=[0.0, 1.0, 0.5])
    for part, keys in (
        (spec.coordinates[0], ("name", "value", "locked")),
        (spec.parameters[0], ("name", "value", "estimated")),
        (spec.markers[0], ("name", "segment", "position", "measured", "estimated", "soft_tissue")),
        (segment.axes[0], ("coordinate", "kind", "direction", "coefficients", "scale")),
        (function, ("kind", "coefficients", "x", "y")),
        (segment, ("name", "parent", "rotation", "translation", "inertia", "inertia_estimated")),
    ):
        again = pickle.loads(pickle.dumps(part))
        for key in keys:
            assert _plain(getattr(again, key)) == _plain(getattr(part, key)), key


@each_spec
def test_nothing_changes_a_model(spec):
    core_spec = to_core(spec)
    model = _core.Model(core_spec)
    x = random_state(Layout(spec), np.random.default_rng(52))
    before = _core.wrench(model, x)
    for thing, name in (
        (model, "spec"),
        (model, "layout"),
        (model, "segment_names"),
        (model.layout, "size"),
        (model.layout, "names"),
    ):
        with pytest.raises(AttributeError):
            setattr(thing, name, getattr(thing, name))
    # Whether or not a specification may be written to, the model has its own copy.
    for owner in (core_spec, model.spec):
        for target, key, value in (
            (owner, "gravity", np.array([0.0, 0.0, 1.0])),
            (owner.segments[0], "inertia", np.full(10, 3.0)),
            (owner.parameters[0], "value", 9.0),
        ):
            try:
                setattr(target, key, value)
            except AttributeError:
                continue
        owner.segments[0].inertia[:] = 5.0
        owner.segments.clear()
    model.layout.names.append("nothing")
    model.layout.blocks.clear()
    np.testing.assert_array_equal(_core.wrench(model, x), before)
    assert as_data(model.spec) == as_data(spec)
    assert model.layout.names == Layout(spec).names


@each_spec
def test_filters_of_one_model_do_not_disturb_each_other(spec):
    """Workspaces are the filter's own: interleaved steps equal separate ones; the model stays as it was."""
    data, options = trial(spec, 53, 12), settings(spec, 53)
    alone = filter_of(spec, options, data.x0, data.P0)
    model = model_of(spec)
    shared = [_core.Filter(model, _core.FilterSettings(**options), data.x0.copy(), data.P0.copy()) for _ in range(2)]
    before = _core.wrench(model, data.x0)
    for k in range(12):
        alone.step(0.01, data.markers[k], data.wrench[k])
        shared[0].step(0.01, data.markers[k], data.wrench[k])
        shared[1].step(0.02, data.markers[-k - 1], data.wrench[-k - 1])
    np.testing.assert_array_equal(shared[0].state, alone.state)
    np.testing.assert_array_equal(shared[0].covariance, alone.covariance)
    np.testing.assert_array_equal(_core.wrench(model, data.x0), before)


def test_a_filter_outlives_its_model():
    spec = SPECS[0]
    data, options = trial(spec, 54, 5), settings(spec, 54)
    model = model_of(spec)
    f = _core.Filter(model, _core.FilterSettings(**options), data.x0, data.P0)
    expected = f.run(data.time, data.markers, data.wrench)["state"]
    f.reset(data.x0, data.P0)
    del model
    np.testing.assert_array_equal(f.run(data.time, data.markers, data.wrench)["state"], expected)


def test_a_specification_gives_copies_of_its_lists() -> None:
    """A reference to an element would dangle as soon as another list is assigned: a process in twenty was aborted."""
    spec = to_core(with_functions(spatial_model(5), 5))
    for field in ("coordinates", "parameters", "segments", "markers"):
        items = getattr(spec, field)
        name = items[0].name
        items[0].name = "another"
        assert getattr(spec, field)[0].name == name
        setattr(spec, field, items)
        items[0].name = "a third"
        assert getattr(spec, field)[0].name == "another"
    segment = next(segment for segment in spec.segments if segment.lengths and segment.axes)
    axis = next(axis for axis in segment.axes if axis.functions)
    for owner, field, key, value in (
        (segment, "axes", "scale", "another"),
        (segment, "lengths", "parameter", "another"),
        (axis, "functions", "kind", "polynomial" if axis.functions[0].kind != "polynomial" else "spline"),
    ):
        setattr(getattr(owner, field)[0], key, value)
        assert getattr(getattr(owner, field)[0], key) != value
