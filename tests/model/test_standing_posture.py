"""A standing trial that is a squat, or of bent knees, is warned of, a good one taken without a word."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dynakin.messages import about
from dynakin.model.calibration.checks import check_standing
from dynakin.model.definition import load_model
from dynakin.recordings.recording import Recording
from dynakin.settings.subject import Subject
from dynakin.simulation.trial import simulate

BENT = [(45.0, 22.0, "knee is 45 deg bent"), (20.0, 40.0, "thigh is 40"), (95.0, 85.0, "knee is 95 deg bent")]


def legs(knee_deg: float, thigh_deg: float) -> dict[str, np.ndarray]:
    """Both alike."""
    t, k = np.radians([thigh_deg, thigh_deg - knee_deg])
    knee = -0.4 * np.array([-np.sin(t), np.cos(t), 0.0])
    ankle = knee - 0.4 * np.array([-np.sin(k), np.cos(k), 0.0])
    return {f"{n}_{s}": p for s in "rl" for n, p in (("hip", np.zeros(3)), ("knee", knee), ("ankle", ankle))}


@pytest.mark.parametrize(("knee", "thigh"), [(0.0, 0.0), (17.0, 10.0), (25.0, 21.0)])
def test_who_stands(knee: float, thigh: float) -> None:
    assert check_standing(legs(knee, thigh), "static") == []


@pytest.mark.parametrize(("knee", "thigh", "said"), BENT)
def test_who_stands_with_bent_legs(knee: float, thigh: float, said: str) -> None:
    (found,) = check_standing(legs(knee, thigh), "static")
    assert (found.topic, found.level) == ("standing", "warning")
    assert said in found.text and found.text.count("--static") == 1


def test_a_height_that_is_estimated_from_who_sits_is_said_to_be_short() -> None:
    for height_m, said in ((1.37, True), (None, False)):
        (found,) = check_standing(legs(95.0, 85.0), "chair", height_m)
        assert ("1.37 m" in found.text and "--height" in found.text) == said


def held(recording: Recording, frame: int) -> Recording:
    """A second in this posture."""
    noise = 2e-4 * np.random.default_rng(0).normal(size=(100, *recording.markers.shape[1:]))
    posture = np.repeat(recording.markers[frame : frame + 1], 100, axis=0) + noise
    return replace(recording, time=np.arange(100) / 100.0, markers=posture, plates=(), name="held")


def test_a_squat_is_no_standing_trial() -> None:
    squat = simulate("fullbody", "squat", 4, 6.0, markers="opencap").recording
    definition = load_model("fullbody", Subject(mass_kg=70.0, height_m=1.75, sex="male"), markers="opencap")
    pelvis = squat.marker("r.ASIS")[:, 1]
    bent, upright = (definition.calibrate(squat, static=held(squat, frame)) for frame in (int(np.argmin(pelvis)), 20))
    (said,) = about(bent.messages, "standing")
    assert said.level == "warning" and said.text.startswith("nobody stands upright in held")
    assert not about(upright.messages, "standing")
