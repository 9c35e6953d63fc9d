"""What a filter of this kind must do, said in sentences; no oracle needed."""

from __future__ import annotations

import copy

import numpy as np
import pytest

from support.core.bridge import filter_of
from support.core.random_models import planar_model, settings, spatial_model, trial
from support.oracle.filter import Filter as Oracle
from support.oracle.filter import Settings
from support.oracle.spec import Axis, Coordinate, Marker, Segment, Spec

SPECS = [planar_model(3), planar_model(50, n_segments=7), spatial_model(6)]
each_spec = pytest.mark.parametrize("spec", SPECS, ids=lambda s: s.name)


def prepared(spec, frames=60, seed=41, gaps=True, **changes):
    data = trial(spec, seed, frames, gaps=gaps)
    return data, settings(spec, seed) | changes


def run(spec, data, options, **kwargs):
    f = filter_of(spec, options, data.x0, data.P0, **kwargs)
    return f.run(data.time, data.markers, data.wrench), f


def assert_same(a, b, tolerance=0.0, keys=("state", "state_sd", "nis", "log_likelihood", "moments")):
    for key in keys:
        np.testing.assert_allclose(a[key], b[key], rtol=tolerance, atol=tolerance, err_msg=key)


@each_spec
def test_run_equals_a_loop_of_steps(spec):
    data, options = prepared(spec)
    out, f = run(spec, data, options)
    g = filter_of(spec, options, data.x0, data.P0)
    for k in range(len(data.time)):
        if k == 0:
            report = g.update(data.markers[0], data.wrench[0])
        else:
            report = g.step(data.time[k] - data.time[k - 1], data.markers[k], data.wrench[k])
        assert not report.diverged
        np.testing.assert_array_equal(g.state, out["state"][k])
        np.testing.assert_array_equal(np.sqrt(np.diag(g.covariance)), out["state_sd"][k])
        assert (report.n_rows, report.constrained) == (out["n_rows"][k], out["constrained"][k])
        assert (report.nis, report.log_likelihood) == (out["nis"][k], out["log_likelihood"][k])
    np.testing.assert_array_equal(g.covariance, f.covariance)


@each_spec
def test_step_is_predict_then_update(spec):
    data, options = prepared(spec, 3)
    a = filter_of(spec, options, data.x0, data.P0)
    b = filter_of(spec, options, data.x0, data.P0)
    a.step(0.013, data.markers[0], data.wrench[0])
    b.predict(0.013)
    b.update(data.markers[0], data.wrench[0])
    np.testing.assert_array_equal(a.state, b.state)
    np.testing.assert_array_equal(a.covariance, b.covariance)


@each_spec
def test_two_half_steps_equal_one_where_there_is_no_process_noise(spec):
    data, options = prepared(spec, 3)
    options["process_variance"] = np.zeros(len(data.x0))
    halves, whole = (filter_of(spec, options, data.x0, data.P0) for _ in range(2))
    halves.predict(0.01)
    halves.predict(0.01)
    whole.predict(0.02)
    np.testing.assert_allclose(halves.state, whole.state, rtol=1e-13, atol=1e-15)
    np.testing.assert_allclose(halves.covariance, whole.covariance, rtol=1e-12, atol=1e-15)


@each_spec
def test_time_steps_of_any_length_in_one_run(spec):
    """dt from 0 (a repeated time stamp) to 50 ms: as the oracle."""
    data, options = prepared(spec, 30)
    data.time = np.cumsum(np.resize([0.0, 0.001, 0.05, 0.01], 30))
    out, _ = run(spec, data, options)
    expected = Oracle(spec, Settings(**options), data.x0, data.P0).run(data.time, data.markers, data.wrench)
    np.testing.assert_allclose(out["state"], expected["state"], rtol=1e-8, atol=1e-8)
    np.testing.assert_allclose(out["state_sd"], expected["state_sd"], rtol=1e-8)


