"""Mass that a segment has more or less than the table says, with the shape of its inertia."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dynakin.filter.augment import initial_covariance
from dynakin.model.definition import load_model
from dynakin.model.inertia import INERTIA_NAMES, RigidBody
from dynakin.model.state_priors import inertia_bounds, inertia_covariance, inertia_prior
from dynakin.settings.model import Bounds, Priors
from dynakin.settings.noise import Noise
from support.made_in_space import measured

SHOE_KG = 0.3
FOOT = RigidBody.from_centre(0.7, [0.06, -0.04, 0.0], np.diag([0.001, 0.004, 0.004]))


def test_more_mass_is_more_of_the_same_body_anywhere_in_it() -> None:
    alone = np.array(list(inertia_prior(FOOT, 0.15, Priors()).values()))
    added = inertia_covariance(FOOT, 0.15, Priors(), SHOE_KG) - np.diag(alone**2)
    heavier = RigidBody.from_vector(FOOT.vector * (1.0 + SHOE_KG / FOOT.mass))
    assert heavier.possible()
    change = heavier.vector - FOOT.vector
    anywhere = np.zeros((10, 10))
    anywhere[1:4, 1:4] = SHOE_KG**2 * np.diag([0.0035, 0.0005, 0.0005]) / FOOT.mass
    np.testing.assert_allclose(added, np.outer(change, change) + anywhere, atol=1e-15)
    np.testing.assert_array_equal(inertia_covariance(FOOT, 0.15, Priors(), 0.0), np.diag(alone**2))


def test_bounds_leave_room_for_it_and_mass_stays_positive() -> None:
    narrow, wide = (inertia_bounds(FOOT, 0.15, Bounds(), worn_kg) for worn_kg in (0.0, SHOE_KG))
    for name in INERTIA_NAMES:
        assert wide[name][1] >= narrow[name][1]
    assert narrow["mass"] == pytest.approx((0.56, 0.84))
    assert wide["mass"] == pytest.approx((0.07, 0.84 + 4.0 * SHOE_KG))
    assert wide["izz"][0] > 0.0


def test_the_filter_starts_from_it() -> None:
    initial = measured()
    names = list(initial.names)
    body = initial.measured_plan().inertia["foot_r"]
    at = [names.index(f"inertia/foot_r/{name}") for name in INERTIA_NAMES]
    worn_kg = Priors().shoe_mass_sd_fraction * 70.0
    noise = Noise(total_mass_use="frame")
    found = initial_covariance(initial, noise)[np.ix_(at, at)]
    expected = inertia_covariance(body, initial.measured_plan().reach["foot_r"], Priors(), worn_kg)
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-15)
    np.testing.assert_allclose(initial.sd0[at] ** 2, np.diag(expected))
    assert np.linalg.eigvalsh(initial_covariance(initial, Noise())).min() > -1e-12
    surer = initial.sd0.copy()
    surer[at] *= 0.1  # known from another trial, say
    sure = initial_covariance(replace(initial, sd0=surer), noise)[np.ix_(at, at)]
    np.testing.assert_allclose(sure, 0.01 * expected, rtol=1e-9, atol=1e-17)


def test_planar_models_keep_their_prior() -> None:
    model = load_model("squat7").model
    assert not model.sided
    plan = replace(measured().measured_plan(), model=model)
    assert plan.worn_kg(Priors()) == {} and plan.joint_prior(Priors()) is None


@pytest.mark.parametrize("ahead_m", [-0.06, 0.0, 0.06])
def test_a_foot_may_wear_a_shoe_and_be_as_heavy_as_in_other_models(ahead_m: float) -> None:
    """A shoe of 0.6 % of the body, or a foot of 2.1 % instead of the table's 1.2 %, heavy at heel or toes."""
    plan = measured().measured_plan()
    sd, body = plan.prior(Priors()), plan.inertia["foot_r"]
    for more_kg in (0.006 * 70.0, 0.021 * 70.0 - body.mass):
        assert more_kg < 1.3 * sd["inertia/foot_r/mass"]
        assert abs(more_kg * (body.centre[0] + ahead_m)) < 1.7 * sd["inertia/foot_r/mx"]
    worn = plan.worn_kg(Priors())
    assert {name for name, kg in worn.items() if kg > worn["hand_r"]} == {"foot_r", "foot_l"}
