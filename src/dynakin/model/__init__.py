"""Models: what a person is made of (TOML), where the markers sit, the inertia tables, and how all is
measured on a recording."""

from dynakin.model.calibration.initial import InitialModel
from dynakin.model.calibration.initialise import initialise
from dynakin.model.calibration.loads import CarriedLoad
from dynakin.model.definition import ModelDefinition, load_model
from dynakin.model.opensim.definition import OpenSimOptions, load_opensim
from dynakin.model.priors import Bounds, Priors
from dynakin.model.subject import Subject

__all__ = [
    "Bounds",
    "CarriedLoad",
    "InitialModel",
    "ModelDefinition",
    "OpenSimOptions",
    "Priors",
    "Subject",
    "initialise",
    "load_model",
    "load_opensim",
]
