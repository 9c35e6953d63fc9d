"""A plate, or one of its sensors, whose gain is not that of the others, by the motion of the centre of mass."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

import dynakin
from dynakin import Estimator, Subject, load_model
from dynakin.arrays import widened
from dynakin.filter.contacts import carry
from dynakin.filter.ground.expected import plate_covariances
from dynakin.filter.ground.gain import SENSOR_M, found_gains
from dynakin.filter.ground.needed import Needed
from dynakin.filter.prepared import Prepared
from dynakin.messages import about, warnings_of
from dynakin.recordings.feet.loads import MEASURED, UNKNOWN
from dynakin.recordings.recording import Plate
from support.plates import person, prepared, scaled, trial, with_plate
from support.simulated import simulate


def said_of_gains(ready: Prepared) -> list[str]:
    return [message.text for message in about(ready.messages, "gain")]


def gain_error(ready: Prepared) -> np.ndarray:
    """(T, F)."""
    assert ready.ground.loads is not None
    return ready.ground.errors.gain_error_of_feet(ready.ground.loads)


@pytest.mark.parametrize("part", [0.9, 1.1])
@pytest.mark.parametrize("mass_kg", [70.0, 73.0])
def test_a_plate_of_another_gain_is_named_whatever_the_person_weighs(part: float, mass_kg: float) -> None:
    recording = with_plate(trial("gait"), 1, scaled(part))
    ready, right = person(mass_kg=mass_kg).prepare(recording), prepared("gait", mass_kg=mass_kg)
    (text,) = said_of_gains(ready)
    assert "plate 2 shows" in text and not said_of_gains(right) and not gain_error(right).any()
    assert float(text.split("plate 2 shows ")[1].split()[0]) == pytest.approx(part, abs=0.02)
    on = recording.plates[1].force[:, 1] > 20.0
    assert gain_error(ready)[on].max(axis=1) == pytest.approx(abs(1.0 - 1.0 / part), abs=0.02)
    assert not gain_error(ready)[~widened(on, 10)].any()
    assert not any("something that no plate measures" in str(message) for message in ready.messages)


@pytest.mark.parametrize(("part", "told"), [(1.1, True), (1.2, False)])
def test_a_declared_hand_is_not_what_a_plate_is_off_by(part: float, told: bool) -> None:
    """It "bore up to 112 N" that were there at the plate alone: an ankle was 12 N m off, said to 4. Where moments do
    not tell which of the two it is, the foot's deviations hold it as well, and a note says so."""
    ready = person("hand_right").prepare(with_plate(trial("gait"), 1, scaled(part)))
    (said,) = about(ready.messages, "gain")
    assert "plate 2 shows" in said.text and (said in warnings_of(ready.messages)) == told
    assert gain_error(ready).max() > 0.08
    assert not said_of_gains(prepared("gait", "hand_right"))


@pytest.mark.parametrize("seed", [3, 4])
def test_a_rail_that_is_declared_is_no_gain(seed: int) -> None:
    held = simulate("fullbody", "belt", seed, 6.0, 50.0, 70.0, 1.75, "male", rail=0.1).recording
    ready = person("hand_right").prepare(held)
    assert not said_of_gains(ready) and ready.ground.bears.any()


def test_deviations_of_moments_hold_what_a_plate_is_off_by() -> None:
    """Of the ankle and the knee over it, in the one stance on it."""
    walk = trial("gait").window(0.0, 2.4)
    recording = with_plate(walk, 1, scaled(1.06))
    found, right = person().run(recording), person().run(walk)
    on = recording.plates[1].force[:, 1] > 300.0
    sides = ["ankle_angle_r", "ankle_angle_l", "knee_angle_r", "knee_angle_l"]
    wrong, true, sd, usual = (
        each.sel(coordinate=sides).values[on]
        for each in (found.data["moments"], right.data["moments"], found.data["moments_sd"], right.data["moments_sd"])
    )
    off = np.abs(wrong - true)
    assert np.nanmax(off) > 4.0 and (off < 2.0 * np.maximum(sd, 1.0))[np.isfinite(off)].all()
    assert np.nanmax(sd) > 2.0 * np.nanmax(usual)


def test_a_sensor_that_says_too_little_is_found_by_what_the_plate_lacks() -> None:
    """A fifth of one of four: a twentieth of the load, and a centre of pressure that is off by a centimetre."""

    def lacking(plate: Plate) -> Plate:
        assert plate.corners is not None
        middle, corner = plate.corners.mean(axis=0), plate.corners[0]
        place = np.nan_to_num(plate.cop - middle)
        half = corner - middle
        share = 0.25 * (1.0 + place[:, 0] / half[0]) * (1.0 + place[:, 2] / half[2])
        lost = 0.2 * share * plate.force[:, 1]
        force, moment = plate.force.copy(), plate.moment.copy()
        force[:, 1] -= lost
        moment -= np.cross(corner, np.stack([0.0 * lost, lost, 0.0 * lost], axis=1))
        return replace(plate, force=force, moment=moment)

    (text,) = said_of_gains(person().prepare(with_plate(trial("gait"), 1, lacking)))
    assert "plate 2 shows 0.9" in text


def test_of_two_plates_nobody_knows_which_is_wrong(data_dir: Path) -> None:
    folder = data_dir / "opencap_subject4"
    recording = dynakin.read(folder / "walking1.trc", folder / "walking1_grf.mot")
    estimator = Estimator(load_model("fullbody", Subject(mass_kg=60.05, height_m=1.7, sex="female")))
    assert not said_of_gains(estimator.prepare(recording))
    ready = estimator.prepare(with_plate(recording, 0, scaled(1.1)))
    (text,) = said_of_gains(ready)
    one, other = (plate.name for plate in recording.plates)
    assert f"{one} or {other}" in text or f"{other} or {one}" in text
    both = np.stack([plate.force[:, 1] > 20.0 for plate in ready.recording.plates], axis=1).any(axis=1)
    assert (gain_error(ready)[both].max(axis=1) > 0.05).mean() > 0.9


