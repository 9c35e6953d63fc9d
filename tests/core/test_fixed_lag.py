"""The fixed-lag smoother equals the full one on the frames until now."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dynakin.bindings import _core
from support.core.random_models import planar_model, spatial_model
from support.core.smoother_cases import BOUNDED, case, impact, lost_and_found, walk
from support.oracle.smoother import rauch_tung_striebel


def started_again():
    c = case(planar_model(50, n_segments=4), 31, 40, states="all", recovery=_core.RecoverySettings())
    c.data.wrench[20] = 1e300
    return c


def equalities():
    """One between coordinates, in each frame anew, and one between lengths."""
    c = case(planar_model(50, n_segments=4), 31, 40, constraint="projection")
    names = list(c.model.layout.names)
    a = np.zeros((2, len(names)))
    a[0, [names.index("q1"), names.index("q2")]] = 1.0, 1.0
    a[1, [names.index("length/l0"), names.index("length/l1")]] = 1.0, -1.0
    c.options |= {"equality": a, "equality_value": a @ c.data.x0 + [0.01, -0.004]}
    return c


CASES = {
    "planar": lambda: case(planar_model(50, n_segments=5), 31, 40),
    "spatial, all blocks": lambda: case(spatial_model(9), 31, 40, states="all"),
    "contacts": lambda: case(spatial_model(4, nonlinear=False), 31, 40, states="contacts"),
    "bounds": BOUNDED["all blocks"],
    "lost and found": lost_and_found,
    "impact": impact,
    "started again": started_again,
    "equalities": equalities,
}


def stepped(c, lag, frames):
    smoother = _core.FixedLag(c.filter(), lag)
    d = c.data
    for k in range(frames):
        dt = d.time[k] - d.time[k - 1] if k else 0.0
        smoother.step(dt, *d.at(k))
        yield k, smoother


@pytest.mark.parametrize("lag", [1, 4, 12])
@pytest.mark.parametrize("name", CASES)
def test_equals_the_full_smoother_on_the_data_until_now(name, lag):
    c = CASES[name]()
    frames = len(c.data.time)
    for k, smoother in stepped(c, lag, frames):
        assert smoother.ready == (k >= lag)
        if k < lag or k % 5:
            continue
        full = c.smoothed(frames=k + 1)
        there = k - lag
        assert smoother.delay_s == pytest.approx(c.data.time[k] - c.data.time[there])
        sd = full["smoothed_state_sd"][there]
        np.testing.assert_allclose(smoother.state_sd, sd, rtol=1e-10)
        # where bounds bind, the projection's own tolerance is 1e-9 of a standard deviation
        np.testing.assert_array_less(np.abs(smoother.state - full["smoothed_state"][there]) / sd, 1e-7)


@pytest.mark.parametrize("lag", [1, 4, 12])
@pytest.mark.parametrize("name", ["planar", "spatial, all blocks", "contacts", "started again", "equalities"])
def test_the_covariance_equals_rauch_tung_striebel(name, lag):
    """Of all pairs of which none is a marker's own, and of those that move the same marker."""
    c = CASES[name]()
    frames = 21 if name == "started again" else 30  # the cut is in the last one, so that every lag crosses it
    *_, (_, smoother) = stepped(c, lag, frames)
    w = walk(replace(c, data=c.data.first(frames)))
    anew = [report.tracking == "restarted" for report in w.reports]
    assert any(anew[frames - lag :]) == (name == "started again")
    F = [f.F * (not cut) for f, cut in zip(w.frames, anew, strict=True)]  # nothing goes on over a cut
    _, P = rauch_tung_striebel(w.x, w.P, w.x_predicted, w.P_predicted, F)
    there = frames - 1 - lag
    sd = np.sqrt(np.diag(P[there]))
    needed = np.ones(P[there].shape, bool)
    for block in ("markers", "soft_tissue"):
        offset, size = c.model.layout.blocks.get(block, (0, 0))
        needed[offset : offset + size] = needed[:, offset : offset + size] = False
    for J in np.split(_core.marker_jacobian(c.model, smoother.state), len(c.spec.markers)):
        moves = J.any(axis=0)
        needed |= np.outer(moves, moves)
    assert not needed.all()
    found = smoother.covariance
    np.testing.assert_allclose((found / np.outer(sd, sd))[needed], (P[there] / np.outer(sd, sd))[needed], atol=1e-9)


