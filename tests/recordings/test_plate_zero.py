"""Zeros of plates: FORCE_PLATFORM:ZERO of a C3D, and plates that were never zeroed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dynakin.recordings.checks import check_plates
from dynakin.recordings.formats.c3d import read_c3d
from dynakin.recordings.frame import find_ground_frame
from dynakin.recordings.plates.zero import zero_of
from dynakin.recordings.recording import Plate
from support.made_c3d import made_c3d
from support.made_recordings import standing

FRAMES, PER_FRAME = 200, 10
STEP = np.repeat(np.clip(np.sin(np.pi * (np.arange(FRAMES) - 50) / 80.0), 0.0, None), PER_FRAME)
STEP *= np.repeat((np.arange(FRAMES) > 50) & (np.arange(FRAMES) < 130), PER_FRAME)
PUSH = np.stack([60.0 * STEP, 10.0 * STEP, -800.0 * STEP, 40.0 * STEP, 20.0 * STEP, 0.0 * STEP])
CORNERS = np.array([[200.0, 300, 0], [-200, 300, 0], [-200, -300, 0], [200, -300, 0]])
UNITS = ["N"] * 3 + ["Nm"] * 3
OFFSET = np.array([[15.0], [-20.0], [-40.0], [3.0], [2.0], [-0.5]])


def zeroed(
    path: Path, channels: np.ndarray, zero: tuple[int, ...], markers: dict[str, np.ndarray], kind: int = 2
) -> tuple[np.ndarray, list[str]]:
    """Forces (T, 3) N that are read, and what is said of the zero; markers in m."""
    plate = {
        "USED": 1,
        "TYPE": [kind],
        "CHANNEL": np.arange(1, 7).reshape(6, 1),
        "CORNERS": CORNERS.T[:, :, None],
        "ORIGIN": np.array([[0.0], [0.0], [-40.0]]),
    }
    made_c3d(
        path,
        {"LASI": np.full((FRAMES, 3), 500.0)} | {name: 1000.0 * place for name, place in markers.items()},
        {"FORCE_PLATFORM": plate | ({"ZERO": list(zero)} if zero else {}), "ANALOG": {"UNITS": UNITS}},
        analog=channels,
        per_frame=PER_FRAME,
    )
    recording = read_c3d(path)
    said = [note for note in map(str, recording.notes) if "FORCE_PLATFORM:ZERO" in note]
    return recording.plates[0].force, said


@pytest.mark.parametrize(
    ("zero", "heel_m", "taken_off"),
    [
        ((1, 20), 0.6, True),
        ((20, 20), 0.6, True),
        ((1, 20), 0.05, False),  # somebody stands on it then
        ((1, 0), 0.6, False),
        ((0, 0), 0.6, False),
        ((100, 300), 0.6, False),  # frames that are not there
        ((), 0.6, False),
    ],
)
def test_the_zero_that_the_file_gives_is_taken_off(
    tmp_path: Path, zero: tuple[int, ...], heel_m: float, taken_off: bool
) -> None:
    def read(name: str, channels: np.ndarray, zero: tuple[int, ...]) -> np.ndarray:
        force, said = zeroed(tmp_path / name, channels, zero, {"LHEE": np.full((FRAMES, 3), [0.0, 0.0, heel_m])})
        assert len(said) == (zero in ((1, 20), (20, 20)))
        return force

    clean, found = read("a.c3d", PUSH, ()), read("b.c3d", PUSH + OFFSET, zero)
    apart = np.abs(found - clean)[60:120].max()
    assert apart < 1e-3 if taken_off else apart > 30.0


SEATED = np.repeat([[0.0], [0.0], [-500.0], [0.0], [0.0], [0.0]], FRAMES * PER_FRAME, axis=1)
PELVIS = np.full((FRAMES, 3), [0.0, 0.0, 0.55])


@pytest.mark.parametrize("part", [1.0, 0.02])  # of the frames of the zero: a mean of 500 N, and of 10 N
def test_a_persons_weight_is_no_zero(tmp_path: Path, part: float) -> None:
    """A seat's plate: no marker is low over it, the feet are on another one."""
    channels = SEATED.copy()
    channels[:, : round((1.0 - part) * FRAMES * PER_FRAME)] = 0.0
    feet = np.full((FRAMES, 3), [0.0, 0.9, 0.05])
    force, said = zeroed(tmp_path / "a.c3d", channels, (1, FRAMES), {"PELVIS": PELVIS, "LHEE": feet})
    assert np.abs(force[-3:-1]).max() > 450.0
    assert len(said) == 1 and f"plate 1: it reads {500.0 * part:.0f} N on average, and" in said[0]
    assert "they are not taken for its zero" in said[0]


