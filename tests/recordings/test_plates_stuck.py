"""Plates whose data stand still under a load that does not: rows that repeat, and channels that are dead."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dynakin.messages import warnings_of
from dynakin.recordings.formats.c3d import read_c3d
from dynakin.recordings.formats.c3d_parameters import Parameters
from dynakin.recordings.formats.c3d_plates import shared_channels
from dynakin.recordings.plates.dead import without_dead_channels
from dynakin.recordings.plates.stuck import frozen, vertical_only, without_doubles
from dynakin.recordings.recording import Plate, Recording
from support.made_recordings import write_c3d

N = 200
T = np.arange(N) / 100.0


def step(start: float) -> Plate:
    """A foot that rolls over a plate for 0.7 s, the laboratory's y up."""
    s = np.clip((T - start) / 0.7, 0.0, 1.0)
    load = np.sin(np.pi * s)
    force = np.column_stack([-100.0 * np.sin(2 * np.pi * s), 800.0 * load, 20.0 * load * s])
    return pressed("plate", force, np.column_stack([0.2 * s, 0.0 * s, 0.1 + 0.02 * s**2]))


def pressed(name: str, force: np.ndarray, place: np.ndarray) -> Plate:
    cop = np.where(force[:, 1:2] > 10.0, place, np.nan)
    return Plate(name, force, np.cross(place, force), cop, np.zeros((N, 3)))


def recorded(*plates: Plate) -> Recording:
    return Recording("made", None, T, ("A",), np.zeros((N, 1, 3)), plates, "m", ())


def edited(
    plate: Plate, force: dict[int, float | np.ndarray] | None = None, cop: dict[int, float] | None = None
) -> Plate:
    """A plate some of whose axes are constant."""
    f, place = plate.force.copy(), np.nan_to_num(plate.cop)
    for axis, value in (force or {}).items():
        f[:, axis] = value
    for axis, value in (cop or {}).items():
        place[:, axis] = value
    return pressed("dead", f, place)


GOOD = step(0.9)
PLACE = "its centre of pressure along"


@pytest.mark.parametrize(
    ("dead", "named"),
    [
        (
            edited(step(0.2), cop={0: 0.1, 2: 0.1}),
            f"{PLACE} X and {PLACE} Z never change",
        ),
        (edited(step(0.2), cop={2: 0.1}), f"{PLACE} Z never changes"),
        (edited(step(0.2), force={0: 0.0}), "its Fx never changes"),
        (edited(step(0.2), force={0: 0.0, 2: 3.0}), "its Fx and its Fz never change"),
    ],
)
def test_a_dead_channel_is_named_and_its_press_not_measured(dead: Plate, named: str) -> None:
    found = without_dead_channels(recorded(GOOD, dead))
    (said,) = warnings_of(found.notes)
    assert said.text.startswith(f"dead: {named}") and "from 0.21 to 0.89 s" in said.text
    assert np.isnan(found.plates[1].force[30:80]).all() and np.isfinite(found.plates[1].force[100:]).all()
    assert found.plates[0] is GOOD


@pytest.mark.parametrize(
    "plates",
    [
        (GOOD, step(0.2)),
        tuple(edited(step(at), force={0: 0.0, 2: 0.0}) for at in (0.2, 0.9)),  # vertical forces only
        tuple(edited(step(at), force={2: 0.0}, cop={2: 0.1}) for at in (0.2, 0.9)),  # in a plane
        (edited(step(0.2), force={2: 0.0}, cop={2: 0.1}),),
        (pressed("still", np.tile([5.0, 700.0, 2.0], (N, 1)), np.full((N, 3), 0.1)), GOOD),  # made up: nothing moves
    ],
)
def test_what_is_not_recorded_at_all_is_no_dead_channel(plates: tuple[Plate, ...]) -> None:
    made = recorded(*plates)
    assert without_dead_channels(made) is made


def test_a_centre_of_pressure_that_moves_along_one_axis_on_no_plate_is_that_of_a_plane() -> None:
    made = recorded(edited(GOOD, cop={2: 0.1}), edited(step(0.2), cop={2: 0.4}))
    assert without_dead_channels(made) is made


