"""When feet stand: on a floor, steps, stairs, a belt, a box, nothing; and which plate carries which."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dynakin.arrays import runs
from dynakin.recordings.feet.assignment import foot_loads
from dynakin.recordings.feet.belt import one_velocity, velocities
from dynakin.recordings.feet.handover import PASSING_S
from dynakin.recordings.feet.loads import MEASURED, OFF_PLATE, SHARED, SWING, UNKNOWN, FootLoads
from dynakin.recordings.plates.ground_plate import GroundPlate
from support.made_steps import (
    FOOT_MARKERS,
    LABORATORY,
    ON_ONE_LEG,
    RATE_HZ,
    TWO_PLATES,
    WEIGHT_N,
    Made,
    MadePlate,
    Stance,
    lasting,
    moved,
    sliding_in,
    steps,
    turning,
    walk,
)


def found(made: Made) -> FootLoads:
    return foot_loads(made.recording, LABORATORY, FOOT_MARKERS)


def assert_true(made: Made, loads: FootLoads, apart_n: float = 12.0) -> None:
    """Where a foot's wrench is said to be known, it is the foot's."""
    known = np.isfinite(loads.wrench[..., 1])
    assert np.abs(loads.wrench[..., 1] - made.push)[known].max() < apart_n


def plates_of(feet: dict[str, list[Stance]], half: tuple[float, float] = (0.2, 0.15)) -> list[MadePlate]:
    """A plate under each stance, at its height."""
    return [
        MadePlate(s.plates[0], (s.x - half[0], s.x + half[0]), (s.z - half[1], s.z + half[1]), s.height)
        for stances in feet.values()
        for s in stances
    ]


@pytest.mark.parametrize("rise", [0.0, 0.17, -0.19])
def test_level_floor_and_stairs_up_and_down_give_every_stance_its_plate(rise: float) -> None:
    feet = walk(6, 0.30, rise=rise)
    made = steps(lasting(6), feet, plates_of(feet))
    loads = found(made)
    assert_true(made, loads)
    for k, side in enumerate(("right", "left")):
        for stance in feet[side]:
            inside = (made.recording.time > stance.start + 0.03) & (made.recording.time < stance.end - 0.03)
            assert (loads.reason[inside, k] == MEASURED).all()
            np.testing.assert_allclose(loads.soles.middle[inside, k, 1], stance.height, atol=0.01)
            np.testing.assert_allclose(
                loads.soles.middle[inside, k][:, [0, 2]], made.sole[inside, k][:, [0, 2]], atol=0.045
            )
    single = (made.push > 0.0).sum(axis=1) == 1
    for k in range(2):
        swings = single & (made.push[:, k] == 0.0) & (made.recording.time > 0.8)
        assert loads.aloft[swings, k].mean() > 0.4 and not (loads.reason[swings, k] == OFF_PLATE).any()
    assert loads.total_known[made.recording.time > 0.5].all()


@pytest.mark.parametrize("rise", [0.17, -0.19])
@pytest.mark.parametrize("shown_s", [0.05, 0.11])
def test_a_step_that_the_recording_cuts_off_has_its_plate(rise: float, shown_s: float) -> None:
    """Up, the last 0.14 s of a stance were nobody's load at the end; down, at the start."""
    feet = walk(6, 0.30, rise=rise)
    made = steps(lasting(6), feet, plates_of(feet))
    last, second = feet["left"][-1], feet["left"][0]
    for start, end in ((0.0, last.start + shown_s), (second.end - shown_s, lasting(6))):
        part = made.recording.window(start, end)
        loads, at = foot_loads(part, LABORATORY, FOOT_MARKERS), round(start * RATE_HZ)
        push = made.push[at : at + part.n_frames]
        assert not [text for text in map(str, loads.messages) if "no foot stands" in text or "Both feet" in text]
        assert (loads.reason[push > 60.0] == MEASURED).all()
        known = np.isfinite(loads.wrench[..., 1])
        assert np.abs(loads.wrench[..., 1] - push)[known].max() < 25.0


