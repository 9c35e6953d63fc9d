"""Verdicts of whole runs: good ones end with a clean word, those with truly wrong settings do not."""

from __future__ import annotations

import pytest

from dynakin.filter.estimator import Estimator
from dynakin.model.definition import load_model
from dynakin.recordings.recording import Recording
from dynakin.results.estimate import Estimate
from dynakin.results.measures.consistency import Consistency
from dynakin.results.measures.metrics import evaluation_window, window_consistency
from dynakin.settings.noise import Noise
from dynakin.settings.subject import Subject
from dynakin.simulation.trial import simulate

SUBJECT = Subject(mass_kg=70.0, height_m=1.75, sex="male")


def said(estimate: Estimate) -> Consistency:
    return window_consistency(estimate, evaluation_window(estimate.time))


def run(model: str, recording: Recording, noise: Noise | None = None) -> Consistency:
    return said(Estimator(load_model(model, SUBJECT), noise or Noise()).run(recording))


@pytest.fixture(scope="module")
def walk() -> Recording:
    return simulate("fullbody", "gait", 6, 2.5, 60.0, mass_kg=70.0, height_m=1.75, sex="male").recording


@pytest.fixture(scope="module")
def squat() -> Recording:
    return simulate("sagittal7", "squat", 6, 6.0, mass_kg=70.0, height_m=1.75, sex="male").recording


@pytest.mark.parametrize(
    ("model", "trial", "noise", "said"),
    [
        ("fullbody", "walk", "calibrated", "whose innovations do not contradict the standard deviations."),
        ("sagittal7", "squat", "declared", "The standard deviations fit this recording."),
    ],
)
def test_a_good_run_is_called_so(request: pytest.FixtureRequest, model: str, trial: str, noise: str, said: str) -> None:
    found = run(model, request.getfixturevalue(trial))
    assert found.noise == noise and found.judgement == "consistent"
    assert found.verdict.endswith(said)


def test_a_scale_that_is_not_this_recordings_is_found_out(walk: Recording) -> None:
    """A hundredth and a hundred times of what it would find."""
    small = run("fullbody", walk, Noise(adapt=False, variance_scale=0.002))
    assert small.noise == "given" and small.judgements["motion"] == "overconfident"
    large = run("fullbody", walk, Noise(adapt=False, variance_scale=20.0))
    assert large.judgement == "conservative"


@pytest.mark.parametrize(("factor", "word"), [(0.2, "overconfident"), (5.0, "conservative")])
def test_declared_noise_that_is_wrong_is_found_out(squat: Recording, factor: float, word: str) -> None:
    declared = Noise()
    wrong = declared.changed(
        marker_variance_scale=factor**2,
        soft_tissue_sd_fraction=factor * declared.soft_tissue_sd_fraction,
        jerk_density_rad2_s5=factor**2 * declared.jerk_density_rad2_s5,
    )
    assert run("sagittal7", squat, wrong).judgements["motion"] == word
