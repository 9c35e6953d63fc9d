"""A marker that is somewhere else from one frame to the next is not where its name says."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dynakin.recordings.formats.trajectories import clean_markers

RATE = 100.0
NAMES = ("r_toe", "r_5meta", "r_calc", "r_ankle", "r_sh2", "r_sh3")
SHAPE = np.array(
    [[0.2, 0.0, 0.0], [0.15, 0.0, 0.07], [0.0, 0.0, 0.0], [0.03, 0.1, 0.03], [0.0, 0.3, 0.0], [0.0, 0.4, 0.05]]
)


def swinging(noise_m: float = 1e-3, rate: float = RATE) -> tuple[np.ndarray, np.ndarray]:
    """A foot and shank that turn by 60 deg within 0.25 s and go on by 1.2 m/s."""
    time = np.arange(int(3.0 * rate)) / rate
    turn = 0.5 * np.sin(2.0 * np.pi * time)
    c, s, o = np.cos(turn), np.sin(turn), 0.0 * turn
    rotation = np.stack([np.stack([c, -s, o], 1), np.stack([s, c, o], 1), np.stack([o, o, o + 1.0], 1)], 1)
    markers = np.einsum("tij,kj->tki", rotation, SHAPE) + 1.2 * time[:, None, None] * [1.0, 0.0, 0.0]
    return time, markers + np.random.default_rng(0).normal(0.0, noise_m, markers.shape)


def cleaned(time: np.ndarray, markers: np.ndarray) -> tuple[np.ndarray, list[str]]:
    found, notes = clean_markers(NAMES, markers, time, Path("walk.trc"))
    return found, [str(note) for note in notes if note.level == "warning"]


@pytest.mark.parametrize("noise_m", [1e-5, 1e-3])
@pytest.mark.parametrize("by_m", [[0.0, 0.03, 0.0], [0.0, 0.0, 0.03], [0.015, 0.0, -0.015]])
def test_between_a_jump_and_the_jump_back_a_marker_is_missing(noise_m: float, by_m: list[float]) -> None:
    time, markers = swinging(noise_m)
    markers[160:180, 0] += by_m
    found, said = cleaned(time, markers)
    missing = np.isnan(found[..., 0])
    assert missing[160:180, 0].all() and missing.sum() == 20
    assert len(said) == 1 and "r_toe by" in said[0] and "from 1.60 to 1.79 s" in said[0]


def test_a_marker_that_slips_is_missing_from_then_on() -> None:
    time, markers = swinging()
    markers[160:, 0] += [0.0, 0.02, 0.0]
    found, said = cleaned(time, markers)
    assert np.isnan(found[160:, 0]).all() and np.isfinite(found[:160]).all() and np.isfinite(found[:, 1:]).all()
    assert len(said) == 1 and "do not come back" in said[0]


def test_a_marker_that_finds_its_place_at_the_start_keeps_it() -> None:
    time, markers = swinging()
    markers[:10, 0] += [0.0, 0.05, 0.0]
    found, _ = cleaned(time, markers)
    assert np.isnan(found[:10, 0]).all() and np.isfinite(found[10:]).all()


def test_after_a_gap_a_marker_is_found_anew() -> None:
    time, markers = swinging()
    markers[150:160, 0] += [0.0, 0.05, 0.0]
    markers[160:170, 0] = np.nan
    found, _ = cleaned(time, markers)
    assert np.isnan(found[150:170, 0]).all() and np.isfinite(found[170:]).all()


def test_one_that_creeps_back_is_measured_again() -> None:
    time, markers = swinging(1e-4)
    markers[100:160, 0] += np.linspace(1.0, 0.0, 60)[:, None] * [0.04, 0.0, 0.0]
    found, _ = cleaned(time, markers)
    assert np.isnan(found[100:140, 0]).all() and np.isfinite(found[165:]).all()


@pytest.mark.parametrize("pairs", [[(0, 1)], [(4, 5)]])
def test_labels_that_are_swapped_for_a_while_are_put_right(pairs: list[tuple[int, int]]) -> None:
    time, markers = swinging()
    wrong = markers.copy()
    for a, b in pairs:
        wrong[160:190, [a, b]] = markers[160:190, [b, a]]
    found, said = cleaned(time, wrong)
    np.testing.assert_array_equal(found, markers)
    assert len(said) == 1 and all(f"{NAMES[a]} and {NAMES[b]} from 1.60 to 1.89 s" in said[0] for a, b in pairs)


@pytest.mark.parametrize("noise_m", [1e-5, 1.5e-3, 3e-3])
@pytest.mark.parametrize("rate", [30.0, 60.0, 100.0, 200.0])
def test_a_fast_foot_is_no_jump(noise_m: float, rate: float) -> None:
    time, markers = swinging(noise_m, rate)
    found, said = cleaned(time, markers)
    assert np.isfinite(found).all() and not said


def test_one_who_is_carried_off_by_a_dropped_frame_does_not_jump() -> None:
    """All markers do: that is said as what it is."""
    time, markers = swinging(1e-4)
    found, said = cleaned(time[:-3], np.delete(markers, slice(150, 153), axis=0))
    assert np.isfinite(found).all() and all("jump" not in text for text in said)


def test_a_jump_by_which_a_marker_comes_home_ends_what_began_unseen() -> None:
    """It crept away; what follows the jump is its place, not what went before."""
    time, markers = swinging(1e-4)
    markers[100:160, 0] += np.linspace(0.0, 1.0, 60)[:, None] * [0.04, 0.0, 0.0]
    found, said = cleaned(time, markers)
    assert np.isnan(found[125:160, 0]).all() and np.isfinite(found[160:]).all() and np.isfinite(found[:100]).all()
    assert len(said) == 1 and "do not come back" not in said[0]


@pytest.mark.parametrize("seed", range(5))
def test_noise_of_which_one_direction_has_the_most_is_no_jump(seed: int) -> None:
    time, markers = swinging(1e-5)
    markers[..., 2] += np.random.default_rng(seed).normal(0.0, 3e-3, markers.shape[:2])
    found, said = cleaned(time, markers)
    assert not said and np.isfinite(found).all()
