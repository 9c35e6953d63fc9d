"""Models: what a person is made of (TOML), where the markers sit, the inertia tables, and how all is
measured on a recording."""

from dynakin.model.definition import Definition, ModelDefinition, available_models, load_model
from dynakin.model.initial import InitialModel
from dynakin.model.initialise import initialise
from dynakin.model.loads import CarriedLoad, with_loads
from dynakin.model.marker_set import available_marker_sets, load_marker_set
from dynakin.model.measure import measure
from dynakin.model.opensim import OpenSimDefinition, OpenSimOptions, load_opensim
from dynakin.model.priors import Bounds, Priors
from dynakin.model.subject import Subject
from dynakin.model.table import load_table

__all__ = [
    "Bounds",
    "CarriedLoad",
    "Definition",
    "InitialModel",
    "ModelDefinition",
    "OpenSimDefinition",
    "OpenSimOptions",
    "Priors",
    "Subject",
    "available_marker_sets",
    "available_models",
    "initialise",
    "load_marker_set",
    "load_model",
    "load_opensim",
    "load_table",
    "measure",
    "with_loads",
]
