"""One simulated subject, measured for identification."""

from __future__ import annotations

from dataclasses import dataclass

from dynakin.identification.trials import Common, MeasuredTrial
from dynakin.simulation.output import SimulatedTrial


@dataclass(frozen=True, eq=False)
class Case:
    """A simulated subject's squat and sit-to-stand."""

    sims: tuple[SimulatedTrial, ...]
    common: Common
    trials: tuple[MeasuredTrial, ...]
