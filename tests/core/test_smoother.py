"""The smoother equals textbook smoothers of the linear problem that the filter solved, and keeps what it must."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from support.core.random_models import planar_model, spatial_model
from support.core.smoother_cases import assert_equal, case, deviations, walk
from support.oracle.smoother import batch, rauch_tung_striebel

FRAMES = 25
CASES = {
    "planar chain": lambda: case(planar_model(50, n_segments=7), 31, FRAMES),
    "planar tree": lambda: case(planar_model(3), 31, FRAMES),
    "spatial, linear axes": lambda: case(spatial_model(4, nonlinear=False), 31, FRAMES),
    "spatial, axis functions": lambda: case(spatial_model(6), 31, FRAMES),
    "planar, all blocks": lambda: case(planar_model(50, n_segments=3), 31, FRAMES, states="all"),
    "planar, all blocks, plates late": lambda: case(
        planar_model(50, n_segments=4), 31, FRAMES, states="all", delay=True
    ),
    "planar, contacts": lambda: case(
        planar_model(50, n_segments=3), 31, FRAMES, states="contacts", delay=True, total_mass=None
    ),
    "spatial, contacts": lambda: case(spatial_model(4, nonlinear=False), 31, FRAMES, states="contacts"),
    "spatial, all blocks": lambda: case(spatial_model(9), 31, FRAMES, states="all", total_mass=None),
}
each_case = pytest.mark.parametrize("name", CASES)


@cache
def solved(name):
    """Case, filter step by step, and all states given all measurements, from one dense regression."""
    c = CASES[name]()
    w = walk(c)
    return c, w, *batch(c.data.x0, c.data.P0, w.frames)


@each_case
def test_the_trials_are_real_tests(name):
    """Rows come and go, later frames tell much, and steps differ."""
    c, w, _, P = solved(name)
    assert len({report.n_rows for report in w.reports}) > 3
    assert np.ptp(np.diff(c.data.time)) > 0.004
    assert (deviations(P)[:-1] / deviations(w.P)[:-1]).min() < 0.5


@each_case
def test_equals_one_dense_regression_over_all_frames(name):
    c, _, x, P = solved(name)
    assert_equal(c.smoothed(), x, P, 1e-10)


@each_case
def test_equals_rauch_tung_striebel(name):
    c, w, _, _ = solved(name)
    expected = rauch_tung_striebel(w.x, w.P, w.x_predicted, w.P_predicted, [f.F for f in w.frames])
    assert_equal(c.smoothed(), *expected, 1e-8)


@each_case
def test_no_variance_grows_and_the_last_frame_is_the_filters(name):
    c, *_ = solved(name)
    out = c.smoothed()
    assert (out["smoothed_state_sd"] <= out["state_sd"] * (1.0 + 1e-12)).all()
    for smoothed, filtered in (
        ("state", "state"),
        ("state_sd", "state_sd"),
        ("markers", "markers_estimated"),
        ("markers_sd", "markers_sd"),
        ("wrench", "wrench_estimated"),
        ("wrench_sd", "wrench_sd"),
        ("moments", "moments"),
        ("moments_sd", "moments_sd"),
    ):
        np.testing.assert_array_equal(out[f"smoothed_{smoothed}"][-1], out[filtered][-1], err_msg=smoothed)


@each_case
def test_constants_are_the_same_at_all_frames(name):
    c, *_ = solved(name)
    out = c.smoothed()
    o = c.options
    constant = (o["process_variance"] == 0.0) & (o["process_density"] == 0.0) & (o["decay_rate"] == 0.0)
    constant[: 3 * c.model.layout.blocks["coordinates"][1]] = False
    assert constant.sum() > 5
    sd = out["state_sd"][-1, constant]
    for key, tolerance in (("state", 1e-9), ("state_sd", 1e-9)):
        values = out[f"smoothed_{key}"][:, constant]
        np.testing.assert_array_less(np.abs(values - values[-1]) / sd, tolerance)


@pytest.mark.parametrize("states", ["", "all"])
def test_smoothing_comes_closer_to_the_truth(states):
    """Speeds and accelerations most of all: what comes later says where they went."""
    c = case(planar_model(50, n_segments=4), 31, 200, states=states)
    out = c.smoothed()
    n = c.model.layout.blocks["coordinates"][1]
    truth = c.data.truth[:, n : 3 * n]  # the state begins with coordinates, speeds and accelerations
    error = {key: np.sqrt(((out[key][:, n : 3 * n] - truth) ** 2).mean()) for key in ("state", "smoothed_state")}
    assert error["smoothed_state"] < 0.8 * error["state"]
