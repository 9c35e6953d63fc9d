"""The simulated subject: a possible body of the given mass, around the table."""

from __future__ import annotations

import numpy as np
import pytest

from dynakin.errors import ConfigError
from dynakin.simulation.bodies.planar import SAGITTAL7, SQUAT7, Planar
from dynakin.simulation.bodies.subject import Spread, affine, draw_subject, mass_com_inertia, pseudo_inertia


@pytest.mark.parametrize("chain", [SAGITTAL7, SQUAT7])
@pytest.mark.parametrize("sex", ["male", "female", None])
@pytest.mark.parametrize("seed", range(5))
def test_masses_add_up_and_every_body_is_possible(seed: int, sex: str | None, chain: Planar) -> None:
    subject = draw_subject(np.random.default_rng(seed), 63.2, 1.68, sex)
    bodies = chain.segment_bodies(subject)
    assert sum(J[3, 3] for J in bodies.values()) == pytest.approx(63.2, rel=1e-12)
    for name, J in bodies.items():
        assert np.linalg.eigvalsh(J)[0] > 0.0, name
    for segment in chain.build_tree(subject):
        moments = np.linalg.eigvalsh(segment.inertia)
        assert moments[0] + moments[1] > moments[2] > 0.0, segment.name


def test_the_same_subject_weighs_the_same_in_both_chains() -> None:
    """Straight, both chains are one and the same mass distribution: their sums about the toe are equal."""
    subject = draw_subject(np.random.default_rng(4), 70.0, 1.75, "male")
    total = []
    for chain in (SAGITTAL7, SQUAT7):
        whole, at = np.zeros((4, 4)), {None: np.zeros(3)}
        for segment in chain.build_tree(subject):
            at[segment.name] = at[segment.parent] + segment.placement
            whole += affine(pseudo_inertia(segment.mass, segment.com, segment.inertia), shift=at[segment.name])
        total.append(whole)
    np.testing.assert_allclose(total[0], total[1], rtol=1e-12, atol=1e-12)


def test_the_ten_numbers_are_those_of_the_tree() -> None:
    """Against second moments of mass: the tensor about the origin is trace(S) 1 - S."""
    subject = draw_subject(np.random.default_rng(3), 70.0, 1.75, "male")
    bodies = SAGITTAL7.segment_bodies(subject)
    named = SAGITTAL7.build_body(subject, np.random.default_rng(0)).parameters()
    for name, J in bodies.items():
        S, h, m = J[:3, :3], J[:3, 3], J[3, 3]
        tensor = np.trace(S) * np.eye(3) - S
        expected = {"mass": m, "mx": h[0], "my": h[1], "mz": h[2]}
        expected |= {"ixx": tensor[0, 0], "iyy": tensor[1, 1], "izz": tensor[2, 2]}
        expected |= {"ixy": tensor[0, 1], "ixz": tensor[0, 2], "iyz": tensor[1, 2]}
        for key, value in expected.items():
            assert named[f"inertia/{name}/{key}"] == pytest.approx(value, rel=1e-12, abs=1e-12), name


def test_without_spread_it_is_the_table() -> None:
    one, other = (
        SAGITTAL7.build_body(
            draw_subject(np.random.default_rng(s), 70.0, 1.75, "male", Spread.none()), np.random.default_rng(s)
        ).parameters()
        for s in (1, 2)
    )
    assert one == other
    # Dumas: both thighs 2 x 12.3 % of a whole that adds up to 100.2 %
    assert one["inertia/thigh/mass"] == pytest.approx(70.0 * 0.246 / 1.002, rel=1e-12)
    assert one["length/shank"] == pytest.approx(0.246 * 1.75, rel=1e-12)


def test_spread_has_its_size() -> None:
    """Over 250 subjects, the standard deviation of the logarithm of a length."""
    for factor in (0.5, 2.0):
        spread = Spread().times(factor)
        lengths = [
            draw_subject(np.random.default_rng(seed), 70.0, 1.75, "male", spread).lengths["shank"]
            for seed in range(250)
        ]
        assert np.log(lengths).std() == pytest.approx(0.03 * factor, rel=0.15)


def test_shift_of_a_pseudo_inertia_is_the_parallel_axis_theorem() -> None:
    inertia, shift = np.diag([0.3, 0.4, 0.5]), np.array([0.1, -0.2, 0.3])
    com = np.array([0.02, 0.01, -0.03])
    mass, moved, same = mass_com_inertia(affine(pseudo_inertia(2.0, com, inertia), shift=shift))
    assert mass == 2.0
    np.testing.assert_allclose(moved, com + shift, rtol=1e-14)
    np.testing.assert_allclose(same, inertia, atol=1e-15)


@pytest.mark.parametrize(
    ("mass_kg", "height_m", "sex", "word"),
    [(0.0, 1.7, None, "mass_kg"), (70.0, -1.0, None, "height_m"), (70.0, 1.7, "m", "sex")],
)
def test_a_wrong_subject_is_named(mass_kg: float, height_m: float, sex: str | None, word: str) -> None:
    with pytest.raises(ConfigError, match=word):
        draw_subject(np.random.default_rng(0), mass_kg, height_m, sex)


@pytest.mark.parametrize("values", [{"length": -0.1}, {"mass": 0.9}, {"size": float("nan")}])
def test_a_wrong_spread_is_named(values: dict[str, float]) -> None:
    with pytest.raises(ConfigError, match=next(iter(values))):
        Spread(**values)
