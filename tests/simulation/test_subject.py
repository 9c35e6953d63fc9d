"""The simulated subject: a possible body of the given mass, around the table."""

from __future__ import annotations

import numpy as np
import pytest

from dynakin.errors import ConfigError
from dynakin.simulation import Spread, draw_subject
from dynakin.simulation.sagittal import build_tree
from dynakin.simulation.subject import affine, mass_com_inertia, pseudo_inertia


@pytest.mark.parametrize("sex", ["male", "female", None])
@pytest.mark.parametrize("seed", range(10))
def test_masses_add_up_and_every_body_is_possible(seed: int, sex: str | None) -> None:
    subject = draw_subject(np.random.default_rng(seed), 63.2, 1.68, sex)
    assert sum(J[3, 3] for J in subject.bodies.values()) == pytest.approx(63.2, rel=1e-12)
    for name, J in subject.bodies.items():
        assert np.linalg.eigvalsh(J)[0] > 0.0, name
    for segment in build_tree(subject):
        moments = np.linalg.eigvalsh(segment.inertia)
        assert moments[0] + moments[1] > moments[2] > 0.0, segment.name


def test_the_planar_numbers_are_those_of_the_tree() -> None:
    subject = draw_subject(np.random.default_rng(3), 70.0, 1.75, "male")
    named = subject.parameters()
    for segment in build_tree(subject):
        x, y, _ = segment.com
        about_origin = segment.inertia[2, 2] + segment.mass * (x**2 + y**2)
        expected = {"mass": segment.mass, "mx": segment.mass * x, "my": segment.mass * y, "izz": about_origin}
        for key, value in expected.items():
            assert named[f"inertia/{segment.name}/{key}"] == pytest.approx(value, rel=1e-12), segment.name


def test_without_spread_it_is_the_table() -> None:
    one, other = (
        draw_subject(np.random.default_rng(s), 70.0, 1.75, "male", Spread.none()).parameters() for s in (1, 2)
    )
    assert one == other
    # Dumas: both thighs 2 x 12.3 % of a whole that adds up to 100.2 %
    assert one["inertia/thigh/mass"] == pytest.approx(70.0 * 0.246 / 1.002, rel=1e-12)
    assert one["length/shank"] == pytest.approx(0.246 * 1.75, rel=1e-12)


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
