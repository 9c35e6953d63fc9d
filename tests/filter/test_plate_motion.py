"""Plates out of step, and plates whose axes are others, by the motion of the centre of mass."""

from __future__ import annotations

import re
from collections.abc import Callable
from copy import copy
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

import dynakin
from dynakin import Estimator, Subject, load_model
from dynakin.cli.check_rows import model_rows
from dynakin.errors import RecordingError
from dynakin.filter.ground import axes
from dynakin.filter.ground.carried import _presses_there, _taken_up, more_than_the_mass
from dynakin.filter.ground.delay import Delay, brought_into_step, plates_delay
from dynakin.filter.ground.fine_delay import UNKNOWN_S
from dynakin.filter.ground.gain import fitting_rate
from dynakin.filter.ground.mass_centre import MassCentre
from dynakin.filter.ground.needed import Needed
from dynakin.filter.ground.plate_errors import PlateErrors
from dynakin.filter.ground.shear import found_shear
from dynakin.messages import about, warnings_of
from dynakin.recordings.recording import Plate, Recording
from dynakin.recordings.resampling import low_pass
from dynakin.results.measures.sources import ABSENT
from dynakin.settings.settings import Settings
from dynakin.units import GRAVITY_M_S2
from dynakin.validation.held_out import measured_wrench
from support.plates import estimated, person, prepared, shifted, trial, with_forces
from support.simulated import simulate


@pytest.mark.parametrize(
    ("motion", "delay_s"),
    [
        ("gait", 0.03),
        ("gait", 0.09),
        ("gait", -0.06),
        ("squat", 0.04),
        ("gait", 0.1),  # further than is looked for at first
        ("gait", 0.25),
        ("squat", -0.3),
        ("squat", 0.4),
    ],
)
def test_plates_that_are_out_of_step_are_brought_into_it(motion: str, delay_s: float) -> None:
    whole = trial(motion)
    late = brought_into_step(whole, Delay(-delay_s, 0.0))
    ready, before = person().prepare(late), prepared(motion)
    text = next(text for text in map(str, ready.messages) if "By the motion the plates" in text)
    side = "behind" if delay_s > 0.0 else "ahead of"
    (found,) = re.findall(rf"([0-9.]+) ms {side} the markers", text)
    assert float(found) == pytest.approx(1000.0 * abs(delay_s), abs=2.0)
    both = np.isfinite(ready.measured.wrench).all(axis=1) & np.isfinite(before.measured.wrench).all(axis=1)
    assert both.sum() > 0.8 * np.isfinite(before.measured.wrench).all(axis=1).sum()
    assert np.abs(ready.measured.wrench[both] - before.measured.wrench[both])[:, :3].mean() < 2.0


def test_plates_that_are_in_step_are_left_alone(data_dir: Path) -> None:
    folder = data_dir / "opencap_subject4"
    walk = dynakin.read(folder / "walking1.trc", folder / "walking1_grf.mot")
    for recording, ready in ((trial("gait"), prepared("gait")), (walk, person().prepare(walk))):
        assert (
            plates_delay(Needed(ready.calibrated, recording.time, ready.measured.markers), ready.measured.wrench[:, :3])
            is None
        )
        assert bool(about(ready.messages, "in step")) == (recording is walk)  # 5 ms, as others of this laboratory


@pytest.mark.parametrize(
    ("turn", "which", "said"),
    [
        (
            [1.0, 1.0, -1.0],
            None,
            r"plate 1, plate 2 and plate 3 does not .* if its first axis \(.* points the other way",
        ),
        ([-1.0, 1.0, 1.0], 1, r"plate 2 does not .* if its second axis \(.* points the other way"),
        ([-1.0, 1.0, -1.0], None, r"plate 1, plate 2 and plate 3 does not .*half a turn"),
    ],
)
def test_plates_with_a_reversed_axis_are_refused(turn: list[float], which: int | None, said: str) -> None:
    walk = trial("gait")
    up = int(np.argmax(np.abs(walk.plates[0].force).mean(axis=0)))
    signs = np.ones(3)
    signs[[k for k in range(3) if k != up]] = np.array(turn)[[0, 2]]
    with pytest.raises(RecordingError, match=f"horizontal force of {said}"):
        person().prepare(with_forces(walk, lambda force: force * signs, which))


