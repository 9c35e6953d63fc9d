"""Bodies in space are possible, weigh what was measured and are alike on both sides, whatever the unknowns are."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dynakin.filter.estimator import Estimator
from dynakin.identification.inertial_parameters import InertialParameters, InertialPriors
from dynakin.model.definition import load_model
from dynakin.model.inertia import RigidBody
from dynakin.settings import presets
from dynakin.settings.subject import Subject
from dynakin.simulation.trial import simulate

_RNG = np.random.default_rng(7)
_NAMES = ("pelvis", "thigh_r", "thigh_l", "head")
_MASS = np.array([12.0, 9.0, 9.0, 5.0])
_CENTRE = np.array([[0.0, 0.05, 0.0], [0.01, -0.2, 0.02], [0.012, -0.21, -0.022], [0.0, 0.1, 0.0]])
_ROOT = np.triu(_RNG.normal(0.0, 0.03, (4, 3, 3))) + 0.1 * np.eye(3)
_MIRROR = np.diag([1.0, 1.0, -1.0])
_ROOT[2] = _MIRROR @ _ROOT[1] @ _MIRROR
BODIES = InertialParameters.in_space(_NAMES, 35.0, _MASS, _CENTRE, _ROOT, InertialPriors())
_COUNT = len(BODIES.sd)


def of_phi(phi: np.ndarray) -> list[RigidBody]:
    return [RigidBody.from_vector(vector) for vector in phi.reshape(-1, 10)]


def deviations(body: RigidBody) -> np.ndarray:
    """Covariance of the mass density about its mean, m^2."""
    c = body.centre
    return np.asarray(body.pseudo_inertia[:3, :3] / body.mass - np.outer(c, c))


@settings(max_examples=60, deadline=None)
@given(st.lists(st.floats(-2.0, 2.0), min_size=_COUNT, max_size=_COUNT))
def test_any_unknowns_are_possible_bodies_of_the_measured_mass(values: list[float]) -> None:
    bodies = of_phi(BODIES.phi(np.array(values)))
    for body in bodies:
        assert body.mass > 0.0
        assert np.linalg.eigvalsh(deviations(body)).min() > -1e-12
    assert sum(body.mass for body in bodies) == pytest.approx(35.0, rel=1e-12)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**31), st.floats(0.1, 4.0))
def test_draws_from_any_posterior_are_possible_bodies(seed: int, size: float) -> None:
    rng = np.random.default_rng(seed)
    A = size * rng.normal(size=(_COUNT, _COUNT)) / np.sqrt(_COUNT)
    for u in (A * BODIES.sd[:, None] @ rng.normal(size=(_COUNT, 5))).T:
        bodies = of_phi(BODIES.phi(u))
        assert all(body.possible() for body in bodies)
        assert sum(body.mass for body in bodies) == pytest.approx(35.0, rel=1e-12)


def test_no_deviation_is_the_table() -> None:
    for k, body in enumerate(of_phi(BODIES.phi(np.zeros(_COUNT)))):
        np.testing.assert_allclose(body.mass, _MASS[k])
        np.testing.assert_allclose(body.centre, _CENTRE[k], atol=1e-12)
        np.testing.assert_allclose(deviations(body), _ROOT[k] @ _ROOT[k].T, atol=1e-12)


def test_left_is_the_mirror_image_of_right_but_for_the_table() -> None:
    u = 2.0 * BODIES.sd * _RNG.normal(size=_COUNT)
    _, right, left, _ = of_phi(BODIES.phi(u))
    assert left.mass == pytest.approx(right.mass)
    np.testing.assert_allclose(left.centre - _CENTRE[2], _MIRROR @ (right.centre - _CENTRE[1]), atol=1e-12)
    np.testing.assert_allclose(deviations(left), _MIRROR @ deviations(right) @ _MIRROR, atol=1e-12)
    assert next(name for name in BODIES.unknowns if "thigh" in name) == "body/thigh/a"


def test_jacobian_is_the_central_difference() -> None:
    u, h = 0.3 * _RNG.normal(size=_COUNT), 1e-6
    numeric = np.stack([(BODIES.phi(u + h * e) - BODIES.phi(u - h * e)) / (2 * h) for e in np.eye(_COUNT)], axis=1)
    np.testing.assert_allclose(BODIES.jacobian(u), numeric, atol=1e-8)


def test_prior_is_round_in_the_entropic_metric() -> None:
    """tr((S^-1 dS)^2) / 2 of one standard deviation is alike for each of the six shape numbers."""
    k, inverse = 3, np.linalg.inv(_ROOT[3] @ _ROOT[3].T)
    first = _COUNT - 10
    lengths = []
    for part in range(4, 10):
        h = np.zeros(_COUNT)
        h[first + part] = 1e-5 * BODIES.sd[first + part]
        step = deviations(of_phi(BODIES.phi(h))[k]) - deviations(of_phi(BODIES.phi(-h))[k])
        change = inverse @ step / 2e-5
        lengths.append(np.trace(change @ change) / 2.0)
    np.testing.assert_allclose(lengths, 2.0 * InertialPriors().log_gyration ** 2, rtol=1e-5)


def test_covariance_counts_that_sides_may_differ_and_keeps_the_total() -> None:
    P = BODIES.covariance(np.zeros(_COUNT), np.diag(BODIES.sd**2))
    total = np.zeros(len(P))
    total[::10] = 1.0
    assert total @ P @ total < 1e-12
    difference = np.zeros(len(P))
    difference[10], difference[20] = 1.0, -1.0
    assert difference @ P @ difference == pytest.approx(2.0 * (0.025 * 9.0) ** 2, rel=1e-6)


def _sd(bodies: InertialParameters, name: str) -> np.ndarray:
    """Of phi at the table, by the prior, of the segment's mass and first moments over its mass."""
    found = np.sqrt(np.diag(bodies.covariance(np.zeros(len(bodies.sd)), np.diag(bodies.sd**2))))
    at = 10 * bodies.segments.index(name)
    return np.asarray(found[at : at + 4])


