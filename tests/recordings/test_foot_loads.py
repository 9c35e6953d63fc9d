"""Which foot stands on which plate, and when the total wrench is known."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dynakin import read
from dynakin.errors import ConfigError
from dynakin.model.markers.recognise import foot_markers_of
from dynakin.recordings.feet.assignment import foot_loads
from dynakin.recordings.feet.loads import MEASURED, OFF_PLATE, REASONS, SHARED, SWING, UNKNOWN
from dynakin.recordings.frame import find_ground_frame
from dynakin.recordings.plates.ground_plate import saturated
from dynakin.recordings.recording import Plate, Recording
from support.made_steps import FOOT_MARKERS, LABORATORY, Made, MadePlate, Stance, lasting, sliding_in, steps, walk

T = 400
TIME = np.arange(T) / 100.0
FEET = {"R": 0.1, "L": -0.1}
MARKERS = {"right": ["RHEE", "RTOE"], "left": ["LHEE", "LTOE"]}
CORNERS = np.array([[-0.3, 0.0, 0.4], [0.3, 0.0, 0.4], [0.3, 0.0, 0.0], [-0.3, 0.0, 0.0]])


def plate(name: str, push: np.ndarray, cop: np.ndarray, corners: np.ndarray | None = None) -> Plate:
    """Forces straight up at these places (T, 3)."""
    force = np.zeros((T, 3))
    force[:, 1] = push + np.where((push > 0.0) & (push < 900.0), 0.1 * np.sin(np.arange(T)), 0.0)  # never quite still
    moment = np.cross(cop, force)
    seen = np.where(push[:, None] > 10.0, cop, np.nan)
    return Plate(name, force, moment, seen, np.zeros((T, 3)), corners)


def walker(lift: dict[str, tuple[int, int]], plates: tuple[Plate, ...], forward: float = 0.0) -> Recording:
    """Two feet with heel and toe; a foot is lifted 0.1 m and moved forward between two frames."""
    names, paths = [], []
    for side, z in FEET.items():
        up, ahead = np.zeros(T), np.zeros(T)
        if side in lift:
            first, end = lift[side]
            phase = np.clip((np.arange(T) - first) / (end - first), 0.0, 1.0)
            up, ahead = 0.1 * np.sin(np.pi * phase), forward * phase
        for marker, x in (("HEE", -0.1), ("TOE", 0.1)):
            names.append(side + marker)
            paths.append(np.stack([x + ahead, 0.03 + up, np.full(T, z)], axis=1))
    return Recording("walker", None, TIME, tuple(names), np.stack(paths, axis=1), plates)


def at(x: float, z: float) -> np.ndarray:
    return np.broadcast_to([x, 0.0, z], (T, 3)).copy()


def test_each_plate_goes_to_the_foot_under_which_it_lies_and_swing_is_zero() -> None:
    lifted = slice(100, 200)
    right, left = np.full(T, 300.0), np.full(T, 300.0)
    right[lifted], left[lifted] = 0.0, 600.0
    recording = walker({"R": (100, 200)}, (plate("a", left, at(0.0, -0.1)), plate("b", right, at(0.02, 0.12))))
    loads = foot_loads(recording, LABORATORY, MARKERS)
    assert loads.feet == ("right", "left")
    assert loads.total_known.all() and loads.all_measured.all()
    np.testing.assert_allclose(loads.wrench[:, 0, 1], right, atol=0.11)
    np.testing.assert_allclose(loads.wrench[:, 1, 1], left, atol=0.11)
    np.testing.assert_allclose(loads.wrench[:, 0, 3], -0.12 * loads.wrench[:, 0, 1], atol=1e-9)
    assert (loads.reason[130:170, 0] == SWING).all() and (loads.reason[:, 1] == MEASURED).all()
    assert any("a carries the left foot" in text for text in map(str, loads.messages))


def test_a_step_beside_the_plates_leaves_the_total_out_while_it_may_bear_load() -> None:
    right = np.where(np.arange(T) < 100, 300.0, 0.0)
    left = np.full(T, 300.0)
    recording = walker(
        {"R": (100, 160)}, (plate("a", left, at(0.0, -0.1)), plate("b", right, at(0.0, 0.1))), forward=0.8
    )
    loads = foot_loads(recording, LABORATORY, MARKERS)
    assert loads.total_known[:140].all() and not loads.total_known[165:].any()
    assert (loads.reason[170:, 0] == OFF_PLATE).all() and np.isnan(loads.wrench[170:, 0]).all()
    assert np.isfinite(loads.wrench[:, 1]).all()
    assert any("right foot stands off the plates from 1.5" in text for text in map(str, loads.messages))


@pytest.mark.parametrize("down", [200, 392])
def test_a_heel_that_slides_when_it_touches_may_bear_from_then_on(down: int) -> None:
    """At 1.2 m/s, slow 0.1 s later, or not any more before the recording ends: it was in the air, "measured" as 0."""
    off = down - 100
    loaded, swings = np.arange(T) >= down, (np.arange(T) >= off) & (np.arange(T) < down)
    right, left = np.where(np.arange(T) < off, 300.0, 0.0), np.where(swings, 600.0, np.where(loaded, 100.0, 300.0))
    recording = walker({"R": (off, down)}, (plate("a", left, at(0.0, -0.1)), plate("b", right, at(0.0, 0.1))), 0.8)
    since = np.clip((np.arange(T) - down) / 100.0, 0.0, 0.17)
    slid, markers = 1.2 * since - 0.5 * 1.2 / 0.17 * since**2, recording.markers.copy()
    markers[down - 30 : down, 0:2, 0] = np.linspace(markers[down - 30, 0:2, 0], markers[down, 0:2, 0], 30)
    markers[:, 0:2, 0] += slid[:, None]
    markers[:, 1, 1] = np.where(loaded, 0.03 + 0.08 * (1.0 - since / 0.17), markers[:, 1, 1] + 0.08 * swings)
    loads = foot_loads(replace(recording, markers=markers), LABORATORY, MARKERS)
    assert (loads.reason[down:, 0] == OFF_PLATE).all() and (loads.reason[off + 20 : down - 15, 0] == SWING).all()
    assert not loads.total_known[down:].any()


def test_a_foot_held_near_the_floor_at_the_end_bears_nothing_while_the_plates_carry_all() -> None:
    left = np.where(np.arange(T) < 100, 300.0, 600.0)
    plates = (plate("a", left, at(0.0, -0.1)), plate("b", 600.0 - left, at(0.0, 0.1)))
    recording = walker({"R": (100, 800)}, plates)
    markers, after = recording.markers.copy(), np.maximum(np.arange(T) - 380, 0) / 100.0
    markers[381:, 0:2, 1] = 0.045
    markers[:, 0:2, 0] += after[:, None]
    trunk = np.broadcast_to([0.0, 1.2, 0.0], (T, 5, 3))
    names = (*recording.marker_names, *(f"T{k}" for k in range(5)))
    recording = replace(recording, marker_names=names, markers=np.concatenate([markers, trunk], axis=1))
    loads = foot_loads(recording, LABORATORY, MARKERS)
    assert (loads.reason[250:, 0] == SWING).all() and loads.total_known[250:].all()


def test_a_heel_beyond_the_edge_of_its_plate_is_off_it() -> None:
    both = np.full(T, 300.0)
    shifted = CORNERS + np.array([0.25, 0.0, 0.0])  # from x = -0.05: the heel markers at -0.1 lie 50 mm beyond
    recording = walker(
        {}, (plate("a", both, at(0.0, 0.1), shifted), plate("b", both, at(0.0, -0.1), CORNERS * [1, 1, -1]))
    )
    loads = foot_loads(recording, LABORATORY, MARKERS)
    assert not loads.total_known.any() and (loads.reason[:, 0] == OFF_PLATE).all()
    inside = walker(
        {}, (plate("a", both, at(0.0, 0.1), CORNERS), plate("b", both, at(0.0, -0.1), CORNERS * [1, 1, -1]))
    )
    assert foot_loads(inside, LABORATORY, MARKERS).total_known.all()


def test_two_feet_on_one_plate_share_it_and_their_sum_is_what_was_measured() -> None:
    recording = walker({}, (plate("a", np.full(T, 600.0), at(0.01, 0.05)),))
    loads = foot_loads(recording, LABORATORY, MARKERS)
    assert loads.total_known.all() and not loads.all_measured.any()
    assert (loads.reason == SHARED).all()
    total = LABORATORY.wrench_to_ground(recording.total_wrench())
    np.testing.assert_allclose(loads.wrench.sum(axis=1), total, atol=1e-9)
    np.testing.assert_allclose(
        loads.wrench[0, :, 1], [450.0, 150.0], rtol=1e-3
    )  # 0.05 lies at three quarters of -0.1 to 0.1
    assert any("Both feet stand on a" in text for text in map(str, loads.messages))


@pytest.mark.parametrize("behind_m", [0.0, 0.1, 0.4])
def test_what_else_bears_on_the_plate_of_both_feet_is_not_theirs(behind_m: float) -> None:
    """A chair behind them for the first two seconds: moments were a prior's all the time, a hip 35 N m off, said to 22.
    The pressure of who leans back lies at the heels."""
    places = at(0.01, 0.0)
    places[:200, 0] -= behind_m
    loads = foot_loads(walker({}, (plate("a", np.full(T, 600.0), places),)), LABORATORY, MARKERS)
    chair = behind_m > 0.2
    assert (loads.reason[:200] == (UNKNOWN if chair else SHARED)).all() and (loads.reason[250:] == SHARED).all()
    assert (loads.total_known[:200] == (not chair)).all() and loads.total_known[250:].all()
    assert (loads.elsewhere[:200] == chair).all() and not loads.elsewhere[250:].any()
    said = [text for text in loads.reasons if "presses beyond both feet" in text.text]
    assert [text.level for text in said] == ["warning"] * chair
    moved = foot_loads(
        walker({}, (plate("a", np.full(T, 600.0), places),)), LABORATORY, MARKERS, assigned={"a": "left"}
    )
    assert not any("presses beyond" in text.text for text in moved.messages)


@pytest.mark.parametrize("corners", [None, CORNERS - [0.0, 0.0, 0.2]])
def test_feet_wide_apart_on_one_plate_share_it(corners: np.ndarray | None) -> None:
    """Under neither foot, but between the two for as long as it is pressed."""
    recording = walker({}, (plate("a", np.full(T, 600.0), at(0.01, 0.0), corners),))
    wide = recording.markers * [1.0, 1.0, 1.8]
    assert (foot_loads(replace(recording, markers=wide), LABORATORY, MARKERS).reason == SHARED).all()


@pytest.mark.parametrize("edges", [True, False])
def test_a_plate_that_is_off_its_place_stays_the_foots_that_leaves_it(edges: bool) -> None:
    """At toe-off its centre of pressure then lies before that foot, on the way to the next one."""
    feet = walk(4, 0.6, stance_s=0.8)
    plates = [MadePlate(f"p{k}", (0.6 * k - 0.25, 0.6 * k + 0.25), moved=(0.08, 0.0), edges=edges) for k in range(4)]
    made = steps(lasting(4, stance_s=0.8), feet, plates)
    on = foot_loads(made.recording, LABORATORY, FOOT_MARKERS).on.any(axis=0)  # (F, P)
    np.testing.assert_array_equal(on, [[True, False, True, False], [False, True, False, True]])


def test_flight_is_measured_as_nothing_and_a_saturated_plate_is_not_measured() -> None:
    jump = np.where((np.arange(T) >= 100) & (np.arange(T) < 160), 0.0, 300.0)
    clipped = jump.copy()
    clipped[200:220] = 900.0
    recording = walker(
        {"R": (100, 160), "L": (100, 160)}, (plate("a", jump, at(0.0, -0.1)), plate("b", clipped, at(0.0, 0.1)))
    )
    loads = foot_loads(recording, LABORATORY, MARKERS)
    assert loads.total_known[100:160].all() and not loads.wrench[110:150].any()
    assert not loads.total_known[200:220].any() and loads.total_known[220:].all()
    np.testing.assert_array_equal(saturated(clipped), clipped == 900.0)
    assert "plate not measured" in REASONS


def test_a_user_knows_better_and_a_load_where_nobody_stands_is_said() -> None:
    push = np.full(T, 300.0)
    plates = (plate("a", push, at(0.0, -0.1)), plate("b", push, at(0.0, 0.1)), plate("c", push, at(2.0, 0.1)))
    loads = foot_loads(walker({}, plates), LABORATORY, MARKERS)
    assert not loads.total_known.any()
    assert any(text.startswith("Warning: c carries up to 300 N") for text in map(str, loads.messages))
    assigned = foot_loads(walker({}, plates), LABORATORY, MARKERS, assigned={"c": "right"})
    assert assigned.total_known.all()
    np.testing.assert_allclose(assigned.wrench[:, 0, 1], 600.0, rtol=1e-3)
    with pytest.raises(ConfigError, match="'d' is not in walker; expected one of a, b, c"):
        foot_loads(walker({}, plates), LABORATORY, MARKERS, assigned={"d": "right"})


def test_a_plate_that_is_given_to_the_foot_beside_it_is_not_believed() -> None:
    """A declared foot was never held against the centre of pressure: knees were 123 N m off, said to 11."""
    push = np.full(T, 300.0)
    plates = (plate("a", push, at(0.0, -0.1)), plate("b", push, at(0.0, 0.1)))
    right = foot_loads(walker({}, plates), LABORATORY, MARKERS, assigned={"a": "left", "b": "right"})
    assert not right.misgiven and right.all_measured.all()
    wrong = foot_loads(walker({}, plates), LABORATORY, MARKERS, assigned={"a": "right", "b": "left"})
    assert wrong.misgiven.startswith(
        'plates: "a" is given to "right", but the right foot is 0.20 m from its centre of pressure and the left foot '
        "stands there"
    )


@pytest.mark.parametrize("to_the_other_m", [0.0, 0.1])
def test_a_plate_off_its_place_that_is_given_to_the_foot_on_it_is_believed(to_the_other_m: float) -> None:
    push = np.full(T, 300.0)
    plates = (plate("a", push, at(0.0, to_the_other_m - 0.1)), plate("b", push, at(0.0, 0.1 - to_the_other_m)))
    loads = foot_loads(walker({}, plates), LABORATORY, MARKERS, assigned={"a": "left", "b": "right"})
    assert not loads.misgiven and loads.on[:, [1, 0], [0, 1]].all()


def test_a_press_of_the_other_foot_on_a_plate_that_is_given_is_not_the_given_foots() -> None:
    push = np.where((np.arange(T) > 250) & (np.arange(T) < 280), 0.0, 300.0)
    places = at(0.0, -0.1)
    places[280:, 2] = 0.1
    loads = foot_loads(walker({}, (plate("a", push, places),)), LABORATORY, MARKERS, assigned={"a": "left"})
    assert not loads.misgiven and loads.on[:250, 1, 0].all() and not loads.on[280:].any()
    assert any("where the foot that it is given to does not stand" in text.text for text in loads.messages)


def test_real_plates(data_dir: Path) -> None:
    folder = data_dir / "opencap_subject4"
    squat = read(folder / "squats1.trc", folder / "squats1_grf.mot")
    loads = foot_loads(squat, find_ground_frame(squat), foot_markers_of(squat))
    assert loads.all_measured.all()
    assert any("plate 1 carries the right foot" in text for text in map(str, loads.messages))
    walk = read(folder / "walking1.trc", folder / "walking1_grf.mot")
    loads = foot_loads(walk, find_ground_frame(walk), foot_markers_of(walk))
    assert not loads.total_known[walk.time < 0.1].any()  # the left foot still pushes, off the plates
    assert loads.total_known[(walk.time > 0.25) & (walk.time < 1.2)].all()
    gait = read(data_dir / "plugin_gait" / "GaitNormal_1.c3d")
    ground = find_ground_frame(gait)
    loads = foot_loads(gait, ground, foot_markers_of(gait))
    known = loads.total_known
    assert known[(gait.time > 0.45) & (gait.time < 1.8)].all() and not known[gait.time < 0.3].any()
    total = ground.wrench_to_ground(gait.total_wrench())
    assert np.abs(loads.wrench.sum(axis=1) - total)[known].max() < 10.0  # an empty plate's noise is nobody's
    turned = replace(gait, plates=tuple(replace(p, corners=None) for p in gait.plates))
    assert foot_loads(turned, ground, foot_markers_of(turned)).total_known[(gait.time > 0.45) & (gait.time < 1.8)].all()


def with_part_moved(made: Made, source: str, target: str, part: np.ndarray) -> Recording:
    """That part (T,) of what one plate carries, on another one."""
    moved = next(plate for plate in made.recording.plates if plate.name == source)
    plates = []
    for plate in made.recording.plates:
        share = part[:, None] * ((plate.name == target) - float(plate.name == source))
        force, moment = plate.force + share * moved.force, plate.moment + share * moved.moment
        plates.append(replace(plate, force=force, moment=moment))
    return made.recording.with_plates(tuple(plates))


def assert_measured_is_true(recording: Recording, push: np.ndarray) -> np.ndarray:
    """(T, F) where a foot's wrench is called measured: there it is the foot's; no foot is off the plates."""
    loads = foot_loads(recording, LABORATORY, FOOT_MARKERS)
    measured = loads.reason <= MEASURED
    np.testing.assert_allclose(loads.wrench[..., 1][measured], push[measured], atol=25.0)
    assert not (loads.reason == OFF_PLATE).any() and loads.total_known.all()
    return measured


@pytest.mark.parametrize("edges", [True, False])
@pytest.mark.parametrize("apart_m", [0.14, 0.2, 0.3])
def test_who_lifts_a_foot_from_one_plate_shares_it_while_both_stand(apart_m: float, edges: bool) -> None:
    """As briefly as that may be in a press of which most is the other foot's alone."""
    feet = {
        "right": [Stance(0.0, 6.0, 0.0, 0.5 * apart_m, 0.0, ("one",))],
        "left": [Stance(*span, 0.0, -0.5 * apart_m, 0.0, ("one",)) for span in ((0.0, 0.7), (5.0, 6.0))],
    }
    made = steps(6.0, feet, [MadePlate("one", edges=edges)])
    measured = assert_measured_is_true(made.recording, made.push)
    assert measured[200:400].all() and not measured[:70].any() and not measured[520:].any()