@pytest.mark.parametrize(
    ("matrix", "said"),
    [
        (np.diag([1.0, -1.0]), r"if its (first|second) axis \(.* points the other way"),
        (-np.eye(2), "if (its .* points the other way|both horizontal axes .*half a turn)"),
        (np.array([[0.0, -1.0], [1.0, 0.0]]), "if the horizontal axes are turned by a quarter turn"),
    ],
)
def test_feet_that_push_against_each_other_show_the_axes_though_their_sum_does_not(
    matrix: np.ndarray, said: str
) -> None:
    """Only the lateral force, which a squat's centre of mass does not need."""
    squat = trial("squat")
    prepared("squat")  # as it is nothing is wrong
    up = int(np.argmax(np.abs(squat.plates[0].force).mean(axis=0)))
    level = [k for k in range(3) if k != up]
    mean = squat.plates[0].force[:, level].mean(axis=0)
    assert abs(mean[1]) > 5.0 * abs(mean[0])  # the second is the lateral one

    def change(force: np.ndarray) -> np.ndarray:
        lateral = np.zeros_like(force)
        lateral[:, level[1]] = force[:, level[1]]
        changed = force - lateral
        changed[:, level] += lateral[:, level] @ matrix.T
        return changed

    with pytest.raises(
        RecordingError, match=rf"plate 1 and plate 2 pushes the feet apart or across: it lies .* deg off .*{said}"
    ):
        person().prepare(with_forces(squat, change))


def test_a_quarter_turn_is_named(data_dir: Path) -> None:
    folder = data_dir / "opencap_subject4"
    walk = dynakin.read(folder / "walking1.trc", folder / "walking1_grf.mot")
    turned = with_forces(walk, lambda force: force[:, [2, 1, 0]] * [1.0, 1.0, -1.0])
    with pytest.raises(RecordingError, match=r"walking1_grf.mot: .* quarter turn.*Correct the signs"):
        person().prepare(turned)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda plate: replace(plate, cop=1000.0 * plate.cop), "has a moment of"),
        (lambda plate: replace(plate, cop=plate.cop + np.array([0.0, 0.0, 0.7])), "away from the nearest foot"),
    ],
)
def test_what_is_wrong_with_plates_names_the_file_of_the_forces(
    data_dir: Path, change: Callable[[Plate], Plate], said: str
) -> None:
    """It was the file of the markers that was named."""
    folder = data_dir / "opencap_subject4"
    walk = dynakin.read(folder / "walking1.trc", folder / "walking1_grf.mot")
    with pytest.raises(RecordingError, match=f"^[^ ]*walking1_grf.mot: .*{said}"):
        person().prepare(walk.with_plates(tuple(change(plate) for plate in walk.plates)))


@pytest.mark.parametrize(
    ("sign", "said"), [(-1.0, "are exchanged. "), (1.0, "are exchanged and point the other way. ")]
)
def test_horizontal_forces_that_are_exchanged_are_named(sign: float, said: str) -> None:
    """A mirror: no turn of the axes gives it. The plates' axes lie a quarter turn from the laboratory's."""
    walk = trial("gait")
    up = int(np.argmax(np.abs(walk.plates[0].force).mean(axis=0)))
    level = [k for k in range(3) if k != up]

    def change(force: np.ndarray) -> np.ndarray:
        changed = force.copy()
        changed[:, level] = sign * force[:, level[::-1]]
        return changed

    with pytest.raises(RecordingError, match=f"does not fit the motion: .* if the two horizontal forces {said}"):
        person().prepare(with_forces(walk, change))


@pytest.mark.parametrize(
    ("by_m", "which", "said"),
    [
        (0.0, None, None),
        (0.05, None, "the plates together by 0.0[3-6] m"),
        (-0.05, None, "the plates together by 0.0[3-6] m"),
        (0.09, 1, "plate 2 by 0.0[3-9] m"),
    ],
)
def test_plates_off_their_place_are_told_by_the_movement(by_m: float, which: int | None, said: str | None) -> None:
    walk = trial("gait")
    up = int(np.argmax(np.abs(walk.plates[0].force).mean(axis=0)))
    pressed = walk.plates[0].cop[np.isfinite(walk.plates[0].cop).all(axis=1)]
    across = int(np.argmin(np.ptp(pressed, axis=0) + 9.0 * np.eye(3)[up]))
    estimate = person().run(shifted(walk, across, by_m, which)) if by_m else estimated("gait")
    found = [message.text for message in about(estimate.messages, "place")]
    assert len(found) == (said is not None)
    if said is not None:
        assert re.search(f"where the plates have it: {said} .X", found[0]) and "the plates lie elsewhere" in found[0]


