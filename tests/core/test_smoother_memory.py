"""Checkpoints change nothing, and neither does smoothing change what the filter does."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from support.core.random_models import planar_model, spatial_model
from support.core.smoother_cases import BOUNDED, case, lost_and_found

FRAMES = 60
CASES = {
    "plain": lambda: case(spatial_model(6), 31, FRAMES),
    "all blocks": lambda: case(planar_model(50, n_segments=3), 31, FRAMES, states="all"),
    "contacts": lambda: case(spatial_model(6), 31, FRAMES, states="contacts", delay=True),
    "bounds": BOUNDED["all blocks"],
    "lost and found": lost_and_found,
}


def assert_near(a, b):
    """What the run gives to the last bit; what smoothing gives within 1e-9 of a standard deviation."""
    smoothed = {key for key in a if key.startswith("smoothed_")}
    assert_same({key: a[key] for key in a.keys() - smoothed}, {key: b[key] for key in b.keys() - smoothed})
    for key in smoothed:
        sd = b[f"{key.removesuffix('_sd')}_sd"]
        np.testing.assert_array_less(np.abs(a[key] - b[key]), 1e-9 * sd + 1e-12, err_msg=key)


def assert_same(a, b):
    for key in a.keys() - {"step_us", "backward_us"}:
        np.testing.assert_array_equal(a[key], b[key], err_msg=key)


@pytest.mark.parametrize("stretch", [1, 7, 25, 0])
@pytest.mark.parametrize("name", CASES)
def test_checkpoints_change_nothing(name, stretch):
    c = CASES[name]()
    assert_near(c.smoothed(stretch=stretch), c.smoothed(stretch=10_000))


def test_the_same_run_gives_the_same_bits():
    c = CASES["contacts"]()
    assert_same(c.smoothed(), c.smoothed())


@pytest.mark.parametrize("stretch", [1, 7, 0])
@pytest.mark.parametrize("name", CASES)
def test_a_second_thread_gives_the_bits_of_one(monkeypatch, name, stretch):
    c, found = CASES[name](), []
    for threads in ("1", "2"):
        monkeypatch.setenv("OMP_NUM_THREADS", threads)
        found.append(c.smoothed(stretch=stretch))
    assert_same(*found)


@pytest.mark.parametrize("how", ["run", "run_lagged"])
@pytest.mark.parametrize("name", CASES)
def test_deviations_of_a_second_thread_are_those_of_one(monkeypatch, name, how):
    c, found = CASES[name](), []
    for threads in ("1", "2"):
        monkeypatch.setenv("OMP_NUM_THREADS", threads)
        f = c.filter()
        more = {"output_sd": True} if how == "run" else {"lag": 5}
        found.append(c.data.run(partial(getattr(f, how), **more)))
    assert "markers_sd" in found[0] or "smoothed_markers_sd" in found[0]
    assert_same(*found)


@pytest.mark.parametrize("name", CASES)
def test_the_forward_run_is_that_of_run(name):
    c = CASES[name]()
    f, g = c.filter(), c.filter()
    both, alone = c.data.run(f.run_smoothed, outputs=True), c.data.run(g.run, output_sd=True)
    assert_same({key: both[key] for key in alone}, alone)
    np.testing.assert_array_equal(f.covariance, g.covariance)
    for _ in range(5):  # also in what they remember
        f.step(0.01, *c.data.at(-1))
        g.step(0.01, *c.data.at(-1))
    np.testing.assert_array_equal(f.state, g.state)


@pytest.mark.parametrize("frames", [1, 2, 5])
def test_short_trials(frames):
    out = CASES["plain"]().smoothed(frames=frames)
    assert out["smoothed_state"].shape == out["state"].shape
    np.testing.assert_array_equal(out["smoothed_state"][-1], out["state"][-1])


def test_progress_counts_both_ways_and_may_interrupt():
    c = case(planar_model(3), 31, 600)
    seen = []
    c.filter().run_smoothed(c.data.time, c.data.markers, c.data.wrench, lambda *done: seen.append(done))
    assert seen[-1] == (1200, 1200)
    done = [d for d, _ in seen]
    assert done == sorted(done)
    assert len(done) > 10

    def stop(done, total):
        if done > 700:
            raise KeyboardInterrupt

    f = c.filter()
    with pytest.raises(KeyboardInterrupt):
        f.run_smoothed(c.data.time, c.data.markers, c.data.wrench, stop)
    f.reset(c.data.x0, c.data.P0)
    np.testing.assert_array_equal(
        f.run(c.data.time, c.data.markers, c.data.wrench)["state"][-1], c.smoothed()["state"][-1]
    )


def test_divergence_is_announced_as_in_run():
    c = case(planar_model(3), 31, 20)
    c.data.wrench[7] = 1e300
    with pytest.raises(Exception, match="diverged at frame 7"):
        c.smoothed()