@pytest.mark.parametrize(
    ("source", "target", "share", "first_s", "last_s"),
    [
        ("p2", "p1", 1.0, 1.10, 1.18),  # the heel sets down before the edge
        ("p1", "p2", 1.0, 1.19, 1.25),  # the toes leave from beyond it
        ("p1", "p2", 0.3, 1.10, 1.25),
        ("p2", "p1", 0.3, 1.10, 1.25),
    ],
)
def test_a_foot_partly_on_its_neighbours_plate_shares_it(
    source: str, target: str, share: float, first_s: float, last_s: float
) -> None:
    """In double support; all other frames stay measured."""
    made = steps(lasting(4), walk(4, 0.6), [MadePlate(f"p{k}", edges=False) for k in range(4)])
    time = made.recording.time
    recording = with_part_moved(made, source, target, share * ((time > first_s) & (time < last_s)))
    measured = assert_measured_is_true(recording, made.push)
    assert not measured[(time > first_s + 0.01) & (time < last_s - 0.01)].any()
    assert measured[(time < 1.02) | (time > 1.33)].all()


@pytest.mark.parametrize(("first", "end"), [(0, 235), (58, 235), (0, 121), (116, 178)])
def test_a_long_plate_is_shared_in_double_support_wherever_a_recording_begins_and_ends(first: int, end: int) -> None:
    feet = {side: [replace(s, plates=("long",)) for s in own] for side, own in walk(4, 0.6).items()}
    made = steps(lasting(4), feet, [MadePlate("long", edges=False)])
    plate, whole = made.recording.plates[0], made.recording
    kept = {name: getattr(plate, name)[first:end] for name in ("force", "moment", "cop", "free_moment")}
    cut = replace(whole, time=whole.time[first:end], markers=whole.markers[first:end], plates=(replace(plate, **kept),))
    measured = assert_measured_is_true(cut, made.push[first:end])
    assert not measured[(made.push[first:end] > 70.0).all(axis=1)].any()
    assert measured.all(axis=1)[(made.push[first:end] > 10.0).sum(axis=1) < 2].mean() > 0.5


