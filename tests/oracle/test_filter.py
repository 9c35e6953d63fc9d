"""The oracle's filter against what is known of Kalman filters."""

from __future__ import annotations

import numpy as np
import pytest

from support.core.random_models import planar_model, settings, spatial_model, trial
from support.oracle import measurement
from support.oracle.filter import Filter, Settings
from support.oracle.sensors import carried_to_origin
from support.oracle.state import Layout


def make(spec, seed=0, frames=3, gaps=False, **changes):
    data = trial(spec, seed, frames, gaps=gaps)
    s = Settings(**(settings(spec, seed) | changes))
    return Filter(spec, s, data.x0, data.P0), data


@pytest.mark.parametrize("spec", [planar_model(0), spatial_model(5)], ids=lambda s: s.name)
def test_unconstrained_update_equals_the_information_form(spec):
    f, data = make(spec, constraint="none")
    z, R, present = f.measurement_rows(data.markers[0], data.wrench[0])
    h, H = measurement.value_and_jacobian(f.layout, f.state)
    z, h, H, R = z[present], h[present], H[present], R[np.ix_(present, present)]
    x, information = f.state, np.linalg.inv(f.covariance) + H.T @ np.linalg.solve(R, H)
    expected = x + np.linalg.solve(information, H.T @ np.linalg.solve(R, z - h))
    f.update(data.markers[0], data.wrench[0])
    np.testing.assert_allclose(f.state, expected, atol=1e-8)
    scale = np.outer(*[np.sqrt(np.diag(f.covariance))] * 2)
    np.testing.assert_allclose(f.covariance / scale, np.linalg.inv(information) / scale, atol=1e-6)


@pytest.mark.parametrize("spec", [planar_model(1), spatial_model(3)], ids=lambda s: s.name)
def test_restricted_gain_adds_d_d_over_s_to_the_covariance(spec):
    """(7), (8): the correction d to the bound costs d d' / s, s = v' S^-1 v, and nothing else moves."""
    free, data = make(spec, constraint="none")
    free.update(data.markers[0], data.wrench[0])
    layout = Layout(spec)
    upper = np.full(layout.size, np.inf)
    beyond = [layout.blocks["coordinates"][0], layout.size - 1]
    upper[beyond] = free.state[beyond] - 0.1
    held, _ = make(spec, upper=upper, lower=-upper)
    report = held.update(data.markers[0], data.wrench[0])
    d = np.zeros(layout.size)
    d[beyond] = -0.1
    assert report.constrained == 2
    np.testing.assert_array_equal(held.state[beyond], upper[beyond])
    np.testing.assert_allclose(held.state, free.state + d, atol=1e-10)
    np.testing.assert_allclose(held.covariance, free.covariance + np.outer(d, d) / report.nis, atol=1e-9)


def test_with_nothing_measured_only_the_mean_moves_to_the_bound():
    spec = planar_model(2)
    layout = Layout(spec)
    upper = np.full(layout.size, np.inf)
    f, data = make(spec, total_mass=None)
    upper[0] = f.state[0] - 0.2
    f.settings.upper = upper
    before = f.covariance.copy()
    report = f.update(np.full_like(data.markers[0], np.nan), np.full(6, np.nan))
    assert (report.n_rows, report.nis, report.constrained) == (0, 0.0, 1)
    assert f.state[0] == upper[0]
    np.testing.assert_allclose(f.covariance, before, atol=1e-15)


def test_wrench_noise_is_carried_to_the_origin():
    """20 N at 1 m is 20 N m."""
    covariance = carried_to_origin(np.diag([400.0, 0, 0, 0, 0, 0]), np.array([0, 1.0, 0]))
    expected = np.zeros((6, 6))
    expected[0, 0] = expected[5, 5] = 400.0
    expected[0, 5] = expected[5, 0] = -400.0
    np.testing.assert_allclose(covariance, expected)


def test_filter_follows_a_simulated_trial():
    """Judged by the truth, not by the residual: joint angles within two degrees, NIS of the right size."""
    spec = planar_model(7, n_segments=5)
    data = trial(spec, 3, 200, gaps=False)
    s = Settings(**settings(spec, 3, bounds=False, total_mass=False))
    s.marker_variance[:] = 0.002**2
    s.wrench_covariance = np.eye(6) * 4.0
    s.reference_point = np.zeros(3)
    f = Filter(spec, s, data.x0, data.P0)
    out = f.run(data.time, data.markers, data.wrench)
    angles = f.layout.block("coordinates")
    error = out["state"][100:, angles] - data.truth[100:, angles]
    assert np.sqrt((error**2).mean()) < np.radians(2.0)
    ratio = out["nis"][20:].mean() / out["n_rows"][20:].mean()
    assert 0.6 < ratio < 1.2
