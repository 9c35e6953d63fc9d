"""A short simulated squat made ready for tuning."""

from __future__ import annotations

import pytest

import dynakin
from dynakin.filter.estimator import Estimator
from dynakin.recordings.recording import Recording
from dynakin.settings import presets
from dynakin.settings.noise import Noise
from dynakin.simulation.trial import simulate
from dynakin.studies.tuning.score import Shared
from dynakin.studies.tuning.trial import prepare


@pytest.fixture(scope="session")
def recording() -> Recording:
    return simulate("sagittal7", "squat", 3, 5.0, 50.0).recording


@pytest.fixture(scope="session")
def definition() -> dynakin.ModelDefinition:
    subject = dynakin.Subject(mass_kg=70.0, height_m=1.75, sex="male")
    return dynakin.load_model("sagittal7", subject, markers="opencap")


def shared_with(noise: Noise, definition: dynakin.ModelDefinition, recording: Recording) -> Shared:
    return Shared((prepare(recording, Estimator(definition, noise)),), noise)


@pytest.fixture(scope="session")
def paper(definition: dynakin.ModelDefinition, recording: Recording) -> Shared:
    return shared_with(presets.paper(), definition, recording)


@pytest.fixture(scope="session")
def default(definition: dynakin.ModelDefinition, recording: Recording) -> Shared:
    return shared_with(presets.default(), definition, recording)
