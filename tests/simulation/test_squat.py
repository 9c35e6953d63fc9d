"""A simulated squat trial: its truth is consistent, its sensors can be switched, its seed decides all."""

from __future__ import annotations

import numpy as np
import pytest

from dynakin.errors import ConfigError
from dynakin.recordings.standing import standing_window
from dynakin.simulation.mechanics import kinematics
from dynakin.simulation.output import SimulatedTrial
from dynakin.simulation.sensors.sensed_markers import regions
from dynakin.simulation.sensors.sizes import SensorNoise
from dynakin.simulation.trial import simulate_squat
from support.trees import motion_of


@pytest.fixture(scope="module")
def perfect() -> SimulatedTrial:
    return simulate_squat(seed=2, noise=SensorNoise.none())


def test_speeds_and_accelerations_are_derivatives() -> None:
    """At 1000 Hz central differences err by less than 1e-4 of the peak."""
    data = simulate_squat(seed=3, duration_s=6.0, rate_hz=1000.0).truth.data
    for value, rate in (("coordinates", "speeds"), ("speeds", "accelerations")):
        difference = np.gradient(data[value].values, 1e-3, axis=0)
        error = np.abs(difference - data[rate].values)[1:-1].max()
        assert error < 1e-4 * np.abs(data[rate].values).max(), rate


def test_force_is_the_rate_of_momentum() -> None:
    """Mass times the second difference of the centre of mass, from the truth's own positions."""
    trial = simulate_squat(seed=3, duration_s=6.0, rate_hz=1000.0)
    truth, data = trial.truth, trial.truth.data
    moving = kinematics(truth.tree, motion_of(trial))
    mc = sum(s.mass * moving.segments[s.name].point(s.com) for s in truth.tree)
    mass = sum(s.mass for s in truth.tree)
    second = (mc[2:] - 2.0 * mc[1:-1] + mc[:-2]) / 1e-6
    expected = second + mass * np.array([0.0, 9.80665, 0.0])
    assert np.abs(data["wrench"].values[1:-1, :3] - expected).max() < 0.01  # N


def test_moments_do_the_work_that_the_energy_gains() -> None:
    data = simulate_squat(seed=4, duration_s=6.0, rate_hz=1000.0).truth.data
    power = (data["moments"] * data["speeds"]).sum("coordinate").values
    gained = np.gradient((data["kinetic_energy"] + data["potential_energy"]).values, 1e-3)
    assert np.abs(power - gained)[1:-1].max() < 1e-4 * np.abs(power).max()


def test_the_toe_moment_is_the_grounds(perfect: SimulatedTrial) -> None:
    """The first hinge turns about -Z at the ground origin, so its moment is the wrench's -mz."""
    data = perfect.truth.data
    moment = data["moments"].sel(coordinate="toe").values
    np.testing.assert_allclose(moment, -data["wrench"].sel(component="mz").values, rtol=1e-12)


@pytest.mark.parametrize("seed", range(1, 9))
def test_centre_of_pressure_stays_within_the_feet(seed: int) -> None:
    recording = simulate_squat(seed, noise=SensorNoise.none()).recording
    heel, toe = recording.marker("r_calc")[:, 0].max(), recording.marker("r_toe")[:, 0].min()
    for plate in recording.plates:
        assert plate.cop[:, 0].min() > heel
        assert plate.cop[:, 0].max() < toe
        assert plate.force[:, 1].min() > 100.0


def test_perfect_plates_add_up_to_the_true_wrench(perfect: SimulatedTrial) -> None:
    measured = perfect.recording.total_wrench(about=perfect.truth.origin_L)
    np.testing.assert_allclose(measured, perfect.truth.data["wrench"].values, atol=1e-9)


def test_perfect_markers_lie_where_the_bones_are(perfect: SimulatedTrial) -> None:
    data = perfect.truth.data
    for name in data["marker"].values:
        exact = data["markers"].sel(marker=name).values + perfect.truth.origin_L
        np.testing.assert_allclose(perfect.recording.marker(str(name)), exact, atol=1e-12)
    hip = 0.5 * (perfect.recording.marker("R_HJC_reg") + perfect.recording.marker("L_HJC_reg"))
    true_hip = data["joint_centres"].sel(joint="hip").values + perfect.truth.origin_L
    np.testing.assert_allclose(hip, true_hip, atol=1e-12)


