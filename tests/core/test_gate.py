"""A sensor that contradicts the prediction is refused, changes nothing, and is named."""

from __future__ import annotations

import copy

import numpy as np
import pytest
from scipy.optimize import least_squares

from support.core.bridge import filter_of
from support.core.random_models import continuous, planar_model, prior_sd, spatial_model, trial, with_slow_errors
from support.oracle import gate, measurement
from support.oracle.filter import Filter as Oracle
from support.oracle.filter import Settings
from support.oracle.state import Layout

SPECS = [with_slow_errors(planar_model(50, n_segments=5), 1), with_slow_errors(spatial_model(4), 2)]
each_spec = pytest.mark.parametrize("spec", SPECS, ids=lambda s: s.name)
GATES = {"marker_gate": gate.limits(1e-4), "wrench_gate": gate.limits(1e-4)}


def following(spec, frames=20, **changes):
    """A filter that has followed a trial, and what it measures next."""
    data = trial(spec, 3, frames + 1, uneven=False, gaps=False)
    f = filter_of(spec, continuous(spec, 3) | GATES | changes, data.x0, data.P0)
    for k in range(frames):
        f.step(0.01, data.markers[k], data.wrench[k])
    f.predict(0.01)
    return f, data.markers[frames].copy(), data.wrench[frames].copy()


def measured(spec):
    return [k for k, m in enumerate(spec.markers) if any(m.measured)]


@each_spec
def test_a_displaced_marker_is_refused_and_changes_nothing(spec):
    """State, covariance and sums equal those of the same frame without it."""
    wrong = measured(spec)[1]
    f, markers, wrench = following(spec)
    g, _, _ = following(spec)
    markers[wrong] += 0.3
    report = f.update(markers, wrench)
    assert f.verdicts[wrong] == "refused"
    assert f.verdicts.count("refused") == 1
    markers[wrong] = np.nan
    expected = g.update(markers, wrench)
    assert g.verdicts[wrong] == "missing"
    np.testing.assert_array_equal(f.state, g.state)
    np.testing.assert_array_equal(f.covariance, g.covariance)
    assert (report.n_rows, report.nis, report.log_likelihood) == (
        expected.n_rows,
        expected.nis,
        expected.log_likelihood,
    )
    assert report.tracking == "following"


@each_spec
def test_plates_that_say_nonsense_are_refused_and_change_nothing(spec):
    f, markers, wrench = following(spec)
    g, _, _ = following(spec)
    f.update(markers, wrench + 5e3)
    assert f.verdicts[-1] == "refused"
    assert "refused" not in f.verdicts[:-1]
    g.update(markers, np.full(6, np.nan))
    assert g.verdicts[-1] == "missing"
    np.testing.assert_array_equal(f.state, g.state)
    np.testing.assert_array_equal(f.covariance, g.covariance)


@each_spec
def test_a_sensor_is_refused_exactly_where_its_innovation_is_too_unlikely(spec):
    """Moved outwards step by step, a marker is refused from the distance on that chi-square gives."""
    f, markers, wrench = following(spec)
    marker = measured(spec)[0]
    rows = [3 * marker + k for k in range(3) if spec.markers[marker].measured[k]]
    layout = Layout(spec)
    h, H = measurement.value_and_jacobian(layout, f.state)
    options = continuous(spec, 3)
    S = H[rows] @ f.covariance @ H[rows].T + options["marker_variance"][marker] * np.eye(len(rows))
    direction = np.linalg.cholesky(S)[:, 0] / np.linalg.norm(np.linalg.solve(S, np.linalg.cholesky(S)[:, 0]))
    direction /= np.sqrt(direction @ np.linalg.solve(S, direction))
    edge = np.sqrt(gate.limits(1e-4)[len(rows) - 1])
    for share, verdict in ((0.999, "accepted"), (1.001, "refused")):
        g, _, _ = following(spec)
        markers.ravel()[rows] = h[rows] + share * edge * direction
        g.update(markers, wrench)
        assert g.verdicts[marker] == verdict


@each_spec
def test_the_order_of_markers_does_not_matter_to_the_gate(spec):
    """All are judged at the prediction, before any is used: the same verdicts, the same state."""
    options = continuous(spec, 3) | GATES | {"marker_gate": gate.limits(0.2)}
    data = trial(spec, 3, 60)
    out = filter_of(spec, options, data.x0, data.P0).run(data.time, data.markers, data.wrench)
    assert (out["verdicts"][:, :-1] == 2).any()
    order = np.random.default_rng(5).permutation(len(spec.markers))
    other = copy.deepcopy(spec)
    other.markers = [other.markers[k] for k in order]
    there = [Layout(spec).names.index(name) for name in Layout(other).names]
    moved = options | {"marker_variance": options["marker_variance"][order]}
    for key in ("process_variance", "process_density", "decay_rate", "lower", "upper"):
        moved[key] = options[key][there]
    g = filter_of(other, moved, data.x0[there], data.P0[np.ix_(there, there)])
    permuted = g.run(data.time, data.markers[:, order], data.wrench)
    np.testing.assert_array_equal(permuted["verdicts"], out["verdicts"][:, [*order, len(order)]])
    np.testing.assert_allclose(permuted["state"], out["state"][:, there], rtol=1e-8, atol=1e-8)


