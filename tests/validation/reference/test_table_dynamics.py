"""The table's wrench and moments: the truth's where inertia and kinematics are, and Pinocchio's for any motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dynakin.recordings.smoothing import smooth
from dynakin.validation.reference.chain import Kinematics
from dynakin.validation.reference.classical import classical_angles, hinge_paths
from dynakin.validation.reference.least_squares import inertia_of
from dynakin.validation.reference.regressor import parameter_names, table_dynamics
from support.perfect import PLANE, Perfect, lively


def test_true_inertia_and_motion_give_the_true_wrench_and_moments(perfect: Perfect) -> None:
    true = inertia_of(perfect.chain, perfect.parameters(parameter_names(perfect.chain)))
    forces = table_dynamics(perfect.chain, perfect.truth, true)
    data = perfect.trial.truth.data
    np.testing.assert_allclose(forces.wrench, perfect.wrench(), atol=1e-8)
    np.testing.assert_allclose(forces.moments, data["moments"].values, atol=1e-8)


@pytest.mark.parametrize("lengths", ["constant", "frame"])
def test_classical_kinematics_without_noise_err_by_differentiation_only(perfect: Perfect, lengths: str) -> None:
    """Both ways of taking lengths are the same where landmarks are exact."""
    time = perfect.trial.recording.time
    angles = classical_angles(perfect.chain, perfect.plan, perfect.landmarks)
    found = smooth(time, angles, None)
    kinematics = Kinematics(found.values, found.rates, found.seconds)
    if lengths == "frame":
        paths = hinge_paths(perfect.chain, perfect.plan, perfect.landmarks, angles)
        for k, link in enumerate(perfect.chain.links):
            np.testing.assert_allclose(paths[:, k], np.tile(link.placement[:2], (len(time), 1)), atol=1e-12)
        still = np.zeros_like(paths)
        kinematics = replace(kinematics, hinges=np.stack([paths, still, still]))
    true = inertia_of(perfect.chain, perfect.parameters(parameter_names(perfect.chain)))
    forces = table_dynamics(perfect.chain, kinematics, true)
    assert np.abs(forces.wrench - perfect.wrench())[:, PLANE].max() < 0.05  # N, N m
    assert np.abs(forces.moments - perfect.trial.truth.data["moments"].values).max() < 0.05


def test_a_hinge_that_slides_counts_with_its_motion(perfect: Perfect) -> None:
    """The whole chain carried along X: the wrench gains total mass times that acceleration."""
    kinematics = lively(7)
    frames = len(kinematics.coordinates)
    places = np.array([link.placement[:2] for link in perfect.chain.links])
    hinges = np.zeros((3, frames, 7, 2))
    hinges[0] = places
    hinges[2, :, 0, 0] = 2.0  # m/s^2 at the root, from rest in place: only the acceleration shows
    carried = table_dynamics(perfect.chain, replace(kinematics, hinges=hinges)).wrench
    resting = table_dynamics(perfect.chain, kinematics).wrench
    total = sum(link.body.mass for link in perfect.chain.links)
    np.testing.assert_allclose(carried[:, 0] - resting[:, 0], 2.0 * total, rtol=1e-10)
    np.testing.assert_allclose(carried[:, 1], resting[:, 1], rtol=1e-10)


def test_wrench_and_moments_equal_pinocchios(perfect: Perfect) -> None:
    pin = pytest.importorskip("pinocchio", reason="Pinocchio is not installed (it is in the dev extra)")
    kinematics = lively(7, frames=6, seed=3)
    model = pin.Model()
    model.gravity.linear = np.array([0.0, -9.80665, 0.0])
    # A free-flyer at rest in the ground carries the chain: its force is the total wrench about the ground origin.
    joints: dict[str | None, int] = {None: model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "ground")}
    for link in perfect.chain.links:
        place = pin.SE3(np.eye(3), link.placement)
        axis = np.array([0.0, 0.0, link.slope])
        joints[link.name] = model.addJoint(joints[link.parent], pin.JointModelRevoluteUnaligned(axis), place, link.name)
        com = link.body.centre
        central = link.body.inertia - link.body.mass * (com @ com * np.eye(3) - np.outer(com, com))
        model.appendBodyToJoint(joints[link.name], pin.Inertia(link.body.mass, com, central), pin.SE3.Identity())
    data = model.createData()
    forces = table_dynamics(perfect.chain, kinematics)
    for t in range(6):
        q = np.concatenate([[0.0] * 6, [1.0], kinematics.coordinates[t]])
        v = np.concatenate([[0.0] * 6, kinematics.speeds[t]])
        tau = pin.rnea(model, data, q, v, np.concatenate([[0.0] * 6, kinematics.accelerations[t]]))
        np.testing.assert_allclose(forces.wrench[t, PLANE], tau[PLANE], rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(forces.moments[t], tau[6:], rtol=1e-9, atol=1e-9)


def test_a_frame_with_a_gap_has_no_wrench_but_the_moments_above_the_gap_are_lost_only_there(perfect: Perfect) -> None:
    kinematics = lively(7, frames=5)
    kinematics.coordinates[2, 3] = np.nan
    forces = table_dynamics(perfect.chain, kinematics)
    assert np.isnan(forces.wrench[2, PLANE]).all()
    assert np.isfinite(np.delete(forces.wrench[:, PLANE], 2, axis=0)).all()
    assert np.isfinite(np.delete(forces.moments, 2, axis=0)).all()
