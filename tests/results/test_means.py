"""Means: what is not known is left out."""

from __future__ import annotations

import numpy as np

from dynakin.arrays import mean_seen, rms, rms_length


def test_what_is_not_known_does_not_count() -> None:
    values = np.array([[3.0, np.nan, np.nan], [4.0, 2.0, np.nan]])
    assert rms(values, axis=0)[:2].tolist() == [np.sqrt(12.5), 2.0] and np.isnan(rms(values, axis=0)[2])
    assert float(rms(values)) == np.sqrt(29.0 / 3.0)


def test_a_vector_with_an_unknown_component_has_no_length() -> None:
    assert rms_length(np.array([[3.0, 4.0], [100.0, np.nan]])) == 5.0
    assert np.isnan(rms_length(np.full((2, 3), np.nan)))


def test_a_point_that_is_seen_in_part_has_no_part_in_the_mean() -> None:
    points = np.array([[[1.0, 2.0], [3.0, 6.0], [100.0, np.nan]], np.full((3, 2), np.nan)])
    assert mean_seen(points, axis=1)[0].tolist() == [2.0, 4.0] and np.isnan(mean_seen(points, axis=1)[1]).all()
