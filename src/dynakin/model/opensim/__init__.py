"""OpenSim's models (.osim) in and out, without OpenSim."""

from dynakin.model.opensim.definition import OpenSimDefinition, load_opensim, scale_names
from dynakin.model.opensim.description import OpenSimModel
from dynakin.model.opensim.read import read_osim

__all__ = ["OpenSimDefinition", "OpenSimModel", "load_opensim", "read_osim", "scale_names"]
