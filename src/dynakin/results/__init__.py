"""What a run gives back: labelled arrays, parameters, events and timing; figures of fit; one writer a file format."""

from typing import TYPE_CHECKING

from dynakin.lazy import loaded_when_asked

if TYPE_CHECKING:
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

__getattr__, __dir__ = loaded_when_asked(
    __name__,
    {
        "estimate": ("Estimate",),
        "measures.consistency": ("consistency",),
        "measures.fit": ("signal_fit", "truth_error"),
        "measures.repetitions": ("Repetition", "find_repetitions", "repetitions_of"),
        "records": ("Event", "Parameter", "Timing"),
    },
)
