"""Moments of the wrong sign are refused by name; what empty plates read below nothing explains a missing mass."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dynakin.errors import RecordingError
from dynakin.filter.ground.plate_sum import Empty
from dynakin.recordings.recording import Plate, Recording
from support.plates import person, prepared, trial, with_plate


def half_a_turn(plate: Plate) -> Plate:
    """With moments about its middle of the other sign."""
    assert plate.corners is not None
    middle = plate.corners.mean(axis=0)
    cop = plate.cop.copy()
    up = int(np.argmin(np.ptp(plate.corners, axis=0)))
    level = [k for k in range(3) if k != up]
    cop[:, level] = 2.0 * middle[level] - cop[:, level]
    moment = np.cross(np.nan_to_num(cop), plate.force) - plate.free_moment
    return replace(plate, cop=cop, moment=moment, free_moment=-plate.free_moment)


@pytest.mark.parametrize("which", [None, 1])
def test_moments_as_action_are_refused_by_name(which: int | None) -> None:
    assert prepared("gait").ground.usable
    with pytest.raises(RecordingError, match=r"as by a wrong sign of all moments\. Correct the signs"):
        person().prepare(with_plate(trial("gait"), which, half_a_turn))


def lowered(newton: float) -> Recording:
    """Plates that read so much too little, and nothing while they are empty."""

    def of(plate: Plate) -> Plate:
        less = np.where(np.linalg.norm(plate.force, axis=1) > 20.0, newton, 0.0)
        up = int(np.argmax(np.abs(plate.force).mean(axis=0)))
        off = np.outer(less, np.eye(3)[up])
        moment = plate.moment - np.cross(np.nan_to_num(plate.cop), off)
        return replace(plate, force=plate.force - off, moment=moment, empty_n=-newton)

    return with_plate(trial("gait"), None, of)


def test_a_zero_that_explains_what_is_missing_is_named_and_not_the_mass() -> None:
    recording = lowered(40.0)
    doubt = person().prepare(recording).ground.doubt
    assert doubt is not None and doubt.topic == "zero" and "read -40 N, which was not taken off" in doubt.text
    unknown = recording.with_plates(tuple(replace(plate, empty_n=0.0) for plate in recording.plates))
    doubt = person().prepare(unknown).ground.doubt
    assert doubt is not None and doubt.topic == "weight"
    doubt = person(mass_kg=75.0).prepare(recording).ground.doubt  # more is missing than that
    assert doubt is not None and doubt.topic == "weight"


def test_what_is_missing_by_the_zero_is_that_of_the_plates_that_bear() -> None:
    recording = lowered(40.0)
    measured = np.ones((recording.n_frames, 6))
    bears = np.mean([np.linalg.norm(plate.force, axis=1) > 20.0 for plate in recording.plates], axis=1)
    found = Empty.of(recording.plates, measured)
    assert found.kg == pytest.approx(-40.0 * bears.sum() / 9.80665) and found.reads == "-40 N"
    assert Empty.of(trial("gait").plates, measured).names == ""
