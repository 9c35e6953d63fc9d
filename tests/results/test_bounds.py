"""Parameters on their bounds are counted by kind, with the time that they spend there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dynakin.report.findings.fit import bounds
from dynakin.results.estimate import Estimate
from dynakin.results.measures.bounds import bound_shares, counts_in_words, parameter_bounds
from dynakin.results.measures.metrics import compute_metrics


def held(estimate: Estimate, name: str, frames: np.ndarray) -> Estimate:
    """The same with one parameter on its upper bound at these frames, and half way to it at the others."""
    (parameter,) = (p for p in estimate.parameters if p.name == name)
    assert parameter.upper is not None
    middle = 0.5 * (parameter.initial + parameter.upper)
    state = estimate.data["state"].copy(deep=True)
    state.loc[{"element": name}] = np.where(frames, parameter.upper, middle)
    return replace(estimate, data=estimate.data.assign(state=state))


def test_share_of_the_window_on_a_bound(estimate: Estimate) -> None:
    window = estimate.time >= 2.0
    made = held(estimate, "length/shank", (estimate.time >= 4.5) & (estimate.time < 7.0))
    assert bound_shares(made, window)["length/shank"] == pytest.approx(250 / 1001)
    made = held(estimate, "length/shank", estimate.time < 2.0)
    assert bound_shares(made, window)["length/shank"] == 0.0


def test_counts_of_each_kind(estimate: Estimate) -> None:
    made = held(estimate, "inertia/foot/mass", (estimate.time > 5.0) & (estimate.time < 6.0))
    found = parameter_bounds(made, estimate.time >= 2.0)
    assert {kind: counts["estimated"] for kind, counts in found["by_kind"].items()} == {
        "length": 6,
        "marker": 20,
        "inertia": 21,
    }
    assert {kind: counts["at_end"] for kind, counts in found["by_kind"].items()} == {
        "length": 1,
        "marker": 0,
        "inertia": 1,
    }
    assert found["by_kind"]["inertia"]["ever"] == 2
    assert set(found["parameters"]) == {"length/thigh", "inertia/pelvis/mass", "inertia/foot/mass"}
    assert found["parameters"]["inertia/foot/mass"] == {"share_of_time": pytest.approx(99 / 1001), "at_end": False}
    assert counts_in_words(found["by_kind"]) == ("1 of 6 lengths, 0 of 20 marker places, 1 of 21 inertial numbers")


def test_a_parameter_without_bounds_is_never_on_one(estimate: Estimate) -> None:
    free = [replace(p, lower=None, upper=None, at_bound=False) for p in estimate.parameters]
    found = parameter_bounds(replace(estimate, parameters=free), np.ones(len(estimate.time), dtype=bool))
    assert found["parameters"] == {}
    one_sided = [replace(p, lower=None) if p.name == "length/shank" else p for p in estimate.parameters]
    made = held(replace(estimate, parameters=one_sided), "length/shank", np.ones(len(estimate.time), dtype=bool))
    assert bound_shares(made, estimate.time >= 2.0)["length/shank"] == 1.0


@pytest.mark.parametrize(("left", "tells"), [(0.3, True), (0.69, True), (0.96, False), (1.0, False)])
def test_a_bound_tells_nothing_of_what_the_recording_did_not_teach(
    estimate: Estimate, left: float, tells: bool
) -> None:
    """The lumbar length of a squat: 84 mm, to 4.2 before and after, on its bound at 101 in good ones too."""
    lumbar = replace(
        estimate.parameters[0], kind="length", initial=0.084, value=0.1008, lower=0.0672, upper=0.1008, at_bound=True,
        prior_sd=0.0042, sd=float(np.hypot(0.0042 * left, 0.0072)), skin_sd=0.0072,
    )  # fmt: skip
    assert lumbar.bound_tells == tells
    found = bounds(replace(estimate, parameters=[lumbar]), compute_metrics(estimate))
    assert found is not None and (found.level == "warning") == tells
