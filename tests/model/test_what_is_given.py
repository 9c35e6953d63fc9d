"""What is given by hand and contradicted by the markers."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from dynakin import Sample, Subject, load_model
from dynakin.errors import DynakinError
from dynakin.messages import about, warnings_of
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.model.calibration.how import Calibration
from dynakin.recordings.recording import Recording
from dynakin.simulation.trial import simulate


@cache
def walk() -> Recording:
    return simulate("fullbody", "gait", 7, 2.5, markers="opencap").recording


def calibrated(height_m: float = 1.75, static: Recording | None = None, **given: Any) -> CalibratedModel:
    subject = Subject(mass_kg=70.0, height_m=height_m, sex="male")
    return load_model("fullbody", subject).calibrate(walk(), static=static, how=Calibration(**given))


@pytest.mark.parametrize("forward", ["-X", "+Z", "-Z"])
def test_a_forward_that_feet_and_pelvis_contradict_is_refused(forward: str) -> None:
    with pytest.raises(DynakinError, match=r"forward is given as .* but the person faces"):
        calibrated(forward=forward)


def test_the_right_one_is_taken() -> None:
    assert calibrated(forward="+X").ground.forward == pytest.approx([1.0, 0.0, 0.0])


@pytest.mark.parametrize(("height_m", "doubted"), [(1.2, True), (1.6, False), (1.75, False), (1.9, False), (2.2, True)])
def test_a_height_of_somebody_else_is_doubted(height_m: float, doubted: bool) -> None:
    said = [str(m) for m in warnings_of(about(calibrated(height_m).messages, "height"))]
    assert any("the markers show about" in text for text in said) == doubted


def test_side_has_no_meaning_where_both_legs_are() -> None:
    with pytest.raises(DynakinError, match="side is left"):
        calibrated(side="left")


def test_a_standing_trial_in_which_nobody_stands_is_warned_of() -> None:
    moving = replace(walk(), name="moving", plates=(), path=None)
    texts = [str(m) for m in calibrated(static=moving.window(1.0, 2.0)).messages]
    assert any("nobody stands still" in text for text in texts)


@pytest.mark.parametrize(("markers", "plates"), [(np.zeros((3, 3)), {}), ({}, None)])
def test_a_sample_without_names_is_refused(markers: Any, plates: Any) -> None:
    with pytest.raises(DynakinError, match="expected a dictionary"):
        Sample(0.0, markers, plates)
