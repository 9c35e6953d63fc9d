"""Where a wrench presses on a level plane: no moment is left there but about the vertical."""

from __future__ import annotations

import numpy as np

from dynakin.arrays import wrench_about
from dynakin.recordings.plates.pressure import Surface, centre_of_pressure, pressed_at
from dynakin.recordings.pushes import LOADED_N


def test_only_a_moment_about_the_vertical_is_left_and_it_is_the_surfaces_own_point() -> None:
    rng = np.random.default_rng(0)
    wrench, height = rng.normal(size=(500, 6)) * [200, 600, 200, 300, 50, 300], rng.normal(size=500)
    x, z = pressed_at(wrench, height).T
    loaded = wrench[:, 1] >= LOADED_N
    np.testing.assert_array_equal(np.isfinite([x, z]), [loaded, loaded])
    left = wrench_about(wrench, np.stack([x, height, z], axis=1))[loaded]
    np.testing.assert_allclose(left[:, [3, 5]], 0.0, atol=1e-9)
    for k in np.flatnonzero(loaded)[:20]:
        surface = Surface(np.array([0.0, height[k], 0.0]), np.array([0.0, 1.0, 0.0]))
        point, _ = centre_of_pressure(wrench[[k], :3], wrench[[k], 3:], surface, LOADED_N)
        np.testing.assert_allclose(pressed_at(wrench[k], height[k]), point[0, [0, 2]], atol=1e-12)


def test_a_plate_in_a_plane_presses_on_its_middle_and_an_empty_one_nowhere() -> None:
    planar = np.array([10.0, 500.0, np.nan, np.nan, np.nan, 50.0])
    np.testing.assert_allclose(pressed_at(planar, 0.5), [0.11, 0.0], atol=1e-15)
    assert np.isnan(pressed_at(np.full(6, np.nan))).all()
    np.testing.assert_allclose(pressed_at(np.array([0.0, -2.0, 0.0, 4.0, 0.0, 1.0]), least_n=-np.inf), [-0.5, 2.0])