def test_a_foot_that_only_sets_down_where_it_is_lowest_rests_flat_on_the_step_above() -> None:
    """Down stairs, the recording ends with the heel 90 mm up: by it the step above lay 90 mm lower, on no plate's
    level, and that plate was both feet's."""
    feet = walk(4, 0.22, rise=-0.19)
    last = feet["left"][-1]
    made = steps(lasting(4), feet, plates_of(feet, (0.12, 0.25)))
    markers, time = made.recording.markers.copy(), made.recording.time
    markers[time > last.start - 0.3, made.recording.marker_names.index("LHEE"), 1] += 0.09
    part = replace(made.recording, markers=markers).window(0.0, last.start + 0.12)
    loads = foot_loads(part, LABORATORY, FOOT_MARKERS)
    above = (part.time > feet["left"][0].start + 0.05) & (part.time < feet["left"][0].end - 0.05)
    np.testing.assert_allclose(loads.soles.middle[above, 1, 1], -0.19, atol=0.01)
    assert not (loads.reason == SHARED).any()


def test_a_foot_that_stands_on_one_step_is_not_on_the_next_one_too() -> None:
    """The last of a load on the step below presses at the edge, under the toes of the foot that went on."""
    feet = walk(3, 0.22, rise=0.17)
    feet = {side: [replace(s, z=z) for s in feet[side]] for side, z in (("right", 0.02), ("left", -0.02))}
    made = steps(lasting(3), feet, plates_of(feet, (0.11, 0.25)))
    part = made.recording.window(feet["right"][0].end - 0.03, lasting(3))
    assert not foot_loads(part, LABORATORY, FOOT_MARKERS).on[:, 1, 0].any()


@pytest.mark.parametrize("rise", [0.0, 0.17, -0.19])
def test_without_plates_a_foot_that_is_loaded_may_bear_and_is_never_in_the_air(rise: float) -> None:
    feet = walk(6, 0.30, rise=rise)
    made = steps(lasting(6), feet, plates_of(feet))
    loads = found(replace(made, recording=made.recording.with_plates(())))
    loaded = made.push > 50.0
    assert loads.soles.bears[loaded].mean() > 0.98 and not loads.aloft[loaded].any()
    assert loads.soles.bears[~loaded].mean() < 0.6 and (loads.reason == SWING).mean(axis=0).min() > 0.1
    assert not loads.total_known.any()


def test_a_plate_on_a_step_has_its_pressure_on_its_own_surface() -> None:
    """0.5 m up, 70 N forwards move it by 50 mm on the floor's plane."""
    feet = {"right": [Stance(0.0, 2.0, 0.0, 0.1, 0.5, ("p0",))], "left": [Stance(0.0, 2.0, 0.0, -0.1, 0.5, ("p1",))]}
    made = steps(2.0, feet, plates_of(feet))
    plate = GroundPlate.of(made.recording.plates[0], LABORATORY)
    assert plate.height_m == pytest.approx(0.5)
    phase = made.recording.time / 2.0
    np.testing.assert_allclose(plate.cop[:, 0], 0.14 * phase - 0.07, atol=0.01)
    np.testing.assert_allclose(found(made).soles.middle[:, 0, 1], 0.5, atol=1e-6)


@pytest.mark.parametrize("speed", [0.6, 1.3, 3.5])
def test_a_belts_speed_is_found_and_its_feet_stand(speed: float) -> None:
    """Walks, and a run with flight; one long plate under each foot."""
    stance, every = (0.7, 0.55) if speed < 2.0 else (0.24, 0.36)
    feet = walk(14, 0.0, stance, every)
    half = 0.5 * speed * stance
    feet = {side: [replace(s, x=half, plates=(side,)) for s in own] for side, own in feet.items()}
    plates = [MadePlate("right", (-1.2, 1.2), (0.0, 0.4)), MadePlate("left", (-1.2, 1.2), (-0.4, 0.0))]
    made = steps(lasting(14, stance, every), feet, plates, belt_m_s=speed)
    loads = found(made)
    assert_true(made, loads)
    said = [text for text in map(str, loads.messages) if "belt" in text]
    assert len(said) == 2 and all(abs(float(t.split(" at ")[1].split()[0]) - speed) < 0.03 * speed for t in said)
    for k, side in enumerate(("right", "left")):
        for one in feet[side][1:-1]:
            inside = (made.recording.time > one.start + 0.06) & (made.recording.time < one.end - 0.06)
            assert loads.soles.bears[inside, k].all() and loads.soles.stance[inside, k].min() > 0.2
            assert (loads.reason[inside, k] == MEASURED).all()
        ends, next_ = feet[side][1].end, feet[side][2].start
        swing = (made.recording.time > ends + 0.2) & (made.recording.time < next_ - 0.1)
        assert loads.aloft[swing, k].all() and swing.any()


