"""A run for its figures alone: the same figures as from what `run` records, and an end where the filter is lost."""

from __future__ import annotations

import numpy as np
import pytest

from dynakin.bindings import _core
from support.core.bridge import filter_of, model_of
from support.core.own_model import chain, draw, settings
from support.oracle.state import Layout

FRAMES, FIRST, AHEAD = 60, 20, 5


@pytest.fixture(scope="module")
def case():
    spec = chain()
    layout = Layout(spec)
    return spec, layout, draw(spec, 1, FRAMES)


def scored(case, markers=None, **options):
    spec, layout, data = case
    f = filter_of(spec, settings(layout), data.x0, data.P0)
    given = data.markers[0] if markers is None else markers
    return f.score(data.time, given, data.wrench[0], **{"first": FIRST, "end": FRAMES} | options)


def sums(difference):
    seen = np.isfinite(difference)
    return np.where(seen, difference**2, 0.0).sum(axis=0), seen.sum(axis=0)


def test_the_figures_are_those_of_what_run_records(case):
    spec, layout, data = case
    run = filter_of(spec, settings(layout), data.x0, data.P0).run(data.time, data.markers[0], data.wrench[0])
    found = scored(case, ahead=AHEAD, trace=True)
    window = slice(FIRST, FRAMES)
    assert (found["done"], found["counted"], found["divergence"]) == (FRAMES, FRAMES - FIRST, "")
    assert found["nis"] == pytest.approx(run["nis"][window].sum(), rel=1e-12)
    assert found["log_likelihood"] == pytest.approx(run["log_likelihood"][window].sum(), rel=1e-12)
    assert found["n_rows"] == run["n_rows"][window].sum()
    np.testing.assert_array_equal(found["state"], run["state"])
    np.testing.assert_array_equal(found["moments"], run["moments"])
    plane = np.array([m.measured for m in spec.markers])
    for name in ("estimated", "predicted"):
        off = np.where(plane, data.markers[0] - run[f"markers_{name}"], np.nan).reshape(FRAMES, -1)
        force = np.where(spec.wrench_measured, data.wrench[0] - run[f"wrench_{name}"], np.nan)
        squares, counts = sums(np.hstack([off, force])[window])
        np.testing.assert_array_equal(found[f"{name}_counts"], counts)
        np.testing.assert_allclose(found[f"{name}_squares"], squares, rtol=1e-10, atol=1e-18)


def test_ahead_is_the_state_moved_on_without_an_update(case):
    spec, layout, data = case
    run = filter_of(spec, settings(layout), data.x0, data.P0).run(data.time, data.markers[0], data.wrench[0])
    model, probe = model_of(spec), filter_of(spec, settings(layout), data.x0, data.P0)
    plane = np.array([m.measured for m in spec.markers])
    off = []
    for then in range(FIRST, FRAMES):
        probe.reset(run["state"][then - AHEAD], data.P0)
        probe.predict(data.time[then] - data.time[then - AHEAD])
        markers = np.where(plane, data.markers[0, then] - _core.marker_positions(model, probe.state), np.nan)
        wrench = np.where(spec.wrench_measured, data.wrench[0, then] - _core.wrench(model, probe.state), np.nan)
        off.append(np.concatenate([markers.ravel(), wrench]))
    squares, counts = sums(np.array(off))
    found = scored(case, ahead=AHEAD)
    np.testing.assert_array_equal(found["ahead_counts"], counts)
    np.testing.assert_allclose(found["ahead_squares"], squares, rtol=1e-9)


def test_frames_that_do_not_count_are_filtered_but_not_summed(case):
    whole, first, second = scored(case), scored(case, end=40), scored(case, first=40)
    assert first["done"] == 40 and second["done"] == FRAMES
    assert first["log_likelihood"] + second["log_likelihood"] == pytest.approx(whole["log_likelihood"], rel=1e-12)
    np.testing.assert_array_equal(first["estimated_counts"] + second["estimated_counts"], whole["estimated_counts"])


def test_a_filter_that_lost_the_markers_is_given_up(case):
    markers = case[2].markers[0].copy()
    markers[30:, ::2] += 50.0  # half of them fly away, so that no state fits
    found = scored(case, markers, lost_m=1.0)
    assert found["divergence"] == "the markers are lost"
    assert 30 <= found["done"] <= 45
