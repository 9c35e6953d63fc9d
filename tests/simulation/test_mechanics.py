"""The simulator's mechanics against what it must conserve, and against Lagrange and Pinocchio."""

from __future__ import annotations

import numpy as np
import pytest

from dynakin.simulation.mechanics import Axis, Motion, Segment, dynamics, kinematics
from support.trees import inverse_dynamics

STEP_S = 1e-4


def random_tree(rng: np.random.Generator) -> list[Segment]:
    """A branched tree in space: rotations and translations about directions of all kinds."""
    segments: list[Segment] = []
    for k in range(5):
        parent = None if k == 0 else segments[rng.integers(k)].name
        axes = []
        for i in range(1 + k % 3):
            direction = rng.standard_normal(3)
            x, y, z = direction / np.linalg.norm(direction)
            axes.append(Axis(f"q{k}{i}", (float(x), float(y), float(z)), translation=(i == 1)))
        root = rng.standard_normal((3, 3))
        second = root @ root.T  # second moments of a real distribution of mass
        inertia = 0.1 * (np.trace(second) * np.eye(3) - second)
        place, com = 0.3 * rng.standard_normal((2, 3))
        segments.append(Segment(f"s{k}", parent, place, tuple(axes), rng.uniform(0.5, 5.0), com, inertia))
    return segments


def wave(rng: np.random.Generator, tree: list[Segment], time: np.ndarray) -> Motion:
    """Sinusoidal coordinates with exact derivatives."""
    names = tuple(axis.coordinate for segment in tree for axis in segment.axes)
    a, w, p = rng.uniform(0.2, 1.0, (3, len(names)))
    w = 4.0 * w
    angle = time[:, None] * w + p
    return Motion(names, a * np.sin(angle), a * w * np.cos(angle), -a * w**2 * np.sin(angle))


def momentum(tree: list[Segment], motion: Motion) -> np.ndarray:
    """Linear and angular momentum (T, 6) about the ground origin."""
    moving = kinematics(tree, motion)
    total = np.zeros((len(motion.q), 6))
    for segment in tree:
        body = moving.segments[segment.name]
        p = segment.mass * body.point_velocity(segment.com)
        inertia = body.rotation @ segment.inertia @ np.swapaxes(body.rotation, 1, 2)
        spin = np.einsum("tij,tj->ti", inertia, body.omega)
        total += np.hstack([p, np.cross(body.point(segment.com), p) + spin])
    return total


def weight(tree: list[Segment], motion: Motion) -> np.ndarray:
    """Gravity's wrench (T, 6) about the ground origin."""
    moving = kinematics(tree, motion)
    total = np.zeros((len(motion.q), 6))
    for segment in tree:
        force = np.tile([0.0, -9.80665 * segment.mass, 0.0], (len(motion.q), 1))
        total += np.hstack([force, np.cross(moving.segments[segment.name].point(segment.com), force)])
    return total


@pytest.mark.parametrize("seed", range(4))
def test_wrench_is_the_rate_of_momentum_less_the_weight(seed: int) -> None:
    rng = np.random.default_rng(seed)
    tree = random_tree(rng)
    motion = wave(rng, tree, STEP_S * np.arange(400))
    rate = np.gradient(momentum(tree, motion), STEP_S, axis=0)
    wrench = dynamics(tree, motion).wrench
    expected = rate - weight(tree, motion)
    assert np.abs(wrench - expected)[2:-2].max() < 1e-5 * np.abs(wrench).max()


@pytest.mark.parametrize("seed", range(4))
def test_moments_do_the_work_that_the_energy_gains(seed: int) -> None:
    rng = np.random.default_rng(seed)
    tree = random_tree(rng)
    motion = wave(rng, tree, STEP_S * np.arange(400))
    forces = dynamics(tree, motion)
    power = np.sum(forces.moments * motion.qd, axis=1)
    gained = np.gradient(forces.kinetic + forces.potential, STEP_S)
    assert np.abs(power - gained)[2:-2].max() < 1e-5 * np.abs(power).max()


@pytest.mark.parametrize("seed", range(3))
def test_moments_are_lagranges(seed: int) -> None:
    """tau = d/dt dT/dqd - dT/dq + dV/dq, each derivative by central differences of the energies alone."""
    rng = np.random.default_rng(seed)
    tree = random_tree(rng)
    names = tuple(axis.coordinate for segment in tree for axis in segment.axes)
    q, qd, qdd = rng.standard_normal((3, len(names)))
    n, h = len(names), 1e-4

    def energies(q: np.ndarray, qd: np.ndarray) -> tuple[float, float]:
        forces = dynamics(tree, Motion(names, q[None], qd[None], np.zeros((1, n))))
        return float(forces.kinetic[0]), float(forces.potential[0])

    def momenta(q: np.ndarray, qd: np.ndarray) -> np.ndarray:  # exact up to rounding: T is quadratic in qd
        return np.array([(energies(q, qd + e)[0] - energies(q, qd - e)[0]) / 2.0 for e in np.eye(n)])

    lagrange = (momenta(q + h * qd, qd + h * qdd) - momenta(q - h * qd, qd - h * qdd)) / (2.0 * h)
    for j, e in enumerate(h * np.eye(n)):
        (t1, v1), (t0, v0) = energies(q + e, qd), energies(q - e, qd)
        lagrange[j] += (v1 - v0 - t1 + t0) / (2.0 * h)
    moments = dynamics(tree, Motion(names, q[None], qd[None], qdd[None])).moments[0]
    assert np.abs(moments - lagrange).max() < 1e-6 * np.abs(moments).max()


@pytest.mark.parametrize("seed", range(4))
def test_moments_equal_pinocchios_inverse_dynamics(seed: int) -> None:
    pin = pytest.importorskip("pinocchio", reason="Pinocchio is not installed (it is in the dev extra)")
    rng = np.random.default_rng(seed)
    tree = random_tree(rng)
    motion = wave(rng, tree, 0.05 * np.arange(5))
    expected = inverse_dynamics(pin, tuple(tree), motion)
    moments = dynamics(tree, motion).moments
    assert np.abs(moments - expected).max() < 1e-11 * np.abs(expected).max()


def test_wrenches_from_outside_are_not_the_joints_to_supply() -> None:
    pin = pytest.importorskip("pinocchio", reason="Pinocchio is not installed (it is in the dev extra)")
    rng = np.random.default_rng(7)
    tree = random_tree(rng)
    motion = wave(rng, tree, 0.05 * np.arange(5))
    outside = {name: 20.0 * rng.standard_normal((5, 6)) for name in ("s2", "s4")}
    expected = inverse_dynamics(pin, tuple(tree), motion, outside)
    loaded = dynamics(tree, motion, external=outside)
    assert np.abs(loaded.moments - expected).max() < 1e-11 * np.abs(expected).max()
    np.testing.assert_allclose(loaded.wrench, dynamics(tree, motion).wrench, atol=1e-9)
