"""Least squares: what the wrench tells of the inertial parameters, and what it does not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dynakin.errors import RecordingError
from dynakin.settings.model import Bounds
from dynakin.validation.reference.least_squares import identify, inertia_of, predicted_wrench
from dynakin.validation.reference.regressor import parameter_names, table_dynamics, table_parameters, wrench_regressor
from support.perfect import MASS_KG, PLANE, Perfect, lively


def test_the_regressor_times_the_table_is_newton_eulers_wrench(perfect: Perfect) -> None:
    kinematics = lively(7)
    places = np.array([link.placement[:2] for link in perfect.chain.links])
    moving = np.random.default_rng(0).standard_normal((3, 400, 7, 2)) + places
    for motion in (kinematics, replace(kinematics, hinges=moving)):
        expected = table_dynamics(perfect.chain, motion).wrench[:, PLANE]
        found = wrench_regressor(perfect.chain, motion) @ table_parameters(perfect.chain)
        np.testing.assert_allclose(found, expected, rtol=1e-10, atol=1e-9)


@pytest.mark.parametrize("which", ["true", "impossible"])
def test_any_parameters_give_what_bodies_with_them_give(perfect: Perfect, which: str) -> None:
    """Negative masses too, as free least squares may find them."""
    names = parameter_names(perfect.chain)
    parameters = perfect.parameters(names)
    if which == "impossible":
        parameters = parameters * np.random.default_rng(1).uniform(-2.0, 2.0, len(names))
    expected = table_dynamics(perfect.chain, perfect.truth, inertia_of(perfect.chain, parameters)).wrench
    np.testing.assert_allclose(predicted_wrench(perfect.chain, perfect.truth, parameters), expected, atol=1e-8)


def test_seven_hinges_in_the_plane_show_22_of_28(perfect: Perfect) -> None:
    """Each hinge but the first hides one number: a mass at it may belong to either neighbour."""
    kinematics = lively(7)
    wrench = table_dynamics(perfect.chain, kinematics).wrench
    base = identify(perfect.chain, perfect.plan, kinematics, wrench).base
    assert base.rank == 22
    assert len(base.singular_values) == 28
    assert base.singular_values[22] < 1e-10 * base.singular_values[21]
    assert [n.split("/")[1] for n in base.over if n not in base.names] == [
        "shank", "thigh", "pelvis", "trunk", "upper_arm", "forearm",
    ]  # fmt: skip
    assert all(name.endswith("/mass") for name in base.over if name not in base.names)
    shank = next(link.placement for link in perfect.chain.links if link.name == "shank")
    row = base.K[base.names.index("inertia/foot/mx"), base.over.index("inertia/shank/mass")]
    assert row == pytest.approx(shank[0])  # a mass at the ankle, as the foot sees it
    assert "inertia/foot/mass + 1 inertia/shank/mass" in base.in_words()[0]


@pytest.mark.parametrize("excitation", ["lively", "squat"])
def test_base_parameters_of_noise_free_data_are_the_truths(perfect: Perfect, excitation: str) -> None:
    kinematics = lively(7) if excitation == "lively" else perfect.truth
    true = perfect.parameters(parameter_names(perfect.chain))
    wrench = predicted_wrench(perfect.chain, kinematics, true)
    found = identify(perfect.chain, perfect.plan, kinematics, wrench, mass_kg=MASS_KG)
    expected = found.base.of(perfect.trial.truth.parameters)
    # A squat with the feet flat excites some directions a million times less than others.
    tolerance = 1e-9 if excitation == "lively" else 1e-5
    np.testing.assert_allclose(found.base.values, expected, atol=tolerance)
    assert (found.base.sd > 0.0).all()
    again = predicted_wrench(perfect.chain, kinematics, found.free)
    assert np.abs(again - wrench)[:, PLANE].max() < 1e-6
    for prior, names in ((found.table, found.names),):
        assert names == parameter_names(perfect.chain)
        assert np.abs(found.free - prior).max() > 0.01  # it did move away from the table


def test_feet_that_never_move_hide_two_more(perfect: Perfect) -> None:
    """izz of a foot at rest never acts, and neither does its height over the sole."""
    kinematics = lively(7)
    for array in (kinematics.coordinates, kinematics.speeds, kinematics.accelerations):
        array[:, 0] = 0.0
    wrench = table_dynamics(perfect.chain, kinematics).wrench
    assert identify(perfect.chain, perfect.plan, kinematics, wrench).base.rank == 20


def test_what_the_wrench_does_not_see_stays_at_the_table(perfect: Perfect) -> None:
    kinematics = lively(7)
    wrench = table_dynamics(perfect.chain, kinematics).wrench
    found = identify(perfect.chain, perfect.plan, kinematics, wrench)
    np.testing.assert_allclose(found.free, found.table, atol=1e-8)
    np.testing.assert_allclose(found.bounded, found.table, atol=1e-6)
    assert found.at_bound == ()


def test_bounds_hold_and_those_reached_are_named(perfect: Perfect) -> None:
    kinematics = lively(7)
    heavy = 1.5 * table_dynamics(perfect.chain, kinematics).wrench
    found = identify(perfect.chain, perfect.plan, kinematics, heavy, bounds=Bounds(mass_fraction=0.1))
    limits = perfect.plan.bounds(Bounds(mass_fraction=0.1))
    for name, value in zip(found.names, found.bounded, strict=True):
        lower, upper = limits[name]
        assert lower - 1e-12 <= value <= upper + 1e-12, name
        assert (name in found.at_bound) == (min(value - lower, upper - value) < 1e-9), name
    assert "inertia/trunk/mass" in found.at_bound
    fit = predicted_wrench(perfect.chain, kinematics, found.bounded) - heavy
    table = predicted_wrench(perfect.chain, kinematics, found.table) - heavy
    assert np.nansum(fit**2) < np.nansum(table**2)


def test_the_total_mass_is_held(perfect: Perfect) -> None:
    """Plates that read 2 % too much do not make the person heavier."""
    kinematics = lively(7)
    wrench = 1.02 * table_dynamics(perfect.chain, kinematics).wrench
    for mass_kg, expected in ((MASS_KG, MASS_KG), (None, 1.02 * MASS_KG)):
        found = identify(perfect.chain, perfect.plan, kinematics, wrench, mass_kg=mass_kg)
        total = sum(v for n, v in zip(found.names, found.free, strict=True) if n.endswith("/mass"))
        assert total == pytest.approx(expected, abs=0.02)
        assert found.base.values[0] == pytest.approx(expected, abs=0.02)  # the first base parameter is the total mass


def test_sd_of_base_parameters_covers_their_errors(perfect: Perfect) -> None:
    rng = np.random.default_rng(4)
    kinematics, sigma = lively(7), (3.0, 5.0, 2.0)
    wrench = table_dynamics(perfect.chain, kinematics).wrench
    errors = []
    for _ in range(15):
        noisy = wrench.copy()
        noisy[:, PLANE] += rng.standard_normal((400, 3)) * sigma
        base = identify(perfect.chain, perfect.plan, kinematics, noisy, sigma=sigma).base
        table = dict(zip(parameter_names(perfect.chain), table_parameters(perfect.chain), strict=True))
        errors.append((base.values - base.of(table)) / base.sd)
    assert 0.85 < np.std(errors) < 1.15


def test_frames_with_gaps_are_left_out(perfect: Perfect) -> None:
    kinematics = lively(7)
    wrench = table_dynamics(perfect.chain, kinematics).wrench
    whole = identify(perfect.chain, perfect.plan, kinematics, wrench)
    wrench[10:20, 1] = np.nan
    kinematics.accelerations[15:40, 2] = np.nan
    found = identify(perfect.chain, perfect.plan, kinematics, wrench)
    assert (whole.frames, found.frames) == (400, 370)
    np.testing.assert_allclose(found.base.values, whole.base.values, atol=1e-8)


def test_too_few_frames_are_refused(perfect: Perfect) -> None:
    kinematics = lively(7, frames=20)
    wrench = table_dynamics(perfect.chain, kinematics).wrench
    with pytest.raises(RecordingError, match="20 frames have all coordinates and the wrench, expected at least 28"):
        identify(perfect.chain, perfect.plan, kinematics, wrench)
