"""Markers of the pelvis that nobody shows standing are put where the trial or the other side has them."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from dynakin.filter.uncertainty.sizes import OF_HIPS, less_sure_joints
from dynakin.messages import about
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.model.definition import load_model
from dynakin.recordings.recording import Recording
from dynakin.settings.subject import Subject
from dynakin.simulation.trial import simulate

ASIS, PSIS = ("r.ASIS", "L.ASIS"), ("r.PSIS", "L.PSIS")


@cache
def squat() -> Recording:
    """Without the virtual markers of the hips."""
    return without(simulate("fullbody", "squat", 4, 5.0, markers="opencap").recording, "R_HJC_reg", "L_HJC_reg")


def standing() -> Recording:
    return replace(squat()._part(slice(0, 60)), plates=(), name="stands")


def without(recording: Recording, *names: str) -> Recording:
    kept = [k for k, name in enumerate(recording.marker_names) if name not in names]
    return replace(
        recording,
        marker_names=tuple(recording.marker_names[k] for k in kept),
        markers=recording.markers[:, kept],
    )


def calibrated(trial: Recording, static: Recording | None) -> CalibratedModel:
    who = Subject(mass_kg=70.0, height_m=1.75, sex="male")
    return load_model("fullbody", who, markers="opencap").calibrate(trial, static=static)


@cache
def hips_when_all_is_seen() -> np.ndarray:
    return hips(calibrated(squat(), standing()))


def hips(found: CalibratedModel) -> np.ndarray:
    """Both in the frame of the pelvis; (2, 3) m."""
    assert found.plan is not None
    segments = {segment.name: segment for segment in found.plan.model.segments}
    return np.array([found.plan.geometry.placement(segments[f"thigh_{side}"]) for side in "rl"])


@pytest.mark.parametrize("lacks", [("r.ASIS",), ("L.ASIS",), ("r.PSIS",), ("L.PSIS",)])
def test_the_trial_shows_one_that_the_standing_person_does_not(lacks: tuple[str, ...]) -> None:
    found = calibrated(squat(), without(standing(), *lacks))
    np.testing.assert_allclose(hips(found), hips_when_all_is_seen(), atol=0.008)
    assert found.provenance.hips == "measured" and not about(found.messages, "joints")
    assert any(f"does not show {lacks[0]}" in message.text for message in about(found.messages, "calibration"))


@pytest.mark.parametrize("lacks", [ASIS, PSIS, ("r.ASIS", "r.PSIS"), ("L.ASIS", "r.PSIS")])
def test_the_trial_shows_two_but_for_a_turn(lacks: tuple[str, ...]) -> None:
    found = calibrated(squat(), without(standing(), *lacks))
    np.testing.assert_allclose(hips(found), hips_when_all_is_seen(), atol=0.015)
    said = about(found.messages, "joints")
    assert {message.level for message in said} == {"warning"} and len(said) == 2
    if "r.ASIS" in lacks:
        assert found.provenance.hips == "supposed"
        assert less_sure_joints(found).items() >= {"thigh_r": OF_HIPS["supposed"]["thigh"]}.items()


@pytest.mark.parametrize("stands", [True, False])
@pytest.mark.parametrize("lacks", ASIS)
def test_the_other_side_has_what_nobody_shows(lacks: str, stands: bool) -> None:
    trial = without(squat(), lacks)
    found = calibrated(trial, without(standing(), lacks) if stands else None)
    np.testing.assert_allclose(hips(found), hips_when_all_is_seen(), atol=0.02)
    (said,) = about(found.messages, "joints")
    assert said.level == "warning" and f"nothing shows {lacks}" in said.text
    assert found.provenance.hips == "supposed" and lacks not in found.recorded_markers


def test_hips_from_proportions_are_said_and_nothing_of_the_legs_is_as_sure() -> None:
    gone = ("r.ASIS", "r.PSIS")
    found = calibrated(without(squat(), *gone), without(standing(), *gone))
    assert found.provenance.hips == "proportions"
    (said,) = about(found.messages, "joints")
    assert said.level == "warning" and "L.ASIS and L.PSIS" in said.text
    times = less_sure_joints(found)
    assert {f"{part}_{side}" for part in ("thigh", "shank", "foot") for side in "rl"} == set(times)


def test_a_pelvis_that_is_seen_stays_as_it_is() -> None:
    found = calibrated(squat(), standing())
    assert found.provenance.hips == "measured" and less_sure_joints(found) == {}
    assert not any("does not show" in message.text for message in found.messages)
