"""Inertial parameters and geometry of a subject from several trials, and whether they predict."""

from dynakin.identification.batch import Posterior, at_start, identify_batch
from dynakin.identification.bodies import BodyPriors, PlanarBodies
from dynakin.identification.change import Change, change_between, change_in_words
from dynakin.identification.coloured import integrated_autocorrelation
from dynakin.identification.decision import Decision, decide
from dynakin.identification.subject import Identified, identify_subject
from dynakin.identification.trials import Common, MeasuredTrial, Movement, measure_all
from dynakin.identification.unknowns import GeometryPriors, Unknowns

__all__ = [
    "BodyPriors",
    "Change",
    "Common",
    "Decision",
    "GeometryPriors",
    "Identified",
    "MeasuredTrial",
    "Movement",
    "PlanarBodies",
    "Posterior",
    "Unknowns",
    "at_start",
    "change_between",
    "change_in_words",
    "decide",
    "identify_batch",
    "identify_subject",
    "integrated_autocorrelation",
    "measure_all",
]
