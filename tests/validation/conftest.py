"""A simulated trial and its comparison, made once."""

from __future__ import annotations

import pytest

import dynakin
from dynakin.filter.estimator import Estimator
from dynakin.simulation.output import SimulatedTrial
from dynakin.simulation.trial import simulate_squat
from dynakin.validation.case import Setup
from dynakin.validation.methods import ComparedTrial, compare_trial


@pytest.fixture(scope="session")
def simulated() -> SimulatedTrial:
    return simulate_squat(seed=3, duration_s=12.0, mass_kg=70.0)


@pytest.fixture(scope="session")
def setup() -> Setup:
    subject = dynakin.Subject(mass_kg=70.0, height_m=1.75, sex="male")
    return Setup(Estimator(dynakin.load_model("sagittal7", subject, markers="opencap")))


@pytest.fixture(scope="session")
def compared(simulated: SimulatedTrial, setup: Setup) -> ComparedTrial:
    return compare_trial(simulated.recording, setup)
