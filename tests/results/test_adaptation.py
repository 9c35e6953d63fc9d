"""When an estimate has settled, on paths that settle at known times."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dynakin.results.estimate import Estimate
from dynakin.results.measures.adaptation import adaptation, constant_settling, misfit_settling, running_rms
from support.estimates.synthetic import make_estimate

TIME = np.arange(2001) / 100.0
RNG = np.random.default_rng(7)


def test_a_constant_settles_where_what_it_still_moves_fits_into_the_band() -> None:
    path = 1.0 + 0.1 * np.exp(-TIME)  # 0.01 is left at ln 10
    assert constant_settling(TIME, path, 0.01).after_s == pytest.approx(np.log(10.0), abs=0.011)
    assert constant_settling(TIME, np.ones(2001), 0.01).after_s == 0.0


def test_a_constant_that_drifts_to_the_end_does_not_settle() -> None:
    assert constant_settling(TIME, 1.0 + 0.01 * TIME, 0.01).after_s is None
    assert constant_settling(TIME, 1.0 + 0.01 * TIME, 0.06).after_s == pytest.approx(14.0, abs=0.011)


def test_a_short_return_to_the_final_value_is_not_settling() -> None:
    path = 1.0 + np.where((TIME > 8.0) & (TIME < 9.0), 0.05, 0.0)
    assert constant_settling(TIME, path, 0.01).after_s == pytest.approx(9.0)


def test_a_misfit_settles_when_its_burst_is_over() -> None:
    noise = RNG.normal(0.0, 1.0, 2001)
    assert misfit_settling(TIME, noise).after_s == 0.0
    burst = noise + np.where(TIME < 3.0, 40.0, 0.0)
    # a running second still holds too much of the burst until nearly all of it has passed
    assert misfit_settling(TIME, burst).after_s == pytest.approx(3.0, abs=0.02)


def test_a_misfit_that_swings_with_the_movement_is_settled() -> None:
    assert misfit_settling(TIME, np.sin(2.0 * np.pi * TIME / 4.0) ** 4).after_s == 0.0


def test_a_misfit_that_grows_or_bursts_near_the_end_does_not_settle() -> None:
    grown = misfit_settling(TIME, np.exp(TIME / 4.0))
    assert grown.after_s is None and grown.growth > 3.0
    late = misfit_settling(TIME, 1.0 + np.where((TIME > 17.0) & (TIME < 18.0), 10.0, 0.0))
    assert late.after_s is None


def test_running_rms_leaves_gaps_out() -> None:
    values = np.array([3.0, np.nan, 4.0, np.nan, np.nan])
    assert running_rms(values, 2) == pytest.approx([3.0, 4.0, 4.0, np.nan], nan_ok=True)


def test_the_trial_has_adapted_with_the_last_of_its_parts(estimate: Estimate) -> None:
    found = adaptation(estimate)
    parts = [group["after_s"] for group in found["constants"].values()]
    parts += [misfit["after_s"] for misfit in found["misfits"].values()]
    assert set(found["constants"]) == {"lengths", "masses", "moments of inertia"}
    assert set(found["misfits"]) == {"markers", "fx", "fy", "mz"}
    assert found["after_s"] == max(parts) > 1.0
    assert f"settled after {found['after_s']:.1f} s" in found["verdict"]


def test_what_does_not_settle_is_named(estimate: Estimate) -> None:
    state = estimate.data["state"].copy(deep=True)
    state.loc[{"element": "length/shank"}] *= 1.0 + 0.02 * estimate.time
    found = adaptation(replace(estimate, data=estimate.data.assign(state=state)))
    assert found["after_s"] is None
    assert found["constants"]["lengths"]["not_settled"] == ["length/shank"]
    assert "does not settle before the trial ends" in found["verdict"] and "lengths (1)" in found["verdict"]
    wrench = estimate.data["wrench_estimated"].copy(deep=True)
    wrench.loc[{"component": "fy"}] += np.exp(estimate.time)
    found = adaptation(replace(estimate, data=estimate.data.assign(wrench_estimated=wrench)))
    assert found["misfits"]["fy"]["after_s"] is None and found["after_s"] is None
    assert "the misfit of fy is up to" in found["verdict"]


def test_a_short_recording_has_no_adaptation_time() -> None:
    found = adaptation(make_estimate(3.0))
    assert found["after_s"] is None and "too short" in found["verdict"]
