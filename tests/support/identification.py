"""One simulated subject, measured for identification."""

from __future__ import annotations

from dataclasses import dataclass

import dynakin
from dynakin.identification.trials import Common, MeasuredTrial
from dynakin.simulation.output import SimulatedTrial


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
