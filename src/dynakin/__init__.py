"""dynakin: how a person moves and what drives the movement, from markers and force plates, in one Kalman filter."""

from importlib import metadata

import dynakin._cpu as _cpu

if not _cpu.supported():
    raise ImportError(
        f"dynakin's core was compiled for {_cpu.level}, which this processor lacks; "
        "build it with: pip install --config-settings=cmake.define.DYNAKIN_VECTOR=baseline ."
    )

from dynakin.errors import DynakinError
from dynakin.filter.estimator import Estimator
from dynakin.filter.samples import Sample
from dynakin.filter.tracker import Tracker
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.model.definition import ModelDefinition, load_model
from dynakin.model.opensim.definition import load_opensim
from dynakin.pipeline.result import Result
from dynakin.pipeline.stages import run
from dynakin.recordings.frame import GroundFrame
from dynakin.recordings.read import read
from dynakin.recordings.recording import Recording
from dynakin.results.estimate import Estimate
from dynakin.settings import presets
from dynakin.settings.model import Bounds, Priors
from dynakin.settings.noise import Noise
from dynakin.settings.subject import Subject

__version__ = metadata.version("dynakin")

__all__ = [
    "Bounds",
    "CalibratedModel",
    "DynakinError",
    "Estimate",
    "Estimator",
    "GroundFrame",
    "ModelDefinition",
    "Noise",
    "Priors",
    "Recording",
    "Result",
    "Sample",
    "Subject",
    "Tracker",
    "load_model",
    "load_opensim",
    "presets",
    "read",
    "run",
]
