"""Plates whose axes are others, of bodies whose trunk no marker shows: by the lean of the body over the foot."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import dynakin
from dynakin import Estimator, Subject, load_model
from dynakin.errors import DynakinError, RecordingError
from dynakin.filter.ground.axes import turned_by_lean
from dynakin.filter.ground.needed import Needed
from dynakin.filter.prepared import Prepared
from dynakin.recordings.recording import Recording
from support.plates import person, prepared, trial

UPPER = ("Sternum", "C7", "Shoulder", "humerus", "elbow", "forearm", "wrist")


@pytest.fixture(scope="module")
def legs() -> tuple[Recording, Prepared]:
    """A walk of legs and pelvis, and as it is prepared."""
    walk = trial("gait")
    kept = [k for k, name in enumerate(walk.marker_names) if not any(word in name for word in UPPER)]
    walk = replace(walk, markers=walk.markers[:, kept], marker_names=tuple(walk.marker_names[k] for k in kept))
    return walk, person().prepare(walk)


def motion_of(ready: Prepared) -> Needed:
    return Needed(ready.calibrated, ready.recording.time, ready.measured.markers)


def turned(recording: Recording, turn: np.ndarray, which: int | None = None) -> Recording:
    """Horizontal forces (of one plate) turned (2, 2) in the laboratory's axes; centres of pressure stay."""
    up = int(np.argmax(np.sum([np.abs(plate.force).mean(axis=0) for plate in recording.plates], axis=0)))
    level = [k for k in range(3) if k != up]
    plates = []
    for k, plate in enumerate(recording.plates):
        force = plate.force.copy()
        if which in (None, k):
            force[:, level] = force[:, level] @ turn.T
        plates.append(replace(plate, force=force))
    return recording.with_plates(tuple(plates))


@pytest.mark.parametrize(
    ("turn", "which", "said"),
    [
        (np.diag([-1.0, 1.0]), None, r"if its (first|second) axis .* points the other way"),
        (np.diag([1.0, -1.0]), None, r"if its (first|second) axis .* points the other way"),
        (-np.eye(2), None, "if both horizontal axes point the other way"),
        (-np.eye(2), 1, "if both horizontal axes point the other way"),
        (np.array([[0.0, 1.0], [-1.0, 0.0]]), None, "if the horizontal axes are turned by a quarter turn"),
    ],
)
def test_turned_axes_push_a_body_that_passes_over_them_against_its_lean(
    legs: tuple[Recording, Prepared], turn: np.ndarray, which: int | None, said: str
) -> None:
    walk, ready = legs
    with pytest.raises(RecordingError, match=r"horizontal force of plate .* does not fit the motion"):
        person().prepare(turned(walk, turn, which))
    found = turned_by_lean(motion_of(ready), turned(walk, turn, which).plates) or ""
    assert found.startswith("the horizontal force of " + ("plate 2 does" if which else "plate 1, plate 2 and plate 3"))
    assert re.search(said, found)


def test_plates_in_order_follow_it(legs: tuple[Recording, Prepared]) -> None:
    walk, ready = legs
    assert ready.calibrated.unseen_kg > 20.0
    assert turned_by_lean(motion_of(ready), walk.plates) is None


def test_one_side_of_a_pelvis_shows_no_lean(legs: tuple[Recording, Prepared]) -> None:
    """Its markers lie a hand's breadth beside the middle: plates in order had a "second axis" that was reversed."""
    walk, _ = legs
    kept = [k for k, name in enumerate(walk.marker_names) if "L" not in name[0] and "ankle_l" not in name]
    right = replace(walk, marker_names=tuple(walk.marker_names[k] for k in kept), markers=walk.markers[:, kept])
    ready = person().prepare(right)
    assert np.isnan(motion_of(ready).root).all()


def test_a_squat_shows_nothing_of_it() -> None:
    """Its pelvis goes back and forth behind the feet, and the trunk the other way."""
    squat = trial("squat")
    ready = prepared("squat")
    for turn in (np.eye(2), -np.eye(2)):
        assert turned_by_lean(motion_of(ready), turned(squat, turn).plates) is None


@pytest.mark.parametrize("signs", [(1.0, 1.0), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)])
def test_of_a_real_walk_of_legs_and_pelvis(data_dir: Path, signs: tuple[float, float]) -> None:
    """Hips 300 N m off without a word."""
    walk = dynakin.read(data_dir / "c3d_parser" / "FMC" / "MH0222_BP06.c3d")
    estimator = Estimator(load_model("fullbody", Subject(mass_kg=81.0, height_m=1.79)))
    try:
        estimator.prepare(turned(walk, np.diag(signs)))
        refused = ""
    except DynakinError as error:
        refused = str(error)
    assert ("against the way it leans" in refused) == (min(signs) < 0.0)
    assert min(signs) < 0.0 or not refused