@pytest.mark.parametrize("start_s", [0.9, 1.4, 1.9])
def test_a_hand_that_holds_on_for_a_while_is_no_gain(start_s: float) -> None:
    """A tenth of the weight, which does not follow a plate's load."""
    recording = trial("gait")
    held = 0.1 * np.clip(np.minimum(recording.time - start_s, start_s + 0.4 - recording.time) / 0.05, 0.0, 1.0)
    plates = tuple(scaled(1.0 - held)(plate) for plate in recording.plates)
    assert not said_of_gains(person().prepare(recording.with_plates(plates)))


def gains_of_who_shifts(shift: float, part: float = 1.0, follows: float = 0.0, load: float = 0.0) -> tuple[str, ...]:
    """What is said of the gains of two plates, of 600 N, for 8 s, between which the weight goes to and fro.

    Args:
        shift: part of the weight. part: of what it should, which the first plate says. follows: part of the shift by
            which what is needed is wrong, as of a trunk that no marker shows. load: part of the weight that the first
            plate bears, too, from 3 s on.
    """
    time = np.arange(800) / 100.0
    to_one = shift * np.sin(2.0 * np.pi * 0.3 * time)
    moves = 0.1 * np.sin(2.0 * np.pi * 0.7 * time) + 0.008 * np.sin(2.0 * np.pi * 1.9 * time)
    needed = 1.0 + moves + follows * to_one + 0.004 * np.sin(2.0 * np.pi * 1.1 * time)
    bears = part * (0.5 * (1.0 + moves) + to_one + load * (time > 3.0)), 0.5 * (1.0 + moves) - to_one
    wrenches = np.zeros((2, len(time), 6))
    wrenches[:, :, 1] = 600.0 * np.stack(bears)
    force = np.zeros((len(time), 3))
    force[:, 1] = 600.0 * needed
    everywhere = np.ones(len(time), dtype=bool)
    motion = SimpleNamespace(force=force, known=everywhere, rate=100.0, weight=600.0)
    names = [cast("Plate", SimpleNamespace(name=f"plate {k}")) for k in (1, 2)]
    return tuple(each.text for each in found_gains(cast("Needed", motion), names, wrenches, everywhere).said)


def test_plates_that_bear_alike_have_no_gain_that_can_be_told() -> None:
    """What is needed of a squat of which only the legs are marked was off by what follows the shift of the weight:
    right plates showed 1.49 and 0.58 times what the others did. Where the weight goes over from one to the other such
    an error is none to speak of, and a gain shows."""
    assert not gains_of_who_shifts(0.03, follows=0.3)
    assert not gains_of_who_shifts(0.3) and not gains_of_who_shifts(0.3, follows=0.02)
    (text,) = gains_of_who_shifts(0.3, part=1.1)
    assert "plate 1 shows 1.10" in text or "plate 2 shows 0.91" in text


@pytest.mark.parametrize("load", [0.03, 0.1])
def test_a_load_that_one_hand_takes_up_is_no_gain(load: float) -> None:
    """10 times what the other plate does, of plates that bear alike; some per cent where the weight goes over."""
    assert not gains_of_who_shifts(0.005, load=load)
    assert not gains_of_who_shifts(0.15, load=load)


def test_what_a_gain_is_off_by_is_all_of_the_load_or_one_sensors() -> None:
    place = np.array([1.0, 0.0, 0.3])
    force = np.array([0.0, 800.0, 60.0])
    wrench = np.concatenate([force, np.cross(place, force)])
    there = carry(-place)
    sd = np.sqrt(np.diag(there @ plate_covariances(wrench[None], place[None], gain_error=0.1)[0] @ there.T))
    np.testing.assert_allclose(sd[1], 80.0, rtol=0.02)
    np.testing.assert_allclose(sd[3:], 80.0 * SENSOR_M, rtol=0.02)
    np.testing.assert_allclose(sd[[0, 2]], np.hypot(np.hypot(2.0, 4.0), 6.0), rtol=1e-6)


@pytest.mark.parametrize("too_much_n", [150.0, 220.0])
def test_a_foot_alone_on_a_plate_that_says_too_much_is_not_measured_meanwhile(too_much_n: float) -> None:
    """For 0.3 s, where the foot presses: no gain, and nothing that bears elsewhere."""
    recording = trial("gait")
    on = np.flatnonzero(recording.plates[1].force[:, 1] > 300.0)
    middle = recording.time[on].mean()
    more = too_much_n * (np.abs(recording.time - middle) < 0.15)

    def pushed(plate: Plate) -> Plate:
        force = plate.force + np.stack([0.0 * more, more, 0.0 * more], axis=1)
        return replace(plate, force=force, moment=np.cross(np.nan_to_num(plate.cop), force) + plate.free_moment)

    ready, right = person().prepare(with_plate(recording, 1, pushed)), prepared("gait")
    loads, before = ready.ground.loads, right.ground.loads
    assert loads is not None and before is not None and not said_of_gains(ready)
    stands = loads.on[:, :, 1] & (more > 0.0)[:, None]
    assert (before.reason[stands] == MEASURED).all() and (loads.reason[stands] == UNKNOWN).mean() > 0.9
    other = loads.on[:, :, [0, 2]].any(axis=2) & ~loads.on[:, :, 1]
    assert (loads.reason[other] == before.reason[other]).mean() > 0.95