def test_frames_in_which_nobody_is_seen_are_no_zero(tmp_path: Path) -> None:
    places = PELVIS.copy()
    places[:20] = np.nan
    hidden = {"LASI": places, "PELVIS": places}
    force, said = zeroed(tmp_path / "a.c3d", PUSH + OFFSET, (1, 20), hidden)
    clean, _ = zeroed(tmp_path / "clean.c3d", PUSH, (), hidden)
    np.testing.assert_allclose(np.linalg.norm((force - clean)[90]), np.linalg.norm(OFFSET[:3]), rtol=1e-3)
    assert len(said) == 1 and "plate 1: no marker is seen in frames 1 to 20" in said[0]
    _, said = zeroed(tmp_path / "b.c3d", PUSH + OFFSET, (1, 21), hidden)
    assert len(said) == 1 and "was taken off as its zero" in said[0]


def test_that_centres_of_pressure_have_no_zero_is_said(tmp_path: Path) -> None:
    """Of type 1."""
    off = np.add(PUSH, [[15.0], [-20.0], [-40.0], [0.0], [0.0], [0.0]])
    force, said = zeroed(tmp_path / "a.c3d", off, (1, 20), {"PELVIS": PELVIS}, kind=1)
    clean, _ = zeroed(tmp_path / "b.c3d", off, (), {"PELVIS": PELVIS}, kind=1)
    np.testing.assert_array_equal(force, clean)
    assert len(said) == 1 and "plate 1: its mean in frames 1 to 20" in said[0] and "was not taken off" in said[0]


def test_a_plate_that_is_loaded_wherever_the_feet_are_is_to_be_zeroed() -> None:
    """It was refused for its place."""
    made = standing(70.0)
    plate = made.plates[0]
    at = plate.cop + np.array([0.0, 0.0, 2.0])
    force = np.tile([0.0, 60.0, 0.0], (made.n_frames, 1))
    never = replace(plate, name="plate 3", force=force, cop=at, moment=np.cross(at, force), corners=None)
    walks = made.markers + np.linspace(0.0, 1.5, made.n_frames)[:, None, None] * [0.0, 0.0, 1.0]
    recording = replace(made, markers=walks).with_plates((never,))
    found = check_plates(
        recording, find_ground_frame(recording, vertical="+Y"), None, {"left": ["LHEE", "LTOE"], "right": ["RHEE"]}
    )
    assert found.refusal is not None and "plate 3 reads 60 N and never nothing, wherever the feet are" in found.refusal
    assert "zero it with nobody on it" in found.refusal


def plate_of(path: Path, off: np.ndarray | float) -> tuple[Plate, list[str]]:
    """Of a step with so much more push throughout (N), and what is said of it."""
    channels = PUSH.copy()
    channels[2] -= off
    zeroed(path, channels, (), {"LHEE": np.tile([0.0, 0.0, 0.6], (FRAMES, 1))})
    recording = read_c3d(path)
    return recording.plates[0], [str(said) for said in recording.notes if "nobody stands" in str(said)]


def test_what_a_plate_reads_steadily_below_nothing_is_taken_off(tmp_path: Path) -> None:
    """No load pulls: under a foot it is missing as well."""
    clean, said = plate_of(tmp_path / "clean.c3d", 0.0)
    assert not said
    for off, word in ((-30.0, "Warning: plate 1 reads -30 N"), (-5.0, "plate 1 reads -5 N")):
        found, said = plate_of(tmp_path / "a.c3d", off)
        np.testing.assert_allclose(found.force, clean.force, atol=1e-6)
        np.testing.assert_allclose(found.moment, clean.moment, atol=1e-6)
        assert found.empty_n == 0.0
        assert said == [f"{word} where nobody stands on it: it is taken off over the whole trial."]