@pytest.mark.parametrize("lag", [1, 6, 60])
@pytest.mark.parametrize("name", CASES)
def test_a_run_gives_what_the_steps_give(name, lag):
    c = CASES[name]()
    frames = len(c.data.time)
    out = c.lagged(lag)
    for k, smoother in stepped(c, lag, frames):
        if smoother.ready and not k % 7:
            np.testing.assert_array_equal(out["smoothed_state"][k - lag], smoother.state)
            np.testing.assert_array_equal(out["smoothed_state_sd"][k - lag], smoother.state_sd)
    filtered, smoothed = c.data.run(c.filter().run), c.smoothed()
    np.testing.assert_array_equal(out["state"], filtered["state"])
    last = slice(max(0, frames - lag - 1), None)  # fewer than the lag follow them: as if smoothed
    np.testing.assert_allclose(out["smoothed_state_sd"][last], smoothed["smoothed_state_sd"][last], rtol=1e-9)
    off = np.abs(out["smoothed_moments"] - smoothed["smoothed_moments"])[last] / smoothed["smoothed_moments_sd"][last]
    assert off.max() < 1e-8


def test_bounds_are_kept_too():
    c = CASES["bounds"]()
    for _, smoother in stepped(c, 6, 60):
        if smoother.ready:
            assert (smoother.state >= c.options["lower"]).all()
            assert (smoother.state <= c.options["upper"]).all()


def test_a_refused_sample_counts_as_a_frame_in_which_nothing_was_measured():
    refused, missing = case(planar_model(3), 31, 40, total_mass=None), case(planar_model(3), 31, 40, total_mass=None)
    refused.data.markers[15, 0] = np.inf
    missing.data.markers[15], missing.data.wrench[15] = np.nan, np.nan
    d = refused.data
    a, b = _core.FixedLag(refused.filter(), 4), _core.FixedLag(missing.filter(), 4)
    for k in range(40):
        dt = d.time[k] - d.time[k - 1] if k else 0.0
        if k == 15:
            with pytest.raises(ValueError, match="infinite"):
                a.step(dt, d.markers[k], d.wrench[k])
        else:
            a.step(dt, d.markers[k], d.wrench[k])
        b.step(dt, missing.data.markers[k], missing.data.wrench[k])
        if a.ready and k != 15:
            np.testing.assert_array_equal(a.state, b.state)
            np.testing.assert_array_equal(a.covariance, b.covariance)


def test_what_is_not_there_is_refused_by_name():
    c = CASES["planar"]()
    with pytest.raises(ValueError, match="lag: expected 1 frame or more, found 0"):
        _core.FixedLag(c.filter(), 0)
    smoother = _core.FixedLag(c.filter(), 3)
    with pytest.raises(ValueError, match="no smoothed frame before frame 3"):
        _ = smoother.state
    with pytest.raises(ValueError, match="no smoothed frame before frame 3"):
        _ = smoother.state_sd


def test_the_impact_is_expected():
    """The case `impact` is one: deviations of innovations are larger than the prediction's."""
    c = impact()
    w, seen = walk(c), c.smoothed()["innovation_sd"]
    frames = [np.sqrt(np.diag(f.H @ P @ f.H.T + f.R)) for f, P in zip(w.frames, w.P_predicted, strict=True)]
    measured = [row[np.isfinite(row)] for row in seen]  # without the total mass, the last of the rows
    grown = [(row / sd[: len(row)]).max() for row, sd in zip(measured, frames, strict=True)]
    assert grown[20] < 1.0 + 1e-9
    assert grown[21] > 1.5
