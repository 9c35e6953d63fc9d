"""dynakin: how a person moves and what drives the movement, from markers and force plates, in one Kalman filter."""

from importlib import metadata
from typing import TYPE_CHECKING

from dynakin.lazy import loaded_when_asked

if TYPE_CHECKING:
    from dynakin.errors import DynakinError
    from dynakin.filter.estimator import Estimator
    from dynakin.filter.samples import Sample
    from dynakin.filter.tracker import Tracker
    from dynakin.model.calibration.calibrated import CalibratedModel
    from dynakin.model.calibration.how import Calibration
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
    "Calibration",
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

__getattr__, __dir__ = loaded_when_asked(
    __name__,
    {
        "errors": ("DynakinError",),
        "filter.estimator": ("Estimator",),
        "filter.samples": ("Sample",),
        "filter.tracker": ("Tracker",),
        "model.calibration.calibrated": ("CalibratedModel",),
        "model.calibration.how": ("Calibration",),
        "model.definition": ("ModelDefinition", "load_model"),
        "model.opensim.definition": ("load_opensim",),
        "pipeline.result": ("Result",),
        "pipeline.stages": ("run",),
        "recordings.frame": ("GroundFrame",),
        "recordings.read": ("read",),
        "recordings.recording": ("Recording",),
        "results.estimate": ("Estimate",),
        "settings": ("presets",),
        "settings.model": ("Bounds", "Priors"),
        "settings.noise": ("Noise",),
        "settings.subject": ("Subject",),
    },
)