@each_spec
def test_marker_order_does_not_matter(spec):
    data, options = prepared(spec)
    out, f = run(spec, data, options)
    order = np.random.default_rng(5).permutation(len(spec.markers))
    assert not np.array_equal(order, np.sort(order))
    other = copy.deepcopy(spec)
    other.markers = [other.markers[k] for k in order]
    names = Oracle(spec, None, data.x0, data.P0).layout.names
    names_there = Oracle(other, None, data.x0, data.P0).layout.names
    there = [names.index(n) for n in names_there]
    moved = copy.copy(data)
    moved.markers = data.markers[:, order]
    moved.x0, moved.P0 = data.x0[there], data.P0[np.ix_(there, there)]
    options = options | {"marker_variance": options["marker_variance"][order]}
    for key in ("process_variance", "lower", "upper"):
        options[key] = options[key][there]
    permuted, g = run(other, moved, options)
    np.testing.assert_allclose(permuted["state"], out["state"][:, there], rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(permuted["state_sd"], out["state_sd"][:, there], rtol=1e-9)
    np.testing.assert_allclose(permuted["nis"], out["nis"], rtol=1e-8, atol=1e-8)
    np.testing.assert_array_equal(permuted["n_rows"], out["n_rows"])
    sd = out["state_sd"][-1]
    moved_back = f.covariance[np.ix_(there, there)] / np.outer(sd[there], sd[there])
    np.testing.assert_allclose(g.covariance / np.outer(sd[there], sd[there]), moved_back, atol=1e-9)


@each_spec
def test_a_marker_of_infinite_noise_equals_a_missing_marker(spec):
    data, options = prepared(spec)
    variance = options["marker_variance"].copy()
    variance[[0, 2]] = np.inf
    noisy, _ = run(spec, data, options | {"marker_variance": variance})
    without = copy.copy(data)
    without.markers = data.markers.copy()
    without.markers[:, [0, 2]] = np.nan
    missing, _ = run(spec, without, options)
    assert_same(noisy, missing, 1e-12)
    np.testing.assert_array_equal(noisy["n_rows"], missing["n_rows"])


@each_spec
@pytest.mark.parametrize("component", range(6))
def test_a_wrench_component_of_infinite_noise_equals_a_missing_one(spec, component):
    data, options = prepared(spec, reference_point=np.zeros(3))
    covariance = options["wrench_covariance"].copy()
    covariance[component, :] = covariance[:, component] = 0.0
    covariance[component, component] = np.inf
    noisy, _ = run(spec, data, options | {"wrench_covariance": covariance})
    without = copy.copy(data)
    without.wrench = data.wrench.copy()
    without.wrench[:, component] = np.nan
    missing, _ = run(spec, without, options)
    assert_same(noisy, missing, 1e-12)
    np.testing.assert_array_equal(noisy["n_rows"], missing["n_rows"])


@each_spec
def test_infinite_noise_of_a_force_is_carried_with_its_lever(spec):
    """Unknown fx at a point off the origin: the moments about the origin that it turns are unknown too."""
    data, options = prepared(spec, 10)
    covariance = options["wrench_covariance"].copy()
    covariance[0, :] = covariance[:, 0] = 0.0
    covariance[0, 0] = np.inf
    noisy, _ = run(spec, data, options | {"wrench_covariance": covariance})
    without = copy.copy(data)
    without.wrench = data.wrench.copy()
    without.wrench[:, [0, 4, 5]] = np.nan  # fx and, through z and y of the lever, my and mz
    covariance[0, 0] = 1.0
    missing, _ = run(spec, without, options | {"wrench_covariance": covariance})
    assert_same(noisy, missing, 1e-12)


@each_spec
def test_a_total_mass_of_infinite_noise_equals_none(spec):
    data, options = prepared(spec)
    noisy, _ = run(spec, data, options | {"total_mass_variance": np.inf})
    none, _ = run(spec, data, options | {"total_mass": None})
    assert_same(noisy, none, 1e-12)


@each_spec
def test_huge_noise_tends_to_a_missing_marker(spec):
    data, options = prepared(spec, 20, gaps=False)
    variance = options["marker_variance"].copy()
    variance[0] = 1e12
    noisy, _ = run(spec, data, options | {"marker_variance": variance})
    variance[0] = np.inf
    missing, _ = run(spec, data, options | {"marker_variance": variance})
    assert_same(noisy, missing, 1e-7, keys=("state", "state_sd"))


def test_only_measured_axes_make_a_marker_missing():
    """In the plane, z may be NaN; NaN in x takes y away with it."""
    spec = SPECS[0]
    data, options = prepared(spec, 1, gaps=False)
    f = {key: filter_of(spec, options, data.x0, data.P0) for key in ("all", "no z", "no x", "gone")}
    markers = {key: data.markers[0].copy() for key in f}
    markers["no z"][0, 2] = np.nan
    markers["no x"][0, 0] = np.nan
    markers["gone"][0] = np.nan
    rows = {key: f[key].update(markers[key], data.wrench[0]).n_rows for key in f}
    assert rows["no z"] == rows["all"]
    assert rows["no x"] == rows["gone"] == rows["all"] - 2
    np.testing.assert_array_equal(f["no z"].state, f["all"].state)
    np.testing.assert_array_equal(f["no x"].state, f["gone"].state)


@each_spec
def test_gain_constraint_lands_exactly_and_keeps_the_covariance_sound(spec):
    data, options = prepared(spec, 150)
    f = filter_of(spec, options, data.x0, data.P0)
    landed = 0
    for k in range(150):
        report = f.step(0.01, data.markers[k], data.wrench[k])
        x, P = f.state, f.covariance
        assert (x >= options["lower"]).all()
        assert (x <= options["upper"]).all()
        on_bound = ((x == options["lower"]) | (x == options["upper"])).sum()
        assert on_bound == report.constrained
        landed += on_bound
        np.testing.assert_array_equal(P, P.T)
        sd = np.sqrt(np.diag(P))
        assert np.linalg.eigvalsh(P / np.outer(sd, sd))[0] > 0
    assert landed > 0


@each_spec
def test_gain_constraint_costs_d_d_over_s(spec):
    """One update: clipped mean, and the covariance of the restricted gain, P + d d'/s, s = v' S^-1 v."""
    data, options = prepared(spec, 1, gaps=False)
    n = len(data.x0)
    none = np.full(n, np.inf)
    free = filter_of(spec, options | {"constraint": "none"}, data.x0, data.P0)
    nis = free.update(data.markers[0], data.wrench[0]).nis
    upper, lower = none.copy(), -none
    chosen = np.array([0, n // 2, n - 1])
    upper[chosen[:2]] = free.state[chosen[:2]] - 0.01
    lower[chosen[2]] = free.state[chosen[2]] + 0.01
    held = filter_of(spec, options | {"lower": lower, "upper": upper}, data.x0, data.P0)
    report = held.update(data.markers[0], data.wrench[0])
    assert report.constrained == 3
    np.testing.assert_array_equal(held.state, np.clip(free.state, lower, upper))
    d = held.state - free.state
    sd = np.sqrt(np.diag(held.covariance))
    expected = (free.covariance + np.outer(d, d) / nis) / np.outer(sd, sd)
    np.testing.assert_allclose(held.covariance / np.outer(sd, sd), expected, atol=1e-12)


@each_spec
def test_with_no_rows_only_the_mean_moves_to_the_bound(spec):
    data, options = prepared(spec, 1, total_mass=None)
    upper = options["upper"].copy()
    lower = np.full(len(data.x0), -np.inf)
    upper[:] = np.inf
    upper[0] = data.x0[0] - 0.1
    f = filter_of(spec, options | {"lower": lower, "upper": upper}, data.x0, data.P0)
    report = f.update(np.full_like(data.markers[0], np.nan), np.full(6, np.nan))
    assert (report.n_rows, report.nis, report.log_likelihood, report.constrained) == (0, 0.0, 0.0, 1)
    expected = data.x0.copy()
    expected[0] = upper[0]
    np.testing.assert_array_equal(f.state, expected)
    np.testing.assert_array_equal(f.covariance, data.P0)


@each_spec
def test_constraint_none_ignores_the_bounds(spec):
    data, options = prepared(spec, 20)
    open_ended = options | {
        "lower": np.full(len(data.x0), -np.inf),
        "upper": np.full(len(data.x0), np.inf),
    }
    ignored, _ = run(spec, data, options | {"constraint": "none"})
    absent, _ = run(spec, data, open_ended)
    assert_same(ignored, absent)
    assert not ignored["constrained"].any()


def test_linear_case_is_the_plain_kalman_filter():
    """One slide along Y with one marker: the equations of any textbook, three states."""
    slide = Axis("height", "translation", np.array([0.0, 1.0, 0.0]))
    cart = Segment("cart", "ground", axes=[slide], inertia=np.array([2.0, 0, 0, 0, 1, 1, 1, 0, 0, 0]))
    top = Marker("top", "cart", np.array([0.0, 0.3, 0.0]), measured=[False, True, False])
    spec = Spec("cart", [Coordinate("height")], [], [cart], [top], wrench_measured=[False] * 6)
    Q, r = np.array([1e-6, 1e-3, 0.5]), 4e-6
    options = {
        "process_variance": Q,
        "marker_variance": np.array([r]),
        "wrench_covariance": np.eye(6),
        "reference_point": np.zeros(3),
        "total_mass": None,
        "total_mass_variance": 1.0,
        "lower": np.full(3, -np.inf),
        "upper": np.full(3, np.inf),
    }
    rng = np.random.default_rng(6)
    x, P, H = np.array([0.1, 0.0, 0.0]), np.diag([0.01, 1.0, 10.0]), np.array([[1.0, 0.0, 0.0]])
    f = filter_of(spec, options, x, P)
    for k in range(200):
        dt = 0.005 + 0.01 * rng.random()
        measured = 0.3 + 0.2 * np.sin(0.02 * k) + 0.002 * rng.normal()
        F = np.array([[1, dt, dt**2 / 2], [0, 1, dt], [0, 0, 1]])
        x, P = F @ x, F @ P @ F.T + np.diag(Q)
        S = (H @ P @ H.T)[0, 0] + r
        K = (P @ H.T)[:, 0] / S
        v = measured - 0.3 - x[0]
        x, P = x + K * v, P - np.outer(K, K) * S
        report = f.step(dt, np.array([[np.nan, measured, 7.0]]), np.full(6, np.nan))
        assert report.n_rows == 1
        assert report.nis == pytest.approx(v**2 / S, rel=1e-9, abs=1e-12)
        log_likelihood = -0.5 * (v**2 / S + np.log(2 * np.pi * S))
        assert report.log_likelihood == pytest.approx(log_likelihood, rel=1e-9, abs=1e-9)
        np.testing.assert_allclose(f.state, x, rtol=1e-10, atol=1e-12)
        np.testing.assert_allclose(f.covariance, P, rtol=1e-8, atol=1e-13)


def test_a_perfect_measurement_leaves_the_mean_alone():
    """v = 0: nothing to correct, NIS 0, and the covariance still shrinks."""
    from support.oracle import measurement

    spec = SPECS[0]
    data, options = prepared(spec, 1, total_mass=None)
    f = filter_of(spec, options | {"constraint": "none"}, data.x0, data.P0)
    layout = Oracle(spec, None, data.x0, data.P0).layout
    h = measurement.everything(layout, data.x0)
    report = f.update(h[:-7].reshape(-1, 3), h[-7:-1])
    assert report.nis < 1e-15
    np.testing.assert_allclose(f.state, data.x0, atol=1e-10)
    assert (np.diag(f.covariance) <= np.diag(data.P0)).all()
    assert np.trace(f.covariance) < np.trace(data.P0)
