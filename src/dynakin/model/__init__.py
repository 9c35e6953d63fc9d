"""Models: what a person is made of (TOML), where the markers sit, the inertia tables, and how all is
measured on a recording."""

from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.model.calibration.loads import CarriedLoad
from dynakin.model.definition import Definition, ModelDefinition, load_model
from dynakin.model.opensim.definition import OpenSimOptions, load_opensim
from dynakin.model.priors import Bounds, Priors
from dynakin.model.subject import Subject

__all__ = [
    "Bounds",
    "CalibratedModel",
    "CarriedLoad",
    "Definition",
    "ModelDefinition",
    "OpenSimOptions",
    "Priors",
    "Subject",
    "load_model",
    "load_opensim",
]
