"""Bodies stay possible: the nearest possible ones, by the projection; judged by principal moments."""

from __future__ import annotations

import copy

import numpy as np
import pytest
from scipy.optimize import least_squares

from support.core.bridge import filter_of
from support.core.projecting import covariance, project
from support.core.random_models import PLANAR_INERTIA, continuous, inertia, planar_model, spatial_model, trial
from support.oracle.inertia import all_possible, is_planar
from support.oracle.mechanics import inertia_tensor
from support.oracle.spec import Axis, Coordinate, Marker, Segment, Spec
from support.oracle.state import Layout

TRIANGLE = np.tril_indices(4)
MARGIN, TOLERATED = 1e-4, 0.5e-4  # consistency.hpp
SPECS = [planar_model(50, n_segments=5), spatial_model(2), spatial_model(6)]
each_spec = pytest.mark.parametrize("spec", SPECS, ids=lambda s: s.name)


def impossible(spec, seed, size=0.4):
    """A state near a possible one whose bodies are mostly impossible, and a covariance of its size."""
    layout, rng = Layout(spec), np.random.default_rng(seed)
    x = layout.initial_state()
    here = layout.block("inertia")
    scale = np.ones(layout.size)
    scale[here] = size * np.maximum(np.abs(x[here]), 0.05)
    x = x + 0.3 * scale * rng.normal(size=layout.size)
    x[here] += 2.0 * scale[here] * rng.normal(size=x[here].size)
    return x, covariance(layout.size, rng, -1.0, 1.0) * np.outer(scale, scale)


@each_spec
def test_an_impossible_body_is_made_possible(spec):
    layout = Layout(spec)
    tried = 0
    for seed in range(60):
        x, P = impossible(spec, seed)
        out = project(spec, x, P)
        assert out.met, seed
        assert all_possible(layout, out.x), seed
        np.testing.assert_array_equal(out.P, P)
        if all_possible(layout, x):
            continue
        assert out.active > 0
        tried += 1
    assert tried > 30


@pytest.mark.parametrize("spec", [spatial_model(s) for s in (4, 5, 10)], ids=lambda s: s.name)
def test_several_bodies_far_from_possible_are_mended_together(spec):
    """One after the other they never end: mending one spoils the next."""
    for seed in range(100, 160):
        x, P = impossible(spec, seed, 1.0)
        out = project(spec, x, P)
        assert out.met, seed
        assert all_possible(Layout(spec), out.x), seed


@each_spec
def test_possible_bodies_are_left_alone(spec):
    layout, rng = Layout(spec), np.random.default_rng(5)
    for _ in range(30):
        x = layout.initial_state()
        here = layout.block("inertia")
        x[here] *= 1 + 0.02 * rng.normal(size=x[here].size)
        if not all_possible(layout, x):
            continue
        out = project(spec, x, covariance(x.size, rng))
        np.testing.assert_array_equal(out.x, x)
        assert out.active == 0


def single_body(planar, seed, estimated=None):
    """One segment on a hinge, with all of its inertia estimated unless given otherwise."""
    phi = inertia(np.random.default_rng(seed))
    estimated = estimated or (PLANAR_INERTIA if planar else [True] * 10)
    body = Segment("body", "ground", axes=[Axis("q", "rotation", np.array([0, 0, 1.0]))])
    body.inertia, body.inertia_estimated = phi, list(estimated)
    wrench = [True, True, False, False, False, True] if planar else [True] * 6
    return Spec("body", [Coordinate("q")], [], [body], [Marker("m", "body", np.zeros(3))], wrench_measured=wrench)


def scaled_matrix(phi, first, planar):
    """The matrix whose smallest eigenvalue counts, each axis in units of where it started."""

    def matrix(p):
        if planar:
            return np.array([[p[6], p[1], p[2]], [p[1], p[0], 0], [p[2], 0, p[0]]])
        tensor = inertia_tensor(p)
        J = np.zeros((4, 4))
        J[:3, :3] = np.trace(tensor) / 2 * np.eye(3) - tensor
        J[:3, 3] = J[3, :3] = p[1:4]
        J[3, 3] = p[0]
        return J

    d = 1 / np.sqrt(np.diag(matrix(first)))
    return matrix(phi) * np.outer(d, d), d


def body_in_plane(free, d, margin):
    """m, mx, my, izz of any body that is possible by the margin: (izz' - margin) (m' - margin) >= mx'^2 + my'^2."""
    log_mass, mx, my, spread = free
    mass = np.exp(log_mass)
    spin = (mx**2 + my**2) / mass + spread**2
    return np.array([(mass + margin) / d[1] ** 2, mx / (d[0] * d[1]), my / (d[0] * d[1]), (spin + margin) / d[0] ** 2])


