"""Bodies are possible and weigh what was measured, whatever the unknowns are."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import dynakin
from dynakin.errors import ModelError
from dynakin.identification.inertial_parameters import InertialParameters, InertialPriors
from dynakin.identification.unknowns import Unknowns
from dynakin.simulation.trial import simulate
from support.identification import Case

_M, _C, _R = np.array([2.0, 30.0, 38.0]), np.array([[0.1, 0.0], [0.0, 0.2], [0.02, 0.3]]), np.array([0.05, 0.1, 0.2])
BODIES = InertialParameters.in_plane(("foot", "leg", "body"), 70.0, _M, _C, _R, np.ones(3), InertialPriors())


@settings(max_examples=60, deadline=None)
@given(st.lists(st.floats(-4.0, 4.0), min_size=12, max_size=12))
def test_any_unknowns_are_possible_bodies_of_the_measured_mass(values: list[float]) -> None:
    m, mx, my, izz = BODIES.phi(np.array(values)).reshape(-1, 4).T
    assert (m > 0.0).all()
    assert (m * izz > mx**2 + my**2).all()
    assert m.sum() == pytest.approx(70.0, rel=1e-12)


def test_no_deviation_is_the_table() -> None:
    phi = BODIES.phi(np.zeros(12)).reshape(-1, 4)
    np.testing.assert_allclose(phi[:, 0], _M)
    np.testing.assert_allclose(phi[:, 1:3], _M[:, None] * _C)
    np.testing.assert_allclose(phi[:, 3], _M * ((_C**2).sum(axis=1) + _R**2))


def test_jacobian_is_the_central_difference() -> None:
    u, h = np.random.default_rng(1).normal(0.0, 0.3, 12), 1e-6
    numeric = np.stack([(BODIES.phi(u + h * e) - BODIES.phi(u - h * e)) / (2 * h) for e in np.eye(12)], axis=1)
    np.testing.assert_allclose(BODIES.jacobian(u), numeric, atol=1e-8)


def test_jacobian_of_the_wrench_is_the_central_difference(case: Case) -> None:
    unknowns, core = Unknowns.of(case.common), case.common.core
    theta, h = 0.5 * unknowns.sd * np.random.default_rng(2).normal(size=len(unknowns.sd)), 1e-6
    states = case.trials[0].movement.states[100:102]
    numeric = np.stack(
        [
            (unknowns.wrench(core, states, theta + h * e) - unknowns.wrench(core, states, theta - h * e)) / (2 * h)
            for e in np.eye(len(theta))
        ],
        axis=2,
    )
    np.testing.assert_allclose(unknowns.jacobian(core, states, theta), numeric, atol=2e-6)


def test_a_model_that_estimates_no_inertia_is_refused_in_one_line() -> None:
    sim = simulate("sagittal7", "sway", 1, 3.0)
    subject = dynakin.Subject(mass_kg=70.0, height_m=1.75, sex="male")
    estimator = dynakin.Estimator(dynakin.load_model("sagittal7", subject=subject), estimate=["lengths"])
    with pytest.raises(ModelError, match=r"model sagittal7: identification needs .* this one estimates no inertia"):
        InertialParameters.of(estimator.start(sim.recording).calibrated)
