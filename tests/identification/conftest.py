"""One simulated subject, measured and identified once for all tests of this folder."""

from __future__ import annotations

import pytest

from dynakin.identification.subject import Identification, identify_subject
from dynakin.identification.trials import Common, measure_all
from dynakin.simulation.trial import simulate
from support.identification import Case
from support.squat_estimator import estimator


@pytest.fixture(scope="session")
def case() -> Case:
    sims = tuple(simulate("sagittal7", task, 3, 12.0) for task in ("squat", "sit-to-stand"))
    standing = simulate("sagittal7", "sway", 3, 3.0).recording
    common = Common.measure(estimator(), sims[0].recording, standing)
    return Case(sims, common, tuple(measure_all(common, [sim.recording for sim in sims])))


@pytest.fixture(scope="session")
def identified(case: Case) -> Identification:
    return identify_subject(estimator(), [sim.recording for sim in case.sims], static=case.common.static)
