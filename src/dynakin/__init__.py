"""dynakin: how a person moves and what drives the movement, from markers and force plates, in one Kalman filter."""

from importlib import metadata

import dynakin._cpu as _cpu

if not _cpu.supported():
    raise ImportError(
        f"dynakin's core was compiled for {_cpu.level}, which this processor lacks; "
        "build it with: pip install --config-settings=cmake.define.DYNAKIN_VECTOR=baseline ."
    )

from dynakin.errors import DynakinError
from dynakin.filter import Estimator, Noise, Sample, presets
from dynakin.model import Bounds, ModelDefinition, Priors, Subject, initialise, load_model, load_opensim
from dynakin.recordings import GroundFrame, Recording, read
from dynakin.results import Estimate

__version__ = metadata.version("dynakin")

__all__ = [
    "Bounds",
    "DynakinError",
    "Estimate",
    "Estimator",
    "GroundFrame",
    "ModelDefinition",
    "Noise",
    "Priors",
    "Recording",
    "Sample",
    "Subject",
    "initialise",
    "load_model",
    "load_opensim",
    "presets",
    "read",
]