def test_a_declared_contact_that_bears_nothing_hides_no_plate_off_its_place() -> None:
    walk = trial("gait")
    up = int(np.argmax(np.abs(walk.plates[0].force).mean(axis=0)))
    pressed = walk.plates[0].cop[np.isfinite(walk.plates[0].cop).all(axis=1)]
    across = int(np.argmin(np.ptp(pressed, axis=0) + 9.0 * np.eye(3)[up]))
    assert about(person("seat").run(shifted(walk, across, 0.05)).messages, "place")


@pytest.mark.parametrize(("by_m", "told"), [(0.0, False), (0.06, True)])
def test_plates_of_a_real_walk_off_their_place(data_dir: Path, by_m: float, told: bool) -> None:
    folder = data_dir / "opencap_subject4"
    walk = dynakin.read(folder / "walking1.trc", folder / "walking1_grf.mot")
    estimator = Estimator(load_model("fullbody", Subject(mass_kg=63.3, height_m=1.70)))
    found = [message.text for message in about(estimator.run(shifted(walk, 0, by_m)).messages, "place")]
    assert len(found) == told
    assert not told or "(X +0.0" in found[0]


def holding(recording: Recording, mass_kg: float, *, acts_there: bool = True) -> Recording:
    """With the force of so much in both hands, half of it on each plate, acting where the hands are, or only under the
    feet."""
    own = [k for k, name in enumerate(recording.marker_names) if "wrist" in name]
    at = low_pass(recording.markers[:, own].mean(axis=1), recording.rate, 6.0)
    step = 1.0 / recording.rate
    push = mass_kg * np.gradient(np.gradient(at, step, axis=0), step, axis=0)
    push[:, int(np.argmax(np.abs(recording.plates[0].force).mean(axis=0)))] += mass_kg * GRAVITY_M_S2

    def of(plate: Plate) -> Plate:
        more = 0.5 * push
        return replace(
            plate, force=plate.force + more, moment=plate.moment + np.cross(at if acts_there else plate.cop, more)
        )

    return recording.with_plates(tuple(of(plate) for plate in recording.plates))


def test_a_force_that_both_feet_share_turns_no_plate(monkeypatch: pytest.MonkeyPatch) -> None:
    """With the axis of one of them turned it cancels, and with it what the movement needs."""
    squat = trial("squat")
    shared = 30.0 * np.sin(2.0 * np.pi * 0.4 * squat.time)[:, None] * forward_of_squat()
    pushed = with_forces(squat, lambda force: force + shared)
    person().prepare(pushed)
    monkeypatch.setattr(axes, "EXPLAINS", np.inf)
    with pytest.raises(RecordingError, match="does not fit the motion"):
        person().prepare(pushed)


@pytest.mark.parametrize("mass_kg", [0.0, 1.0, 6.0, 12.0])
def test_what_is_carried_in_the_hands_is_said(mass_kg: float) -> None:
    squat = trial("squat")
    who = Subject(mass_kg=70.0 + mass_kg, height_m=1.75, sex="male")
    ready = Estimator(load_model("fullbody", who)).prepare(holding(squat, mass_kg))
    said = [message.text for message in about(ready.messages, "carried")]
    assert len(said) == (mass_kg > 2.0)
    if said:
        (found,) = re.findall("as if about ([0-9]+) kg were carried in the hands", said[0])
        assert abs(int(found) - mass_kg) < 3.0


def test_a_load_in_the_hands_also_presses_where_these_are() -> None:
    """A squat with the arms held forward, and nothing in them, was said to carry 6 kg: by 4 N, while 0.045 m of the
    centre of pressure were lacking."""
    who = Subject(mass_kg=94.0, height_m=1.75, sex="male")
    ready = Estimator(load_model("fullbody", who)).prepare(holding(trial("squat"), 24.0, acts_there=False))
    assert not about(ready.messages, "carried")


