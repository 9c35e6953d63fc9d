"""Wrong numbers are refused where they come in, by a line that names it; divergence is announced."""

from __future__ import annotations

import copy

import numpy as np
import pytest

from dynakin.bindings import _core
from dynakin.errors import DivergenceError
from support.core.bridge import filter_of, model_of
from support.core.random_models import planar_model, settings, trial
from support.oracle.spec import Coordinate, Function

SPEC = planar_model(0)
DATA = trial(SPEC, 1, 20)
OPTIONS = settings(SPEC, 1)
INF, NAN = np.inf, np.nan


def put(array, where, value):
    changed = np.array(array, float)
    changed[where] = value
    return changed


def make(x0=DATA.x0, P0=DATA.P0, **changes):
    return filter_of(SPEC, OPTIONS | changes, x0, P0)


def symmetric(matrix, i, j, value):
    return put(put(matrix, (i, j), value), (j, i), value)


BAD_SETTINGS = {
    "process_variance": [put(OPTIONS["process_variance"], 0, v) for v in (NAN, INF, -1.0)],
    "marker_variance": [put(OPTIONS["marker_variance"], 0, v) for v in (NAN, 0.0, -1.0)],
    "wrench_covariance": [
        *(put(OPTIONS["wrench_covariance"], (0, 0), v) for v in (NAN, 0.0, -1.0)),
        put(OPTIONS["wrench_covariance"], (0, 1), 100.0),
        symmetric(OPTIONS["wrench_covariance"], 0, 1, NAN),
        symmetric(OPTIONS["wrench_covariance"], 0, 1, 100.0),  # indefinite
    ],
    "reference_point": [put(OPTIONS["reference_point"], 0, v) for v in (NAN, INF)],
    "total_mass": [NAN, INF, 0.0, -1.0],
    "total_mass_variance": [NAN, 0.0, -1.0],
    "lower": [put(OPTIONS["lower"], 0, NAN), put(OPTIONS["lower"], 0, 1e9), OPTIONS["lower"][:-1]],
    "upper": [put(OPTIONS["upper"], 0, NAN), put(OPTIONS["upper"], 0, -1e9), OPTIONS["upper"][:-1]],
    "constraint": ["projekt", ""],
}
SHORT = {k: OPTIONS[k][:-1] for k in ("process_variance", "marker_variance", "lower", "upper")}


@pytest.mark.parametrize(
    ("key", "value"), [(k, v) for k, values in BAD_SETTINGS.items() for v in values] + list(SHORT.items())
)
def test_wrong_settings_are_refused_by_name(key, value):
    with pytest.raises(ValueError, match="bounds|lower|upper" if key in ("lower", "upper") else key):
        make(**{key: value})


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("x0", DATA.x0[:-1]),
        ("x0", put(DATA.x0, 0, NAN)),
        ("x0", put(DATA.x0, 0, INF)),
        ("P0", DATA.P0[:-1]),
        ("P0", DATA.P0[:-1, :-1]),
        ("P0", put(DATA.P0, (0, 0), NAN)),
        ("P0", put(DATA.P0, (0, 0), INF)),
        ("P0", put(DATA.P0, (0, 0), -1.0)),
        ("P0", put(DATA.P0, (0, 1), 9.0)),
        ("P0", symmetric(DATA.P0, 0, 1, 9.0)),  # indefinite
        ("P0", symmetric(DATA.P0, 2, 30, NAN)),
    ],
)
def test_wrong_start_is_refused(key, value):
    with pytest.raises(ValueError, match=key):
        make(**{key: value})
    f = make()
    start = {"x0": DATA.x0, "P0": DATA.P0} | {key: value}
    with pytest.raises(ValueError, match=r"x|P"):
        f.reset(np.array(start["x0"]), np.array(start["P0"]))


@pytest.mark.parametrize("dt", [NAN, INF, -0.01])
def test_wrong_time_step_is_refused_and_changes_nothing(dt):
    f = make()
    with pytest.raises(ValueError, match="dt"):
        f.step(dt, DATA.markers[0], DATA.wrench[0])
    with pytest.raises(ValueError, match="dt"):
        f.predict(dt)
    np.testing.assert_array_equal(f.state, DATA.x0)
    np.testing.assert_array_equal(f.covariance, DATA.P0)