@pytest.mark.parametrize("light_n", [30.0, 45.0])
def test_the_order_of_the_plates_changes_nothing(light_n: float) -> None:
    """A foot on two plates slides on, low over both and lightly, and is under the centre of pressure of one of them
    alone: that it is not in the air is known by that one, whichever comes first."""
    frames = np.arange(T)

    def push(stands: float) -> np.ndarray:
        return np.where(frames < 100, stands, np.where(frames < 125, light_n, 0.0))

    under = at(0.0, 0.1) + np.outer(0.6 * np.clip((frames - 100) / 60.0, 0.0, 1.0), [1.0, 0.0, 0.0])
    beside = under + np.outer(frames >= 100, [0.8, 0.0, 0.0])
    left = plate("left", np.full(T, 400.0), at(0.0, -0.1))
    plates = (plate("beside", push(200.0), beside), plate("under", push(100.0), under), left)
    made = walker({"R": (100, 160)}, plates, forward=0.6)
    recording = replace(made, markers=made.markers * [1.0, 0.1, 1.0] + [0.0, 0.027, 0.0])
    one, other = (foot_loads(recording.with_plates(given), LABORATORY, MARKERS) for given in (plates, plates[::-1]))
    np.testing.assert_array_equal(one.on, other.on[:, :, ::-1])
    np.testing.assert_array_equal(one.aloft, other.aloft)
    np.testing.assert_array_equal(one.reason, other.reason)
    np.testing.assert_allclose(one.wrench, other.wrench, atol=1e-9)


