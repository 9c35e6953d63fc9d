"""The projection is the nearest state in the metric of P^-1. (Warm starts: cpp/tests/test_projection.cpp.)"""

from __future__ import annotations

import copy

import numpy as np
import pytest

from support.core.bridge import filter_of
from support.core.projecting import covariance, project
from support.core.random_models import continuous, planar_model, spatial_model, trial, with_slow_errors
from support.oracle import projection
from support.oracle.state import Layout


def without_inertia(spec):
    spec = copy.deepcopy(spec)
    for segment in spec.segments:
        segment.inertia_estimated = [False] * 10
    return spec


SPECS = [without_inertia(planar_model(50, n_segments=7)), without_inertia(spatial_model(6))]
each_spec = pytest.mark.parametrize("spec", SPECS, ids=lambda s: s.name)


def problem(spec, seed, **kwargs):
    rng = np.random.default_rng(seed)
    middle = Layout(spec).initial_state()
    n = middle.size
    P = covariance(n, rng, **kwargs)
    sd = np.sqrt(np.diag(P))
    lower, upper = middle - sd * rng.uniform(0, 1.5, n), middle + sd * rng.uniform(0, 1.5, n)
    lower[rng.random(n) > rng.uniform(0.2, 1)] = -np.inf
    upper[rng.random(n) > rng.uniform(0.2, 1)] = np.inf
    return middle + sd * rng.normal(size=n) * rng.uniform(0.5, 2), P, lower, upper


@each_spec
@pytest.mark.parametrize("common", [0, 20])
def test_equals_an_independent_least_distance_problem(spec, common):
    """Variances from 1e-8 to 1e4, a few or most bounds active."""
    most = 0
    for seed in range(40):
        x, P, lower, upper = problem(spec, seed, common=common)
        expected, active = projection.nearest(x, P, *projection.bounds_as_rows(lower, upper))
        out = project(spec, x, P, lower=lower, upper=upper)
        sd = np.sqrt(np.diag(P))
        np.testing.assert_allclose(out.x / sd, expected / sd, atol=1e-8 + 1e-13 * np.abs(x / sd).max())
        np.testing.assert_array_equal(out.P, P)
        assert out.met
        assert out.active == active.sum()
        assert (out.x >= lower).all()
        assert (out.x <= upper).all()
        most = max(most, out.active)
    assert most > 15


@each_spec
def test_one_bound_moves_the_correlated_states_along(spec):
    """x + P e_i (b - x_i) / P_ii: the same as knowing the value of that element, for the mean."""
    rng = np.random.default_rng(3)
    x, n = Layout(spec).initial_state(), Layout(spec).size
    P = covariance(n, rng)
    upper = np.full(n, np.inf)
    upper[2] = x[2] - 0.7 * np.sqrt(P[2, 2])
    out = project(spec, x, P, upper=upper)
    np.testing.assert_allclose(out.x, x + P[:, 2] * (upper[2] - x[2]) / P[2, 2], rtol=1e-12)
    assert out.x[2] == upper[2]


@each_spec
def test_equalities_hold_at_every_frame_and_cost_their_variance(spec):
    """Also where bounds bind: a x = b to rounding, a' P a = 0."""
    spec = with_slow_errors(spec, 5)
    data, layout = trial(spec, 6, 60), Layout(spec)
    equality = np.zeros((2, layout.size))
    equality[0, :2] = 1.0, -1.0
    equality[1, layout.block("markers").start] = 1.0
    equality[1, layout.block("lengths").start] = 2.0
    options = continuous(spec, 6, constraint="projection") | {
        "equality": equality,
        "equality_value": equality @ layout.initial_state(),
    }
    f = filter_of(spec, options, data.x0, data.P0)
    bound = 0
    for k in range(60):
        report = f.step(0.01, data.markers[k], data.wrench[k])
        assert report.constraints_met, k
        bound += report.constrained
        np.testing.assert_allclose(equality @ f.state, options["equality_value"], atol=1e-10)
        loose = np.einsum("ki,ij,kj->k", np.abs(equality), np.abs(f.covariance), np.abs(equality))
        assert (np.einsum("ki,ij,kj->k", equality, f.covariance, equality) < 1e-10 * loose).all()
        sd = np.sqrt(np.diag(f.covariance))
        assert np.linalg.eigvalsh(f.covariance / np.outer(sd, sd))[0] > -1e-10
    assert bound > 10


