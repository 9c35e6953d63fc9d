"""Models measured on a simulated person, and one simulated squat with what it tells."""

from __future__ import annotations

import pytest

from dynakin import load_model
from dynakin.identification.observability.measured import MeasuredModel
from dynakin.identification.observability.simulated import tracker_of
from dynakin.identification.observability.trial import identifiability
from support.identifiability import Told, estimated_squat


@pytest.fixture(scope="session", params=["sagittal7", "squat7"])
def measured(request: pytest.FixtureRequest) -> MeasuredModel:
    return MeasuredModel.of(tracker_of(load_model(request.param)))


@pytest.fixture(scope="session")
def squat() -> Told:
    estimate, tracker = estimated_squat()
    return Told(tracker, estimate, identifiability(tracker, estimate))
