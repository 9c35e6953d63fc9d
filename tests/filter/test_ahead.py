"""What is expected a moment ahead: how a motion goes on, and what is left of the ground's push then."""

from __future__ import annotations

import numpy as np
import pytest

import dynakin
from dynakin.arrays import Array, rms, wrench_about
from dynakin.bindings import _core
from dynakin.errors import ConfigError
from dynakin.filter.live.ahead import FADE_S, Ahead, LookAhead, carried_on
from dynakin.filter.tracker import Tracker
from dynakin.simulation.sensors.sizes import SensorNoise
from dynakin.simulation.trial import simulate, simulate_squat
from dynakin.validation.yardsticks import expected_ahead
from support.squat_estimator import SUBJECT, estimator, samples

HORIZON_S = 0.1
RATE_HZ = 100.0


@pytest.fixture(scope="module")
def person() -> Tracker:
    """Of a body that is fixed nowhere, at its start."""
    walk = simulate("fullbody", "gait", 3, 2.5, 50.0, noise=SensorNoise.none()).recording
    return dynakin.Estimator(dynakin.load_model("fullbody", subject=SUBJECT)).start(walk)


def standing(person: Tracker) -> Array:
    state = person.state.copy()
    for name in ("speeds", "accelerations"):
        first, size = person.core_model.layout.blocks[name]
        state[first : first + size] = 0.0
    return state


def place(person: Tracker, block: str, coordinate: str) -> int:
    """In the state."""
    free = [name for name in person.core_model.coordinate_names if name in person.calibrated.names]
    return int(person.core_model.layout.blocks[block][0]) + free.index(coordinate)


def pushed(person: Tracker, seconds: float, acceleration: object) -> tuple[Array, Array]:
    """Times and states of who is pushed up and forwards, in the posture of the start."""
    time = np.arange(0.0, seconds, 1.0 / RATE_HZ)
    states = np.tile(standing(person), (len(time), 1))
    states[:, place(person, "accelerations", "pelvis_ty")] = acceleration(time)  # type: ignore[operator]
    states[:, place(person, "accelerations", "pelvis_tx")] = 0.5 * acceleration(time)  # type: ignore[operator]
    return time, states


def after(person: Tracker, time: Array, states: Array) -> Ahead:
    look = LookAhead(person.core_model, HORIZON_S)
    for t, state in zip(time, states, strict=True):
        look.look(float(t), state)
    found = look.expected()
    assert found is not None and found.time_s == pytest.approx(time[-1] + HORIZON_S)
    return found


def test_a_motion_is_carried_on_by_its_speed_and_a_little_by_its_acceleration() -> None:
    """The exact integrals of an acceleration that fades, by small steps."""
    q, speed, acceleration = 1.0, 2.0, 30.0
    step = 1e-5
    for _ in range(10000):
        q, speed, acceleration = q + step * speed, speed + step * acceleration, acceleration * (1.0 - step / FADE_S)
    found = carried_on(np.array([1.0, 2.0, 30.0]).reshape(3, 1, 1), 0.1)
    np.testing.assert_allclose(found.ravel(), [q, speed, acceleration], rtol=1e-3)


def test_who_stands_still_is_expected_to(person: Tracker) -> None:
    state = standing(person)
    found = after(person, np.arange(0.0, 1.0, 0.01), np.tile(state, (100, 1)))
    np.testing.assert_allclose(found.values["wrench"], _core.wrench(person.core_model, state), atol=1e-9)
    np.testing.assert_allclose(found.values["markers"], _core.marker_positions(person.core_model, state))
    assert found.wrench["fy"] == pytest.approx(9.80665 * 70.0, rel=0.02)
    np.testing.assert_array_equal(found.values["wrench_sd"], 0.0)


def test_a_push_that_nothing_is_known_of_returns_as_a_critically_damped_spring(person: Tracker) -> None:
    """By small steps; of each component, from its value and its slope."""
    time, states = pushed(person, 0.2, lambda t: 1.0 + 20.0 * (t - 0.19))
    weight = _core.wrench(person.core_model, standing(person))
    beyond, slope = (_core.wrench(person.core_model, states[k]) - weight for k in (-1, -4))
    slope = (beyond - slope) / 0.03
    step, value = 1e-5, beyond.copy()
    for _ in range(10000):
        value, slope = value + step * slope, slope - step * (2.0 * slope / FADE_S + value / FADE_S**2)
    found = after(person, time, states)
    np.testing.assert_allclose(found.values["wrench"][:2] - weight[:2], value[:2], rtol=2e-3)
    assert np.isnan(found.values["wrench_sd"]).all()  # nothing has come true yet


