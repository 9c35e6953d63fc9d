"""Standard deviations of what is reported: J P J' of the filtered and of the smoothed covariance."""

from __future__ import annotations

import numpy as np
import pytest

from dynakin.bindings import _core
from support.core.random_models import planar_model, spatial_model
from support.core.smoother_cases import case, walk

CASES = {
    "planar, plates late": lambda: case(planar_model(50, n_segments=4), 31, 12, states="all", delay=True),
    "spatial": lambda: case(spatial_model(6), 31, 12),
    "spatial, all blocks": lambda: case(spatial_model(9), 31, 12, states="all"),
}
OUTPUTS = ("markers", "wrench", "moments")


def expected(model, x, P):
    """By dense Jacobians; the body's own wrench, whatever the plates add to it."""
    found = {}
    for name, J in zip(
        OUTPUTS,
        (_core.marker_jacobian(model, x), _core.wrench_jacobian(model, x), _core.moment_jacobian(model, x)),
        strict=True,
    ):
        found[name] = np.sqrt(np.diag(J @ P @ J.T).clip(0.0))
    found["markers"] = found["markers"].reshape(-1, 3)
    return found


@pytest.mark.parametrize("name", CASES)
def test_filtered(name):
    c = CASES[name]()
    w = walk(c)
    out = c.filter().run(c.data.time, c.data.markers, c.data.wrench, output_sd=True)
    for k in range(len(c.data.time)):
        for key, sd in expected(c.model, w.x[k], w.P[k]).items():
            np.testing.assert_allclose(out[f"{key}_sd"][k], sd, rtol=1e-9, atol=1e-12 * sd.max(), err_msg=key)
    assert (out["wrench_sd"].max(axis=0) > 0.1).any()


@pytest.mark.parametrize("name", CASES)
def test_smoothed(name):
    """The covariance of a smoothed frame is that of a fixed lag when the trial ends."""
    c = CASES[name]()
    out = c.smoothed()
    frames = len(c.data.time)
    for lag in (1, 5, frames - 1):
        smoother = _core.FixedLag(c.filter(), lag)
        for k in range(frames):
            smoother.step(c.data.time[k] - c.data.time[k - 1] if k else 0.0, c.data.markers[k], c.data.wrench[k])
        there = frames - 1 - lag
        x = out["smoothed_state"][there]
        for key, sd in expected(c.model, x, smoother.covariance).items():
            actual = out[f"smoothed_{key}_sd"][there]
            np.testing.assert_allclose(actual, sd, rtol=1e-8, atol=1e-10 * sd.max(), err_msg=key)
        np.testing.assert_allclose(
            out["smoothed_moments"][there], _core.joint_moments(c.model, x), rtol=1e-12, atol=1e-9
        )
        np.testing.assert_allclose(out["smoothed_wrench"][there], _core.wrench(c.model, x), rtol=1e-12, atol=1e-9)
        np.testing.assert_allclose(out["smoothed_markers"][there], _core.marker_positions(c.model, x), atol=1e-12)


def test_on_demand_only():
    c = CASES["spatial"]()
    out = c.filter().run(c.data.time, c.data.markers, c.data.wrench)
    assert not {"markers_sd", "wrench_sd", "moments_sd"} & out.keys()
