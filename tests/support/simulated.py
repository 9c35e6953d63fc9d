"""Simulated trials, each made once by a process: several tests, of several files, start from the same walk or squat."""

from __future__ import annotations

import inspect
from functools import lru_cache
from typing import Any

from dynakin.simulation import trial
from dynakin.simulation.output import SimulatedTrial

_ARGUMENTS = inspect.signature(trial.simulate)


def simulate(*args: Any, **kwargs: Any) -> SimulatedTrial:
    """`dynakin.simulation.trial.simulate` of a model and a motion that have names, made once. Nobody changes it: its
    recording's arrays cannot be written."""
    given = _ARGUMENTS.bind(*args, **kwargs)
    given.apply_defaults()  # a default that is written out is no other trial
    return _made(*given.args, **given.kwargs)


def simulate_squat(seed: int = 1, duration_s: float = 20.0, *args: Any, **kwargs: Any) -> SimulatedTrial:
    """`dynakin.simulation.trial.simulate_squat`, made once."""
    return simulate("sagittal7", "squat", seed, duration_s, *args, **kwargs)


@lru_cache(maxsize=24)
def _made(*args: Any, **kwargs: Any) -> SimulatedTrial:
    made = trial.simulate(*args, **kwargs)
    for own in (made.recording, *made.recording.plates):
        for array in vars(own).values():
            if hasattr(array, "setflags"):
                array.setflags(write=False)
    return made
