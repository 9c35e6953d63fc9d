"""given a filter that follows a person, when sensors fail, then it says so, rides through and follows again."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from dynakin.bindings import _core
from dynakin.errors import DivergenceError
from support.core.bridge import filter_of, model_of
from support.core.random_models import (
    continuous,
    planar_model,
    spatial_model,
    trial,
    with_contacts,
    with_slow_errors,
)
from support.oracle import gate, measurement, process
from support.oracle.inertia import all_possible
from support.oracle.state import Layout

SPECS = [with_slow_errors(planar_model(50, n_segments=5), 1), with_slow_errors(spatial_model(4, nonlinear=False), 2)]
SPECS += [with_contacts(SPECS[1])]
each_spec = pytest.mark.parametrize("spec", SPECS, ids=lambda s: s.name)
FOLLOWING, DOUBTFUL, LOST, FOUND, RESTARTED = range(5)
REFUSED = 2
FRAMES, BEGIN, END = 600, 200, 300  # 6 s at 100 Hz, the fault in the third
SENSORS = {"innovation", "innovation_sd", "test_ratio"}  # NaN where a sensor measures nothing, but never infinite
BLIND = 20  # frames, blind_s of 0.2 s


def options_of(spec, **changes):
    n = Layout(spec).size
    recovering = {
        "marker_gate": gate.limits(1e-4),
        "wrench_gate": gate.limits(1e-4),
        "wrench_needs_markers": True,
        "iterate_beyond": 0.1,
        "recovery": _core.RecoverySettings(),
        "total_mass": None,
        "lower": np.full(n, -np.inf),
        "upper": np.full(n, np.inf),
    }
    return continuous(spec, 3, constraint="projection") | recovering | changes


@cache
def recorded(name):
    spec = next(s for s in SPECS if s.name == name)
    return trial(spec, 3, FRAMES, uneven=False, gaps=False)


def run(spec, markers, wrench, **changes):
    data = recorded(spec.name)
    out = filter_of(spec, options_of(spec, **changes), data.x0, data.P0).run(data.time, markers, wrench, **data.given)
    return {key: np.asarray(value) for key, value in out.items()}


@cache
def undisturbed(name):
    spec, data = next(s for s in SPECS if s.name == name), recorded(name)
    return run(spec, data.markers, data.wrench)


def copies(spec):
    data = recorded(spec.name)
    return data.markers.copy(), data.wrench.copy()


def constants(spec):
    layout = Layout(spec)
    return np.concatenate([np.arange(layout.size)[layout.block(b)] for b in ("lengths", "markers", "inertia")])


def motion_error(spec, out, truth=None):
    """Largest over the coordinates, a frame each, rad or m."""
    here = Layout(spec).block("coordinates")
    truth = recorded(spec.name).truth if truth is None else truth
    return np.abs(out["state"] - truth)[:, here].max(axis=1)


def check_rode_through(spec, out, end=END, settle=20, parameters_within=1.0):
    """No NaN, every body possible, the motion as good as undisturbed soon after, the constants hardly moved."""
    clean = undisturbed(spec.name)
    for key, value in out.items():
        assert np.isfinite(value[~np.isnan(value)] if key in SENSORS else value).all(), key
    assert all(all_possible(Layout(spec), x) for x in out["state"][::5])
    assert out["constraints_met"].all()
    assert motion_error(spec, out)[end + settle :].max() < 1.2 * motion_error(spec, clean)[end:].max() + 0.01
    moved = np.abs(out["state"][-1] - clean["state"][-1]) / clean["state_sd"][-1]
    assert moved[constants(spec)].max() < parameters_within
    assert (out["tracking"][end + 1 :] == FOLLOWING).all()


@each_spec
def test_undisturbed_nothing_is_said(spec):
    out = undisturbed(spec.name)
    assert not out["tracking"].any()
    assert (out["verdicts"] == REFUSED).mean() < 1e-3


@each_spec
def test_given_all_markers_lost_for_a_second_when_they_return_then_the_motion_is_found(spec):
    markers, wrench = copies(spec)
    markers[BEGIN:END] = np.nan
    out = run(spec, markers, wrench)
    tracking = out["tracking"]
    assert (tracking[: BEGIN + BLIND - 1] == FOLLOWING).all()
    assert (tracking[BEGIN + BLIND : END] == LOST).all()
    assert tracking[END] == FOUND
    assert (out["n_rows"][BEGIN:END] == 0).all()
    sd = out["state_sd"][:, Layout(spec).block("coordinates")]
    assert (sd[BEGIN + BLIND : END] >= 0.5).all()  # and admits that it does not know
    check_rode_through(spec, out)


@each_spec
def test_given_a_motion_that_was_lost_when_markers_return_with_one_astray_then_that_one_is_refused(spec):
    """A lost motion is so uncertain that no gate would refuse anything."""
    markers, wrench = copies(spec)
    markers[BEGIN:END] = np.nan
    astray = 2
    markers[END : END + 50, astray] += 0.4
    out = run(spec, markers, wrench)
    assert out["tracking"][END] == FOUND
    assert (out["verdicts"][END : END + 50, astray] == REFUSED).all()
    assert (out["verdicts"][END : END + 50] == REFUSED).sum() == 50
    markers[END : END + 50, astray] = np.nan
    without = run(spec, markers, wrench)
    assert without["tracking"][END] == FOUND
    np.testing.assert_allclose(out["state"] / out["state_sd"], without["state"] / out["state_sd"], atol=1e-6)


@each_spec
def test_given_markers_that_fit_nothing_when_they_are_right_again_then_the_motion_is_found_a_tenth_later_at_most(spec):
    """Each search in vain puts the next one off."""
    markers, wrench = copies(spec)
    random = np.random.default_rng(4)
    markers[BEGIN:END] = random.uniform(-2.0, 2.0, markers[BEGIN:END].shape)
    out = run(spec, markers, wrench)
    assert (out["tracking"][BEGIN + BLIND : END] == LOST).all()
    found = int(np.argmax(out["tracking"] == FOUND))
    assert END <= found <= END + (END - BEGIN) // 10
    check_rode_through(spec, out, end=found)


@each_spec
def test_given_one_marker_lost_for_three_seconds_then_nothing_is_lost(spec):
    markers, wrench = copies(spec)
    markers[BEGIN : BEGIN + 300, 3] = np.nan
    out = run(spec, markers, wrench)
    assert not out["tracking"].any()
    assert (out["verdicts"][BEGIN : BEGIN + 300, 3] == 0).all()
    check_rode_through(spec, out, BEGIN + 300)


@each_spec
@pytest.mark.parametrize("pair", [(2, 5), (2, 3)], ids=["of two segments", "of one segment"])
def test_given_two_markers_swapped_for_a_second_then_both_are_refused(spec, pair):
    markers, wrench = copies(spec)
    a, b = pair
    markers[BEGIN:END, [a, b]] = markers[BEGIN:END, [b, a]]
    out = run(spec, markers, wrench)
    assert (out["verdicts"][BEGIN:END, [a, b]] == REFUSED).all()
    assert not out["tracking"].any()
    check_rode_through(spec, out)


@each_spec
def test_given_a_marker_that_flies_off_then_it_is_refused_until_it_is_back(spec):
    markers, wrench = copies(spec)
    markers[BEGIN:END, 4] += np.linspace(0, 2, END - BEGIN)[:, None]
    out = run(spec, markers, wrench)
    assert (out["verdicts"][BEGIN + 5 : END, 4] == REFUSED).all()
    assert out["verdicts"][END, 4] != REFUSED
    assert not out["tracking"].any()
    check_rode_through(spec, out)


@each_spec
@pytest.mark.parametrize("fault", ["drops out", "reads zero", "saturates"])
def test_given_a_plate_that_fails_for_a_second_then_markers_carry_on(spec, fault):
    markers, wrench = copies(spec)
    if fault == "drops out":
        wrench[BEGIN:END] = np.nan
    elif fault == "reads zero":
        wrench[BEGIN:END] = 0.0
    else:
        ceiling = 0.6 * np.abs(wrench[BEGIN:END, 1]).mean()
        wrench[BEGIN:END, 1] = np.clip(wrench[BEGIN:END, 1], -ceiling, ceiling)
    out = run(spec, markers, wrench)
    assert (out["verdicts"][BEGIN:END, -1] == (0 if fault == "drops out" else REFUSED)).all()
    assert not out["tracking"].any()
    check_rode_through(spec, out)


@each_spec
@pytest.mark.parametrize("blind", [True, False], ids=["while blind", "in sight"])
@pytest.mark.parametrize("jump", [0.5, 1.2])
def test_given_a_posture_that_changed_at_once_then_it_is_doubted_lost_and_found(spec, blind, jump):
    """Every coordinate is elsewhere from one frame to the next, as after a cut in the recording."""
    data, layout = recorded(spec.name), Layout(spec)
    truth = data.truth.copy()
    sign = np.resize([1.0, -1.0], layout.blocks["coordinates"][1])
    truth[END:, layout.block("coordinates")] += jump * sign
    noise = data.markers - measurement.marker_positions(layout, data.truth)
    wrench = measurement.plates(layout, truth) + data.wrench - measurement.plates(layout, data.truth)
    markers = measurement.marker_positions(layout, truth) + noise
    if blind:
        markers[BEGIN:END] = np.nan
    out = run(spec, markers, wrench)
    tracking = out["tracking"]
    if blind:
        assert tracking[END - 1] == LOST
    else:
        doubted = int(np.argmax(tracking[END:] != DOUBTFUL))
        # with contacts accelerations are less certain, so that the gate may agree before the motion is sought
        assert doubted >= (0.7 * BLIND if spec.contacts else BLIND - 1)
        assert (out["n_rows"][END : END + doubted] == 0).all()
    back = tracking[END:] == FOUND
    if spec.contacts and not blind and not back.any():
        back = tracking[END:] == FOLLOWING
    assert back.any()
    found = END + int(np.argmax(back))
    assert found <= END + BLIND + 2
    assert (tracking[found + 1 :] == FOLLOWING).all()
    for key, value in out.items():
        assert np.isfinite(value[~np.isnan(value)] if key in SENSORS else value).all(), key
    clean = undisturbed(spec.name)
    assert motion_error(spec, out, truth)[found + 20 :].max() < 0.1
    # Another posture tells other things of the constants, so they are compared with the truth.
    wrong = np.abs(out["state"][-1] - truth[-1]) / np.maximum(out["state_sd"][-1], 1e-9)
    was = np.abs(clean["state"][-1] - truth[-1]) / np.maximum(clean["state_sd"][-1], 1e-9)
    assert wrong[constants(spec)].max() < max(3.5, 1.2 * was[constants(spec)].max())


@each_spec
def test_given_most_markers_wrong_for_a_tenth_of_a_second_then_the_frames_are_not_used(spec):
    markers, wrench = copies(spec)
    markers[BEGIN : BEGIN + 10] += 0.5
    out = run(spec, markers, wrench)
    assert (out["tracking"][BEGIN : BEGIN + 10] == DOUBTFUL).all()
    assert (out["n_rows"][BEGIN : BEGIN + 10] == 0).all()
    check_rode_through(spec, out, BEGIN + 10)


@each_spec
def test_given_the_total_mass_at_each_frame_when_markers_are_doubted_then_they_stay_out(spec):
    """Also where the frame is linearised anew: a mass is measured, so there is something to iterate on."""
    markers, wrench = copies(spec)
    markers[BEGIN : BEGIN + 10] += 0.5
    mass = float(sum(s.inertia[0] for s in spec.segments))
    out = run(spec, markers, wrench, total_mass=mass, iterate_beyond=1e-9)
    doubted = out["tracking"] == DOUBTFUL
    assert doubted[BEGIN : BEGIN + 10].all()
    assert (out["n_rows"][doubted] == 1).all()
    assert motion_error(spec, out)[BEGIN:].max() < 0.1


@each_spec
def test_given_a_recording_with_hardly_any_markers_then_they_are_enough_to_follow(spec):
    """Half of the markers gone for three seconds: the others are believed."""
    markers, wrench = copies(spec)
    markers[BEGIN : BEGIN + 300, ::2] = np.nan
    out = run(spec, markers, wrench)
    assert not out["tracking"].any()
    for key, value in out.items():
        assert np.isfinite(value[~np.isnan(value)] if key in SENSORS else value).all(), key


BREAKDOWNS = ["a number beyond all numbers", "a time step beyond all times"]


def broken_down(spec, how, **changes):
    """A filter whose numbers have just broken down, its report, and the frame it is at."""
    data = recorded(spec.name)
    gateless = {"marker_gate": None, "wrench_gate": None}
    f = filter_of(spec, options_of(spec, **gateless, **changes), data.x0, data.P0)
    f.update(*data.at(0))
    for k in range(1, BEGIN):
        assert f.step(0.01, *data.at(k)).status == "ok"
    if how == BREAKDOWNS[0]:
        return f, f.step(0.01, data.markers[BEGIN], np.full(6, 1e300))
    f.predict(1e150)
    return f, f.update(data.markers[BEGIN], data.wrench[BEGIN])


@each_spec
def test_given_numbers_that_break_down_when_recovering_then_it_restarts_says_why_and_finds_the_motion(spec):
    data, here = recorded(spec.name), Layout(spec).block("coordinates")
    f, report = broken_down(spec, BREAKDOWNS[0])
    assert report.tracking == "restarted"
    assert report.status != "ok"
    assert not report.diverged
    np.testing.assert_array_equal(f.state, data.x0)
    np.testing.assert_array_equal(f.covariance, data.P0)
    states = []
    for k in range(BEGIN + 1, FRAMES):
        states.append(f.step(0.01, *data.at(k)).tracking)
    assert "found" in states[:3]
    assert set(states[3:]) == {"following"}
    assert np.abs(f.state - data.truth[-1])[here].max() < 0.1


@each_spec
@pytest.mark.parametrize("how", BREAKDOWNS)
def test_without_recovery_divergence_is_announced_and_stays(spec, how):
    data = recorded(spec.name)
    f, report = broken_down(spec, how, recovery=None)
    assert report.diverged
    assert report.tracking == "following"
    again = f.step(0.01, data.markers[BEGIN + 1], data.wrench[BEGIN + 1])
    assert again.diverged
    assert again.status == report.status
    f.reset(data.x0, data.P0)
    assert not f.update(data.markers[0], data.wrench[0]).diverged


def test_without_recovery_a_run_raises():
    spec = SPECS[0]
    markers, wrench = copies(spec)
    markers[BEGIN, 0] = 1e300
    with pytest.raises(DivergenceError, match=f"frame {BEGIN}"):
        run(spec, markers, wrench, recovery=None, marker_gate=None)


@each_spec
def test_recovery_does_nothing_to_a_trial_without_faults(spec):
    data = recorded(spec.name)
    without = run(spec, data.markers, data.wrench, recovery=None)
    for key in ("state", "state_sd", "nis"):
        np.testing.assert_array_equal(without[key], undisturbed(spec.name)[key])


def after_gap(spec, dt, frames=1):
    """A filter and the state (x, P) it had before nothing was seen for dt, in so many steps."""
    data = recorded(spec.name)
    f = filter_of(spec, options_of(spec), data.x0, data.P0)
    f.update(*data.at(0))
    for k in range(1, BEGIN):
        f.step(0.01, *data.at(k))
    before = f.state, f.covariance
    nothing = np.full_like(data.markers[0], np.nan)
    for _ in range(frames):
        report = f.step(dt / frames, nothing, data.wrench[BEGIN])
    return f, before, report


@each_spec
@pytest.mark.parametrize("dt", [0.5, 10.0, 300.0, 1e12])
def test_over_a_gap_the_motion_is_held_and_constants_and_soft_tissue_keep_what_they_knew(spec, dt):
    """The posture 0.2 s after the last frame, at rest and wide; the rest as the oracle's process has it, without the
    drift of constants, and without its correlations with the motion."""
    f, (x, P), report = after_gap(spec, dt)
    assert report.tracking == "lost" and report.n_rows == 0
    layout, options = Layout(spec), options_of(spec)
    n = layout.blocks["coordinates"][1]
    decay = options["decay_rate"]
    assert (decay > 0.0).sum() > 5
    density = np.where(decay > 0.0, options["process_density"], 0.0)
    F, Q = process.transition(layout, density, decay, min(dt, 50.0))  # by then it has decayed
    drift = np.where(decay > 0.0, 0.0, options["process_density"]) * 0.2  # while the motion is still believed
    carried, _ = process.transition(layout, 0.0 * density, 0.0 * decay, 0.2)
    expected_x = F @ x
    expected_x[:n] = (carried @ x)[:n]
    expected_x[n : 3 * n] = 0.0
    expected_P = F @ P @ F.T + Q + np.diag(drift)
    expected_P[: 3 * n] = expected_P[:, : 3 * n] = 0.0
    expected_P[range(3 * n), range(3 * n)] = np.repeat([0.5, 2.0, 20.0], n) ** 2
    sd = np.sqrt(np.diag(expected_P))
    np.testing.assert_allclose(f.state / sd, expected_x / sd, atol=1e-7)
    np.testing.assert_allclose(f.covariance / np.outer(sd, sd), expected_P / np.outer(sd, sd), atol=1e-7)


@each_spec
def test_a_gap_is_the_same_without_frames_as_with_frames_that_hold_nothing(spec):
    one, many = after_gap(spec, 3.0)[0], after_gap(spec, 3.0, 300)[0]
    sd = np.sqrt(np.diag(one.covariance))
    np.testing.assert_allclose(many.state / sd, one.state / sd, atol=1e-6)
    np.testing.assert_allclose(many.covariance / np.outer(sd, sd), one.covariance / np.outer(sd, sd), atol=1e-6)


def test_a_restart_puts_contacts_back_to_their_prior_and_a_search_keeps_what_was_known_of_them():
    """Like soft tissue they are in the covariance; a held motion costs them nothing but what they shared with it."""
    spec = SPECS[2]
    data, layout = recorded(spec.name), Layout(spec)
    contacts, motion = layout.block("contacts"), slice(0, 3 * layout.blocks["coordinates"][1])
    f, report = broken_down(spec, BREAKDOWNS[0])
    assert report.tracking == "restarted"
    np.testing.assert_array_equal(f.state[contacts], data.x0[contacts])
    np.testing.assert_array_equal(f.covariance[contacts, contacts], np.eye(12))
    f, (x, P), _ = after_gap(spec, 0.5)
    assert np.sqrt(np.diag(P)[contacts]).min() < 0.6  # something was known of them
    fade = np.exp(-0.5 * options_of(spec)["decay_rate"][contacts])
    np.testing.assert_allclose(f.state[contacts], fade * x[contacts], rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(
        f.covariance[contacts, contacts],
        np.outer(fade, fade) * P[contacts, contacts] + np.diag(1.0 - fade**2),
        atol=1e-9,
    )
    assert not f.covariance[contacts, motion].any()
    held, still = f.state[contacts], f.covariance[contacts, contacts]
    report = f.step(0.0, data.markers[BEGIN], np.full(6, np.nan))  # markers alone say nothing of contacts
    assert report.tracking == "found"
    np.testing.assert_allclose(f.state[contacts], held, atol=0.3)
    assert (np.diag(f.covariance[contacts, contacts]) <= np.diag(still) + 1e-12).all()


@each_spec
@pytest.mark.parametrize("gap_s", [0.5, 1.0, 5.0, 60.0, 300.0])
def test_given_no_frames_for_a_while_when_they_come_again_then_the_motion_is_found(spec, gap_s):
    """The recording's time jumps by the gap, the person goes on moving meanwhile."""
    data = recorded(spec.name)
    kept = np.r_[0:BEGIN, END:FRAMES]
    time = data.time[kept] + np.where(kept < END, 0.0, gap_s - 0.01 * (END - BEGIN))
    f = filter_of(spec, options_of(spec), data.x0, data.P0)
    given = {name: values[kept] for name, values in data.given.items()}
    out = f.run_smoothed(time, data.markers[kept], data.wrench[kept], outputs=True, **given)
    tracking, clean = np.asarray(out["tracking"]), undisturbed(spec.name)
    assert tracking[BEGIN] == FOUND and not np.delete(tracking, BEGIN).any()
    error = motion_error(spec, {"state": out["state"]}, data.truth[kept])
    assert error[BEGIN + 20 :].max() < 1.2 * motion_error(spec, clean)[END:].max() + 0.01
    moved = np.abs(out["state"][-1] - clean["state"][-1]) / clean["state_sd"][-1]
    assert moved[constants(spec)].max() < 1.0
    assert np.isfinite(out["smoothed_state"]).all()
    assert (out["smoothed_state_sd"] <= out["state_sd"] * (1.0 + 1e-9)).all()


