"""Markers of a segment that were measured together: what is not known of their places moves all of them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from dynakin.filter.augment import initial_covariance
from dynakin.model.state_priors import JointPrior, cluster_covariance
from dynakin.settings.model import Priors
from dynakin.settings.noise import Noise
from support.made_in_space import measured

PLACES = np.array([[0.1, 0.02, 0.0], [0.0, -0.2, 0.05], [-0.03, 0.1, -0.08]])


def test_shift_and_turn_of_a_cluster() -> None:
    priors = Priors(cluster_shift_sd_m=0.01, cluster_turn_sd_deg=2.0, cluster_marker_sd_m=1e-9)
    rng = np.random.default_rng(1)
    middle, drawn = PLACES.mean(axis=0), []
    for _ in range(20000):
        turn = Rotation.from_rotvec(np.deg2rad(2.0) * rng.normal(size=3))
        moved = middle + turn.apply(PLACES - middle) + 0.01 * rng.normal(size=3)
        drawn.append((moved - PLACES).ravel())
    found = cluster_covariance(PLACES, priors)
    np.testing.assert_allclose(found, np.cov(np.array(drawn).T), atol=0.03 * found.max())


def test_distances_within_a_cluster_are_known() -> None:
    priors = Priors()
    found = cluster_covariance(PLACES, priors)
    between = (PLACES[0] - PLACES[1]) / np.linalg.norm(PLACES[0] - PLACES[1])
    row = np.concatenate([between, -between, np.zeros(3)])
    assert np.sqrt(row @ found @ row) == pytest.approx(np.sqrt(2.0) * priors.cluster_marker_sd_m)
    alone = cluster_covariance(PLACES[:1], priors)
    np.testing.assert_allclose(alone, priors.marker_sd_m**2 * np.eye(3))


def test_the_filter_starts_from_it() -> None:
    initial = measured()
    names = list(initial.names)
    own = [m for m in initial.spec.markers if m.segment == "shank_r"]
    at = [names.index(f"marker/{m.name}/{axis}") for m in own for axis in "xyz"]
    expected = cluster_covariance(np.array([m.position for m in own]), Priors())
    assert len(own) > 1
    np.testing.assert_allclose(initial_covariance(initial, Noise())[np.ix_(at, at)], expected, rtol=1e-9, atol=1e-15)
    np.testing.assert_allclose(initial.sd0[at] ** 2, np.diag(expected))


def test_what_is_known_otherwise_takes_its_place() -> None:
    prior = JointPrior(("a", "b", "c"), np.array([[4.0, 1.0, 0.5], [1.0, 9.0, 2.0], [0.5, 2.0, 16.0]]))
    found = prior.with_known(JointPrior(("b", "d"), np.array([[0.1, 0.05], [0.05, 0.2]])))
    assert found.names == ("a", "c", "b", "d")
    np.testing.assert_array_equal(found.covariance[:2, :2], [[4.0, 0.5], [0.5, 16.0]])
    np.testing.assert_array_equal(found.covariance[2:, 2:], [[0.1, 0.05], [0.05, 0.2]])
    assert not found.covariance[:2, 2:].any()
