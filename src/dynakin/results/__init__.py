"""What a run gives back: labelled arrays, parameters, events and timing; figures of fit; one writer a file format."""

from dynakin.results.estimate import Estimate
from dynakin.results.measures.consistency import consistency
from dynakin.results.measures.fit import signal_fit, truth_error
from dynakin.results.measures.repetitions import Repetition, find_repetitions, repetitions_of
from dynakin.results.records import Event, Parameter, Timing

__all__ = [
    "Estimate",
    "Event",
    "Parameter",
    "Repetition",
    "Timing",
    "consistency",
    "find_repetitions",
    "repetitions_of",
    "signal_fit",
    "truth_error",
]