@each_spec
def test_plates_may_need_markers(spec):
    """With wrench_needs_markers a frame of plates alone is not used; else it is."""
    for needs in (True, False):
        f, markers, wrench = following(spec, total_mass=None, wrench_needs_markers=needs)
        before = f.state
        report = f.update(np.full_like(markers, np.nan), wrench)
        assert (report.n_rows == 0) == needs
        assert np.array_equal(f.state, before) == needs
        assert report.status == ("nothing measured" if needs else "ok")


@each_spec
def test_without_limits_nothing_is_refused(spec):
    f, markers, wrench = following(spec, marker_gate=None, wrench_gate=None)
    f.update(markers + 1.0, wrench + 1e4)
    assert "refused" not in f.verdicts


@pytest.mark.parametrize("value", [0.0, -1.0, np.nan])
@pytest.mark.parametrize("key", ["marker_gate", "wrench_gate"])
def test_limits_that_are_none_are_refused(key, value):
    with pytest.raises(ValueError, match="gate: is"):
        following(SPECS[0], 1, **{key: [1.0, 2.0, value, 4.0, 5.0, 6.0]})


@each_spec
def test_an_iterated_update_ends_at_the_most_likely_state(spec):
    """From far off, one update reaches the state that minimises prior and measurement together."""
    layout = Layout(spec)
    data = trial(spec, 3, 1, gaps=False)
    sd = prior_sd(layout)
    sd[layout.block("coordinates")] = 0.5
    x0, P0 = data.truth[0].copy(), np.diag(sd**2)
    x0[layout.block("coordinates")] += 0.35 * np.random.default_rng(4).choice([-1, 1], layout.blocks["coordinates"][1])
    options = continuous(spec, 3, total_mass=None)
    f = filter_of(spec, options | {"iterate_beyond": 0.1}, x0, P0)
    none = np.full(6, np.nan)
    report = f.update(data.markers[0], none)
    oracle = Oracle(spec, Settings(**options), x0, P0)
    z, R, use = oracle.measurement_rows(data.markers[0], none)
    noise = np.sqrt(np.diag(R)[use])

    def cost(x):
        return np.concatenate([(x - x0) / sd, (z - measurement.everything(layout, x))[use] / noise])

    def slope(x):
        H = measurement.value_and_jacobian(layout, x)[1][use]
        return np.vstack([np.diag(1 / sd), -H / noise[:, None]])

    best = least_squares(cost, f.state, slope, x_scale=sd, xtol=1e-15, ftol=1e-15, gtol=1e-15)
    np.testing.assert_allclose(f.state / sd, best.x / sd, atol=1e-4)
    H = measurement.value_and_jacobian(layout, best.x)[1][use]
    expected = np.linalg.inv(np.diag(1 / sd**2) + H.T @ (H / noise[:, None] ** 2))
    np.testing.assert_allclose(f.covariance / np.outer(sd, sd), expected / np.outer(sd, sd), atol=1e-4)
    once = filter_of(spec, options, x0, P0)
    first = once.update(data.markers[0], none)
    assert (report.nis, report.n_rows) == (first.nis, first.n_rows)  # of the innovation as it was predicted
    assert (cost(f.state) ** 2).sum() < 0.9 * (cost(once.state) ** 2).sum()


@each_spec
def test_a_state_that_is_known_is_not_iterated(spec):
    """Below iterate_beyond the update is the plain one, to the last bit."""
    f, markers, wrench = following(spec)
    g, _, _ = following(spec, iterate_beyond=1.0)
    f.update(markers, wrench)
    g.update(markers, wrench)
    np.testing.assert_array_equal(f.state, g.state)
    np.testing.assert_array_equal(f.covariance, g.covariance)


@each_spec
def test_what_no_marker_sees_is_not_linearised_for(spec):
    """A coordinate may be as unsure as it likes where it moves none of the frame's markers: the update is plain."""
    layout, data = Layout(spec), trial(spec, 3, 1, gaps=False)
    leaf = spec.segments[-1]
    own = {a.coordinate for a in leaf.axes} - {a.coordinate for s in spec.segments[:-1] for a in s.axes}
    free = [c.name for c in spec.coordinates if not c.locked]
    unsure = [k for k, name in enumerate(free) if name in own]
    P0 = data.P0.copy()
    P0[unsure, unsure] += 4.0
    assert unsure and np.sqrt(np.delete(np.diag(P0)[: len(free)], unsure).max()) < 1.0
    markers = data.markers[0].copy()

    def updated(**changes):
        f = filter_of(spec, continuous(spec, 3) | changes, data.x0, P0)
        f.update(markers, data.wrench[0])
        return f.state[layout.block("coordinates")]

    assert not np.array_equal(updated(iterate_beyond=1.0), updated())
    markers[[m.segment == leaf.name for m in spec.markers]] = np.nan
    np.testing.assert_array_equal(updated(iterate_beyond=1.0), updated())
