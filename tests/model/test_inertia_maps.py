"""Each map that carries a table entry into the chain against sums over point masses."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest
from scipy.spatial.transform import Rotation

from dynakin.model.inertia import RigidBody

Array = npt.NDArray[np.float64]


def brute(points: Array, masses: Array) -> RigidBody:
    """Mass, first moment and tensor about the origin, summed point by point."""
    tensor = sum(m * (p @ p * np.eye(3) - np.outer(p, p)) for m, p in zip(masses, points, strict=True))
    return RigidBody(float(masses.sum()), masses @ points, np.asarray(tensor))


def same(a: RigidBody, b: RigidBody) -> None:
    np.testing.assert_allclose(a.vector, b.vector, rtol=1e-12, atol=1e-12)


@pytest.fixture
def cloud() -> tuple[Array, Array]:
    random = np.random.default_rng(3)
    return random.normal(size=(20, 3)) * [0.1, 0.3, 0.05] + [0.02, -0.2, 0.1], random.uniform(0.1, 1.0, 20)


def test_from_centre_is_the_parallel_axis_theorem(cloud: tuple[Array, Array]) -> None:
    points, masses = cloud
    centre = masses @ points / masses.sum()
    about_centre = brute(points - centre, masses)
    same(RigidBody.from_centre(about_centre.mass, centre, about_centre.inertia), brute(points, masses))


def test_map_1_turns_the_frame(cloud: tuple[Array, Array]) -> None:
    points, masses = cloud
    rotation = Rotation.from_rotvec([0.3, -1.1, 0.7]).as_matrix()
    same(brute(points, masses).rotated(rotation), brute(points @ rotation.T, masses))


def test_map_2_moves_the_origin(cloud: tuple[Array, Array]) -> None:
    points, masses = cloud
    origin = np.array([0.1, 0.45, -0.2])
    same(brute(points, masses).moved(origin), brute(points + origin, masses))


def test_map_2_there_and_back_is_nothing(cloud: tuple[Array, Array]) -> None:
    body = brute(*cloud)
    same(body.moved([0.2, -0.4, 0.1]).moved([-0.2, 0.4, -0.1]), body)


def test_map_3_mirrors_and_sums(cloud: tuple[Array, Array]) -> None:
    points, masses = cloud
    mirror = points * [1.0, 1.0, -1.0]
    body = brute(points, masses)
    same(body.mirrored(), brute(mirror, masses))
    both = body + body.mirrored()
    same(both, brute(np.vstack([points, mirror]), np.concatenate([masses, masses])))
    assert both.first_moment[2] == 0.0
    assert both.inertia[0, 2] == 0.0
    assert both.inertia[1, 2] == 0.0


def test_the_ten_numbers_there_and_back(cloud: tuple[Array, Array]) -> None:
    body = brute(*cloud)
    same(RigidBody.from_vector(body.vector), body)


def test_consistency_in_space_and_in_the_plane(cloud: tuple[Array, Array]) -> None:
    body = brute(*cloud)
    assert body.possible()
    assert body.possible_in_plane()
    thin = RigidBody(1.0, np.array([0.0, 0.3, 0.0]), np.diag([0.1, 0.01, 0.08]))  # m izz < my^2
    assert not thin.possible_in_plane()
    assert not thin.possible()
    # good in the plane though no body in space: frozen out-of-plane numbers must not reject it (DESIGN
    # section 3)
    flat = RigidBody(1.0, np.zeros(3), np.diag([0.1, 0.1, 0.5]))
    assert flat.possible_in_plane()
    assert not flat.possible()


def test_spread_is_the_covariance_of_where_the_mass_lies() -> None:
    masses, points = np.array([1.0, 3.0]), np.array([[0.0, 0.2, 0.0], [0.4, 0.0, 0.1]])
    body = RigidBody.nothing()
    for mass, point in zip(masses, points, strict=True):
        body = body + RigidBody.from_centre(mass, point, np.zeros((3, 3)))
    np.testing.assert_allclose(body.spread, np.cov(points.T, aweights=masses, ddof=0), atol=1e-15)