def tilted(plate: Plate) -> Plate:
    """All of its force along an axis that is not quite vertical."""
    return pressed("tilted", plate.force[:, [1]] * [0.002, 1.0, -0.001], np.nan_to_num(plate.cop))


def noisy(plate: Plate, sd_n: float) -> Plate:
    """Its vertical force, and noise of the others."""
    rng = np.random.default_rng(4)
    force = rng.normal(scale=[sd_n, 0.0, sd_n], size=(N, 3)) + plate.force * [0.0, 1.0, 0.0]
    return pressed("noisy", force, np.nan_to_num(plate.cop))


INCLINED = tuple(
    pressed("inclined", step(at).force[:, [1]] * [0.03, 1.0, 0.0], np.nan_to_num(step(at).cop)) for at in (0.2, 0.9)
)
INWARDS = tuple(
    pressed("inwards", step(0.2).force[:, [1]] * [0.0, 1.0, part], np.nan_to_num(step(0.2).cop))
    for part in (-0.08, 0.08)
)


@pytest.mark.parametrize(
    ("plates", "alone"),
    [
        ((noisy(step(0.2), 1.0), noisy(GOOD, 1.0)), True),
        ((noisy(step(0.2), 8.0), noisy(GOOD, 8.0)), False),
        (INCLINED, True),
        (INWARDS, False),  # hops of two legs
        (tuple(edited(step(at), force={0: 0.0, 2: 0.0}) for at in (0.2, 0.9)), True),
        (tuple(edited(step(at), force={0: 2.0, 2: -1.0}) for at in (0.2, 0.9)), True),  # an amplifier's zero
        ((tilted(step(0.2)), tilted(GOOD)), True),
        ((edited(step(0.2), force={0: 0.0, 2: 0.0}), GOOD), False),  # one that has none is a dead channel's
        (tuple(edited(step(at), force={2: 0.0}, cop={2: 0.1}) for at in (0.2, 0.9)), False),  # in a plane
        ((pressed("still", np.tile([0.0, 700.0, 0.0], (N, 1)), np.full((N, 3), 0.1)),), False),  # made up
        ((pressed("empty", np.zeros((N, 3)), np.zeros((N, 3))),), False),
        ((), False),
    ],
)
def test_plates_that_measure_the_vertical_force_alone_are_known(plates: tuple[Plate, ...], alone: bool) -> None:
    made = recorded(*plates)
    assert vertical_only(made) is alone
    if alone:  # what no plate has is no dead channel
        assert without_dead_channels(made) is made


def at(plate: Plate, name: str, moved: float = 0.0) -> Plate:
    place = np.nan_to_num(plate.cop) + np.array([moved, 0.0, 0.0])
    return replace(pressed("", plate.force, place), name=name)


def test_a_plate_that_is_listed_twice_is_one() -> None:
    first = at(GOOD, "plate 1")
    found = without_doubles(recorded(first, at(step(0.2), "plate 2"), at(GOOD, "plate 3")))
    assert [plate.name for plate in found.plates] == ["plate 1", "plate 2"] and found.plates[0] is first
    (said,) = warnings_of(found.notes)
    assert said.text.startswith("plate 1 and plate 3 hold the same forces in every row, at the same place")
    assert "plate 3 is left out" in said.text


def test_the_same_rows_at_different_places_are_measured_at_none() -> None:
    other = at(step(0.2), "plate 2")
    found = without_doubles(recorded(at(GOOD, "plate 1"), other, at(GOOD, "plate 3", moved=0.5)))
    assert np.isnan(found.plates[0].force).all() and np.isnan(found.plates[2].force).all()
    assert found.plates[1] is other
    (said,) = warnings_of(found.notes)
    assert "plate 1 and plate 3" in said.text and "Neither is measured" in said.text


def test_halves_of_a_movement_in_a_plane_are_no_doubles() -> None:
    halves = [at(edited(GOOD, force={2: 0.0}, cop={2: 0.1}), f"plate {k}", moved=0.5 * k) for k in (0, 1)]
    made = recorded(*halves)
    assert without_doubles(made) is made


