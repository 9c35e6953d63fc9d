"""Dead channels of a C3D's plates, one by one as they were recorded: on plates that are turned, with sensors below the
surface, with noise."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dynakin.messages import warnings_of
from dynakin.recordings.formats.c3d import read_c3d
from dynakin.recordings.recording import Recording
from support.made_recordings import write_c3d

FRAMES, PER_FRAME = 200, 10
T = np.arange(FRAMES * PER_FRAME) / (100.0 * PER_FRAME)
DEPTH_M = 0.04
TURN = np.array([[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])
CORNERS = np.array([[250.0, 150, 0], [-250, 150, 0], [-250, -150, 0], [250, -150, 0]]) @ TURN.T
SENSORS_M = (0.2, 0.12)  # of a Kistler plate, from its axes


def walked(start_s: float, seed: int) -> np.ndarray:
    """Fx to Mz (6, N) N and N m, at the sensors, of a foot that rolls over a plate for 0.7 s."""
    s = np.clip((T - start_s) / 0.7, 0.0, 1.0)
    load = np.sin(np.pi * s)
    force = np.stack([100.0 * np.sin(2 * np.pi * s), 20.0 * load * np.cos(5.0 * s), -800.0 * load])
    place = np.stack([0.2 * s - 0.1, 0.01 * np.sin(6.0 * s), np.full_like(s, -DEPTH_M)])
    moment = np.cross(place, force, axis=0) + np.stack([0.0 * load, 0.0 * load, 5.0 * load * np.sin(7.0 * s)])
    noise = np.random.default_rng(seed).normal(scale=np.repeat([[1.0], [0.15]], 3, axis=0), size=(6, len(T)))
    return np.concatenate([force, moment]) + noise


def squatted(seed: int) -> np.ndarray:
    """The same of a foot that stays, whose load changes by a quarter, with a small shear."""
    swing = np.sin(2 * np.pi * 0.7 * T)
    force = np.stack([2.0 * swing, 10.0 + 3.0 * swing, -400.0 + 60.0 * swing])
    place = np.stack([0.02 + 0.02 * swing, 0.003 + 0.002 * swing, np.full_like(T, -DEPTH_M)])
    moment = np.cross(place, force, axis=0) + np.outer([0.0, 0.0, 1.0], swing)
    noise = np.random.default_rng(seed).normal(scale=np.repeat([[1.0], [0.15]], 3, axis=0), size=(6, len(T)))
    return np.concatenate([force, moment]) + noise


def of_kistler(wrench: np.ndarray) -> np.ndarray:
    """Its eight channels."""
    a, b = SENSORS_M
    fx, fy, fz, mx, my, mz = wrench
    return np.stack(
        [
            *(0.5 * fx + sign * 0.25 * mz / b for sign in (-1, 1)),
            *(0.5 * fy + sign * 0.25 * mz / a for sign in (1, -1)),
            *(0.25 * (fz + p * mx / b + q * my / a) for p, q in ((1, -1), (1, 1), (-1, 1), (-1, -1))),
        ]
    )


def recorded(path: Path, kind: int, *plates: np.ndarray) -> Recording:
    """Plates at the same place, which is nothing to a reader."""
    units = ["N"] * 8 if kind == 3 else ["N"] * 3 + ["Nm"] * 3
    origin = [1000.0 * side for side in SENSORS_M] if kind == 3 else [0.0, 0.0]
    write_c3d(
        path,
        {"LASI": np.full((FRAMES, 3), 500.0)},
        kinds=[kind] * len(plates),
        channels=np.concatenate(plates),
        corners=[CORNERS] * len(plates),
        origins=[[*origin, -1000.0 * DEPTH_M]] * len(plates),
        analog_units=units * len(plates),
        per_frame=PER_FRAME,
    )
    return read_c3d(path)


def dead(channels: np.ndarray, which: int, noise: float = 0.0) -> np.ndarray:
    """One of them is: an amplifier's zero, and noise."""
    found = channels.copy()
    found[which] = 3.0 + noise * np.random.default_rng(9).normal(size=len(T))
    return found