@pytest.mark.parametrize(
    ("carried_kg", "reach_m", "off_m", "there"),
    [
        (6.0, 0.5, 0.0, True),
        (6.0, 0.5, -0.015, True),  # the model's centre of mass is off by so much
        (0.0, 0.5, 0.0, False),
        (0.0, 0.5, 0.015, False),
        (0.0, 0.2, 0.0, True),  # too near to tell
    ],
)
def test_where_a_load_in_the_hands_presses(carried_kg: float, reach_m: float, off_m: float, there: bool) -> None:
    still = np.zeros((50, 3))
    body, hands = (np.tile([along, up, 0.0], (50, 1)) for along, up in ((0.0, 1.0), (reach_m, 1.2)))
    pressed = np.full((50, 2), [carried_kg / 70.0 * reach_m + off_m, 0.0])
    centre = MassCentre(body, still, np.ones(50, dtype=bool))
    needed = cast(Needed, SimpleNamespace(centre=centre, initial=SimpleNamespace(weighed_kg=70.0)))
    assert _presses_there(needed, centre.known, pressed, hands, still, 6.0) == there


@pytest.mark.parametrize(
    ("kg", "first_s", "end_s", "told"),
    [
        (4.0, 3.0, 8.0, True),
        (4.0, 0.0, 4.0, True),  # put down
        (4.0, 2.0, 6.0, True),
        (1.0, 3.0, 8.0, False),
        (4.0, 3.0, 3.2, False),  # no longer than a pull
        (-4.0, 3.0, 8.0, False),  # a hand that leans on something
    ],
)
def test_a_load_that_one_hand_takes_up_is_carried(kg: float, first_s: float, end_s: float, told: bool) -> None:
    """The plate of that side gives more, and stays so: "plate 1 shows 10.30 times what plate 2 does", and the shoulder
    was 11 N m off, said to 1.3."""
    squat = trial("squat")
    up = np.abs(squat.plates[0].force).mean(axis=0).argmax()
    more = np.zeros((squat.n_frames, 3))
    more[:, up] = kg * GRAVITY_M_S2 * np.interp(squat.time, [first_s - 0.2, first_s, end_s, end_s + 0.2], [0, 1, 1, 0])
    ready = person().prepare(with_forces(squat, lambda force: force + more, 0))
    said = [message.text for message in about(ready.messages, "carried")]
    assert len(said) == told and not about(ready.messages, "gain")
    assert not told or "about 4 kg were carried in the hands" in said[0]


@pytest.mark.parametrize("times", [0.96, 1.0, 1.01, 1.04, 1.08])
def test_what_plates_carry_beyond_the_mass_may_be_in_the_hands(times: float) -> None:
    """A box of 2.9 kg had L5/S1 14 N m off, said to 6, under a clean verdict; nothing is said to be absent by it."""
    squat = trial("squat")
    ready = person().prepare(with_forces(squat, lambda force: times * force))
    said = [message for message in about(ready.messages, "carried") if "more than the mass" in message.text]
    assert ready.ground.in_hands_kg == (pytest.approx(70.0 * (times - 1.0), abs=0.3) if times > 1.02 else 0.0)
    assert [message.level for message in said] == (["note"] if times == 1.04 else [])  # at 1.08 the mass is doubted
    rows = [text for title, text in model_rows(ready, Settings(), None) if title == "Results"]
    assert all(message.text in rows for message in said)


def test_a_model_without_hands_holds_nothing_in_them() -> None:
    ready = person().prepare(simulate("fullbody", "squat", 7, 5.0).recording).calibrated
    assert more_than_the_mass(ready, 1.04) > 2.0
    spec = copy(ready.spec)
    spec.segments = [segment for segment in spec.segments if not segment.name.startswith("hand_")]
    assert more_than_the_mass(replace(ready, spec=spec), 1.04) == 0.0


def test_a_load_is_looked_for_in_an_hour_as_in_a_minute() -> None:
    excess = np.where(np.arange(360_000) < 90_000, 0.0, 40.0)
    assert _taken_up(excess, 100.0) == pytest.approx(40.0 / GRAVITY_M_S2, rel=0.02)


