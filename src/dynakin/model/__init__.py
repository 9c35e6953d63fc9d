"""Models: what a person is made of (TOML), where the markers sit, the inertia tables, and how all is
measured on a recording."""

from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.model.definition import Definition, ModelDefinition, load_model
from dynakin.model.opensim.definition import load_opensim

__all__ = [
    "CalibratedModel",
    "Definition",
    "ModelDefinition",
    "load_model",
    "load_opensim",
]
