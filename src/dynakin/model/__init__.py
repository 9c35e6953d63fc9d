"""Models: what a person is made of (TOML), where the markers sit, the inertia tables, and how all is
measured on a recording."""

from dynakin.model.calibration.initial import InitialModel
from dynakin.model.calibration.initialise import initialise
from dynakin.model.definition import ModelDefinition, load_model
from dynakin.model.opensim.definition import load_opensim

__all__ = [
    "InitialModel",
    "ModelDefinition",
    "initialise",
    "load_model",
    "load_opensim",
]
