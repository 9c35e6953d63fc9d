"""Classical joint angles: the truth's where landmarks are exact, the model's own zeros and signs, gaps left open."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import dynakin
from dynakin.errors import ModelError
from dynakin.model.calibration.how import Calibration
from dynakin.model.calibration.posture import find_posture
from dynakin.simulation.output import SimulatedTrial
from dynakin.simulation.trial import simulate_squat
from dynakin.validation.reference.chain import PlanarChain
from dynakin.validation.reference.classical import classical_angles, landmark_paths
from support.perfect import Perfect


@pytest.fixture(scope="module")
def noisy() -> SimulatedTrial:
    return simulate_squat(seed=5, duration_s=5.0)


def test_exact_landmarks_give_the_true_angles(perfect: Perfect) -> None:
    angles = classical_angles(perfect.chain, perfect.plan, perfect.landmarks)
    assert np.abs(angles - perfect.truth.coordinates).max() < 1e-9


def test_markers_on_the_joints_give_the_true_leg_angles(perfect: Perfect) -> None:
    """By the marker set's recipes; above the hip these are regressions, which no subject fits exactly."""
    paths = landmark_paths(perfect.trial.recording, perfect.initial, perfect.definition)
    angles = classical_angles(PlanarChain.of(perfect.initial.plan), perfect.initial.plan, paths)
    error = np.abs(np.degrees(angles - perfect.truth.coordinates))
    assert error[:, :4].max() < 1e-6  # toe, ankle, knee, hip
    assert error.max() < 8.0


@pytest.mark.parametrize("side", ["right", "both"])
@pytest.mark.parametrize("model", ["sagittal7", "squat7"])
def test_angles_are_those_that_the_models_own_posture_finds(noisy: SimulatedTrial, model: str, side: str) -> None:
    """`find_posture` solves each joint by iteration; the classical method must agree at every frame and side."""
    definition = dynakin.load_model(model, dynakin.Subject(mass_kg=70.0, height_m=1.75, sex="male"), markers="opencap")
    initial = definition.calibrate(noisy.recording, how=Calibration(side=side))
    plan, chain = initial.plan, PlanarChain.of(initial.plan)
    paths = landmark_paths(noisy.recording, initial, definition)
    angles = classical_angles(chain, plan, paths)
    standing = find_posture(plan.model, plan.geometry, {name: path[0] for name, path in paths.items()})
    for frame in (0, 150, 300, 450):
        now = {name: path[frame] for name, path in paths.items() if np.isfinite(path[frame]).all()}
        posture = find_posture(plan.model, plan.geometry, now, standing)
        expected = [posture.coordinates[name] for name in chain.coordinates]
        np.testing.assert_allclose(angles[frame], expected, atol=1e-6)


def test_locked_coordinates_stay_at_their_lock(perfect: Perfect) -> None:
    recording = perfect.trial.recording
    legs = [k for k, name in enumerate(recording.marker_names) if not any(s in name for s in ("elbow", "wrist"))]
    legs = [k for k in legs if not any(s in recording.marker_names[k] for s in ("humerus", "forearm"))]
    without_arms = replace(
        recording, marker_names=tuple(recording.marker_names[k] for k in legs), markers=recording.markers[:, legs]
    )
    initial = perfect.definition.calibrate(without_arms)
    chain = PlanarChain.of(initial.plan)
    assert {"shoulder", "elbow"} <= set(chain.locked)
    angles = classical_angles(chain, initial.plan, landmark_paths(without_arms, initial, perfect.definition))
    assert np.isfinite(angles).all()
    for name, value in chain.locked.items():
        assert (angles[:, chain.coordinates.index(name)] == value).all()


def test_a_lost_marker_leaves_its_angles_open_and_no_others(perfect: Perfect) -> None:
    recording = perfect.trial.recording
    markers = recording.markers.copy()
    markers[300:340, recording.marker_names.index("r_knee")] = np.nan
    lost = replace(recording, markers=markers)
    initial = perfect.definition.calibrate(lost, how=Calibration(side="right"))
    paths = landmark_paths(lost, initial, perfect.definition)
    angles = classical_angles(PlanarChain.of(initial.plan), initial.plan, paths)
    missing = np.isnan(angles)
    assert missing[300:340].all(axis=0).tolist() == [False, True, True, True, False, False, False]
    assert not missing[:300].any() and not missing[340:].any()


def test_both_sides_leave_a_gap_where_one_side_is_lost(perfect: Perfect) -> None:
    """The other side alone would shift the middle."""
    recording = perfect.trial.recording
    markers = recording.markers.copy()
    markers[300:340, recording.marker_names.index("L_ankle")] = np.nan
    lost = replace(recording, markers=markers)
    initial = perfect.definition.calibrate(lost, how=Calibration(side="both"))
    ankle = landmark_paths(lost, initial, perfect.definition)["ankle"]
    assert np.isnan(ankle[300:340]).all() and np.isfinite(ankle[340:]).all()


def test_an_angle_beyond_half_a_turn_does_not_jump(perfect: Perfect) -> None:
    turn = np.linspace(-0.5, 5.0, 1001)
    landmarks = dict(perfect.landmarks)
    reach = 0.3 * np.column_stack([np.sin(turn), -np.cos(turn), 0.0 * turn])
    landmarks["elbow"] = landmarks["shoulder"] + reach
    angles = classical_angles(perfect.chain, perfect.plan, landmarks)
    assert np.abs(np.diff(angles[:, 5])).max() < 0.1
    assert np.ptp(angles[:, 5]) > 4.0


def test_models_that_are_no_planar_hinges_are_refused(perfect: Perfect) -> None:
    plan = perfect.initial.plan
    with pytest.raises(ModelError, match="planar"):
        PlanarChain.of(replace(plan, model=plan.model.model_copy(update={"planar": False})))
    foot = plan.model.segments[0]
    slide = foot.axes[0].model_copy(update={"kind": "translation"})
    sliding = (foot.model_copy(update={"axes": (slide,)}), *plan.model.segments[1:])
    with pytest.raises(ModelError, match='"foot": expected one hinge about Z'):
        PlanarChain.of(replace(plan, model=plan.model.model_copy(update={"segments": sliding})))