def test_deviations_hold_what_the_hands_may_hold_and_nothing_is_absent_by_it() -> None:
    squat = simulate("fullbody", "squat", 7, 5.0).recording
    usual, more = (
        person().run(with_forces(squat, lambda force, times=times: times * force), lag_s=0.0).data
        for times in (1.0, 1.04)
    )
    np.testing.assert_array_equal(more["moment_source"], usual["moment_source"])
    for name, least in (("elbow_flex_l", 1.3), ("lumbar_extension", 1.1), ("knee_angle_r", 0.0)):
        wider = more["moments_sd"].sel(coordinate=name).mean() / usual["moments_sd"].sel(coordinate=name).mean()
        assert wider > least, name
        assert (wider < 1.1) == (name == "knee_angle_r")


def test_moments_that_bear_what_is_carried_are_absent() -> None:
    """Elbows were 7 N m off and said to 1."""
    squat = trial("squat")
    who = Subject(mass_kg=82.0, height_m=1.75, sex="male")
    data = Estimator(load_model("fullbody", who)).run(holding(squat, 12.0), lag_s=0.0).data
    absent = {str(name) for name in data["coordinate"].values[(data["moment_source"].values == ABSENT).all(axis=0)]}
    assert {"lumbar_extension", "arm_flex_r", "elbow_flex_l"} <= absent
    assert not absent & {"hip_flexion_r", "knee_angle_l", "ankle_angle_r"}
    assert data["moments"].sel(coordinate="elbow_flex_l").isnull().all()


def forward_of_squat() -> np.ndarray:
    """Unit vector (3,), laboratory frame."""
    ahead: np.ndarray = prepared("squat").calibrated.ground.vectors_to_laboratory(np.array([1.0, 0.0, 0.0]))
    return ahead


def no_shear(errors: PlateErrors) -> bool:
    """Whether nothing is off, nor said, of the horizontal forces."""
    none = errors.shear_zero_n == (0.0, 0.0) and errors.shear_gain_error == 0.0
    return none and not (errors.unmeasured or about(errors.said, "zero"))


@pytest.mark.parametrize("each_n", [0.0, 2.0, 12.0, 20.0])
def test_plates_that_were_not_zeroed_in_shear_are_told_and_deviations_hold_it(each_n: float) -> None:
    """12 N under each foot had hips 7 to 9 N m off, said to 3; with 15 the mass was called wrong and hips absent."""
    squat = trial("squat")
    off = each_n * forward_of_squat()
    whole, ready = prepared("squat"), person().prepare(with_forces(squat, lambda force: force + off))
    said = [message.text for message in about(ready.messages, "zero")]
    assert len(said) == (each_n > 10.0) and no_shear(whole.ground.errors)
    assert not about(warnings_of(ready.messages), "weight")
    assert ready.ground.loads is not None and ready.ground.loads.total_known.all()
    contacts = (whole.measured.contacts, ready.measured.contacts)
    sd = [np.sqrt(each.covariance[100, 0, 0]) for each in contacts if each is not None]
    if said:
        assert f"by {2.0 * each_n:.0f} N" in said[0] or f"by {2.0 * each_n + 1.0:.0f} N" in said[0]
        assert sd[1] == pytest.approx(2.0 * each_n, rel=0.1)
    else:
        assert sd[1] == pytest.approx(sd[0], rel=0.05)


@pytest.mark.parametrize(
    ("contact", "each_n", "told", "bears"),
    [("seat", 12.0, True, False), ("hand_right", 12.0, False, True), ("hand_right", 25.0, True, False)],
)
def test_a_declared_contact_switches_no_check_off(contact: str, each_n: float, told: bool, bears: bool) -> None:
    """Plates that were not zeroed are named where the moments say that nothing pulls at the hand. Where these do not
    tell, both may be: the hand bears by a prior, and the feet's deviations hold the zero."""
    squat = trial("squat")
    off = each_n * forward_of_squat()
    ready = person(contact).prepare(with_forces(squat, lambda force: force + off))
    said = about(ready.messages, "zero")
    assert len(said) == 1 and bool(warnings_of(said)) == told
    assert ready.ground.bears.all() == ready.ground.bears.any() == bears
    assert np.hypot(*ready.ground.errors.shear_zero_n) == pytest.approx(2.0 * each_n, abs=1.5)
    assert not about(prepared("squat", contact).messages, "zero")