@pytest.mark.parametrize("noise", [0.0, 1.0])
@pytest.mark.parametrize(
    ("kind", "which", "name"),
    [
        (2, 0, "Fx"),
        (2, 1, "Fy"),
        (2, 3, "Mx"),
        (2, 4, "My"),
        (2, 5, "Mz"),
        (3, 0, "Fx12"),
        (3, 3, "Fy23"),
        (3, 4, "Fz1"),
    ],
)
def test_a_dead_channel_is_named_and_its_plate_not_measured(
    tmp_path: Path, kind: int, which: int, name: str, noise: float
) -> None:
    good, other = walked(0.2, 1), walked(1.1, 2)
    if kind == 3:
        good, other = of_kistler(good), of_kistler(other)
    size = 0.15 if name[0] == "M" else 1.0
    found = recorded(tmp_path / "a.c3d", kind, good, dead(other, which, noise * size))
    (said,) = warnings_of(found.notes)
    channel = len(good) + which
    assert said.text.startswith(
        f"plate 2: its {name} (channel {channel + 1} of the file, 'ch{channel}') never changes "
    )
    assert np.isfinite(found.plates[0].force).all()
    assert np.isnan(found.plates[1].force[118:172]).all() and np.isfinite(found.plates[1].force[:100]).all()


@pytest.mark.parametrize(("which", "name"), [(0, "Fx"), (1, "Fy"), (4, "My")])
def test_a_dead_channel_of_the_only_plate_that_is_stepped_on_is_named(tmp_path: Path, which: int, name: str) -> None:
    """Its own channel that is nowhere else is no sign of a movement in a plane, because who comes onto it moves all."""
    walk = dead(walked(0.2, 1), which, 0.15 if name[0] == "M" else 0.5)
    for beside in ((), (NOISE,)):
        found = recorded(tmp_path / "a.c3d", 2, walk, *beside)
        assert [said.text[:15] for said in warnings_of(found.notes)] == [f"plate 1: its {name}"]


def test_a_dead_channel_of_who_squats_is_named(tmp_path: Path) -> None:
    found = recorded(tmp_path / "a.c3d", 2, dead(squatted(1), 4, 0.15), squatted(2))
    assert [said.text[:15] for said in warnings_of(found.notes)] == ["plate 1: its My"]
    assert np.isnan(found.plates[0].force).all() and np.isfinite(found.plates[1].force).all()


def in_steps(wrench: np.ndarray) -> np.ndarray:
    """As an amplifier of 12 bits writes it: 1 N, 0.2 N m."""
    step = np.repeat([[1.0], [0.2]], 3, axis=0)
    return np.asarray(np.round(wrench / step) * step)


STILL = np.tile([[0.0], [0.0], [-400.0], [1.0], [2.0], [0.0]], len(T))
NOISE = np.random.default_rng(4).normal(scale=0.2, size=STILL.shape)
ONLY_UP = np.array([[0.0], [0.0], [1.0], [1.0], [1.0], [0.0]])
IN_A_PLANE = np.array([[1.0], [0.0], [1.0], [0.0], [1.0], [0.0]])
NO_SHEAR_ACROSS = np.array([[1.0], [0.0], [1.0], [1.0], [1.0], [1.0]])  # simulated, beside the middle of the plates
FREE_MOMENT = np.array([[1.0], [1.0], [1.0], [1.0], [1.0], [0.0]])


@pytest.mark.parametrize(
    "plates",
    [
        (walked(0.2, 1), walked(1.1, 2)),
        (in_steps(walked(0.2, 1)), in_steps(walked(1.1, 2))),
        (squatted(1), squatted(2)),
        (in_steps(squatted(1)), in_steps(squatted(2))),
        tuple(NO_SHEAR_ACROSS * squatted(k) + NOISE for k in (1, 2)),
        (STILL, STILL + NOISE),  # nobody moves
        (walked(0.2, 1), NOISE),  # nobody is there
        *(tuple(part * walked(at, 1) + NOISE for at in (0.2, 1.1)) for part in (ONLY_UP, IN_A_PLANE, FREE_MOMENT)),
    ],
)
def test_right_plates_and_what_none_of_them_measures_are_not_accused(
    tmp_path: Path, plates: tuple[np.ndarray, ...]
) -> None:
    found = recorded(tmp_path / "a.c3d", 2, *plates)
    assert not [said for said in warnings_of(found.notes) if "never change" in said.text]


def test_a_moment_that_no_plate_has_beside_a_force_that_all_have_is_dead(tmp_path: Path) -> None:
    """No movement in a plane does without it."""
    found = recorded(tmp_path / "a.c3d", 2, dead(walked(0.2, 1), 4), dead(walked(1.1, 2), 4))
    assert [said.text[:15] for said in warnings_of(found.notes)] == ["plate 1: its My", "plate 2: its My"]