def test_a_number_that_an_equality_fixes_alone_stays_fixed():
    """Its variance is 0 from the first frame on; the filter goes on."""
    spec = planar_model(50, n_segments=4)
    data, layout = trial(spec, 6, 50), Layout(spec)
    equality = np.zeros((1, layout.size))
    length = layout.block("lengths").start
    equality[0, length] = 2.0
    options = continuous(spec, 6, constraint="projection", equality=equality, equality_value=np.array([0.7]))
    options["lower"], options["upper"] = np.full(layout.size, -np.inf), np.full(layout.size, np.inf)
    f = filter_of(spec, options, data.x0, data.P0)
    for k in range(50):
        report = f.step(0.01, data.markers[k], data.wrench[k])
        assert not report.diverged, report.status
        assert report.constraints_met
        assert f.state[length] == pytest.approx(0.35, abs=1e-14)
        assert not f.covariance[length].any()


@each_spec
def test_two_equalities_that_contradict_each_other_are_reported(spec):
    rng = np.random.default_rng(4)
    n = Layout(spec).size
    row = rng.normal(size=n)
    x, P, lower, upper = problem(spec, 1)
    out = project(
        spec, x, P, lower=lower, upper=upper, equality=np.array([row, 2 * row]), equality_value=np.array([1.0, 3.0])
    )
    assert not out.met
    assert (out.x >= lower).all()
    assert (out.x <= upper).all()


@each_spec
def test_bounds_out_of_reach_are_reported_and_kept_one_by_one(spec):
    """An equality that no state within the bounds keeps: the bounds win, and nothing else is moved."""
    x, P, lower, upper = problem(spec, 2)
    n = x.size
    lower[4], upper[4] = x[4] - 0.1, x[4] + 0.1
    equality = np.zeros((1, n))
    equality[0, 4] = 1.0
    out = project(spec, x, P, lower=lower, upper=upper, equality=equality, equality_value=np.array([x[4] + 5.0]))
    assert not out.met
    conditioned, _ = projection.condition(x, P, equality, np.array([x[4] + 5.0]))
    np.testing.assert_allclose(out.x, np.clip(conditioned, lower, upper), rtol=1e-9, atol=1e-12)


def test_equalities_need_the_projection():
    spec = SPECS[0]
    n = Layout(spec).size
    for changes, text in (
        ({"constraint": "gain", "equality": np.ones((1, n)), "equality_value": np.ones(1)}, "equality: needs"),
        ({"equality": np.ones((1, n - 1)), "equality_value": np.ones(1)}, f"equality: expected {n} columns"),
        ({"equality": np.ones((1, n))}, "equality_value: expected 1"),
        ({"equality": np.full((1, n), np.nan), "equality_value": np.ones(1)}, "equality: is not finite"),
    ):
        x, P, _, _ = problem(spec, 1)
        with pytest.raises(ValueError, match=text):
            project(spec, x, P, **changes)


@each_spec
def test_a_filter_that_is_reset_starts_from_nothing(spec):
    """What bound in the run before leaves no trace."""
    data = trial(spec, 7, 40)
    options = continuous(spec, 7, constraint="projection")
    f = filter_of(spec, options, data.x0, data.P0)
    first = f.run(data.time, data.markers, data.wrench)
    assert first["constrained"].any()
    angles = first["state"][:, : first["at_limit"].shape[1]]
    lower, upper = (np.asarray(options[name])[: angles.shape[1]] for name in ("lower", "upper"))
    np.testing.assert_array_equal(first["at_limit"], (angles <= lower) | (angles >= upper))
    f.reset(data.x0, data.P0)
    np.testing.assert_array_equal(f.run(data.time, data.markers, data.wrench)["state"], first["state"])
