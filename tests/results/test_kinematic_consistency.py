"""Speeds that are not the derivatives of their coordinates are seen and said."""

from __future__ import annotations

import numpy as np
import pytest

from dynakin.results.measures.consistency import mismatch_in_words, speed_mismatch

TIME = np.linspace(0.0, 4.0, 401)
ANGLES = np.stack([np.sin(TIME), 0.2 * np.cos(2.0 * TIME)], axis=1)
ROTATION = np.array([True, True])
SURE = np.array([0.01, 0.01])  # what speeds say of themselves
SPEEDS = np.stack([np.cos(TIME), -0.4 * np.sin(2.0 * TIME)], axis=1)


def test_true_speeds_fit() -> None:
    mismatch, moving = speed_mismatch(TIME, ANGLES, SPEEDS)
    assert (mismatch < 2e-3 * moving).all()
    assert mismatch_in_words(["hip", "knee"], ROTATION, mismatch, moving, SURE) == ""


def test_a_wrong_speed_is_measured_and_named() -> None:
    wrong = SPEEDS + np.array([0.0, 1.5])
    mismatch, moving = speed_mismatch(TIME, ANGLES, wrong)
    assert mismatch[1] == pytest.approx(1.5, rel=1e-3)
    text = mismatch_in_words(["hip", "knee"], ROTATION, mismatch, moving, SURE)
    assert "1 of 2" in text and "knee, 1.5 rad/s off" in text


def test_a_speed_that_is_no_further_off_than_it_says_fits() -> None:
    """A live estimate steps where a measurement corrects it; a forearm that nothing shows by more than it moves."""
    mismatch, moving = speed_mismatch(TIME, ANGLES, SPEEDS + np.array([0.0, 1.5]))
    assert mismatch_in_words(["hip", "knee"], ROTATION, mismatch, moving, np.array([0.01, 1.6])) == ""
    assert mismatch_in_words(["hip", "knee"], ROTATION, mismatch, moving, np.array([0.01, 1.4]))


def test_a_coordinate_at_rest_with_a_speed_is_wrong() -> None:
    mismatch, moving = speed_mismatch(TIME, np.zeros_like(ANGLES), SPEEDS)
    assert "2 of 2" in mismatch_in_words(["hip", "knee"], ROTATION, mismatch, moving, SURE)


def test_a_translation_is_told_in_metres() -> None:
    mismatch, moving = speed_mismatch(TIME, ANGLES, SPEEDS + np.array([0.0, 1.5]))
    assert "1.5 m/s off" in mismatch_in_words(["hip", "slide"], np.array([True, False]), mismatch, moving, SURE)


def test_a_coordinate_that_is_locked_is_no_mismatch() -> None:
    """Rounding of a coordinate that stands still is larger than its motion."""
    still = 0.3 + 1e-16 * np.random.default_rng(1).normal(size=ANGLES.shape)
    mismatch, moving = speed_mismatch(TIME, still, 0.002 * np.ones_like(ANGLES))
    assert (mismatch > 1e3 * moving).all()
    assert mismatch_in_words(["hip", "knee"], ROTATION, mismatch, moving, SURE) == ""
