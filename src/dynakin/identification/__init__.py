"""Inertial parameters of a subject from several trials, and whether they predict."""

from dynakin.identification.batch import Posterior, at_start, identify_batch
from dynakin.identification.bodies import Bodies, PlanarBodies, bodies_of
from dynakin.identification.body_priors import BodyPriors
from dynakin.identification.change import Change, change_between, change_in_words
from dynakin.identification.coloured import integrated_autocorrelation
from dynakin.identification.decision import Decision, decide, foretell, rms_of
from dynakin.identification.spatial_bodies import SpatialBodies
from dynakin.identification.subject import Identified, identify_subject
from dynakin.identification.trials import Common, MeasuredTrial, Movement, about, measure_all
from dynakin.identification.unknowns import GeometryPriors, Unknowns

__all__ = [
    "Bodies",
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
    "SpatialBodies",
    "Unknowns",
    "about",
    "at_start",
    "bodies_of",
    "change_between",
    "change_in_words",
    "decide",
    "foretell",
    "identify_batch",
    "identify_subject",
    "integrated_autocorrelation",
    "measure_all",
    "rms_of",
]
