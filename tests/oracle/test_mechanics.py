"""The oracle's mechanics against Pinocchio, virtual power and time derivatives: it stands on its own feet."""

from __future__ import annotations

import numpy as np
import pytest

from support.core.random_models import planar_model, random_state, spatial_model, with_functions
from support.oracle import measurement, mechanics
from support.oracle.spec import Axis, Coordinate, Marker, Segment, Spec
from support.oracle.state import Layout, unpack

MODELS = [planar_model(s) for s in range(4)] + [spatial_model(s) for s in range(12)]
MODELS += [with_functions(spatial_model(s), s) for s in range(12, 18)]
IDENTITY = [spatial_model(s, nonlinear=False) for s in range(100, 106)]


def close(actual: np.ndarray, expected: np.ndarray, relative: float) -> None:
    np.testing.assert_allclose(actual, expected, rtol=0, atol=relative * max(1.0, np.abs(expected).max()))


@pytest.mark.parametrize("spec", MODELS + IDENTITY, ids=lambda s: s.name)
def test_equals_pinocchio(spec):
    from support.oracle import pinocchio_tree

    layout = Layout(spec)
    rng = np.random.default_rng(1)
    for _ in range(5):
        x = random_state(layout, rng)
        values = unpack(layout, x)
        expected = pinocchio_tree.solve(spec, values)
        kin = mechanics.kinematics(spec, values.q, values.qd, values.qdd, values.parameters)
        close(np.array([b.R for b in kin.segments]), expected["rotations"], 1e-12)
        close(np.array([b.o for b in kin.segments]), expected["origins"], 1e-12)
        close(measurement.marker_positions(layout, x), expected["markers"], 1e-12)
        close(measurement.wrench(layout, x), expected["wrench"], 1e-11)
        close(measurement.joint_moments(layout, x), expected["moments"], 1e-11)


@pytest.mark.parametrize("spec", MODELS, ids=lambda s: s.name)
def test_joint_moments_do_the_work_of_the_segment_forces(spec):
    """Kane: the moment of coordinate j is the sum of all segments' forces on their partial velocities."""
    layout = Layout(spec)
    values = unpack(layout, random_state(layout, np.random.default_rng(2)))
    kin = mechanics.kinematics(spec, values.q, values.qd, values.qdd, values.parameters)
    forces = mechanics.segment_wrenches(spec, kin, values.inertia)
    expected = []
    for j in range(len(spec.coordinates)):
        unit = np.zeros(len(spec.coordinates))
        unit[j] = 1.0
        partial = mechanics.kinematics(spec, values.q, unit, 0 * unit, values.parameters)
        power = 0.0
        for body, (force, moment) in zip(partial.segments, forces, strict=True):
            power += force @ body.v + (moment - np.cross(body.o, force)) @ body.w
        expected.append(power)
    actual = mechanics.joint_moments(spec, kin, values.inertia)
    close(actual, np.array(expected), 1e-12)


@pytest.mark.parametrize("spec", MODELS[::3], ids=lambda s: s.name)
def test_velocity_and_acceleration_are_time_derivatives(spec):
    """Along q(t) = q + qd t + qdd t^2 / 2, markers and segments really move so."""
    layout = Layout(spec)
    values = unpack(layout, random_state(layout, np.random.default_rng(3)))

    def motion(t):
        t = np.asarray(t)[..., None]
        q = values.q + values.qd * t + values.qdd * t**2 / 2
        shape = q.shape[:-1]
        parameters = {k: np.broadcast_to(v, shape) for k, v in values.parameters.items()}
        return mechanics.kinematics(spec, q, values.qd + values.qdd * t, values.qdd + 0 * t, parameters)

    h = 1e-30
    now, moved = motion(0.0), motion(np.asarray(1j * h))
    for body, later in zip(now.segments, moved.segments, strict=True):
        close(body.v, later.o.imag / h, 1e-11)
        close(body.a, later.v.imag / h, 1e-11)
        close(body.alpha, later.w.imag / h, 1e-11)
        spin = (later.R.imag / h) @ body.R.T
        close(body.w, np.array([spin[2, 1], spin[0, 2], spin[1, 0]]), 1e-11)


@pytest.mark.parametrize("spec", [MODELS[0], MODELS[5], MODELS[8]], ids=lambda s: s.name)
def test_complex_step_equals_central_differences(spec):
    layout = Layout(spec)
    x = random_state(layout, np.random.default_rng(4))
    value, jacobian = measurement.value_and_jacobian(layout, x)
    h = 1e-5
    plus = measurement.everything(layout, x + h * np.eye(layout.size))
    minus = measurement.everything(layout, x - h * np.eye(layout.size))
    assert value.shape == (3 * len(spec.markers) + 7,)
    close(jacobian, ((plus - minus) / (2 * h)).T, 1e-7)


def test_pendulum_by_hand():
    """A point mass m at the end of a rod of length r: textbook force and moment."""
    m, r, angle, speed, acceleration = 2.0, 0.5, 0.3, 1.7, -2.2
    inertia = np.array([m, m * r, 0, 0, 0, m * r**2, m * r**2, 0, 0, 0])
    hinge = Axis("angle", "rotation", np.array([0.0, 0.0, 1.0]))
    rod = Segment("rod", "ground", axes=[hinge], inertia=inertia, inertia_estimated=[True] + [False] * 9)
    tip = Marker("tip", "rod", np.array([r, 0, 0]))
    spec = Spec("pendulum", [Coordinate("angle")], [], [rod], [tip])
    layout = Layout(spec)
    assert layout.names == ["angle", "angle/speed", "angle/acceleration", "inertia/rod/mass"]
    x = np.array([angle, speed, acceleration, m])
    out = np.array([np.cos(angle), np.sin(angle), 0])
    across = np.array([-np.sin(angle), np.cos(angle), 0])
    force = m * (r * acceleration * across - r * speed**2 * out + [0, 9.80665, 0])
    moment = m * r**2 * acceleration + m * 9.80665 * r * np.cos(angle)
    np.testing.assert_allclose(measurement.marker_positions(layout, x), [r * out], atol=1e-15)
    np.testing.assert_allclose(measurement.wrench(layout, x), [*force, 0, 0, moment], atol=1e-13)
    np.testing.assert_allclose(measurement.joint_moments(layout, x), [moment], atol=1e-13)
    assert measurement.total_mass(layout, x) == m
