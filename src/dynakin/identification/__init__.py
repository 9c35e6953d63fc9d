"""Inertial parameters of a subject from several trials, and whether they predict."""

from dynakin.identification.batch import Posterior, identify_batch
from dynakin.identification.bodies import PlanarBodies
from dynakin.identification.body_priors import BodyPriors
from dynakin.identification.change import Change, change_between
from dynakin.identification.decision import Decision
from dynakin.identification.spatial_bodies import SpatialBodies
from dynakin.identification.subject import identify_subject
from dynakin.identification.trials import measure_all

__all__ = [
    "BodyPriors",
    "Change",
    "Decision",
    "PlanarBodies",
    "Posterior",
    "SpatialBodies",
    "change_between",
    "identify_batch",
    "identify_subject",
    "measure_all",
]
