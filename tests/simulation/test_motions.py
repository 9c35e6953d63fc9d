"""Sitting down and standing up, swaying, and a motion from a file: possible for a person, and exact."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dynakin.errors import ConfigError, RecordingError
from dynakin.results.files.storage import write_storage
from dynakin.simulation.mechanics import Motion, kinematics
from dynakin.simulation.motions.registry import MOTIONS
from dynakin.simulation.output import SimulatedTrial
from dynakin.simulation.sensors.sizes import SensorNoise
from dynakin.simulation.trial import simulate
from support.trees import inverse_dynamics, motion_of

PERFECT = SensorNoise.none()
MODELS = ("sagittal7", "squat7")
SHORTEST = {"squat": 6.0, "sit-to-stand": 12.0, "sway": 6.0}
HEEL, TOE = {"sagittal7": "r_calc", "squat7": "RHEE"}, {"sagittal7": "r_toe", "squat7": "RTOE"}


@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize("model", MODELS)
def test_truth_is_consistent(model: str, motion: str) -> None:
    """Speeds and accelerations are derivatives; force is the second derivative of the centre of mass times the mass."""
    trial = simulate(model, motion, 3, SHORTEST[motion], 500.0, noise=PERFECT)
    data, tree = trial.truth.data, trial.truth.tree
    for value, rate in (("coordinates", "speeds"), ("speeds", "accelerations")):
        error = np.abs(np.gradient(data[value].values, 2e-3, axis=0) - data[rate].values)[1:-1].max()
        assert error < 5e-4 * np.abs(data[rate].values).max(), rate
    moving = kinematics(tree, motion_of(trial))
    mc = sum(s.mass * moving.segments[s.name].point(s.com) for s in tree)
    expected = (mc[2:] - 2.0 * mc[1:-1] + mc[:-2]) / 4e-6 + 70.0 * np.array([0.0, 9.80665, 0.0])
    assert np.abs(data["wrench"].values[1:-1, :3] - expected).max() < 0.05  # N


@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize("model", MODELS)
def test_moments_equal_pinocchios(model: str, motion: str) -> None:
    """With what the seat carries as an outer force on the pelvis."""
    pin = pytest.importorskip("pinocchio", reason="Pinocchio is not installed (it is in the dev extra)")
    trial = simulate(model, motion, 5, SHORTEST[motion], 20.0, noise=PERFECT)
    carried = trial.truth.data["contact_wrench"]
    outside = {"pelvis": carried.sel(contact="seat").values} if motion == "sit-to-stand" else {}
    expected = inverse_dynamics(pin, trial.truth.tree, motion_of(trial), outside)
    assert np.abs(trial.truth.data["moments"].values - expected).max() < 1e-11 * np.abs(expected).max()


@pytest.mark.parametrize("seed", range(1, 5))
@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize("model", MODELS)
def test_the_feet_could_do_it(model: str, motion: str, seed: int) -> None:
    recording = simulate(model, motion, seed, noise=PERFECT).recording
    heel, toe = recording.marker(HEEL[model])[:, 0].max(), recording.marker(TOE[model])[:, 0].min()
    for plate in recording.plates[:2]:
        assert plate.force[:, 1].min() > 20.0
        assert plate.cop[:, 0].min() > heel
        assert plate.cop[:, 0].max() < toe


@pytest.mark.parametrize("seed", range(1, 4))
def test_the_seat_carries_only_who_sits_on_it(seed: int) -> None:
    trial = simulate("sagittal7", "sit-to-stand", seed, noise=PERFECT)
    hip = trial.truth.data["joint_centres"].sel(joint="hip").values[:, 1]
    push = trial.truth.data["contact_wrench"].sel(contact="seat", component="fy").values
    assert push.min() == 0.0
    assert 200.0 < push.max() < 70.0 * 9.80665
    assert push[hip > hip.min() + 0.005].max() == 0.0
    assert trial.recording.plates[2].force[:, 1].max() == pytest.approx(push.max())
    assert len(trial.truth.repetitions) >= 2
    for repetition in trial.truth.repetitions:  # between them the person stands
        k = np.searchsorted(trial.recording.time, repetition.start_s)
        assert hip[k] > hip.max() - 0.005


def test_repetitions_differ_in_depth_and_pace() -> None:
    repetitions = simulate("squat7", "squat", 1, 30.0, noise=PERFECT).truth.repetitions
    assert len(repetitions) >= 6
    assert np.ptp([r.depth for r in repetitions]) > 0.1
    assert np.ptp([r.end_s - r.start_s for r in repetitions]) > 0.3


def coordinates_file(trial: SimulatedTrial, path: Path, *, keep: slice = slice(None), spoil: bool = False) -> Path:
    data = trial.truth.data
    names = [str(n) for n in data["coordinate"].values][keep]
    values = np.degrees(data["coordinates"].values)[:, keep]
    if spoil:
        values[7, 2] = np.nan
    write_storage(path, "Coordinates", data["time"].values + 3.0, names, values, in_degrees=True)
    return path


def test_a_motion_from_a_file_is_followed_and_exact(tmp_path: Path) -> None:
    source = simulate("sagittal7", "squat", 2, 6.0, noise=PERFECT)
    path = coordinates_file(source, tmp_path / "coordinates.mot")
    trial = simulate("sagittal7", path, 9, rate_hz=500.0, noise=PERFECT)
    data = trial.truth.data
    assert data["time"].values[[0, -1]] == pytest.approx([0.0, 6.0])
    off = data["coordinates"].values[::5] - source.truth.data["coordinates"].values
    assert np.degrees(np.abs(off)).max() < 0.1
    error = np.abs(np.gradient(data["speeds"].values, 2e-3, axis=0) - data["accelerations"].values)[1:-1].max()
    assert error < 5e-4 * np.abs(data["accelerations"].values).max()
    assert "low-passed at 6 Hz" in trial.recording.notes[0].text


def test_noise_in_a_file_is_smoothed_away(tmp_path: Path) -> None:
    """White noise of 0.1 deg at 100 Hz would be accelerations of 17 rad/s^2 and more."""
    source = simulate("sagittal7", "sway", 2, 6.0, noise=PERFECT)
    data = source.truth.data
    noisy = np.degrees(data["coordinates"].values) + 0.1 * np.random.default_rng(1).standard_normal((601, 7))
    path = tmp_path / "noisy.mot"
    write_storage(path, "Coordinates", data["time"].values, list(data["coordinate"].values), noisy, in_degrees=True)
    trial = simulate("sagittal7", path, noise=PERFECT)
    error = trial.truth.data["accelerations"].values - data["accelerations"].values
    assert np.sqrt(np.mean(error[20:-20] ** 2)) < 1.0


def test_a_function_of_time_is_a_motion() -> None:
    names = ("elbow", "toe", "ankle", "knee", "hip", "lumbar", "shoulder")  # in any order

    def nod(time: np.ndarray) -> Motion:
        only = np.eye(7)[0]
        q, qd = 0.3 * np.outer(np.sin(2.0 * time), only), 0.6 * np.outer(np.cos(2.0 * time), only)
        return Motion(names, q, qd, -4.0 * q)

    data = simulate("sagittal7", nod, duration_s=1.0, noise=PERFECT).truth.data
    np.testing.assert_allclose(data["coordinates"].sel(coordinate="elbow"), 0.3 * np.sin(2.0 * data["time"]))
    assert np.abs(data["coordinates"].drop_sel(coordinate="elbow")).max() == 0.0


def test_a_wrong_file_is_named(tmp_path: Path) -> None:
    source = simulate("sagittal7", "squat", 2, 6.0, noise=PERFECT)
    short = coordinates_file(source, tmp_path / "short.mot", keep=slice(0, 6))
    with pytest.raises(ConfigError, match=r"short\.mot: no column for coordinate 'elbow'"):
        simulate("sagittal7", short)
    with pytest.raises(ConfigError, match=r"knee is no number at 3\.07 s"):
        simulate("sagittal7", coordinates_file(source, tmp_path / "gap.mot", spoil=True))
    good = coordinates_file(source, tmp_path / "good.mot")
    with pytest.raises(ConfigError, match=r"duration_s is 7, expected at most the 6 s"):
        simulate("sagittal7", good, duration_s=7.0)
    with pytest.raises(ConfigError, match="motion_cutoff_hz is 80"):
        simulate("sagittal7", good, motion_cutoff_hz=80.0)
    (tmp_path / "empty.mot").write_text("")
    with pytest.raises(RecordingError, match=r"empty\.mot"):
        simulate("sagittal7", tmp_path / "empty.mot")


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"motion": "squats"}, r"motion is 'squats' \(did you mean 'squat'\?\)"),
        ({"model": "sagital7"}, r"model is 'sagital7' \(did you mean 'sagittal7'\?\)"),
        ({"motion": "sit-to-stand", "duration_s": 5.0}, "duration_s is 5, expected at least 10.5 s"),
        ({"motion": "sway", "duration_s": -1.0}, "duration_s is -1"),
        ({"seed": -1}, "seed is -1"),
        ({"seed": 1.5}, "seed is 1.5"),
        ({"rate_hz": float("nan")}, "rate_hz is nan"),
        ({"rate_hz": 1e9}, "rate_hz 1e\\+09 makes"),
        ({"duration_s": float("inf")}, "duration_s is inf"),
        ({"duration_s": 1e9}, "duration_s 1e\\+09 at rate_hz 100 makes"),
        ({"height_m": float("inf")}, "height_m: .*found inf"),
    ],
)
def test_a_wrong_argument_is_named(arguments: dict, said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        simulate(**arguments)