def test_belts_that_move_apart_each_carry_their_foot() -> None:
    feet = walk(10, 0.0)
    feet = {side: [replace(s, x=0.3, plates=(side,)) for s in own] for side, own in feet.items()}
    plates = [MadePlate("right", (-1.2, 1.2), (0.0, 0.4)), MadePlate("left", (-1.2, 1.2), (-0.4, 0.0))]
    made = steps(lasting(10), feet, plates, belt_m_s={"right": 0.6, "left": 1.2})
    loads = found(made)
    assert_true(made, loads)
    speeds = {t.split()[1]: float(t.split(" at ")[1].split()[0]) for t in map(str, loads.messages) if "belt" in t}
    assert speeds["right"] == pytest.approx(0.6, abs=0.03) and speeds["left"] == pytest.approx(1.2, abs=0.05)


def test_no_belt_is_seen_where_people_walk_over_the_floor() -> None:
    made = steps(lasting(6), walk(6, 0.65), plates_of(walk(6, 0.65)))
    assert not any("belt" in text for text in map(str, found(made).messages))


def test_a_box_that_no_plate_measures_bears_a_foot_that_alone_can_and_a_foot_held_up_stands_on_nothing() -> None:
    """The right foot steps on a box, the left one follows; and one foot is held 0.3 m up while a plate carries all."""
    box = {
        "right": [Stance(0.0, 1.0, 0.0, 0.1, 0.0, ("p0",)), Stance(1.4, 4.0, 0.4, 0.1, 0.3)],
        "left": [Stance(0.0, 1.8, 0.0, -0.1, 0.0, ("p1",)), Stance(2.2, 4.0, 0.4, -0.1, 0.3)],
    }
    plates = [MadePlate("p0", z=(0.0, 0.3)), MadePlate("p1", z=(-0.3, 0.0))]
    made = steps(4.0, box, plates)
    loads = found(made)
    time = made.recording.time
    assert_true(made, loads)
    assert (loads.reason[time > 1.6, 0] == OFF_PLATE).all() and (loads.reason[time > 2.4, 1] == OFF_PLATE).all()
    assert not loads.total_known[time > 1.5].any() and loads.total_known[time < 0.9].all()
    np.testing.assert_allclose(loads.soles.middle[time > 2.4, :, 1], 0.3, atol=0.03)
    held = {
        "right": [Stance(0.0, 1.0, 0.0, 0.1, 0.0, ("p0",)), Stance(1.6, 4.0, 0.0, 0.1, 0.3)],
        "left": [Stance(0.0, 4.0, 0.0, -0.1, 0.0, ("p1",))],
    }
    made = steps(4.0, held, plates)
    loads = found(made)
    assert (loads.reason[time > 1.3, 0] == SWING).all() and loads.total_known.all()
    assert not loads.soles.bears[time > 1.3, 0].any()


def test_a_foot_that_hovers_beside_the_plates_bears_nothing_while_these_bear_the_person() -> None:
    """It keeps 10 mm from the floor behind the person; one that sets down there bears a half."""
    made = steps(4.0, ON_ONE_LEG, TWO_PLATES)
    time = made.recording.time
    to = np.where(time[:, None] > 1.4, [-0.5, 0.01, 0.1], np.nan)
    loads = found(moved(made, "right", to))
    assert (loads.reason[time > 1.3, 0] == SWING).all() and loads.total_known.all()
    assert (loads.reason[:, 1] == MEASURED).all()
    loads = found(steps(4.0, {**ON_ONE_LEG, "right": [*ON_ONE_LEG["right"], Stance(1.6, 4.0, -0.5, 0.1)]}, TWO_PLATES))
    assert (loads.reason[time > 1.7, 0] == OFF_PLATE).all() and not loads.total_known[time > 1.7].any()


