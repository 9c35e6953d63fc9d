"""Inverse kinematics and dynamics of a whole body: on motions that are known, and against a simulator that shares none
of their mechanics."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import dynakin
from dynakin.bindings import _core
from dynakin.filter.estimator import Estimator
from dynakin.filter.prepared import Prepared
from dynakin.model.calibration.inverse_kinematics import fixed_model, inverse_kinematics
from dynakin.model.spec import free_names
from dynakin.simulation.output import SimulatedTrial
from dynakin.simulation.sensors.sizes import SensorNoise
from dynakin.simulation.trial import simulate
from dynakin.validation.case import Setup
from dynakin.validation.methods import ComparedTrial, compare_trial
from dynakin.validation.reference.inverse_dynamics import INVERSE, RigidMotion, inverse_name, rigid_motions

FLEXION = [f"{joint}_{side}" for joint in ("hip_flexion", "knee_angle", "ankle_angle") for side in "rl"]


@pytest.fixture(scope="module")
def simulated() -> SimulatedTrial:
    return simulate("fullbody", "squat", 2, 5.0, 50.0, noise=SensorNoise.none())


@pytest.fixture(scope="module")
def setup() -> Setup:
    return Setup(
        Estimator(dynakin.load_model("fullbody", dynakin.Subject(mass_kg=70.0, height_m=1.75, sex="male"))), lag_s=0.0
    )


@pytest.fixture(scope="module")
def ready(simulated: SimulatedTrial, setup: Setup) -> Prepared:
    return setup.estimator("default").prepare(simulated.recording)


def moved(ready: Prepared, frames: int = 40) -> tuple[np.ndarray, np.ndarray]:
    """Free coordinates (T, F) that wander from the start posture within their ranges, and the markers (T, M, 3)."""
    calibrated, model = ready.calibrated, fixed_model(ready.calibrated)
    at = [calibrated.names.index(name) for name in free_names(model.spec)]
    phase = np.random.default_rng(1).uniform(0.0, 6.0, len(at))
    wander = 0.2 * (np.sin(np.linspace(0.0, 3.0, frames)[:, None] + phase) - np.sin(phase))
    q = np.clip(calibrated.x0[at] + wander, calibrated.lower[at] + 0.01, calibrated.upper[at] - 0.01)
    states = np.hstack([q, np.zeros((frames, 2 * len(at)))])
    return q, RigidMotion(model, states).markers()


def test_a_posture_is_found_again_from_its_markers(ready: Prepared) -> None:
    q, markers = moved(ready)
    assert np.abs(inverse_kinematics(ready.calibrated, markers) - q).max() < 1e-4  # rad or m; 1e-7 but for pronation
    hidden = markers.copy()
    hidden[10:20, ::6] = np.nan
    assert np.abs(inverse_kinematics(ready.calibrated, hidden) - q).max() < 1e-3
    hidden[30] = np.nan
    found = inverse_kinematics(ready.calibrated, hidden)
    assert np.isnan(found[30]).all() and np.isfinite(np.delete(found, 30, axis=0)).all()


def test_a_joint_stays_within_its_range(ready: Prepared) -> None:
    q, markers = moved(ready)
    calibrated, model = ready.calibrated, fixed_model(ready.calibrated)
    free = free_names(model.spec)
    knee = free.index("knee_angle_r")
    upper = calibrated.upper.copy()
    limit = upper[calibrated.names.index("knee_angle_r")] = float(np.median(q[:, knee]))
    found = inverse_kinematics(replace(calibrated, upper=upper), markers)[:, knee]
    assert found.max() <= limit
    assert np.allclose(found[q[:, knee] > limit + 0.02], limit)


def test_no_other_posture_is_nearer_to_the_markers(ready: Prepared) -> None:
    """The gradient of the squared distances vanishes: an oracle that knows nothing of how the least was sought."""
    markers = ready.measured.markers[60:70] + np.random.default_rng(2).normal(
        0.0, 0.005, ready.measured.markers[60:70].shape
    )
    found, model = inverse_kinematics(ready.calibrated, markers), fixed_model(ready.calibrated)
    state = np.zeros(model.layout.size)

    def cost(q: np.ndarray, k: int) -> float:
        state[: len(q)] = q
        return float(np.nansum((_core.marker_positions(model, state) - markers[k]) ** 2))

    for k, q in enumerate(found):
        for j in range(len(q)):
            step = np.eye(len(q))[j] * 1e-3
            assert cost(q, k) <= cost(q + step, k) + 1e-9 and cost(q, k) <= cost(q - step, k) + 1e-9


def test_wrench_and_moments_are_near_the_simulated_truth(simulated: SimulatedTrial, ready: Prepared) -> None:
    """Sensors without errors: what is left is the calibration's and the table's."""
    motion = rigid_motions(ready.calibrated, ready.recording.time, ready.measured.markers, (6.0,))[6.0]
    assert ready.measured.contacts is not None
    external = np.zeros((len(motion.states), len(motion.model.segment_names), 6))
    for k, segment in enumerate(ready.measured.contacts.segments[:2]):
        external[:, motion.model.segment_names.index(segment)] = ready.measured.contacts.wrench[:, k]
    truth, inner = simulated.truth.data, slice(25, -25)
    names = motion.model.coordinate_names
    columns = [names.index(name) for name in FLEXION]
    moments = truth["moments"].sel(coordinate=FLEXION).transpose("time", "coordinate").values
    error = (motion.moments(external)[:, columns] - moments)[inner]
    assert np.sqrt(np.mean(error**2, axis=0)).max() < 6.0 < 0.15 * np.abs(moments).max()
    needed = (motion.wrench() - truth["wrench"].transpose("time", "component").values)[inner]
    assert np.sqrt(np.mean(needed[:, :3] ** 2, axis=0)).max() < 10.0


def test_beside_the_filter_it_has_the_same_labels_and_says_what_it_leaves(
    simulated: SimulatedTrial, setup: Setup
) -> None:
    trial: ComparedTrial = compare_trial(simulated.recording, setup)
    assert [method.name for method in trial.methods] == ["EKF (default)", "IK + ID (6 Hz)", "IK + ID (12 Hz)"]
    assert trial.methods[1].kind == INVERSE and trial.methods[1].name == inverse_name(6.0)
    assert any("What it leaves at the pelvis" in note for note in map(str, trial.notes))
    filtered, classical = trial.methods[0], trial.methods[1]
    assert trial.reference("AT") is trial.reference("classical") is classical
    for name in ("coordinates", "moments", "markers", "wrench"):
        assert getattr(classical, name).shape == getattr(filtered, name).shape
    knee = trial.coordinate_names.index("knee_angle_r")
    difference = np.degrees(classical.coordinates - filtered.coordinates)[:, knee]
    assert np.sqrt(np.nanmean(difference**2)) < 3.0
