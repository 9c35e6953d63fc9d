"""Joints and frames from landmarks, for general trees as well."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from dynakin.model.calibration.posture import axes_from, joint_motion, solve_joint
from dynakin.model.schema import Axis, Segment


@pytest.mark.parametrize("main", ["x", "y", "z"])
def test_axes_are_a_proper_rotation_with_the_main_axis_kept(main: str) -> None:
    direction = np.array([0.3, 0.8, -0.2])
    rotation = axes_from(main, direction)
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-14)
    assert np.linalg.det(rotation) == pytest.approx(1.0)
    np.testing.assert_allclose(rotation[:, "xyz".index(main)], direction / np.linalg.norm(direction))


def test_an_upright_segment_has_the_grounds_axes() -> None:
    np.testing.assert_allclose(axes_from("y", np.array([0.0, 2.0, 0.0])), np.eye(3), atol=1e-15)
    np.testing.assert_allclose(axes_from("x", np.array([2.0, 0.0, 0.0])), np.eye(3), atol=1e-15)


@pytest.mark.parametrize("seed", range(5))
def test_solving_a_spatial_joint_gives_back_its_coordinates(seed: int) -> None:
    """Given a six-axis joint in a random place, when it is solved, then the pose is met."""
    random = np.random.default_rng(seed)
    axes = tuple(
        Axis(coordinate=f"q{k}", kind=kind, direction=tuple(np.eye(3)[k % 3]))  # type: ignore[arg-type]
        for k, kind in enumerate(["translation"] * 3 + ["rotation"] * 3)
    )
    values = {f"q{k}": float(v) for k, v in enumerate(random.uniform(-1.2, 1.2, 6))}
    segment = Segment(name="root", axes=axes)
    target = joint_motion(axes, values, {})
    found = solve_joint(segment, target, {}, {})
    rotation, translation = joint_motion(axes, found, {})
    np.testing.assert_allclose(rotation, target[0], atol=1e-8)
    np.testing.assert_allclose(translation, target[1], atol=1e-8)


@pytest.mark.parametrize("angle", [-3.0, -1.5, 0.0, 0.4, 2.0, 3.1])
def test_a_hinge_with_a_sign_is_exact(angle: float) -> None:
    axis = Axis(coordinate="q", coefficients=(0.0, -1.0))
    segment = Segment(name="shank", axes=(axis,))
    found = solve_joint(segment, joint_motion((axis,), {"q": angle}, {}), {}, {})
    assert found["q"] == pytest.approx(angle, abs=1e-9)


def test_a_scaled_polynomial_axis() -> None:
    axis = Axis(coordinate="q", kind="translation", direction=(1, 0, 0), coefficients=(0.1, 1.0, 0.5), scale="L")
    _, translation = joint_motion((axis,), {"q": 0.2}, {"L": 2.0})
    np.testing.assert_allclose(translation, [2.0 * (0.1 + 0.2 + 0.5 * 0.04), 0.0, 0.0])


def test_coordinates_that_are_fixed_stay() -> None:
    axes = (Axis(coordinate="a"), Axis(coordinate="b"))
    segment = Segment(name="s", axes=axes)
    found = solve_joint(segment, joint_motion(axes, {"a": 0.3, "b": 0.5}, {}), {"a": 0.1}, {})
    assert found == pytest.approx({"b": 0.7})


def test_a_pose_that_a_joint_cannot_meet_is_met_in_the_plane() -> None:
    """A root that slides and turns in the plane, given a turn out of it: its origin stays, and the turn is that of
    least squares alone, as where it cannot slide."""
    axes = (
        Axis(coordinate="x", kind="translation", direction=(1, 0, 0)),
        Axis(coordinate="y", kind="translation", direction=(0, 1, 0)),
        Axis(coordinate="turn"),
    )
    tilted = Rotation.from_euler("ZXY", [20.0, 5.0, 8.0], degrees=True).as_matrix()
    found = solve_joint(Segment(name="root", axes=axes), (tilted, np.array([0.5, 0.9, 0.1])), {}, {})
    alone = solve_joint(Segment(name="root", axes=axes[2:]), (tilted, np.zeros(3)), {}, {})
    assert found == pytest.approx({"x": 0.5, "y": 0.9, **alone}, abs=1e-8)