@pytest.mark.parametrize(
    ("markers", "wrench"),
    [
        (DATA.markers[0][:-1], DATA.wrench[0]),
        (DATA.markers[0][:, :2], DATA.wrench[0]),
        (DATA.markers[0], DATA.wrench[0][:5]),
        (DATA.markers, DATA.wrench[0]),
    ],
)
def test_a_frame_of_wrong_shape_is_refused_and_changes_nothing(markers, wrench):
    f = make()
    with pytest.raises((ValueError, TypeError)):
        f.update(markers, wrench)
    np.testing.assert_array_equal(f.state, DATA.x0)


@pytest.mark.parametrize(
    ("time", "markers", "wrench"),
    [
        (DATA.time, DATA.markers[:-1], DATA.wrench),
        (DATA.time, DATA.markers, DATA.wrench[:-1]),
        (DATA.time, DATA.markers[:, :-1], DATA.wrench),
        (DATA.time[:-1], DATA.markers, DATA.wrench),
        (DATA.time[::-1].copy(), DATA.markers, DATA.wrench),
        (put(DATA.time, 3, NAN), DATA.markers, DATA.wrench),
    ],
)
def test_a_trial_of_wrong_shape_or_time_is_refused(time, markers, wrench):
    with pytest.raises(ValueError, match=r"markers|wrench|time|frame \d+: dt"):
        make().run(time, markers, wrench)


@pytest.mark.parametrize("value", [INF, -INF])
@pytest.mark.parametrize("what", ["markers", "wrench"])
def test_an_infinite_measurement_is_refused_and_changes_nothing(what, value):
    markers, wrench = DATA.markers.copy(), DATA.wrench.copy()
    (markers if what == "markers" else wrench)[7] = value
    with pytest.raises(ValueError, match=r"frame 7: .*infinite"):
        make().run(DATA.time, markers, wrench)
    f = make()
    with pytest.raises(ValueError, match="infinite"):
        f.update(markers[7], wrench[7])
    np.testing.assert_array_equal(f.state, DATA.x0)
    np.testing.assert_array_equal(f.covariance, DATA.P0)


@pytest.mark.parametrize("what", ["markers", "wrench"])
def test_divergence_names_the_frame(what):
    markers, wrench = DATA.markers.copy(), DATA.wrench.copy()
    (markers if what == "markers" else wrench)[7] = 1e200
    with pytest.raises(DivergenceError, match=rf"\b7\b.*{DATA.time[7]:.3f}"):
        make().run(DATA.time, markers, wrench)


@pytest.mark.parametrize("what", ["markers", "wrench"])
def test_a_diverging_step_says_so(what):
    """A step does not raise: its report tells, so that a live loop can decide."""
    markers, wrench = DATA.markers[0].copy(), DATA.wrench[0].copy()
    (markers if what == "markers" else wrench)[0] = 1e200
    f = make()
    report = f.step(0.01, markers, wrench)
    assert report.diverged
    assert report.status not in ("", "ok")
    f.reset(DATA.x0, DATA.P0)
    assert not f.step(0.01, DATA.markers[0], DATA.wrench[0]).diverged


def test_progress_is_called_and_may_stop_the_run():
    calls = []
    make().run(DATA.time, DATA.markers, DATA.wrench, lambda done, total: calls.append((done, total)))
    assert calls[-1] == (20, 20)

    class Stop(Exception):
        pass

    def stop(done, total):
        raise Stop

    with pytest.raises(Stop):
        make().run(DATA.time, DATA.markers, DATA.wrench, stop)


def _set(path, value):
    """A change of the spec at e.g. "segments.1.parent"."""

    def change(spec):
        *way, last = path.split(".")
        target = spec
        for part in way:
            target = target[int(part)] if part.isdigit() else getattr(target, part)
        if last.isdigit():
            target[int(last)] = value
        else:
            setattr(target, last, value)

    return change