def test_a_foot_that_is_held_beside_the_other_one_is_not_on_its_plate() -> None:
    """Its outline is 8 cm from where the one that stands presses."""
    made = steps(4.0, ON_ONE_LEG, TWO_PLATES)
    time = made.recording.time
    loads = found(moved(made, "right", np.where(time[:, None] > 1.4, [0.0, 0.12, -0.02], np.nan)))
    assert (loads.reason[time > 1.4, 0] == SWING).all() and loads.total_known.all()
    assert (loads.reason[:, 1] == MEASURED).all()


@pytest.mark.parametrize("sways_m", [0.0, 0.02])
def test_a_foot_that_never_comes_down_is_held_where_it_sways(sways_m: float) -> None:
    """By the other foot's markers its own are 7 cm up, beside it; of who stands on one leg for 20 s every moment was a
    prior. One that keeps its place is on something."""
    made = steps(4.0, ON_ONE_LEG, TWO_PLATES)
    sway = sways_m * np.sin(3.0 * made.recording.time)[:, None] * [1.0, 0.5, 1.0]
    recording = moved(made, "right", sway + np.array([0.0, 0.07 + sways_m, -0.02])).recording.window(1.5, 4.0)
    loads = foot_loads(recording, LABORATORY, FOOT_MARKERS)
    held = bool(sways_m)
    assert (loads.reason[:, 0] == SWING).all() == held
    assert (loads.reason[:, 1] == MEASURED).all() == held


@pytest.mark.parametrize("about", [-0.09, 0.02])
def test_a_foot_that_turns_about_its_heel_or_its_ball_stands(about: float) -> None:
    made = turning(steps(4.0, ON_ONE_LEG, TWO_PLATES), about)
    loads = found(made)
    assert (loads.reason[:, 1] == MEASURED).all() and loads.total_known.all()
    np.testing.assert_allclose(loads.wrench[:, 1, 1], made.push[:, 1], atol=12.0)


def test_a_jump_is_flight_and_not_a_step() -> None:
    feet = {
        side: [Stance(0.0, 1.0, 0.0, z, 0.0, (plate,)), Stance(1.4, 2.5, 0.1, z, 0.0, (plate,))]
        for side, z, plate in (("right", 0.1, "p0"), ("left", -0.1, "p1"))
    }
    plates = [MadePlate("p0", z=(0.0, 0.3)), MadePlate("p1", z=(-0.3, 0.0))]
    made = steps(2.5, feet, plates)
    loads = found(made)
    assert_true(made, loads)
    assert loads.total_known.all()
    assert (loads.reason[110:130] == SWING).all() and not loads.wrench[110:130].any()


def test_a_foot_that_is_loaded_before_it_is_slow_has_its_load() -> None:
    """A tall person's heel moves by 0.7 m/s for 90 ms after it strikes, in which it took 260 N: nobody's."""
    feet = walk(5, 0.6)
    made = sliding_in(steps(lasting(5), feet, plates_of(feet, (0.25, 0.2))), feet, late_s=0.09)
    loads = found(made)
    assert not [message for message in loads.messages if message.level == "warning"]
    assert loads.total_known.all()
    assert_true(made, loads, 25.0)


@pytest.mark.parametrize(("moved", "its"), [(0.25, True), (0.9, False)])
def test_a_load_that_is_nobodys_leaves_no_foot_near_it_in_the_air(moved: float, its: bool) -> None:
    """A plate that is said to lie 0.25 m aside may bear any foot near it; one at 0.9 m bears something else."""
    feet = walk(4, 0.6)
    plates = [replace(plate, moved=(0.0, moved if plate.name == "p1" else 0.0)) for plate in plates_of(feet)]
    made = sliding_in(steps(lasting(4), feet, plates), feet, late_s=0.09)
    loads, time = found(made), made.recording.time
    lands = (made.push[:, 1] > 55.0) & (time < 0.6)
    assert lands.any() and not loads.total_known[lands].any()
    assert (loads.reason[lands, 1] == OFF_PLATE).all()  # the foot itself stands where that plate is not
    passes = np.abs(made.sole[:, 0, 0] - made.sole[:, 1, 0]) < 0.25  # the other foot, over that load
    passes &= (made.push[:, 1] > 55.0) & (time < 1.1)
    assert passes.sum() > 5 and (loads.reason[passes, 0] == (UNKNOWN if its else SWING)).all()