def test_a_rhythm_is_found_in_the_past_and_errors_are_said(person: Tracker) -> None:
    """Pushes of 1.2 Hz with a noise, of which persistence and the prior miss most."""
    random = np.random.default_rng(4)

    def rhythm(time: Array) -> Array:
        return np.asarray(2.0 * np.sin(2.0 * np.pi * 1.2 * time) + 0.02 * random.standard_normal(len(time)))

    time, states = pushed(person, 8.0, rhythm)
    model = person.core_model
    true = np.array([_core.wrench(model, state) for state in states])
    found = expected_ahead(model, time, states, HORIZON_S)[1]
    late = time > 4.0
    errors = rms((found - true)[late], axis=0)[:2]
    held = rms((true[:-10] - true[10:])[late[10:]], axis=0)[:2]
    prior = np.array(LookAhead(model, HORIZON_S)._prior)  # of a sine, by its value and its slope at the end
    swing, omega = rms(true - true.mean(axis=0), axis=0)[:2], 2.0 * np.pi * 1.2
    unlearned = np.abs(np.exp(1j * omega * HORIZON_S) - prior[0] - 1j * omega * prior[1]) * swing
    assert (errors < 0.25 * np.minimum(held, unlearned)).all(), (errors, held, unlearned)
    sd = after(person, time, states).values["wrench_sd"][:2]
    assert ((sd > 0.9 * errors) & (sd < 2.0 * errors)).all(), (sd, errors)  # the beginning is not forgotten yet


def test_what_is_left_of_a_push_goes_along_with_the_body(person: Tracker) -> None:
    """Its moment is about the floor below the body's centre, wherever that is, and the person may stand anywhere."""
    time, states = pushed(person, 0.5, lambda t: 1.0 + np.sin(8.0 * t))
    still = _core.wrench(person.core_model, standing(person))
    walks = states.copy()
    walks[:, place(person, "coordinates", "pelvis_tx")] += 3.0 + 1.5 * time
    walks[:, place(person, "speeds", "pelvis_tx")] = 1.5
    here, there = (after(person, time, each).values["wrench"] for each in (states, walks))
    moved = 3.0 + 1.5 * (time[-1] + HORIZON_S)
    np.testing.assert_allclose(there[:3], here[:3], atol=1e-6)
    np.testing.assert_allclose(wrench_about(there, np.array([moved, 0.0, 0.0])), here, atol=1e-6)
    assert abs(here[1] - still[1]) > 2.0


def test_a_pause_ends_what_was_seen_but_not_what_was_learned(person: Tracker) -> None:
    time, states = pushed(person, 3.0, lambda t: 2.0 * np.sin(8.0 * t))
    look = LookAhead(person.core_model, HORIZON_S)
    for t, state in zip(time, states, strict=True):
        look.look(float(t), state)
    before = look.expected()
    look.interrupted()
    assert look.expected() is None and before is not None
    look.look(10.0, standing(person))
    found = look.expected()
    assert found is not None
    np.testing.assert_allclose(found.values["wrench"], _core.wrench(person.core_model, standing(person)), atol=1e-9)
    np.testing.assert_allclose(found.values["wrench_sd"][:3], before.values["wrench_sd"][:3])


def test_a_step_of_zero_changes_nothing(person: Tracker) -> None:
    time, states = pushed(person, 1.0, lambda t: np.sin(8.0 * t))
    twice = np.repeat(time, 2), np.repeat(states, 2, axis=0)
    np.testing.assert_allclose(
        after(person, *twice).values["wrench"], after(person, time, states).values["wrench"], rtol=1e-6
    )


def test_a_tracker_looks_ahead_of_its_own_states() -> None:
    """As the yardstick does, which judges it; and another one of the same person does, too."""
    recording = simulate_squat(seed=2, duration_s=5.0).recording
    tracker = estimator().start(recording, ahead_s=HORIZON_S)
    assert tracker.ahead() is None
    states, said = [], []
    for sample in samples(recording):
        tracker.step(sample)
        states.append(tracker.state)
        said.append(tracker.ahead())
    markers, wrench = expected_ahead(tracker.core_model, recording.time, np.array(states), HORIZON_S)
    frames = len(states) - np.flatnonzero(np.isfinite(wrench[:, 1]))[0]
    expected = [each for each in said[:frames] if each is not None]
    assert len(expected) == frames
    np.testing.assert_allclose([each.values["wrench"] for each in expected], wrench[-frames:], rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose([each.values["markers"] for each in expected], markers[-frames:], rtol=0.0, atol=1e-9)
    last = expected[-1]
    assert last.wrench["fy"] == last.values["wrench"][1] and last.markers["r_knee"].shape == (3,)
    assert last.coordinates["knee"] != 0.0 and last.speeds["knee"] != 0.0 and last.wrench_sd["fy"] > 0.0
    anew = tracker.fresh()
    anew.step(samples(recording)[0])
    assert anew.ahead() is not None


def test_while_the_motion_is_lost_nothing_is_expected() -> None:
    recording = simulate_squat(seed=2, duration_s=5.0).recording
    tracker = estimator().start(recording, ahead_s=HORIZON_S)
    for sample in samples(recording)[:300]:
        tracker.step(sample)
    assert tracker.ahead() is not None
    for sample in samples(recording)[300:]:
        tracker.step(dynakin.Sample(sample.time_s, {}, {}))
    assert tracker.ahead() is None


def test_who_does_not_ask_gets_none() -> None:
    recording = simulate_squat(seed=2, duration_s=5.0).recording
    with pytest.raises(ConfigError, match=r"does not look ahead, expected Estimator\.start"):
        estimator().start(recording).ahead()
    for wrong in (-0.1, np.nan, np.inf):
        with pytest.raises(ConfigError, match=r"ahead_s: .* expected 0"):
            estimator().start(recording, ahead_s=wrong)
