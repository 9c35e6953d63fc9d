"""Markers that sit otherwise in the standing trial are named; skin that moves is no such thing."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from dynakin.filter.uncertainty.sizes import ONE_SIDED, less_sure_joints
from dynakin.messages import Message, warnings_of
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.model.definition import load_model
from dynakin.recordings.recording import Recording
from dynakin.settings.subject import Subject
from dynakin.simulation.trial import simulate


@cache
def squat() -> Recording:
    return simulate("fullbody", "squat", 4, 5.0, markers="opencap").recording


def standing(moved: dict[str, tuple[float, float, float]]) -> Recording:
    part = replace(squat()._part(slice(0, 60)), plates=(), name="stands")
    markers = part.markers.copy()
    for name, by in moved.items():
        markers[:, part.marker_names.index(name)] += by
    return replace(part, markers=markers)


def exchanged(recording: Recording, one: str, other: str) -> Recording:
    names = {one: other, other: one}
    return replace(recording, marker_names=tuple(names.get(name, name) for name in recording.marker_names))


def calibrated(trial: Recording, static: Recording) -> tuple[CalibratedModel, list[Message]]:
    who = Subject(mass_kg=70.0, height_m=1.75, sex="male")
    found = load_model("fullbody", who, markers="opencap").calibrate(trial, static=static)
    return found, warnings_of(found.messages)


def test_markers_that_stay_where_they_are() -> None:
    found, said = calibrated(squat(), standing({}))
    assert said == [] and found.provenance.moved_joints == () and less_sure_joints(found) == {}


@pytest.mark.parametrize(("name", "by"), [("r_knee", (0.0, 0.025, 0.0)), ("L_knee", (0.0, 0.025, 0.0))])
def test_one_that_slipped_is_named(name: str, by: tuple[float, float, float]) -> None:
    found, (said,) = calibrated(squat(), standing({name: by}))
    assert said.topic == "calibration" and f"({name})" in said.text and "--static" in said.text
    side = name[0].lower()
    assert set(found.provenance.moved_joints) == {
        f"knee_{side}",
        f"ankle_{side}",
    }  # along the line between both it lies inwards
    assert less_sure_joints(found) == dict.fromkeys((f"shank_{side}", f"foot_{side}"), ONE_SIDED)


def test_markers_of_another_day() -> None:
    rng = np.random.default_rng(2)
    by = {name: tuple(rng.normal(0.0, 0.009, 3)) for name in squat().marker_names}
    found, said = calibrated(squat(), standing(by))
    assert any("as if all were put on anew" in message.text for message in said)
    assert found.provenance.hips == "supposed" and set(found.provenance.moved_joints) == {
        "knee_r",
        "knee_l",
        "ankle_r",
        "ankle_l",
    }


@pytest.mark.parametrize("in_trial", [True, False])
@pytest.mark.parametrize("pair", [("r_toe", "r_5meta"), ("L_thigh1", "L_thigh3")])
def test_names_that_are_exchanged_in_one_of_both(pair: tuple[str, str], in_trial: bool) -> None:
    trial, static = squat(), standing({})
    if in_trial:
        trial = exchanged(trial, *pair)
    else:
        static = exchanged(static, *pair)
    said = calibrated(trial, static)[1]
    assert any(message.topic == "labels" and set(pair) <= set(message.text.split()) for message in said), said
