"""A body in space goes through the same simulator: what must hold in the plane holds for it."""

from __future__ import annotations

import numpy as np
import pytest

from dynakin.errors import ConfigError
from dynakin.simulation.mechanics import kinematics
from dynakin.simulation.output import SimulatedTrial
from dynakin.simulation.sensors.sizes import SensorNoise
from dynakin.simulation.trial import simulate
from support.trees import inverse_dynamics, motion_of, spatial_body, waving, wrench_of_momentum

RATE_HZ = 200.0
MIDDLE = {"knee_r": 0.4, "knee_l": 0.4, "elbow_r": 0.5, "elbow_l": 0.5}


@pytest.fixture(scope="module")
def trial() -> SimulatedTrial:
    body = spatial_body()
    motion = waving(body.coordinates, MIDDLE)
    return simulate(body, motion, seed=2, duration_s=3.0, rate_hz=RATE_HZ, noise=SensorNoise.none())


def test_it_is_a_whole_person(trial: SimulatedTrial) -> None:
    assert sum(segment.mass for segment in trial.truth.tree) == pytest.approx(64.0, rel=1e-12)
    assert trial.truth.data.sizes["coordinate"] == 29


def test_plates_measure_the_rate_of_momentum(trial: SimulatedTrial) -> None:
    """Linear and angular momentum about the ground origin, from poses and their rates in the truth alone."""
    moving = kinematics(trial.truth.tree, motion_of(trial))
    expected = wrench_of_momentum(trial.truth.tree, moving.segments, 1.0 / RATE_HZ)
    measured = trial.recording.total_wrench(about=trial.truth.origin_L)
    assert np.abs(measured - expected)[3:-3].max() < 2e-4 * np.abs(expected).max()
    np.testing.assert_allclose(measured, trial.truth.data["wrench"].values, atol=1e-9)


def test_moments_equal_pinocchios_with_each_foots_own_wrench(trial: SimulatedTrial) -> None:
    pin = pytest.importorskip("pinocchio", reason="Pinocchio is not installed (it is in the dev extra)")
    data = trial.truth.data.isel(time=slice(0, None, 50))
    outside = {
        f"foot_{word[0]}": data["contact_wrench"].sel(contact=f"{word} foot").values for word in ("right", "left")
    }
    expected = inverse_dynamics(pin, trial.truth.tree, motion_of(trial, 50), outside)
    assert np.abs(data["moments"].values - expected).max() < 1e-11 * np.abs(expected).max()


def test_nothing_but_the_ground_carries_the_pelvis(trial: SimulatedTrial) -> None:
    root = [name for name in trial.truth.data["coordinate"].values if str(name).startswith("pelvis")]
    assert len(root) == 6
    assert np.abs(trial.truth.data["moments"].sel(coordinate=root)).max() < 1e-9


def test_the_lesser_foot_carries_less(trial: SimulatedTrial) -> None:
    """Each foot presses at its own side, and the shares follow the centre of pressure."""
    right, left = trial.recording.plates
    total = right.force[:, 1] + left.force[:, 1]
    assert right.force[:, 1].min() > 0.0
    assert left.force[:, 1].min() > 0.0
    z = (right.force[:, 1] * right.cop[:, 2] + left.force[:, 1] * left.cop[:, 2]) / total - trial.truth.origin_L[2]
    np.testing.assert_allclose(right.force[:, 1] / total, np.clip((z + 0.15) / 0.30, 0.0, 1.0), atol=1e-12)


def test_soft_tissue_follows_the_driver_that_a_site_names() -> None:
    body = spatial_body()
    noise = SensorNoise(soft_tissue_random=0.0)
    trial = simulate(body, waving(body.coordinates, MIDDLE), duration_s=1.0, noise=noise)
    moved = np.linalg.norm(trial.truth.data["soft_tissue"].sel(marker="thigh_r_0+").values, axis=1)
    knee = trial.truth.data["coordinates"].sel(coordinate="knee_r").values
    np.testing.assert_allclose(moved, 0.018 * np.abs(knee - knee[0]) / 1.6, atol=1e-12)


@pytest.mark.parametrize("motion", ["squat", "sway"])
def test_a_motion_that_the_body_does_not_know_is_named(motion: str) -> None:
    with pytest.raises(ConfigError, match=f"motion is '{motion}', but spatial knows none of them"):
        simulate(spatial_body(), motion)


def test_a_motion_without_a_coordinate_is_named() -> None:
    body = spatial_body()
    with pytest.raises(ConfigError, match="no coordinate 'elbow_l'"):
        simulate(body, waving(body.coordinates[:-1], MIDDLE))