def test_one_foot_over_two_plates_has_both() -> None:
    feet = {"right": [Stance(0.0, 3.0, 0.0, 0.1, 0.0, ("a", "b"))], "left": [Stance(0.0, 3.0, 0.0, -0.2, 0.0, ("c",))]}
    plates = [
        MadePlate("a", (-0.5, 0.0), (0.0, 0.3)),
        MadePlate("b", (0.0, 0.5), (0.0, 0.3)),
        MadePlate("c", (-0.5, 0.5), (-0.4, 0.0)),
    ]
    made = steps(3.0, feet, plates)
    loads = found(made)
    assert (loads.reason == MEASURED).all() and loads.all_measured.all()
    assert_true(made, loads)


def test_two_feet_on_one_plate_in_turn_are_measured_and_together_shared() -> None:
    feet = walk(4, 0.5)
    feet = {side: [replace(s, plates=("long",)) for s in own] for side, own in feet.items()}
    made = steps(lasting(4), feet, [MadePlate("long", (-0.5, 2.5), (-0.4, 0.4))])
    loads = found(made)
    both, one = (made.push > 60.0).all(axis=1), (made.push > 60.0).sum(axis=1) == 1
    shared = (loads.reason == SHARED).all(axis=1)
    assert shared[both].mean() > 0.9 and (loads.reason == MEASURED).any(axis=1)[one].mean() > 0.7
    total = LABORATORY.wrench_to_ground(made.recording.total_wrench())
    known = np.isfinite(loads.wrench).all(axis=(1, 2))
    np.testing.assert_allclose(loads.wrench.sum(axis=1)[known & shared], total[known & shared], atol=1e-6)
    assert np.sqrt(np.mean((loads.wrench[..., 1] - made.push)[shared] ** 2)) < 0.2 * WEIGHT_N


def test_a_foot_that_crosses_to_the_other_belts_plate_takes_it_along() -> None:
    feet = walk(8, 0.0)
    feet = {side: [replace(s, x=0.35, plates=(side,)) for s in own] for side, own in feet.items()}
    feet["right"][2] = replace(feet["right"][2], z=-0.05, plates=("left",))
    plates = [MadePlate("right", (-1.2, 1.2), (0.0, 0.4)), MadePlate("left", (-1.2, 1.2), (-0.4, 0.0))]
    made = steps(lasting(8), feet, plates, belt_m_s=1.0)
    loads = found(made)
    crossed = feet["right"][2]
    alone = (made.push[:, 0] > 300.0) & (made.push[:, 1] == 0.0)
    alone &= (made.recording.time > crossed.start) & (made.recording.time < crossed.end)
    shared = alone & (loads.reason == SHARED).any(axis=1)  # just after the left foot has left, which may still bear
    np.testing.assert_allclose(loads.wrench[shared, :, 1].sum(axis=1), made.push[shared, 0], atol=12.0)
    alone &= ~shared
    assert alone.sum() > 10
    np.testing.assert_allclose(loads.wrench[alone, 0, 1], made.push[alone, 0], atol=12.0)
    assert not np.nan_to_num(loads.wrench[alone, 1, 1]).any()


@pytest.mark.parametrize("side", ["right", "left"])
def test_a_foot_that_nobody_sees_for_a_second_does_not_lose_its_plate_to_the_other(side: str) -> None:
    feet = walk(12, 0.3)
    made = steps(lasting(12), feet, plates_of(feet))
    whole = found(made)
    k = list(FOOT_MARKERS).index(side)
    hidden = made.recording.markers.copy()
    gap = np.zeros(made.recording.n_frames, dtype=bool)
    for stance in feet[side][1:-1:2]:
        gap[round((stance.end - 0.4) * RATE_HZ) : round((stance.end + 0.6) * RATE_HZ)] = True
    columns = [made.recording.marker_names.index(name) for name in FOOT_MARKERS[side]]
    hidden[np.ix_(gap, columns)] = np.nan
    loads = found(replace(made, recording=replace(made.recording, markers=hidden)))
    assert_true(made, loads)
    np.testing.assert_array_equal(loads.reason[:, 1 - k], whole.reason[:, 1 - k])
    assert set(np.unique(loads.reason[gap, k])) <= {MEASURED, UNKNOWN}
    pressed = gap & (made.push[:, k] > 20.0)
    assert (loads.reason[pressed, k] == MEASURED).mean() > 0.9
    assert not loads.total_known[gap & (loads.reason[:, k] == UNKNOWN)].any()


