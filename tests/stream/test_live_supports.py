"""Live feet on steps, belts and boxes, frame by frame, beside the same feet afterwards."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from dynakin.filter.live.feet import LiveFeet
from dynakin.recordings.feet.assignment import foot_loads
from dynakin.recordings.feet.loads import MEASURED, OFF_PLATE, SHARED, SWING, UNKNOWN, FootLoads
from dynakin.recordings.standing import marker_velocities
from dynakin.settings import presets
from dynakin.tree import Tree
from support.made_steps import (
    FOOT_MARKERS,
    LABORATORY,
    ON_ONE_LEG,
    TWO_PLATES,
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


def live(made: Made, assigned: Mapping[str, str] | None = None, said: list[str] | None = None) -> list[FootLoads]:
    """What is known at each frame, of what was seen until then; ``said`` takes the sentences."""
    recording = made.recording
    segments = {name: f"foot_{side}" for side, names in FOOT_MARKERS.items() for name in names}
    spec = SimpleNamespace(markers=[SimpleNamespace(segment=segments.get(n, "body")) for n in recording.marker_names])
    spec.segments = [SimpleNamespace(name="body", parent="ground")] + [
        SimpleNamespace(name=f"foot_{side}", parent="body") for side in FOOT_MARKERS
    ]
    feet_of = {side: f"foot_{side}" for side in FOOT_MARKERS}
    initial: Any = SimpleNamespace(feet=feet_of, contacts={}, spec=spec, tree=Tree.of(spec.segments), ground=LABORATORY)
    feet = LiveFeet(initial, presets.default(), tuple(plate.name for plate in recording.plates), assigned or {})
    velocity = np.gradient(recording.markers, recording.time, axis=0)
    assert marker_velocities(recording).shape == velocity.shape
    plates = np.stack([np.hstack([p.force, p.moment]) for p in recording.plates], axis=1)
    loads = [
        feet.loads(time, recording.markers[t], velocity[t], plates[t]) for t, time in enumerate(recording.time.tolist())
    ]
    if said is not None:
        said += feet.news()
    return loads


def both(made: Made) -> tuple[np.ndarray, np.ndarray, np.ndarray, FootLoads]:
    """Reasons (T, F) live, vertical forces (T, F) live, heights (T, F) of the soles live, and all of it offline."""
    now = live(made)
    return (
        np.concatenate([one.reason for one in now]),
        np.concatenate([one.wrench[..., 1] for one in now]),
        np.concatenate([one.soles.middle[..., 1] for one in now]),
        foot_loads(made.recording, LABORATORY, FOOT_MARKERS),
    )


@pytest.mark.parametrize("speed", [0.8, 1.3])
def test_a_belt_is_found_after_some_steps_and_live_then_says_what_offline_says(speed: float) -> None:
    feet = walk(14, 0.0)
    feet = {side: [replace(s, x=0.35 * speed, plates=(side,)) for s in own] for side, own in feet.items()}
    plates = [MadePlate("right", (-1.2, 1.2), (0.0, 0.4)), MadePlate("left", (-1.2, 1.2), (-0.4, 0.0))]
    made = steps(lasting(14), feet, plates, belt_m_s=speed)
    reason, push, _, offline = both(made)
    later = made.recording.time > 3.0
    known = later[:, None] & np.isfinite(push) & np.isfinite(offline.wrench[..., 1])
    assert np.abs(push - made.push)[known].max() < 30.0 and known[later].mean() > 0.9
    assert (reason == offline.reason)[later].mean() > 0.93
    standing = later[:, None] & (made.push > 100.0)
    assert (reason == MEASURED)[standing].mean() > 0.97


@pytest.mark.parametrize("rise", [-0.19, 0.17])
def test_stairs_live(rise: float) -> None:
    """Down each step is the lowest place so far; up it is believed once it has been kept for 0.15 s. The person begins
    with both feet on the floor."""
    feet = walk(6, 0.3, rise=rise)
    feet["left"].insert(0, Stance(0.0, 0.25, 0.0, -0.1, 0.0, ("q",)))
    plates = [MadePlate(s.plates[0], edges=False, height=s.height) for own in feet.values() for s in own]
    made = steps(lasting(6), feet, plates)
    reason, push, height, offline = both(made)
    known = np.isfinite(push)
    assert np.abs(push - made.push)[known].max() < 60.0
    for k, side in enumerate(("right", "left")):
        for stance in feet[side][1:]:
            inside = (made.recording.time > stance.start + 0.3) & (made.recording.time < stance.end - 0.05)
            assert (reason[inside, k] == MEASURED).mean() > 0.9
            np.testing.assert_allclose(height[inside, k], stance.height, atol=0.03)
            assert (offline.reason[inside, k] == MEASURED).all()


def test_a_box_and_a_foot_held_up_live() -> None:
    box = {
        "right": [Stance(0.0, 1.0, 0.0, 0.1, 0.0, ("p0",)), Stance(1.4, 4.0, 0.4, 0.1, 0.3)],
        "left": [Stance(0.0, 1.8, 0.0, -0.1, 0.0, ("p1",)), Stance(2.2, 4.0, 0.4, -0.1, 0.3)],
    }
    plates = [MadePlate("p0", z=(0.0, 0.3)), MadePlate("p1", z=(-0.3, 0.0))]
    made = steps(4.0, box, plates)
    now = live(made)
    time = made.recording.time
    reason = np.concatenate([one.reason for one in now])
    known = np.array([bool(one.total_known[0]) for one in now])
    assert (reason[time > 2.5] == OFF_PLATE).any(axis=1).all() and not known[time > 2.2].any()
    held = {
        "right": [Stance(0.0, 1.0, 0.0, 0.1, 0.0, ("p0",)), Stance(1.6, 4.0, 0.0, 0.1, 0.3)],
        "left": [Stance(0.0, 4.0, 0.0, -0.1, 0.0, ("p1",))],
    }
    now = live(steps(4.0, held, plates))
    reason = np.concatenate([one.reason for one in now])
    assert (reason[time > 1.4, 0] == SWING).all()
    assert all(bool(one.total_known[0]) for one, t in zip(now, time, strict=True) if t > 1.4)


def test_who_stands_on_one_leg_and_turns_on_it_live() -> None:
    """The other foot is held beside it, 8 cm from where it presses."""
    made = steps(4.0, ON_ONE_LEG, TWO_PLATES)
    time = made.recording.time
    held = moved(made, "right", np.where(time[:, None] > 1.4, [0.0, 0.12, -0.02], np.nan))
    reason, push, _, _ = both(turning(held, 0.02))
    assert (reason[time > 1.4] == [SWING, MEASURED]).all()
    np.testing.assert_allclose(push[time > 1.4, 1], made.push[time > 1.4, 1], atol=12.0)


def test_a_plate_that_is_off_its_place_stays_the_foots_that_leaves_it_live() -> None:
    """At toe-off its centre of pressure then lies before that foot, on the way to the next one."""
    plates = [MadePlate(f"p{k}", (0.6 * k - 0.25, 0.6 * k + 0.25), moved=(0.08, 0.0)) for k in range(4)]
    now = live(steps(lasting(4, stance_s=0.8), walk(4, 0.6, stance_s=0.8), plates))
    assert not (np.concatenate([one.reason for one in now]) == SHARED).any()


@pytest.mark.parametrize("step_m", [0.0, 0.5])
def test_plates_that_are_given_to_the_other_foot_are_not_believed_live(step_m: float) -> None:
    """Walking in place and ahead; the right keys are believed and nothing is said."""
    feet = walk(6, step_m)
    if step_m == 0.0:
        feet = {side: [replace(s, plates=(side,)) for s in own] for side, own in feet.items()}
    plates = [MadePlate(name) for name in dict.fromkeys(s.plates[0] for own in feet.values() for s in own)]
    made = steps(lasting(6), feet, plates)
    right = {s.plates[0]: side for side, own in feet.items() for s in own}
    said: list[str] = []
    believed = live(made, right, said)
    assert not [text for text in said if text.startswith("plates:")]
    wrong = {name: "left" if side == "right" else "right" for name, side in right.items()}
    found = live(made, wrong, said)
    said = [text for text in said if text.startswith("plates:")]
    assert len(said) == len(plates)
    assert said[0].startswith(f'plates: "{plates[0].name}" is given to "left", but the left foot is 0.')
    assert "and the right foot stands there" in said[0] and "before, moments were wrong" in said[0]
    if step_m == 0.0:  # the same plates are pressed again
        for frame in np.flatnonzero(made.recording.time > 1.5):
            np.testing.assert_array_equal(found[frame].on, believed[frame].on)


def test_a_sample_without_plates_does_not_end_the_doubt() -> None:
    feet = {side: [replace(s, plates=(side,)) for s in own] for side, own in walk(6, 0.0).items()}
    made = steps(lasting(6), feet, [MadePlate("right"), MadePlate("left")])
    gap = [replace(p, force=p.force.copy()) for p in made.recording.plates]
    for plate in gap:
        plate.force[20] = np.nan
    said: list[str] = []
    live(replace(made, recording=replace(made.recording, plates=tuple(gap))), {"right": "left", "left": "right"}, said)
    assert len([text for text in said if text.startswith("plates:")]) == 2


def test_stance_rises_and_falls_live() -> None:
    feet = walk(6, 0.6)
    plates = [
        MadePlate(s.plates[0], (s.x - 0.2, s.x + 0.2), (s.z - 0.1, s.z + 0.1), edges=False)
        for own in feet.values()
        for s in own
    ]
    made = steps(lasting(6), feet, plates)
    weights = np.concatenate([one.soles.stance for one in live(made)])
    assert weights.min() == 0.0 and weights.max() > 0.99
    for k, side in enumerate(("right", "left")):
        for stance in feet[side][1:-1]:
            middle = (made.recording.time > stance.start + 0.2) & (made.recording.time < stance.end - 0.05)
            swing = (made.recording.time > stance.end + 0.18) & (made.recording.time < stance.end + 0.3)
            assert weights[middle, k].min() > 0.9 and weights[swing, k].max() < 0.05


@pytest.mark.parametrize("moved", [0.0, 0.25])
def test_a_foot_that_is_loaded_before_it_is_slow_is_never_in_the_air_live(moved: float) -> None:
    """It has its load, or, where that is said to lie aside and is nobody's, what it carries is not known."""
    feet = walk(4, 0.6)
    plates = [
        MadePlate(s.plates[0], (s.x - 0.25, s.x + 0.25), (s.z - 0.2, s.z + 0.2), moved=(0.0, moved))
        for s in (*feet["right"], *feet["left"])
    ]
    made = sliding_in(steps(lasting(4), feet, plates), feet, late_s=0.09)
    reasons, push, _, _ = both(made)
    loaded = made.push > 60.0
    assert not (reasons[loaded] == SWING).any()
    if moved:
        assert (reasons[loaded] == UNKNOWN).any()
    else:
        assert np.abs(push - made.push)[loaded & (reasons == MEASURED)].max() < 25.0