def test_what_a_declared_hand_may_bear_without_that_it_shows_is_held_by_deviations() -> None:
    """3 % of the weight in both hands had elbows 1.9 N m off, said to 0.9."""
    assert prepared("squat", "hand_right").ground.in_hands_kg == pytest.approx(0.03 * 70.0)
    assert not prepared("squat", "seat").ground.in_hands_kg


@pytest.mark.parametrize("zero_n", [0.0, 20.0])
def test_an_error_of_the_motion_that_each_step_repeats_is_no_zero_of_the_plates(zero_n: float) -> None:
    """Of legs that alone are marked: where the vertical force does not close the horizontal one errs too, and what is
    left does not average out (22 N of plates in order)."""
    needed = Needed.__new__(Needed)
    needed.time = np.arange(400) / 100.0
    needed.rate, needed.weight, needed.whole, needed.known = 100.0, 600.0, False, np.ones(400, dtype=bool)
    step = np.sin(2.0 * np.pi * needed.time / 0.5)
    needed.force = np.stack([30.0 * step, 600.0 + 200.0 * np.maximum(step, 0.0), np.zeros(400)], axis=1)
    force = np.tile([zero_n, 600.0, 0.0], (400, 1))
    assert np.nanmean((needed.closed(force) - needed.force)[:, 0]) > zero_n + 9.0
    found = found_shear(needed, force)
    assert len(found.said) == (zero_n > 0.0)
    np.testing.assert_allclose(found.shear_zero_n, [zero_n, 0.0], atol=0.5)


@pytest.mark.parametrize(("gain", "told"), [(0.5, True), (0.9, False), (1.0, False), (1.5, True)])
def test_shear_of_another_gain_is_told(gain: float, told: bool) -> None:
    walk = trial("gait")
    up = int(np.argmax(np.abs(walk.plates[0].force).mean(axis=0)))
    gains = np.where(np.arange(3) == up, 1.0, gain)
    ready = person().prepare(with_forces(walk, lambda force: force * gains))
    assert bool(about(ready.messages, "gain")) == told
    assert (ready.ground.errors.shear_gain_error > 0.3) == told


def test_nothing_is_said_of_the_shear_of_real_plates(data_dir: Path) -> None:
    folder = data_dir / "opencap_subject4"
    for name in ("walking1", "squats1"):
        recording = dynakin.read(folder / f"{name}.trc", folder / f"{name}_grf.mot")
        assert no_shear(person().prepare(recording).ground.errors)


def faster(recording: Recording, factor: float) -> Recording:
    """All of it, as if it had been recorded so many times as fast."""
    return replace(recording, time=recording.time / factor)


@pytest.mark.parametrize(
    ("motion", "factor", "contacts"),
    [("gait", 1.2, ()), ("gait", 0.8, ()), ("squat", 1.2, ()), ("squat", 2.0, ()), ("gait", 1.2, ("hand_right",))],
)
def test_a_rate_that_does_not_fit_the_forces_is_told_with_one_that_would(
    motion: str, factor: float, contacts: tuple[str, ...]
) -> None:
    whole = trial(motion)
    said = [message.text for message in about(person(*contacts).prepare(faster(whole, factor)).messages, "rate")]
    assert len(said) == 1 and f"at {100.0 * factor:.4g} Hz" in said[0] and "Correct the rate" in said[0]
    (fits,) = re.findall(r"About ([0-9.]+) Hz would fit", said[0])
    assert float(fits) == pytest.approx(100.0, abs=6.0)


def test_of_a_real_walk_the_rate_is_told_and_of_a_good_one_nothing(data_dir: Path) -> None:
    """Half of its frames are of 0.5 s then."""
    folder = data_dir / "opencap_subject4"
    walk = dynakin.read(folder / "walking1.trc", folder / "walking1_grf.mot")
    for factor in (1.0, 1.2, 2.0):
        said = [message.text for message in about(person().prepare(faster(walk, factor)).messages, "rate")]
        assert len(said) == (factor != 1.0)
        assert not said or "Hz: by the plates" in said[0]


