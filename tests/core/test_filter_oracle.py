"""The core's filter equals the dense NumPy oracle over whole trials."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from oracle.filter import Filter, Settings

from core.bridge import filter_of
from core.random_models import planar_model, settings, spatial_model, trial

FRAMES = 300
CHUNKS = (1, 7, 28, 1000)
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


@cache
def case(name):
    spec = CASES[name][0]()
    data = trial(spec, 31, FRAMES)
    options = settings(spec, 31) | CASES[name][1]
    expected = Filter(spec, Settings(**options), data.x0, data.P0).run(data.time, data.markers, data.wrench)
    return spec, data, options, expected


def near(actual, expected, scale=None, tolerance=1e-8, name=""):
    scale = np.maximum(1.0, np.abs(expected)) if scale is None else scale
    np.testing.assert_array_less(np.abs(actual - expected) / scale, tolerance, err_msg=name)


@pytest.mark.parametrize("name", CASES)
def test_trial_is_a_real_test(name):
    """Bounds are active for a part of the frames, rows are missing, and the oracle stays finite."""
    _, data, options, expected = case(name)
    assert np.isfinite(expected["state"]).all()
    assert np.isnan(data.markers).any()
    assert len(set(expected["n_rows"])) > 3
    if options["constraint"] == "gain":
        active = (expected["constrained"] > 0).mean()
        assert 0.01 < active < 1.0, active


@pytest.mark.parametrize("chunk_rows", CHUNKS)
@pytest.mark.parametrize("name", CASES)
def test_run_equals_the_oracle(name, chunk_rows):
    spec, data, options, expected = case(name)
    f = filter_of(spec, options, data.x0, data.P0, chunk_rows)
    out = f.run(data.time, data.markers, data.wrench)
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
    assert out["step_us"].shape == (FRAMES,)
    assert (out["step_us"] >= 0).all()


@pytest.mark.parametrize("name", ["paper: planar chain of 7", "spatial, axis functions"])
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
                report = core.update(data.markers[k], data.wrench[k])
                expected = oracle.update(data.markers[k], data.wrench[k])
                assert (report.n_rows, report.constrained) == (expected.n_rows, expected.constrained)
                assert report.nis == pytest.approx(expected.nis, rel=1e-9, abs=1e-9)
                assert report.log_likelihood == pytest.approx(expected.log_likelihood, rel=1e-9, abs=1e-9)
            near(core.state, oracle.state)
            sd = np.sqrt(np.diag(oracle.covariance))
            near(core.covariance, oracle.covariance, scale=np.outer(sd, sd))
