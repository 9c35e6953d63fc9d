"""One simulated subject, measured and identified once for all tests of this folder."""

from __future__ import annotations

from dataclasses import dataclass

import pytest

import dynakin
from dynakin.identification.subject import Identification, identify_subject
from dynakin.identification.trials import Common, MeasuredTrial, measure_all
from dynakin.simulation.output import SimulatedTrial
from dynakin.simulation.trial import simulate


@dataclass(frozen=True, eq=False)
class Case:
    """A simulated subject's squat and sit-to-stand."""

    sims: tuple[SimulatedTrial, ...]
    common: Common
    trials: tuple[MeasuredTrial, ...]


def estimator() -> dynakin.Estimator:
    """Not started."""
    subject = dynakin.Subject(mass_kg=70.0, height_m=1.75, sex="male")
    return dynakin.Estimator(dynakin.load_model("sagittal7", subject=subject, markers="opencap"))


@pytest.fixture(scope="session")
def case() -> Case:
    sims = tuple(simulate("sagittal7", task, 3, 12.0) for task in ("squat", "sit-to-stand"))
    standing = simulate("sagittal7", "sway", 3, 3.0).recording
    common = Common.measure(estimator(), sims[0].recording, standing)
    return Case(sims, common, tuple(measure_all(common, [sim.recording for sim in sims])))


@pytest.fixture(scope="session")
def identified(case: Case) -> Identification:
    return identify_subject(estimator(), [sim.recording for sim in case.sims], static=case.common.static)