@pytest.mark.parametrize(("pelvis_m", "slope", "told"), [(0.02, 1.4, True), (0.001, 1.4, False), (0.001, 2.0, True)])
def test_a_leg_that_kicks_and_weighs_more_than_by_the_table_is_no_wrong_rate(
    pelvis_m: float, slope: float, told: bool
) -> None:
    """The pelvis hardly moves then, out of step; "about 119 Hz would fit" was said of four kicks at 100 Hz."""
    needed = Needed.__new__(Needed)
    needed.time = np.arange(400) / 100.0
    needed.rate, needed.weight, needed.whole, needed.known = 100.0, 600.0, True, np.ones(400, dtype=bool)
    turn = 2.0 * np.pi * needed.time
    up, side = 60.0 * np.sin(turn), np.zeros(400)
    needed.force = np.stack([side, 600.0 + up, side], axis=1)
    needed.root = np.stack([side, 1.0 - pelvis_m * np.sin(turn) + 0.002 * np.cos(turn), side], axis=1)
    found = fitting_rate(needed, np.stack([side, 600.0 + slope * up, side], axis=1))
    assert (found is not None) == told
    assert found is None or found[0] == pytest.approx(100.0 * np.sqrt(slope))


@pytest.mark.parametrize("seconds", [(0.0, 14.0), (5.0, 8.0), (0.3, 1.5)])
def test_a_chair_is_no_wrong_rate(data_dir: Path, seconds: tuple[float, float]) -> None:
    folder = data_dir / "opencap_subject4"
    chair = dynakin.read(folder / "STS1.trc", folder / "STS1_grf.mot").window(*seconds)
    assert not about(person().prepare(chair).messages, "rate")


WEIGHT = 70.0 * GRAVITY_M_S2


@pytest.mark.parametrize(
    ("one", "unit"),
    [
        (0.01 * WEIGHT, "% of the body weight"),
        (4.448, "pounds of force"),
        (GRAVITY_M_S2, "kg of force"),
    ],
)
def test_another_unit_of_the_forces_of_a_walk_is_refused_and_named(one: float, unit: str) -> None:
    walk = trial("gait")
    with pytest.raises(RecordingError, match=f"probably in {unit}: convert them to N in the file"):
        person().prepare(with_forces(walk, lambda force: force / one))


@pytest.mark.parametrize(("one", "unit"), [(WEIGHT, "body weights"), (70.0, "N per kg of body mass")])
def test_forces_in_a_unit_that_makes_them_next_to_nothing_are_not_used_and_the_unit_is_named(
    one: float, unit: str
) -> None:
    """An idle plate that drifts looks the same: the recording is run as one without plates."""
    walk = trial("gait")
    ready = person().prepare(with_forces(walk, lambda force: force / one))
    assert any("carry nobody" in text and f"in {unit}, not N" in text for text in map(str, ready.messages))
    assert not np.isfinite(ready.measured.wrench).any()


def test_another_unit_of_the_forces_of_a_squat_is_named() -> None:
    """It is no reason to refuse: who sits all the time bears as little on the feet."""
    squat = trial("squat")
    ready = person().prepare(with_forces(squat, lambda force: 100.0 / WEIGHT * force))
    assert any("or the forces are in % of the body weight, not N" in text for text in map(str, ready.messages))


def test_who_judges_takes_plates_in_step_too() -> None:
    """Held-out trials and identification ask for the plates by themselves."""
    whole = trial("gait")
    late = brought_into_step(whole, Delay(-0.04, 0.0))
    calibrated = prepared("gait").calibrated
    (there, _), (before, _) = measured_wrench(late, calibrated), measured_wrench(whole, calibrated)
    both = np.isfinite(there).all(axis=1) & np.isfinite(before).all(axis=1)
    assert np.abs(there[both] - before[both])[:, :3].mean() < 2.0


def test_where_plates_end_before_they_are_not_known() -> None:
    whole = trial("gait")
    there = brought_into_step(whole, Delay(0.05, 0.0))
    assert np.isnan(there.plates[0].force[-3:]).all()  # for 20 ms the last one is held
    assert np.isfinite(there.plates[0].force[:-3]).all()