def test_a_foot_whose_sole_its_markers_do_not_show_keeps_its_plate() -> None:
    """Its heel lies 0.16 m behind the only marker."""
    made = steps(lasting(4), walk(4, 0.6), [MadePlate(f"p{k}", edges=False) for k in range(4)])
    assert foot_loads(made.recording, LABORATORY, {"right": ["RMT5"], "left": ["LMT5"]}).all_measured.all()


def test_a_plate_beside_one_of_two_flat_feet_is_shared_and_its_place_doubted() -> None:
    """Between them, and nearer than any sole of the foot that is not on a plate of its own."""
    push = np.full(T, 350.0)
    recording = walker({}, (plate("a", push, at(0.0, -0.15)), plate("b", push, at(0.0, 0.07))))
    wide = replace(recording, markers=recording.markers * [1.0, 1.0, 1.5])
    loads = foot_loads(wide, LABORATORY, MARKERS)
    assert (loads.reason == SHARED).all()
    assert any("b lies off its place" in message.text for message in loads.messages)


def test_a_foot_that_slides_low_beside_the_plates_as_the_recording_ends_may_set_down() -> None:
    feet = walk(3, 0.6)
    made = sliding_in(steps(lasting(3), feet, [MadePlate(f"p{k}", edges=False) for k in range(3)]), feet, late_s=0.09)
    part = made.recording.with_plates(made.recording.plates[:2]).window(0.0, feet["right"][1].start + 0.04)
    said = [text for text in map(str, foot_loads(part, LABORATORY, FOOT_MARKERS).messages) if "off the plates" in text]
    assert len(said) == 1 and "The right foot may set down off the plates" in said[0]
