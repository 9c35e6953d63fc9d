"""Inertial parameters and geometry of a subject from several trials, and whether they predict."""

from dynakin.identification.batch import Posterior, at_start, identify_batch
from dynakin.identification.bodies import BodyPriors, PlanarBodies
from dynakin.identification.coloured import integrated_autocorrelation
from dynakin.identification.trials import Common, MeasuredTrial, Movement, measure_all
from dynakin.identification.unknowns import GeometryPriors, Unknowns

__all__ = [
    "BodyPriors",
    "Common",
    "GeometryPriors",
    "MeasuredTrial",
    "Movement",
    "PlanarBodies",
    "Posterior",
    "Unknowns",
    "at_start",
    "identify_batch",
    "integrated_autocorrelation",
    "measure_all",
]