def test_a_seat_that_nobody_declared_is_no_zero_of_the_plates(data_dir: Path) -> None:
    """Feet that push against a seat push forward all the time: it was taken for the plates' zero, and no frame left."""
    folder = data_dir / "opencap_subject4"
    chair = dynakin.read(folder / "STS1.trc", folder / "STS1_grf.mot")
    ready = Estimator(load_model("fullbody", Subject(mass_kg=61.0))).prepare(chair)
    assert not about(ready.messages, "zero") and no_shear(ready.ground.errors)
    assert np.isfinite(ready.measured.wrench).all(axis=1).sum() > 700


UPPER = ("Sternum", "C7", "Shoulder", "humerus", "elbow", "forearm", "wrist")


def legs_of(recording: Recording) -> Recording:
    """With the markers of legs and pelvis alone."""
    kept = [k for k, name in enumerate(recording.marker_names) if not any(word in name for word in UPPER)]
    names = tuple(recording.marker_names[k] for k in kept)
    return replace(recording, markers=recording.markers[:, kept], marker_names=names)


@pytest.mark.parametrize("delay_s", [0.0, 0.02, -0.02, 0.04, -0.06, 0.12])
def test_legs_alone_show_plates_that_are_out_of_step_by_the_vertical_force(delay_s: float) -> None:
    """By 20 ms a hip was 12 N m off, with nothing said and said to 3."""
    walk = legs_of(trial("gait"))
    ready = person().prepare(brought_into_step(walk, Delay(-delay_s, 0.0)))
    said = about(ready.messages, "in step")
    assert [message.level for message in said] == ["warning"] * (delay_s != 0.0)
    for message in said:
        (found,) = re.findall(r"([0-9.]+) ms (?:behind|ahead of) the markers", message.text)
        assert float(found) == pytest.approx(1000.0 * abs(delay_s), abs=8.0)
        assert ("behind" in message.text) == (delay_s > 0.0)
    assert 0.004 < ready.ground.clock_sd_s < 0.012
    if not said:
        assert any("not all of the body is marked" in message.text for message in ready.messages)


def test_plates_that_nothing_judges_may_be_some_milliseconds_out_of_step() -> None:
    """One step on a plate: 20 ms late an ankle was 6.4 N m off, said to 1.2."""
    walk = trial("gait")
    one, whole = (person().prepare(walk.with_plates(walk.plates[k:2])).ground for k in (1, 0))
    assert one.clock_sd_s == UNKNOWN_S and any("is not known here" in message.text for message in one.notes)
    assert whole.clock_sd_s == 0.0 and not any("is not known here" in message.text for message in whole.notes)


def test_a_pelvis_that_nobody_sees_says_nothing_of_the_plates() -> None:
    """A hidden pelvis made plates of a squat contradict each other: what hangs on it is not where the others show."""
    recording = simulate("fullbody", "squat", 3, 6.0).recording
    ready = person().prepare(recording)
    root = [k for k, marker in enumerate(ready.calibrated.spec.markers) if marker.segment == "pelvis"]
    whole = Needed(ready.calibrated, recording.time, ready.measured.markers).known
    for frames, said in ((slice(200, 210), True), (slice(200, 260), False)):
        markers = ready.measured.markers.copy()
        markers[frames, root] = np.nan
        known = Needed(ready.calibrated, recording.time, markers).known
        assert whole[frames].all() and known[frames].all() == said and known[frames].any() == said


@pytest.mark.parametrize(("mass_kg", "told"), [(70.0, False), (76.0, True)])
def test_single_stances_of_a_walk_on_one_plate_tell_a_wrong_mass(mass_kg: float, told: bool) -> None:
    """They need 0.7 to 0.9 of the weight: taken for a runner's, accelerations that may be off hid a mass that was a
    tenth too large."""
    walk = trial("gait")
    most = max(walk.plates, key=lambda plate: float(np.nansum(plate.force[:, 1])))
    ready = person(mass_kg=mass_kg).prepare(walk.with_plates((most,)))
    assert bool(warnings_of(about(ready.messages, "weight"))) == told
    assert ready.ground.load_ratio == pytest.approx(70.0 / mass_kg, abs=0.02)