def test_a_slow_recording_is_not_blind_between_its_frames():
    """4 Hz: longer than blind_s from frame to frame, yet every frame is believed."""
    spec = SPECS[0]
    data = recorded(spec.name)
    f = filter_of(spec, options_of(spec), data.x0, data.P0)
    f.update(data.markers[0], data.wrench[0])
    for k in range(25, FRAMES, 25):
        assert f.step(0.25, data.markers[k], data.wrench[k]).tracking == "following"


@pytest.mark.parametrize("key", ["blind_s", "fit_m", "coordinate_sd", "speed_sd", "acceleration_sd"])
@pytest.mark.parametrize("value", [0.0, -1.0, np.nan, np.inf])
def test_wrong_recovery_settings_are_refused(key, value):
    spec = SPECS[0]
    n = model_of(spec).layout.size
    with pytest.raises(ValueError, match="recovery: holds"):
        filter_of(spec, options_of(spec, recovery=_core.RecoverySettings(**{key: value})), np.zeros(n), np.eye(n))


def _motion_of_unknown_speed(spec, seen, **recovery):
    """State and deviations over a trial at 25 Hz whose speeds nobody knows at the start, only these markers seen."""
    data = recorded(spec.name)
    n = Layout(spec).blocks["coordinates"][1]
    P0 = data.P0.copy()
    P0[: 3 * n] = P0[:, : 3 * n] = 0.0
    P0[range(3 * n), range(3 * n)] = np.repeat([0.01, 3.0, 40.0], n) ** 2
    f = filter_of(spec, options_of(spec, recovery=_core.RecoverySettings(**recovery)), data.x0, P0)
    markers = np.where(np.asarray(seen)[:, None], data.markers, np.nan)
    f.update(*data.at(0))
    rows = []
    for k in range(4, len(markers), 4):
        f.step(0.04, markers[k], data.wrench[k])
        rows.append((f.state[: 3 * n], np.sqrt(np.diag(f.covariance)[:n])))
    return tuple(np.array(each) for each in zip(*rows, strict=True))


@each_spec
def test_a_coordinate_that_is_seen_is_not_held_however_unsure_its_speed_is_at_first(spec):
    """One step of 0.04 s at 3 rad/s passes the limit; the next frame knows better."""
    seen = np.ones(len(spec.markers), dtype=bool)
    free = _motion_of_unknown_speed(spec, seen)
    limited = _motion_of_unknown_speed(spec, seen, coordinate_sd=0.12, unseen_sd=0.12)
    np.testing.assert_array_equal(limited[0], free[0])


@each_spec
def test_a_coordinate_that_nobody_sees_is_held_at_its_limit_and_no_further(spec):
    last = spec.markers[-1].segment
    seen = np.array([marker.segment != last for marker in spec.markers])
    free = _motion_of_unknown_speed(spec, seen)[1]
    limited = _motion_of_unknown_speed(spec, seen, coordinate_sd=0.12, unseen_sd=0.12)[1]
    hidden = free[-1].argmax()
    assert free[-1, hidden] > 0.3
    assert limited[:, hidden].max() < 0.24