def test_plates_with_loads_of_their_own_or_none_are_no_doubles() -> None:
    noisy = at(GOOD, "plate 3")
    noisy = replace(noisy, force=noisy.force + np.random.default_rng(1).normal(0.0, 0.1, noisy.force.shape))
    empty = [pressed(f"plate {k}", np.zeros((N, 3)), np.zeros((N, 3))) for k in (4, 5)]
    made = recorded(at(GOOD, "plate 1"), at(step(0.2), "plate 2"), noisy, *empty)
    assert without_doubles(made) is made


def rows() -> np.ndarray:
    return np.hstack([GOOD.force, GOOD.moment])


def lost_in(data: np.ndarray, rate: float = 100.0) -> np.ndarray:
    return np.flatnonzero(frozen(data, data[:, 1], rate))


@pytest.mark.parametrize("after", [None, np.nan])
def test_rows_that_repeat_until_nothing_follows_are_frozen(after: float | None) -> None:
    data = rows()
    data[120:] = data[120]
    if after is not None:
        data[190:] = after
    np.testing.assert_array_equal(lost_in(data), np.arange(121, N if after is None else 190))


def test_rows_that_repeat_and_then_jump_are_frozen() -> None:
    data = rows()
    data[110:125] = data[110]
    np.testing.assert_array_equal(lost_in(data), np.arange(111, 125))


@pytest.mark.parametrize(
    "data",
    [
        rows(),
        np.repeat(rows()[::10], 10, axis=0),  # brought to a higher rate
        np.round(rows(), -1),
        np.tile([0.0, 700.0, 0.0, 1.0, 2.0, 3.0], (N, 1)),
        np.where(T[:, None] < 1.0, [[0.0, 700.0, 0.0, 1.0, 2.0, 3.0]], 0.0),  # made up: on and off
        np.round(np.random.default_rng(1).normal(size=(N, 6)).cumsum(axis=0) * 0.05 + 700.0),  # standing, rounded
    ],
)
def test_rows_that_are_held_rounded_or_made_up_are_not_frozen(data: np.ndarray) -> None:
    assert not len(lost_in(data))


def test_frozen_samples_of_a_c3d_are_not_measured(tmp_path: Path) -> None:
    t = np.arange(10 * N) / 1000.0
    load = np.clip(np.sin(np.pi * (t - 0.5)), 0.0, None) * (t < 1.5)
    channels = np.stack([60.0 * load, 5.0 * load**2, -800.0 * load, 40.0 * load, 20.0 * load, 0.0 * t])
    channels += np.random.default_rng(2).normal(0.0, 0.3, channels.shape)
    channels[:, 700:900] = channels[:, 700:701]
    corners = np.array([[200.0, 300, 0], [-200, 300, 0], [-200, -300, 0], [200, -300, 0]])
    write_c3d(
        tmp_path / "a.c3d",
        {"LASI": np.full((N, 3), 500.0)},
        kinds=[2],
        channels=channels,
        corners=[corners],
        origins=[[0.0, 0.0, -40.0]],
        per_frame=10,
    )
    found = read_c3d(tmp_path / "a.c3d")
    (said,) = warnings_of(found.notes)
    assert said.text.startswith("plate 1 repeats one and the same row while somebody stands on it, from 0.70 to 0.90 s")
    unknown = np.isnan(found.plates[0].force[:, 2])
    assert unknown[71:90].all() and not unknown[:55].any() and not unknown[105:].any()


@pytest.mark.parametrize(("second", "shared"), [([7, 8, 9, 10, 11, 12], False), ([7, 8, 3, 4, 11, 12], True)])
def test_plates_that_share_channels_are_named(second: list[int], shared: bool) -> None:
    listed = {"CHANNEL": {"value": np.array([[1, 2, 3, 4, 5, 6], second]).T}, "TYPE": {"value": [2, 2]}}
    said = shared_channels(Parameters({"FORCE_PLATFORM": listed}), [0, 1])
    assert list(said) == (["plate 2"] if shared else [])
    for others, each in said.values():
        assert others == ["plate 1"]
        assert each.text.startswith("plate 2 lists the analog channels of plate 1 (numbers 3, 4 ")