def body_in_space(free, d, margin):
    """Ten numbers of any body that is possible by the margin: J' = margin + L L', L triangular."""
    L = np.zeros((4, 4))
    L[np.tril_indices(4)] = free
    J = (L @ L.T + margin * np.eye(4)) / np.outer(d, d)
    tensor = np.trace(J[:3, :3]) * np.eye(3) - J[:3, :3]
    return np.array([J[3, 3], *J[:3, 3], *np.diag(tensor), tensor[0, 1], tensor[0, 2], tensor[1, 2]])


def nearest_cost(wanted, P, first, planar, margin):
    """Smallest (phi - wanted)' P^-1 (phi - wanted) over all bodies that are possible by the margin.

    The bodies are written so that nothing is constrained any more, and sought from several starts.
    """
    root = np.linalg.inv(np.linalg.cholesky(P))
    _, d = scaled_matrix(first, first, planar)
    body, start = (body_in_plane, np.array([0.0, 0.1, 0.1, 0.5])) if planar else (body_in_space, np.eye(4)[TRIANGLE])
    rng = np.random.default_rng(0)
    starts = [start + 0.2 * k * rng.normal(size=start.size) for k in range(3)]
    tight = {"xtol": 1e-12, "ftol": 1e-12, "gtol": 1e-12, "max_nfev": 500}
    return min(2 * least_squares(lambda f: root @ (body(f, d, margin) - wanted), s, **tight).cost for s in starts)


def nearest_costs(wanted, P, first, planar, _):
    """By what is tolerated, and by the margin."""
    return [nearest_cost(wanted, P, first, planar, margin) for margin in (TOLERATED, MARGIN)]


# Of bodies in space by their seed: what `nearest_costs` takes up to 4 s for one to find. The nightly
# test finds them again, and shows what is to be stored of a seed that differs.
STORED = {
    0: [0.4558995023, 0.456167825],
    1: [0.1273722667, 0.1274304676],
    2: [0.3315171641, 0.3316968211],
    4: [4.218599144, 4.219051142],
    5: [0.1981268956, 0.1981733536],
    6: [6.359135307, 6.359915903],
    7: [149.9304061, 149.9438293],
    8: [2.65335866, 2.6536486],
    9: [3.464171547, 3.464277043],
    10: [6.234252613, 6.234878958],
    11: [0.02443535522, 0.02448562383],
    12: [0.1270552714, 0.1270700505],
    13: [7.509402856, 7.511077395],
    14: [17.52519893, 17.52844156],
    15: [0.02240150623, 0.02242738792],
}


def stored_costs(*given):
    return STORED[given[-1]]


@pytest.mark.parametrize(
    ("planar", "seeds", "costs"),
    [
        pytest.param(True, range(60), nearest_costs, id="plane"),
        pytest.param(False, range(16), stored_costs, id="space"),
        pytest.param(False, range(16), nearest_costs, id="space, sought", marks=pytest.mark.nightly),
    ],
)
def test_the_body_found_is_the_nearest_possible_one(planar, seeds, costs):
    """Its distance lies between those of the nearest bodies possible by what is tolerated and by the margin."""
    kept = np.array([0, 1, 2, 6]) if planar else np.arange(10)
    tried = 0
    for seed in seeds:
        spec = single_body(planar, seed)
        x, P = impossible(spec, seed, 0.3)
        here = Layout(spec).block("inertia")
        first = np.array(spec.segments[0].inertia)
        if all_possible(Layout(spec), x):
            continue
        out = project(spec, x, P)
        full = first.copy()
        full[kept] = out.x[here]
        assert np.linalg.eigvalsh(scaled_matrix(full, first, planar)[0])[0] > 0.999 * TOLERATED
        cost = (out.x - x) @ np.linalg.solve(P, out.x - x)
        least, most = costs(x[here], P[here, here], first, planar, seed)
        assert planar or [least, most] == pytest.approx(STORED[seed], rel=1e-6), seed
        assert least * (1 - 1e-6) <= cost <= most * (1 + 1e-6), seed
        tried += 1
    assert tried > 5


@pytest.mark.parametrize("planar", [True, False], ids=["plane", "space"])
@pytest.mark.parametrize("kept", [[0], [1], [6], [0, 1], [1, 2, 6], [0, 6]], ids=str)
def test_numbers_that_are_not_estimated_are_respected(planar, kept):
    """A fixed mass, a fixed first moment: the numbers that are free give way alone."""
    estimated = [k in kept for k in range(10)]
    tried = 0
    for seed in range(20):
        spec = single_body(planar, seed, estimated)
        x, P = impossible(spec, seed, 1.0)
        if all_possible(Layout(spec), x):
            continue
        out = project(spec, x, P)
        assert out.met, seed
        assert all_possible(Layout(spec), out.x), seed
        tried += 1
    assert tried > 2


