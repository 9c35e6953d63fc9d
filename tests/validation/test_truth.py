"""Errors against truth: nothing for the truth itself, and each kind of error where it was put."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from dynakin.simulation.trial import simulate_squat
from dynakin.validation.truth import FIGURES, LEG, truth_errors


@pytest.fixture(scope="module")
def truth() -> xr.Dataset:
    return simulate_squat(seed=2, duration_s=6.0).truth.data


def as_estimate(truth: xr.Dataset) -> xr.Dataset:
    return truth.rename(wrench="wrench_estimated").copy(deep=True)


def errors(data: xr.Dataset, truth: xr.Dataset) -> dict[str, float]:
    window = truth["time"].values >= 2.0
    return dict(zip((title for title, _ in FIGURES), truth_errors("it", data, truth, window, LEG).values, strict=True))


def test_the_truth_has_no_error(truth: xr.Dataset) -> None:
    assert errors(as_estimate(truth), truth) == dict.fromkeys((title for title, _ in FIGURES), 0.0)


def test_an_offset_of_one_angle_counts_as_it_is_and_not_about_the_mean(truth: xr.Dataset) -> None:
    data = as_estimate(truth)
    data["coordinates"].loc[{"coordinate": "knee"}] += np.radians(7.0)
    found = errors(data, truth)
    assert found["angles"] == pytest.approx(1.0)  # 7 deg in one of seven coordinates
    assert found["about their mean"] == pytest.approx(0.0, abs=1e-9)


def test_errors_before_the_window_and_moments_of_other_joints_do_not_count(truth: xr.Dataset) -> None:
    data = as_estimate(truth)
    data["speeds"].values[data["time"].values < 2.0] += 5.0
    data["moments"].loc[{"coordinate": "toe"}] += 100.0
    found = errors(data, truth)
    assert found["speeds"] == 0.0 and found["moments"] == 0.0


def test_wrench_components_are_told_apart_and_order_of_coordinates_does_not_matter(truth: xr.Dataset) -> None:
    data = as_estimate(truth)
    data["wrench_estimated"].loc[{"component": "mz"}] -= 3.0
    found = errors(data.isel(coordinate=slice(None, None, -1)), truth)
    assert found["MZ"] == pytest.approx(3.0)
    assert found["FX"] == found["FY"] == found["angles"] == 0.0