def test_markers_stay_rigid_on_their_segments(perfect: SimulatedTrial) -> None:
    """Without noise two markers of one segment keep their distance; knee to ankle is the shank's length."""
    recording = perfect.recording
    for a, b in (("r_knee", "r_thigh1"), ("r.ASIS", "L.PSIS"), ("C7", "R_Shoulder"), ("r_sh2", "r_sh3")):
        distance = np.linalg.norm(recording.marker(a) - recording.marker(b), axis=1)
        assert np.ptp(distance) < 1e-12
    shank = np.linalg.norm((recording.marker("r_knee") - recording.marker("r_ankle"))[:, :2], axis=1)
    np.testing.assert_allclose(shank, perfect.truth.parameters["length/shank"], rtol=1e-12)


def test_soft_tissue_has_its_declared_size() -> None:
    """Over subjects: the root mean square at the deepest frames, scaled to a full squat, is the list's."""
    at_depth: list[float] = []
    for seed in range(1, 13):
        data = simulate_squat(seed, 6.0, noise=SensorNoise(soft_tissue_random=0.0)).truth.data
        ratio = (data["coordinates"] - data["coordinates"][0]).sel(coordinate="knee").values / np.deg2rad(95.0)
        deepest = int(np.argmax(ratio))
        moved = np.linalg.norm(data["soft_tissue"].sel(marker="r_thigh2").values[deepest])
        at_depth.append(float(moved / ratio[deepest]))
    np.testing.assert_allclose(at_depth, regions()["thigh"].amplitude_m, rtol=1e-9)
    wandering = simulate_squat(5, 60.0, noise=SensorNoise(soft_tissue_random=1.0)).truth.data["soft_tissue"]
    thigh = [name for name in wandering["marker"].values if "thigh" in str(name)]
    rms = float(np.sqrt((wandering.sel(marker=thigh) ** 2).sum("axis").mean()))
    assert rms == pytest.approx(regions()["thigh"].amplitude_m, rel=0.1)
    assert float(np.abs(wandering.sel(marker=["r_toe", "L_toe"])).max()) == 0.0


def test_noise_has_its_declared_size(perfect: SimulatedTrial) -> None:
    noise = SensorNoise(marker_sd_m=0.002, soft_tissue=0.0, plate_force_sd_n=3.0, plate_moment_sd_nm=0.5)
    noisy = simulate_squat(seed=2, noise=noise).recording
    own = slice(0, -2)  # the virtual hip centres at the end follow the four pelvis markers
    difference = (noisy.markers - perfect.recording.markers)[:, own]
    assert difference.std() == pytest.approx(0.002, rel=0.02)
    force = noisy.plates[0].force - perfect.recording.plates[0].force
    assert force.std() == pytest.approx(3.0, rel=0.05)


def test_the_same_seed_gives_the_same_bytes_and_another_seed_does_not() -> None:
    one, same, other = (simulate_squat(seed, duration_s=6.0) for seed in (7, 7, 8))
    assert one.recording.markers.tobytes() == same.recording.markers.tobytes()
    for a, b in zip(one.recording.plates, same.recording.plates, strict=True):
        assert a.force.tobytes() == b.force.tobytes()
        assert a.moment.tobytes() == b.moment.tobytes()
    assert one.truth.data.identical(same.truth.data)
    assert one.truth.parameters == same.truth.parameters != other.truth.parameters
    assert one.recording.markers.tobytes() != other.recording.markers.tobytes()


def test_one_sensors_noise_leaves_the_others_as_they_are() -> None:
    loud = simulate_squat(1, 6.0, noise=SensorNoise(marker_sd_m=0.01)).recording
    quiet = simulate_squat(1, 6.0, noise=SensorNoise(marker_sd_m=0.0)).recording
    assert loud.plates[0].moment.tobytes() == quiet.plates[0].moment.tobytes()


def test_it_begins_standing_and_squats_deep(perfect: SimulatedTrial) -> None:
    standing = standing_window(perfect.recording)
    assert standing is not None
    assert standing.start == 0
    knee = np.rad2deg(perfect.truth.data["coordinates"].sel(coordinate="knee").values)
    assert knee[0] < 10.0
    assert knee.max() > 60.0


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        ({"duration_s": 2.0}, "duration_s"),
        ({"rate_hz": 0.0}, "rate_hz"),
        ({"mass_kg": 0.0}, "mass_kg"),
        ({"sex": "x"}, "sex"),
    ],
)
def test_a_wrong_argument_is_named(arguments: dict[str, float | str], word: str) -> None:
    with pytest.raises(ConfigError, match=word):
        simulate_squat(**arguments)  # type: ignore[arg-type]


@pytest.mark.parametrize("key", ["marker_sd_m", "soft_tissue", "plate_force_sd_n"])
def test_negative_noise_is_refused(key: str) -> None:
    with pytest.raises(ConfigError, match=key):
        SensorNoise(**{key: -1.0})