BAD_MODELS = [
    ("segments.1.parent", "zz", "s1.*zz"),
    ("segments.1.parent", "s1", "s1"),
    ("segments.0.parent", "s1", "s0.*s1"),
    ("segments.1.name", "s0", "s0"),
    ("segments.1.rotation", -np.eye(3), "s1.*rotation"),
    ("segments.1.rotation", 2 * np.eye(3), "s1.*rotation"),
    ("segments.1.rotation", np.full((3, 3), NAN), "s1.*rotation"),
    ("segments.1.translation", np.full(3, NAN), "s1.*translation"),
    ("segments.1.inertia", np.full(10, NAN), "s1.*inertia"),
    ("segments.1.lengths.0.parameter", "zz", "s1.*zz"),
    ("segments.1.lengths.0.direction", np.full(3, INF), "s1"),
    ("segments.1.axes.0.coordinate", "zz", "s1.*zz"),
    ("segments.1.axes.0.kind", "zz", "zz"),
    ("segments.1.axes.0.direction", np.zeros(3), "s1.*unit"),
    ("segments.1.axes.0.direction", np.array([0, 0, 2.0]), "s1.*unit"),
    ("segments.1.axes.0.coefficients", [], "s1.*coefficient"),
    ("segments.1.axes.0.coefficients", [0.0, NAN], "s1.*coefficient"),
    ("segments.1.axes.0.scale", "zz", "s1.*zz"),
    ("segments.1.axes.0.functions", [Function("zz")], "kind.*zz"),
    ("segments.1.axes.0.functions", [Function()], "s1.*without coefficients"),
    ("segments.1.axes.0.functions", [Function("polynomial", [NAN])], "s1.*coefficient"),
    ("segments.1.axes.0.functions", [Function("spline", x=[0.0], y=[0.0])], "s1.*1 points"),
    ("segments.1.axes.0.functions", [Function("spline", x=[0.0, 1.0], y=[0.0])], "s1.*2 x and 1 y"),
    ("segments.1.axes.0.functions", [Function("spline", x=[0.0, 1.0, 1.0], y=[0.0] * 3)], "s1.*increase"),
    ("segments.1.axes.0.functions", [Function("piecewise_linear", x=[0.0, 1.0], y=[0.0, INF])], "s1.* y .*finite"),
    ("markers.1.name", "m0", "m0"),
    ("markers.0.segment", "zz", "m0.*zz"),
    ("markers.0.position", np.full(3, NAN), "m0"),
    ("coordinates.1.name", "q0", "q0"),
    ("coordinates.1.value", NAN, "q1"),
    ("parameters.1.name", "l0", "l0"),
    ("parameters.1.value", INF, "l1"),
    ("gravity", np.full(3, NAN), "gravity"),
]


@pytest.mark.parametrize(("path", "value", "said"), BAD_MODELS)
def test_a_wrong_model_is_refused_by_name(path, value, said):
    spec = copy.deepcopy(SPEC)
    _set(path, value)(spec)
    with pytest.raises(ValueError, match=said):
        model_of(spec)


def test_a_coordinate_that_moves_nothing_is_refused():
    spec = copy.deepcopy(SPEC)
    spec.coordinates.append(Coordinate("unused"))
    with pytest.raises(ValueError, match="unused"):
        model_of(spec)


def test_covariance_and_state_are_copies():
    f = make()
    f.state[:] = 0.0
    f.covariance[:] = 0.0
    np.testing.assert_array_equal(f.state, DATA.x0)
    np.testing.assert_array_equal(f.covariance, DATA.P0)


def test_the_filter_keeps_its_own_settings_and_start():
    """Arrays handed over may be written to afterwards."""
    x0, P0 = DATA.x0.copy(), DATA.P0.copy()
    options = {k: np.array(v) if isinstance(v, np.ndarray) else v for k, v in OPTIONS.items()}
    f = _core.Filter(model_of(SPEC), _core.FilterSettings(**options), x0, P0)
    for array in (x0, P0, *(v for v in options.values() if isinstance(v, np.ndarray))):
        array[:] = NAN
    out = f.run(DATA.time, DATA.markers, DATA.wrench)
    np.testing.assert_array_equal(out["state"], make().run(DATA.time, DATA.markers, DATA.wrench)["state"])
