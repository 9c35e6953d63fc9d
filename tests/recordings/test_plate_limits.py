"""A plate with a channel of a wrong scale is refused, naming plate, component and factor; good plates never are."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dynakin.errors import RecordingError
from dynakin.recordings.checks import check_plates
from dynakin.recordings.frame import find_ground_frame
from dynakin.recordings.plates.limits import beyond_limits
from dynakin.recordings.plates.pressure import Surface, part_pulling, plate_from_wrench
from dynakin.recordings.recording import Plate, Recording
from support.made_recordings import standing
from support.real_trials import real_trials

TURNED = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])  # Z up in the laboratory


def refusal(recording: Recording, plate: Plate) -> str:
    return beyond_limits(plate, recording, find_ground_frame(recording)) or ""


def scaled(plate: Plate, axis: int, factor: float, frames: slice = slice(None)) -> Plate:
    """One channel of the force times a factor; the moment about the laboratory's origin stays as it is."""
    force = plate.force.copy()
    force[frames, axis] *= factor
    return replace(plate, force=force)


def test_a_horizontal_component_a_thousand_times_too_large_is_named() -> None:
    recording = standing(70.0)
    wrong = scaled(recording.plates[1], 2, 1000.0)
    text = refusal(recording, wrong)
    assert text.startswith("plate 2: the horizontal force, mostly its z component, is 58 times the vertical one")
    assert "in 100 % of the loaded frames" in text and "Fz" in text
    found = check_plates(recording.with_plates((recording.plates[0], wrong)), find_ground_frame(recording), 70.0)
    assert found.refusal is not None and text in found.refusal


def test_the_component_is_the_laboratorys_where_z_is_up() -> None:
    recording = standing(70.0, rotation_LG=TURNED)
    text = refusal(recording, scaled(recording.plates[0], 1, 1000.0))
    assert "mostly its y component" in text


def test_a_fault_that_sets_in_later_counts_and_an_impact_does_not() -> None:
    recording = standing(70.0)
    assert refusal(recording, scaled(recording.plates[1], 2, 1000.0, slice(60, None)))
    assert not refusal(recording, scaled(recording.plates[1], 2, 1000.0, slice(50, 55)))
    assert not refusal(recording, scaled(recording.plates[1], 2, 12.0))  # 0.7 of the vertical: a drop jump's


def test_a_moment_a_thousand_times_too_large_moves_the_pressure_away() -> None:
    recording = standing(70.0)
    good = recording.plates[0]
    corners = np.array([[-0.2, 0, -0.4], [0.4, 0, -0.4], [0.4, 0, 0.0], [-0.2, 0, 0.0]])
    moment = good.moment * [1.0, 1.0, 1000.0]
    surface = Surface(np.zeros(3), np.array([0.0, 1.0, 0.0]))
    wrong = plate_from_wrench(
        "plate 1", good.force, moment, surface, corners=corners, threshold_n=10.0, zero_unloaded=False
    )
    text = refusal(recording, wrong)
    assert "the centre of pressure lies 99.6 m beyond the plate's edges" in text
    text = refusal(recording, replace(wrong, corners=None))
    assert "beyond the nearest marker" in text
    assert not refusal(recording, replace(good, corners=corners))


def test_a_twist_beyond_friction_is_named() -> None:
    recording = standing(70.0)
    text = refusal(
        recording, replace(recording.plates[0], free_moment=1000.0 * recording.plates[0].free_moment)
    )  # fmt: skip
    assert "the free moment, mostly its y component, is 2e+03 N m" in text


def test_no_plate_of_a_real_recording_is_beyond(data_dir: Path) -> None:
    judged = 0
    for recording in real_trials(data_dir):
        if not recording.plates:
            continue
        try:
            ground = find_ground_frame(recording)
        except RecordingError:
            ground = find_ground_frame(recording, forward="+X")
        for plate in recording.plates:
            assert beyond_limits(plate, recording, ground) is None, recording.name
            judged += 1
    assert judged >= 40


@pytest.mark.parametrize(("name", "axis"), [("walking1", 0), ("squats1", 2), ("DJ1", 0)])
def test_scaled_channels_of_real_plates_are_refused(data_dir: Path, name: str, axis: int) -> None:
    folder = data_dir / "opencap_subject4"
    recording = next(r for r in real_trials(folder) if r.name == name)
    loaded = max(recording.plates, key=lambda plate: float(np.nansum(plate.force[:, 1])))
    text = refusal(recording, scaled(loaded, axis, 1000.0))
    assert text.startswith(f"{loaded.name}: the horizontal force, mostly its {'xyz'[axis]} component")


def test_a_plate_without_samples_pulls_in_none() -> None:
    assert part_pulling(np.empty(0)) == 0.0