def test_a_missing_heel_does_not_move_a_foots_outline() -> None:
    feet = walk(4, 0.4)
    made = steps(lasting(4), feet, plates_of(feet))
    hidden = made.recording.markers.copy()
    hidden[50:150, made.recording.marker_names.index("RHEE")] = np.nan
    loads, whole = found(replace(made, recording=replace(made.recording, markers=hidden))), found(made)
    np.testing.assert_array_equal(loads.reason, whole.reason)
    np.testing.assert_allclose(loads.soles.middle, whole.soles.middle, atol=0.01)


def test_stance_rises_from_touch_down_and_falls_to_toe_off() -> None:
    made = steps(lasting(6), walk(6, 0.6), plates_of(walk(6, 0.6)))
    loads = found(made)
    own = loads.soles.stance[:, 0]
    assert own.min() == 0.0 and own.max() == 1.0
    assert np.abs(np.diff(own)).max() < 1.6 / (PASSING_S * RATE_HZ)
    for (first, end), stance in zip(runs(own > 0.0)[:2], walk(6, 0.6)["right"][:2], strict=True):
        assert abs(first / RATE_HZ - stance.start) < 0.06 and abs(end / RATE_HZ - stance.end) < 0.12


def test_a_swing_alone_is_no_belt() -> None:
    """At 4 m/s a foot passes low over the floor for 0.1 s; what goes on for longer than a swing takes is carried."""
    low, body = np.ones((100, 2), dtype=bool), np.tile([1.3, 0.0, 0.0], (100, 1))
    velocity, time = np.tile([4.0, 0.0, 0.0], (100, 2, 1)), np.arange(100) / 100.0
    assert one_velocity(velocity[:20], low[:20], body[:20], time[:20]) is None
    np.testing.assert_allclose(one_velocity(velocity, low, body, time), [4.0, 0.0])


def test_a_belt_that_carries_one_foot_carries_the_other() -> None:
    """Of which each low stretch is too short to show a belt: it had no stance, and the whole plate was the other's."""
    time, body, belt = np.arange(100) / 100.0, np.zeros((100, 3)), np.tile([-1.2, 0.0, 0.0], (100, 2, 1))
    long, short = np.ones((100, 2), dtype=bool), np.repeat((np.arange(100) % 20 < 12)[:, None], 2, axis=1)
    slower = belt * (1.15 / 1.2)
    assert one_velocity(slower, short, body, time) is None
    for speed in velocities([(slower, short), (belt, long)], body, time):
        np.testing.assert_allclose(speed, [-1.2, 0.0])
    assert velocities([(0.5 * belt, short), (belt, long)], body, time)[0] is None  # something else
    still = velocities([(0.0 * belt, long), (belt, long)], body, time)[0]  # a foot beside the belt
    np.testing.assert_allclose(still, [0.0, 0.0])


def test_feet_that_take_turns_bear_all_of_the_weight() -> None:
    feet = walk(6, 0.6, stance_s=0.52)
    made = steps(lasting(6), feet, plates_of(feet))
    soles = found(made).soles
    bears = soles.stance.sum(axis=1) > 0.0
    np.testing.assert_allclose(soles.share.sum(axis=1)[bears], soles.support[bears])
    first, end = np.flatnonzero(bears)[[0, -1]]
    inside = slice(first + round(PASSING_S * RATE_HZ), end - round(PASSING_S * RATE_HZ))
    assert soles.stance.sum(axis=1)[inside].min() < 0.99  # not so by each foot's own rise and fall
    np.testing.assert_allclose(soles.support[inside], 1.0)