def test_out_of_plane_numbers_count_where_the_wrench_is_measured_in_space():
    """izz may not exceed ixx + iyy, even if these are not estimated; in the plane nobody asks."""
    space, plane = single_body(False, 3, PLANAR_INERTIA), single_body(True, 3, PLANAR_INERTIA)
    assert is_planar(plane) and not is_planar(space)
    for spec in (space, plane):
        layout = Layout(spec)
        x = layout.initial_state()
        x[layout.names.index("inertia/body/izz")] *= 5
        out = project(spec, x, np.eye(layout.size))
        assert out.met
        assert all_possible(layout, out.x)
        assert np.array_equal(out.x, x) == (spec is plane)


def test_a_start_nearer_to_impossible_than_the_margin_may_stay():
    """A rod as thin as a needle is possible; the margin gives way to it."""
    for planar in (True, False):
        spec = single_body(planar, 1)
        spec.segments[0].inertia = np.array([2.0, 0, 0.6, 0, 0.24, 1e-7, 0.24, 0, 0, 0])
        layout = Layout(spec)
        x = layout.initial_state()
        assert all_possible(layout, x)
        out = project(spec, x, np.eye(layout.size))
        np.testing.assert_array_equal(out.x, x)
        x[layout.names.index("inertia/body/my")] = 1.1
        out = project(spec, x, np.eye(layout.size))
        assert out.met
        assert all_possible(layout, out.x)


@pytest.mark.parametrize("planar", [True, False], ids=["plane", "space"])
def test_a_body_without_extent_gains_one_or_stays(planar):
    """A point mass is the edge of what is possible: it is not lost on it, and the filter says so if it cannot help."""
    spec = single_body(planar, 1)
    spec.segments[0].inertia = np.array([2.0] + [0.0] * 9)
    out = project(spec, Layout(spec).initial_state(), np.eye(Layout(spec).size))
    assert np.isfinite(out.x).all()
    np.testing.assert_allclose(out.x, Layout(spec).initial_state(), atol=1e-6)
    fixed = single_body(planar, 1, [k == 0 for k in range(10)])
    fixed.segments[0].inertia = np.array([2.0] + [0.0] * 9)
    out = project(fixed, Layout(fixed).initial_state(), np.eye(Layout(fixed).size))
    np.testing.assert_array_equal(out.x, Layout(fixed).initial_state())


def test_a_body_that_no_estimate_can_make_possible_is_reported_and_does_not_run_away():
    """A first moment without any second: more mass does not help. The mass stays where the data want it."""
    spec = single_body(True, 1, [k == 0 for k in range(10)])
    spec.segments[0].inertia = np.array([2.0, 0, 0.5, 0, 0, 0, 0.0, 0, 0, 0])
    x = Layout(spec).initial_state()
    out = project(spec, x, np.eye(x.size))
    assert not out.met
    assert out.status == "nothing measured"
    np.testing.assert_allclose(out.x, x, atol=1e-9)


@each_spec
def test_bounds_and_bodies_together(spec):
    """Boxes that cut through the possible bodies: both are kept."""
    layout, rng = Layout(spec), np.random.default_rng(9)
    here = layout.block("inertia")
    for seed in range(30):
        x, P = impossible(spec, seed)
        start = layout.initial_state()
        lower, upper = np.full(layout.size, -np.inf), np.full(layout.size, np.inf)
        half = 0.5 * np.abs(start[here]) * rng.uniform(0.3, 1, start[here].size) + 0.01
        lower[here], upper[here] = start[here] - half, start[here] + half
        out = project(spec, x, P, lower=lower, upper=upper)
        assert out.met, seed
        assert (out.x >= lower).all()
        assert (out.x <= upper).all()
        assert all_possible(layout, out.x), seed


@pytest.mark.parametrize("spec", [planar_model(50, n_segments=5), spatial_model(2)], ids=lambda s: s.name)
def test_bodies_are_possible_at_every_frame_of_a_trial_that_pulls_at_them(spec):
    """The plates tell of a body that cannot be: without the projection the estimate leaves what is possible."""
    spec = copy.deepcopy(spec)
    for segment in spec.segments:  # slender: close to the edge
        m, c = segment.inertia[0], segment.inertia[1:4] / segment.inertia[0]
        segment.inertia[4:7] = m * (c @ c - c**2) + 0.02 * m * 0.01
        segment.inertia[7:10] = -m * np.array([c[0] * c[1], c[0] * c[2], c[1] * c[2]])
    data, layout = trial(spec, 6, 60), Layout(spec)
    here = layout.block("inertia")
    data.P0[here, here] *= 9.0
    unbounded = {"lower": np.full(layout.size, -np.inf), "upper": np.full(layout.size, np.inf)}
    possible = {}
    for constraint in ("none", "projection"):
        f = filter_of(spec, continuous(spec, 6, constraint=constraint, **unbounded), layout.initial_state(), data.P0)
        out = f.run(data.time, data.markers, data.wrench)
        assert np.isfinite(out["state"]).all()
        assert out["constraints_met"].all()
        possible[constraint] = np.array([all_possible(layout, x) for x in out["state"]])
    assert not possible["none"].all()
    assert possible["projection"].all()