def test_a_plate_that_drifts_below_nothing_keeps_it_in_mind(tmp_path: Path) -> None:
    """It is 0 while the plate is empty, and missing under a foot: nobody knows how much."""
    clean, _ = plate_of(tmp_path / "clean.c3d", 0.0)
    drift = np.linspace(-5.0, -45.0, PUSH.shape[1])
    found, said = plate_of(tmp_path / "a.c3d", drift)
    assert -45.0 < found.empty_n < -5.0 and "but not steadily (not taken off as it is read)" in said[0]
    loaded = np.linalg.norm(clean.force, axis=1) > 1.0
    assert np.abs(found.force[~loaded]).max() < 1.0 and np.linalg.norm(found.force - clean.force, axis=1).max() > 10.0


def test_a_sample_that_is_missing_takes_no_other_with_it(tmp_path: Path) -> None:
    """Of a moment's channel: its median over the idle frames was none."""
    off = np.full(PUSH.shape[1], -20.0)
    off[40:60] = np.nan
    found, said = plate_of(tmp_path / "a.c3d", off)
    assert len(said) == 1 and np.isfinite(found.wrench).all(axis=1).mean() > 0.8


def test_a_plate_that_pulls_is_empty_there_whatever_it_reads_otherwise(tmp_path: Path) -> None:
    off = np.where(np.arange(PUSH.shape[1]) > 0.9 * PUSH.shape[1], -300.0, 4.0)
    found, _ = plate_of(tmp_path / "a.c3d", off)
    assert np.abs(found.force[-3:]).max() == 0.0


def test_what_may_be_a_light_load_is_left_to_the_markers(tmp_path: Path) -> None:
    found, said = plate_of(tmp_path / "a.c3d", 8.0)
    up = int(np.argmax(found.force.mean(axis=0)))
    assert np.median(found.force[:, up]) == pytest.approx(8.0, abs=0.1) and "or by a light load" in said[0]
    noise, said = plate_of(tmp_path / "b.c3d", -2.0)
    assert noise.empty_n == 0.0 and not said


@pytest.mark.parametrize("part", [0.4, 0.7, 1.0])
def test_a_handle_that_is_pulled_keeps_its_load(part: float) -> None:
    """It carries across the plate's normal, where it read -60 N before and nothing during the pull."""
    handle = np.tile([0.0, -6.0, 0.0, 0.0, 0.0, 0.0], (1000, 1))
    handle[: round(1000 * part), 0] = 60.0
    found = zero_of("plate 9", handle, np.array([0.0, 1.0, 0.0]), 1000.0)
    assert not found.wrench.any() and found.reads_n == -6.0
    assert "plate 9 reads -6 N where nobody stands on it, but with a load across it (not" in str(found.said[0])


def test_a_short_pull_leaves_the_zero_of_the_rest() -> None:
    handle = np.tile([2.0, -6.0, 1.0, 0.0, 0.0, 0.0], (1000, 1))
    handle[:100, 0] = 60.0
    found = zero_of("plate 9", handle, np.array([0.0, 1.0, 0.0]), 1000.0)
    np.testing.assert_allclose(found.wrench[:3], [2.0, -6.0, 1.0])


@pytest.mark.parametrize("rate", [1000.0, 100.0])
@pytest.mark.parametrize("noise_n", [0.5, 7.0])
def test_noise_is_no_handle_that_is_pulled(noise_n: float, rate: float) -> None:
    """From 5.6 N of it a fifth of the single samples lies farther off than a steady load may."""
    zero = np.array([4.5, -15.0, 6.0, 0.3, -0.2, 0.1])
    read = zero + np.random.default_rng(1).normal(0.0, 1.0, (4000, 6)) * ([noise_n] * 3 + [0.1 * noise_n] * 3)
    read[1500:2500, 1] += 700.0
    found = zero_of("plate 1", read, np.array([0.0, 1.0, 0.0]), rate)
    np.testing.assert_allclose(found.wrench, zero, atol=0.1 * noise_n)
    assert found.reads_n == 0.0 and found.said[0].level == "warning"
    pulled = read + np.outer(np.arange(4000) > 2800, [60.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    assert not zero_of("plate 1", pulled, np.array([0.0, 1.0, 0.0]), rate).wrench.any()