def test_a_shoe_widens_the_mass_and_where_it_lies() -> None:
    """Regardless of the segment's own mass: a light foot's by more than half, a thigh's hardly."""
    shod = InertialParameters.in_space(
        _NAMES, 35.0, _MASS, _CENTRE, _ROOT, InertialPriors(), worn_kg=np.array([0.0, 0.5, 0.5, 3.0])
    )
    at = [k for k, name in enumerate(shod.unknowns) if name.startswith(("body/thigh/", "body/head/"))]
    bare, more = BODIES.sd[at].reshape(2, 10), shod.sd[at].reshape(2, 10)
    np.testing.assert_allclose(more[:, 0] ** 2 - bare[:, 0] ** 2, [(0.5 / 9.0) ** 2, (3.0 / 5.0) ** 2])
    wide = np.sqrt(np.diagonal(_ROOT[[1, 3]] @ _ROOT[[1, 3]].swapaxes(1, 2), axis1=1, axis2=2))
    share = np.array([[0.5 / 9.0], [3.0 / 5.0]])
    np.testing.assert_allclose(more[:, 1:4] ** 2 - bare[:, 1:4] ** 2, (share * wide) ** 2)
    np.testing.assert_array_equal(more[:, 4:], bare[:, 4:])


def test_a_trunk_whose_joint_is_unsure_keeps_its_centre_and_its_doubt() -> None:
    held = InertialParameters.in_space(
        _NAMES, 35.0, _MASS, _CENTRE, _ROOT, InertialPriors(), trunks=[name == "head" for name in _NAMES]
    )
    at = [held.unknowns.index(f"body/head/c{axis}") for axis in "xyz"]
    np.testing.assert_allclose(held.sd[at], InertialPriors().trunk_centre * BODIES.sd[at])
    np.testing.assert_array_equal(np.delete(held.sd, at), np.delete(BODIES.sd, at))
    np.testing.assert_allclose(_sd(held, "head"), _sd(BODIES, "head"))  # not less known than it was


@pytest.mark.parametrize(("kg", "held"), [(75.0, True), (120.0, False)])
def test_a_person_may_wear_what_a_run_says_and_a_belly_shows(kg: float, held: bool) -> None:
    sim = simulate("fullbody", "squat", 1, 5.0, 50.0)
    estimator = Estimator(load_model("fullbody", Subject(mass_kg=kg, height_m=1.75)), presets.default())
    initial = estimator.start(sim.recording).calibrated
    bodies = InertialParameters.of(initial)
    for k, name in enumerate(bodies.segments):
        own = bodies.unknowns.index(f"body/{name.removesuffix('_l').removesuffix('_r')}/a")
        expected = initial.sd0[initial.names.index(f"inertia/{name}/mass")] / bodies.mass[k]
        assert bodies.sd[own] == pytest.approx(expected)
    assert bodies.sd[bodies.unknowns.index("body/foot/a")] > 0.3
    wide = bodies.sd[bodies.unknowns.index("body/torso/cx")]
    assert (wide < 0.003) == held and (wide > 0.01) != held
