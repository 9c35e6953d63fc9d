"""Plates whose moment about the vertical is wrong: found by the motion, and held by the deviations of moments."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from dynakin.filter.ground.expected import plate_covariances
from dynakin.filter.ground.ground import Ground
from dynakin.filter.ground.plate_errors import PlateErrors
from dynakin.messages import about
from dynakin.recordings.plates.pressure import free_moments
from dynakin.recordings.recording import Plate
from support.plates import person, prepared, trial, with_plate

UP = np.array([0.0, 1.0, 0.0])


def offset(by_nm: float) -> Callable[[Plate], Plate]:
    """A plate that reads so much about the vertical too much while it is loaded."""

    def of(plate: Plate) -> Plate:
        more = by_nm * np.outer(plate.force[:, 1] > 20.0, UP)
        return replace(plate, moment=plate.moment + more, free_moment=plate.free_moment + more)

    return of


def times(factor: float) -> Callable[[Plate], Plate]:
    """A plate whose free moment is so many times the true one."""

    def of(plate: Plate) -> Plate:
        more = (factor - 1.0) * np.nan_to_num(plate.free_moment)
        return replace(plate, moment=plate.moment + more, free_moment=plate.free_moment + more)

    return of


@cache
def judged(motion: str, which: int | None, kind: str, by: float) -> Ground:
    change = {"offset": offset, "times": times}[kind](by)
    return person().prepare(with_plate(trial(motion), which, change)).ground


def said(ground: Ground) -> list[str]:
    found = about(ground.notes, "free moment")
    assert all(message.level == "warning" for message in found)
    return [message.text for message in found]


@pytest.mark.parametrize("motion", ["squat", "gait"])
def test_plates_in_order_turn_the_person_as_the_motion_needs(motion: str) -> None:
    ready = prepared(motion)
    assert not about(ready.messages, "free moment")
    errors = ready.ground.errors
    assert not np.any(errors.turn_error_nm)


@pytest.mark.parametrize("by_nm", [10.0, -10.0])
def test_a_zero_of_one_plate_is_said_and_any_foot_may_have_it(by_nm: float) -> None:
    ground = judged("squat", 0, "offset", by_nm)
    (text,) = said(ground)
    assert f"on average by {np.sign(by_nm):+.0f}"[:-1] in text
    np.testing.assert_allclose(ground.errors.turn_error_nm, 10.0, atol=2.0)
    assert ground.loads is not None
    feet = ground.errors.turn_error_of_feet(ground.loads)
    np.testing.assert_allclose(feet[50:-50], 10.0, atol=2.0)


def test_of_plates_that_bear_one_after_the_other_the_wrong_one_is_named() -> None:
    ground = judged("gait", 1, "offset", 15.0)
    (text,) = said(ground)
    assert "plate 2" in text and "plate 1" not in text and "plate 3" not in text
    np.testing.assert_allclose(ground.errors.turn_error_nm, [0.0, 15.0, 0.0], atol=4.0)


@pytest.mark.parametrize("factor", [-8.0, 10.0])
def test_free_moments_of_another_sign_or_unit_are_told_from_a_zero(factor: float) -> None:
    ground = judged("gait", None, "times", factor)
    (text,) = said(ground)
    found = re.search(r"as if the true free moments were (-?[0-9.]+) times those measured", text)
    assert found is not None and float(found[1]) == pytest.approx(1.0 / factor, abs=0.15)
    assert np.all(np.asarray(ground.errors.turn_error_nm) > 5.0)
    assert ground.errors.turn_gain_error == pytest.approx(abs(1.0 - 1.0 / factor), abs=0.15)


def test_no_clock_is_found_where_it_is_the_vertical_moment_that_misfits() -> None:
    ground = judged("squat", 0, "times", -100.0)
    assert said(ground)
    assert not about(ground.notes, "in step") and not about(ground.notes, "rate")
    assert abs(ground.behind_s - prepared("squat").ground.behind_s) < 0.003


def test_the_deviation_is_that_of_the_moment_about_the_vertical_alone() -> None:
    wrench, foot = np.array([[20.0, 600.0, 30.0, 6.0, 8.0, 60.0]]), np.array([[0.1, 0.0, -0.01]])
    (free,) = free_moments(wrench)
    off = PlateErrors(turn_gain_error=5.0 / abs(free))
    for found in (plate_covariances(wrench, foot, turn_error_nm=5.0), plate_covariances(wrench, foot, off)):
        more = (found - plate_covariances(wrench, foot))[0]
        np.testing.assert_allclose(more, 25.0 * np.diag(np.eye(6)[4]), atol=1e-9)


def test_free_moments_are_about_where_each_wrench_presses() -> None:
    at, force = np.array([0.3, 0.0, -0.2]), np.array([40.0, 500.0, -20.0])
    wrench = np.concatenate([force, np.cross(at, force) + 7.0 * UP])
    np.testing.assert_allclose(free_moments(np.stack([wrench, 0.01 * wrench, np.full(6, np.nan)])), [7.0, 0.0, 0.0])
