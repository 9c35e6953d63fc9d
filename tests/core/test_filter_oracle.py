"""The core's filter equals the dense NumPy oracle over whole trials."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from support.core.bridge import filter_of
from support.core.random_models import (
    continuous,
    planar_model,
    settings,
    spatial_model,
    trial,
    with_contacts,
    with_slow_errors,
)
from support.oracle import gate
from support.oracle.filter import Filter, Settings
from support.oracle.inertia import all_possible
from support.oracle.state import Layout

FRAMES = 300
CASES = {
    "paper: planar chain of 7": (lambda: planar_model(50, n_segments=7), {}),
    "planar tree": (lambda: planar_model(3), {}),
    "planar tree, no mass, no constraint": (
        lambda: planar_model(2),
        {"total_mass": None, "constraint": "none"},
    ),
    "spatial": (lambda: spatial_model(4, nonlinear=False), {}),
    "spatial, axis functions": (lambda: spatial_model(6), {}),
    "spatial, axis functions, 2": (lambda: spatial_model(9), {"total_mass": None}),
}

# White jerk, soft tissue, plates that err and come late, and what else the default preset does. Constraints of
# 'projection' leave the inertia possible here; test_consistency has the others.
CONTINUOUS = {
    "continuous, planar chain": (lambda: planar_model(50, n_segments=7), {"total_mass": None}),
    "continuous, spatial": (lambda: spatial_model(6), {}),
    "projection, planar chain": (lambda: planar_model(50, n_segments=5), {"constraint": "projection"}),
    "projection, spatial": (lambda: spatial_model(4), {"constraint": "projection"}),
    "projection and gates, planar tree": (
        lambda: planar_model(3),
        {"constraint": "projection", "marker_gate": gate.limits(0.2), "wrench_gate": gate.limits(0.2)},
    ),
    "gates, spatial, plates need markers": (
        lambda: spatial_model(9),
        {"marker_gate": gate.limits(0.3), "wrench_gate": gate.limits(0.1), "wrench_needs_markers": True},
    ),
    "sigmoid, planar chain": (lambda: planar_model(50, n_segments=4), {"constraint": "sigmoid"}),
    "gain, spatial": (lambda: spatial_model(6), {"constraint": "gain"}),
    "contacts, planar chain": (
        lambda: with_contacts(planar_model(50, n_segments=5)),
        {"constraint": "projection", "total_mass": None},
    ),
    "contacts, spatial": (lambda: with_contacts(spatial_model(4)), {}),
    "contacts and gates, spatial, axis functions": (
        lambda: with_contacts(spatial_model(9), ("left", "right", "seat")),
        {"marker_gate": gate.limits(0.3), "wrench_gate": gate.limits(0.1), "wrench_needs_markers": True},
    ),
}
NAMES = [*CASES, *CONTINUOUS]


@cache
def case(name):
    if name in CASES:
        spec = CASES[name][0]()
        data = trial(spec, 31, FRAMES)
        options = settings(spec, 31) | CASES[name][1]
    else:
        spec = with_slow_errors(CONTINUOUS[name][0](), 31)
        data = trial(spec, 31, FRAMES // 2)
        options = continuous(spec, 31, **CONTINUOUS[name][1])
        if options["constraint"] == "sigmoid":  # at an edge its map is so flat that rounding grows a millionfold
            options["lower"], options["upper"] = options["lower"].copy(), options["upper"].copy()
            options["lower"][0] -= 0.3
            options["upper"][0] += 0.3
    expected = Filter(spec, Settings(**options), data.x0, data.P0).run(
        data.time, data.markers, data.wrench, **data.given
    )
    return spec, data, options, expected


def near(actual, expected, scale=None, tolerance=1e-8, name=""):
    scale = np.maximum(1.0, np.abs(expected)) if scale is None else scale
    np.testing.assert_array_less(np.abs(actual - expected) / scale, tolerance, err_msg=name)


@pytest.mark.parametrize("name", NAMES)
def test_trial_is_a_real_test(name):
    """Bounds are active for a part of the frames, rows are missing, and the oracle stays finite."""
    spec, data, options, expected = case(name)
    assert np.isfinite(expected["state"]).all()
    assert np.isnan(data.markers).any()
    assert len(set(expected["n_rows"])) > 3
    if "gate" in name:
        refused = (expected["verdicts"] == "refused").mean(axis=0)
        assert refused[:-1].max() > 0.02
        assert 0 < refused[-1] < 0.9
    if spec.contacts:  # which are there, change, are gone, and decide something while they are there
        acts = np.abs(data.wrench_effects).max(axis=1).reshape(len(data.time), -1, 6).max(axis=2) > 0.0
        assert len(np.unique(acts, axis=0)) > 3 and not acts[-1].any()
        assert np.isnan(data.wrench[acts.any(axis=1)]).any()
        assert expected["state_sd"][:, Layout(spec).block("contacts")].min() < 0.6  # 1 before anything is measured
    if options["constraint"] == "projection":
        assert all(all_possible(Layout(spec), x) for x in expected["state"])
    if options["constraint"] == "sigmoid":
        bounded = np.isfinite(options["lower"]) & np.isfinite(options["upper"])
        assert bounded[Layout(spec).block("coordinates")].any() and bounded.sum() > 5
    elif options["constraint"] != "none":
        active = (expected["constrained"] > 0).mean()
        assert 0.01 < active < 1.0, active


@pytest.mark.parametrize("name", NAMES)
def test_run_equals_the_oracle(name):
    spec, data, options, expected = case(name)
    f = filter_of(spec, options, data.x0, data.P0)
    out = data.run(f.run)
    near(out["state"], expected["state"], name="state")
    near(out["state_sd"], expected["state_sd"], scale=expected["state_sd"], name="state_sd")
    np.testing.assert_array_equal(out["n_rows"], expected["n_rows"])
    np.testing.assert_array_equal(out["constrained"], expected["constrained"])
    near(out["nis"], expected["nis"], name="nis")
    near(out["log_likelihood"], expected["log_likelihood"], name="log_likelihood")
    near(out["moments"], expected["moments"], tolerance=1e-7, name="moments")
    for what in ("predicted", "estimated"):
        measured = np.array([m.measured for m in spec.markers])
        key = f"markers_{what}"
        near(out[key][:, measured], expected[key][:, measured], name=key)
        components = np.array(spec.wrench_measured)
        key = f"wrench_{what}"
        near(out[key][:, components], expected[key][:, components], tolerance=1e-7, name=key)
    sd = expected["state_sd"][-1]
    near(f.covariance, expected["covariance"][-1], scale=np.outer(sd, sd), name="covariance")
    near(f.state, expected["state"][-1])
    words = np.array(["missing", "accepted", "refused"])
    np.testing.assert_array_equal(words[out["verdicts"]], expected["verdicts"])
    for key in ("innovation", "innovation_sd", "test_ratio"):
        assert np.isfinite(expected[key]).any()
        np.testing.assert_array_equal(np.isnan(out[key]), np.isnan(expected[key]))
        seen = ~np.isnan(expected[key])
        near(out[key][seen], expected[key][seen], tolerance=1e-7, name=key)
    assert not out["tracking"].any()
    assert out["constraints_met"].all()
    assert out["step_us"].shape == (len(data.time),)
    assert (out["step_us"] >= 0).all()


@pytest.mark.parametrize(
    "name",
    [
        "paper: planar chain of 7",
        "spatial, axis functions",
        "projection, spatial",
        "sigmoid, planar chain",
        "contacts, spatial",
    ],
)
def test_single_steps_equal_the_oracle(name):
    """Covariance after each of predict and update, not only at the end."""
    spec, data, options, _ = case(name)
    core = filter_of(spec, options, data.x0, data.P0)
    oracle = Filter(spec, Settings(**options), data.x0, data.P0)
    for k in range(40):
        for do in ("predict", "update"):
            if do == "predict":
                core.predict(0.004 + 0.0003 * k)
                oracle.predict(0.004 + 0.0003 * k)
            else:
                core.report_sensors(k % 2 == 0)
                report, expected = core.update(*data.at(k)), oracle.update(*data.at(k))
                assert (report.n_rows, report.constrained) == (expected.n_rows, expected.constrained)
                assert report.nis == pytest.approx(expected.nis, rel=1e-9, abs=1e-9)
                assert report.log_likelihood == pytest.approx(expected.log_likelihood, rel=1e-9, abs=1e-9)
                if k % 2 == 0:  # on demand, and the estimate is the same with and without
                    sensors = core.sensors
                    for key in sensors:
                        np.testing.assert_allclose(sensors[key], getattr(expected, key), rtol=1e-8, atol=1e-8)
            near(core.state, oracle.state)
            sd = np.sqrt(np.diag(oracle.covariance))
            near(core.covariance, oracle.covariance, scale=np.outer(sd, sd))
