"""Errors over standard deviations: right ones are called so, wrong ones by how much."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from dynakin.results.records import Parameter
from dynakin.simulation.trial import simulate_squat
from dynakin.validation.coverage import block_coverage, coverage, independent, parameter_coverage
from dynakin.validation.truth import parameter_errors

NAMES = ("hip", "knee")


def draws(frames: int = 4000, seed: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """White errors of the standard deviations that are given with them."""
    sd = np.tile([0.02, 0.5], (frames, 1))
    return np.random.default_rng(seed).normal(0.0, sd), sd


def test_right_standard_deviations_are_consistent() -> None:
    found = coverage("coordinates", NAMES, *draws(), own_model=True)
    assert found.judgement == "consistent" and found.sizes() == "right to a factor of 1.0" and found.seldom == {}
    assert found.inside == pytest.approx([0.95, 0.95], abs=0.012)
    assert found.mean_square == pytest.approx(1.0, abs=0.07)
    assert found.interval_95[0] < found.mean_square < found.interval_95[1]
    assert found.sd_over_error == pytest.approx([1.0, 1.0], abs=0.04)


def test_the_interval_holds_right_runs_in_95_percent_of_cases_white_or_not() -> None:
    rng = np.random.default_rng(2)
    for memory in (0.0, 0.95):
        inside = 0
        for _ in range(300):
            z = rng.normal(size=(600, 2))
            for k in range(1, 600):
                z[k] = memory * z[k - 1] + np.sqrt(1.0 - memory**2) * z[k]
            found = coverage("speeds", NAMES, z, np.ones_like(z))
            inside += found.interval_95[0] < found.mean_square < found.interval_95[1]
        assert 0.90 * 300 <= inside <= 0.99 * 300, memory


@pytest.mark.parametrize(
    ("factor", "judgement", "text"),
    [(0.25, "overconfident", "4 times too small"), (5.0, "conservative", "5 times too large")],
)
def test_wrong_standard_deviations_are_told_with_their_size(factor: float, judgement: str, text: str) -> None:
    error, sd = draws()
    found = coverage("speeds", NAMES, error, factor * sd)
    assert found.judgement == judgement and found.sizes() == text
    assert (found.pooled < 0.5) == (judgement == "overconfident")
    assert found.verdict().startswith(f"Speeds: {judgement}.") and text in found.verdict()


def test_an_element_that_a_mean_hides_is_named() -> None:
    """The demo said "consistent" of angles of which the knee's truth lay in 30 % of its intervals."""
    error, sd = draws()
    error[:, 0] = 2.2 * sd[:, 0]
    error[:, 1] *= 0.5
    found = coverage("coordinates", NAMES, error, sd)
    assert found.seldom == {NAMES[0]: 0.0}
    assert found.factor == pytest.approx(1.6, abs=0.05)


def test_what_holds_the_truth_too_seldom_is_overconfident_whatever_the_mean_is() -> None:
    rng = np.random.default_rng(3)
    error = rng.normal(size=(2000, 2))
    part = np.where(np.arange(2000)[:, None] < 700, 0.4, 3.0)  # a third of it 2.5 times too sure
    found = coverage("speeds", NAMES, error, np.broadcast_to(part, error.shape))
    assert found.mean_square < 4.0 and found.pooled < 0.85
    assert found.judgement == "overconfident" and "too small for part of it" in found.verdict()
    few = coverage("lengths", ["a", "b", "c"], np.array([[2.2, 0.1, 0.2]]), np.ones((1, 3)))
    assert few.pooled < 0.85 and few.judgement == "consistent"  # one of three: by chance


def test_a_little_too_sure_is_wrong_for_own_data_only() -> None:
    error, sd = draws()
    assert coverage("speeds", NAMES, error, 0.9 * sd).judgement == "consistent"
    assert coverage("speeds", NAMES, error, 0.9 * sd, own_model=True).judgement == "overconfident"


def test_an_offset_is_outside_as_it_is_and_inside_about_its_mean() -> None:
    error, sd = draws()
    found = coverage("coordinates", NAMES, error + np.array([0.0, 5.0]), sd)
    assert found.inside == pytest.approx([0.95, 0.0], abs=0.012)
    assert found.inside_about_mean == pytest.approx([0.95, 0.95], abs=0.012)
    assert found.pooled == pytest.approx(0.475, abs=0.01) and found.pooled_about_mean == pytest.approx(0.95, abs=0.01)


def test_a_constant_error_is_worth_few_values_and_a_white_one_all() -> None:
    assert independent(np.full(1000, 0.3)) < 2.0
    assert independent(np.random.default_rng(3).normal(size=4000)) > 3500


@pytest.fixture(scope="module")
def truth() -> xr.Dataset:
    return simulate_squat(seed=2, duration_s=6.0).truth.data


def test_blocks_of_an_estimate_by_name_within_the_window(truth: xr.Dataset) -> None:
    window = truth["time"].values >= 2.0
    rng = np.random.default_rng(4)
    data = truth.isel(coordinate=slice(None, None, -1)).copy(deep=True)
    sizes = {"coordinates": 0.01, "speeds": 0.2, "accelerations": 3.0}
    for name, size in sizes.items():
        data[name] = data[name] + rng.normal(0.0, size, data[name].shape)
        data[f"{name}_sd"] = xr.full_like(data[name], size)
    data["coordinates"].values[~window] += 9.0
    data["coordinates_sd"].loc[{"coordinate": "toe"}] = 0.0  # locked: nothing is claimed
    found = {block.block: block for block in block_coverage(data, truth, window)}
    assert set(found) == set(sizes)  # moments have no standard deviation here
    assert "toe" not in found["coordinates"].names and "toe" in found["speeds"].names
    assert all(block.mean_square == pytest.approx(1.0, abs=0.15) for block in found.values())


def constant(name: str, value: float, sd: float, initial: float) -> Parameter:
    kind, segment, *_ = name.split("/")
    return Parameter(name, kind, segment, "m", value, sd, initial, None, None, None, False, True)


def test_constants_at_the_end_against_their_truth() -> None:
    parameters = [
        constant("length/shank", 0.41, 0.01, 0.44),
        constant("length/thigh", 0.43, 0.01, 0.40),
        constant("inertia/thigh/mass", 8.0, 1.0, 10.0),
        constant("inertia/thigh/mx", 0.1, 0.1, 0.0),
    ]
    truth = {"length/shank": 0.40, "length/thigh": 0.40, "inertia/thigh/mass": 10.0, "inertia/thigh/mx": 0.1}
    lengths, inertia = parameter_coverage(parameters, truth)
    assert lengths.mean_square == pytest.approx(5.0) and lengths.dof == 2.0  # (1 + 9) / 2
    assert list(lengths.inside) == [True, False] and lengths.pooled_about_mean is None
    assert inertia.block == "inertial numbers" and inertia.mean_square == pytest.approx(2.0)
    errors = parameter_errors(parameters, truth)
    assert errors["lengths"] == pytest.approx((2, 10.0 * np.sqrt(0.5), np.sqrt((2.5**2 + 7.5**2) / 2.0)))
    assert errors["masses"] == pytest.approx((1, 0.0, 20.0))
