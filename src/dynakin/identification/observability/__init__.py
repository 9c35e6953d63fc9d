"""What can be told and what was: base parameters, gauges, posterior against prior, and what motion would tell more.

    estimator = dynakin.Estimator(model)
    estimate, tracker = estimator.track(recording)
    print("\\n".join(identifiability(tracker, estimate).advice))

It stands beside the chain, as `comparison` does: it needs the core, the filter and the reference's base parameters.
"""

from dynakin.identification.observability.advice import GAIN
from dynakin.identification.observability.gauges import Gauge, Gauges
from dynakin.identification.observability.measured import tracker_of
from dynakin.identification.observability.structure import Structure, structure_of
from dynakin.identification.observability.trial import BaseParameterTold, Identifiability, identifiability

__all__ = [
    "GAIN",
    "BaseParameterTold",
    "Gauge",
    "Gauges",
    "Identifiability",
    "Structure",
    "identifiability",
    "structure_of",
    "tracker_of",
]
