"""What the filter does beside plain updates, smoothed: bounds, equalities, iterations, motion lost, starting again.

Rauch-Tung-Striebel needs only what the filter held before and after each update, whatever it did in between.
"""

from __future__ import annotations

import numpy as np
import pytest

from dynakin.bindings import _core
from support.core.random_models import planar_model, spatial_model
from support.core.smoother_cases import BOUNDED, assert_equal, case, deviations, lost_and_found, walk
from support.oracle.smoother import batch, rauch_tung_striebel


@pytest.mark.parametrize("name", BOUNDED)
def test_bounds_by_projection(name):
    c = BOUNDED[name]()
    w, out = walk(c), c.smoothed()
    assert 0.1 < (out["constrained"] > 0).mean() < 1.0
    x, P = rauch_tung_striebel(w.x, w.P, w.x_predicted, w.P_predicted, [f.F for f in w.frames])
    lower, upper = c.options["lower"], c.options["upper"]
    assert ((out["smoothed_state"] >= lower) & (out["smoothed_state"] <= upper)).all()
    keeps = ((x >= lower) & (x <= upper)).all(axis=1)
    assert keeps.sum() > 10
    np.testing.assert_array_less(np.abs(out["smoothed_state"] - x)[keeps] / deviations(P)[keeps], 1e-8)
    np.testing.assert_array_less(np.abs(out["smoothed_state_sd"] / deviations(P) - 1.0), 1e-8)
    for k in np.flatnonzero(~keeps):  # no feasible state that is nearer, along the line to any frame's
        to_other = np.clip(x[k], lower, upper) - out["smoothed_state"][k]
        gradient = np.linalg.solve(P[k], out["smoothed_state"][k] - x[k])
        assert gradient @ to_other > -1e-6 * np.linalg.norm(gradient * np.sqrt(np.diag(P[k])))


def test_constants_that_met_their_bounds_are_the_same_at_all_frames():
    """A bound acts on the trial, not on a frame: what it held on the way does not drift off backwards."""
    c = case(planar_model(50, n_segments=4), 31, 60, constraint="projection")
    lengths = [name.startswith("length/") for name in c.model.layout.names]
    free = c.smoothed(constraint="none")
    c.options["lower"], c.options["upper"] = np.full((2, len(c.data.x0)), [[-np.inf], [np.inf]])
    c.options["upper"][lengths] = free["state"][-1, lengths] - 2.0 * free["state_sd"][-1, lengths]
    c.data.x0[lengths] = np.minimum(c.data.x0, c.options["upper"])[lengths]
    out = c.smoothed()
    assert (out["constrained"] > 0).sum() >= 10
    drift = out["smoothed_state"][:, lengths] - out["state"][-1, lengths]
    np.testing.assert_array_less(np.abs(drift) / out["state_sd"][-1, lengths], 1e-8)


def test_equalities_are_rows_without_noise():
    """One between coordinates, at each frame anew, and one between lengths, once and for all."""
    c = case(planar_model(50, n_segments=4), 31, 25)
    names = list(c.model.layout.names)
    a = np.zeros((2, len(names)))
    a[0, [names.index("q1"), names.index("q2")]] = 1.0, 1.0
    a[1, [names.index("length/l0"), names.index("length/l1")]] = 1.0, -1.0
    b = a @ c.data.x0 + [0.01, -0.004]
    w = walk(c, constraint="projection", equality=a, equality_value=b)
    for k, frame in enumerate(w.frames):
        rows = [0, 1] if k == 0 else [0]
        frame.H = np.vstack([frame.H, a[rows]])
        frame.R = np.pad(frame.R, (0, len(rows)))
        frame.z = np.concatenate([frame.z, b[rows]])
    x, P = batch(c.data.x0, c.data.P0, w.frames)
    out = c.smoothed(constraint="projection", equality=a, equality_value=b)
    assert_equal(out, x, P, 1e-7)
    np.testing.assert_allclose(out["smoothed_state"] @ a.T, np.tile(b, (25, 1)), atol=1e-10)


@pytest.mark.parametrize("spec", [planar_model(50, n_segments=5), spatial_model(6)], ids=lambda s: s.name)
def test_iterated_updates(spec):
    c = case(spec, 31, 25, iterate_beyond=1e-9)
    w = walk(c)
    assert np.abs(walk(case(spec, 31, 25)).x - w.x).max() > 1e-6
    expected = rauch_tung_striebel(w.x, w.P, w.x_predicted, w.P_predicted, [f.F for f in w.frames])
    assert_equal(c.smoothed(), *expected, 1e-8)


def test_a_motion_that_was_lost_and_found():
    """Holding it is a linear map: what is forgotten is drawn anew; what is not goes on."""
    c = lost_and_found()
    w, out = walk(c), c.smoothed()
    held = [k for k, report in enumerate(w.reports) if report.tracking in ("lost", "found")]
    assert [w.reports[k].tracking for k in held].count("found") == 1
    assert len(held) > 10
    o = c.options
    n = c.model.layout.blocks["coordinates"][1]
    variance = np.zeros(len(o["decay_rate"]))
    variance[: 3 * n] = np.repeat([0.01, 2.0, 20.0], n) ** 2
    forgotten = variance > 0.0
    F = [f.F for f in w.frames]
    for k in held:
        F[k] = F[k] * ~forgotten[:, None]
        w.x_predicted[k, n : 3 * n] = 0.0
        w.P_predicted[k] *= np.outer(~forgotten, ~forgotten)
        w.P_predicted[k] += np.diag(variance)
    expected = rauch_tung_striebel(w.x, w.P, w.x_predicted, w.P_predicted, F)
    assert_equal(out, *expected, 1e-8)
    assert (out["smoothed_state_sd"] <= out["state_sd"] * (1.0 + 1e-12)).all()
    before = slice(0, held[0])
    assert (out["smoothed_state"][before] != out["state"][before]).any()


def test_starting_again_cuts_the_trial_in_two():
    c = case(planar_model(50, n_segments=4), 31, 50, states="all", recovery=_core.RecoverySettings())
    c.data.wrench[20] = 1e300
    out = c.smoothed()
    assert list(np.flatnonzero(out["tracking"] == 4)) == [20]
    np.testing.assert_array_equal(out["state"][20], c.data.x0)
    for key in ("state", "state_sd"):
        np.testing.assert_array_equal(out[f"smoothed_{key}"][19], out[key][19])
    before = c.smoothed(frames=20)
    np.testing.assert_allclose(out["smoothed_state"][:20], before["smoothed_state"], rtol=1e-11, atol=1e-12)
    assert (out["smoothed_state_sd"][20] < 0.9 * out["state_sd"][20]).any()


@pytest.mark.parametrize("constraint", ["gain", "sigmoid"])
def test_bounds_kept_otherwise_are_refused(constraint):
    c = case(planar_model(3), 31, 10, bounds=True, constraint=constraint)
    with pytest.raises(ValueError, match=f"smoothing: bounds are kept by constraint '{constraint}'.*'projection'"):
        c.smoothed()
    with pytest.raises(ValueError, match="smoothing"):
        _core.FixedLag(c.filter(), 3)
    free = case(planar_model(3), 31, 10, constraint=constraint)
    np.testing.assert_array_equal(
        free.smoothed()["smoothed_state"], case(planar_model(3), 31, 10).smoothed()["smoothed_state"]
    )
