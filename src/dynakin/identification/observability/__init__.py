"""Observability of the constants: base parameters, gauges, posterior against prior, movements that would help.

    estimator = dynakin.Estimator(model)
    estimate, tracker = estimator.track(recording)
    print("\\n".join(identifiability(tracker, estimate).advice))

It stands apart from the chain, as `validation` does: it needs the core, the filter and the reference's base parameters.
"""

from typing import TYPE_CHECKING

from dynakin.lazy import loaded_when_asked

if TYPE_CHECKING:
    from dynakin.identification.observability.advice import GAIN
    from dynakin.identification.observability.gauges import Gauge, Gauges
    from dynakin.identification.observability.simulated import tracker_of
    from dynakin.identification.observability.structure import Structure, structure_of
    from dynakin.identification.observability.trial import BasePosterior, Identifiability, identifiability

__all__ = [
    "GAIN",
    "BasePosterior",
    "Gauge",
    "Gauges",
    "Identifiability",
    "Structure",
    "identifiability",
    "structure_of",
    "tracker_of",
]

__getattr__, __dir__ = loaded_when_asked(
    __name__,
    {
        "advice": ("GAIN",),
        "gauges": ("Gauge", "Gauges"),
        "simulated": ("tracker_of",),
        "structure": ("Structure", "structure_of"),
        "trial": ("BasePosterior", "Identifiability", "identifiability"),
    },
)
