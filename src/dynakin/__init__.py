"""dynakin: how a person moves and what drives the movement, from markers and force plates, in one Kalman filter."""

from importlib import import_module, metadata
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
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

_HOMES = {
    "Bounds": "dynakin.settings.model",
    "CalibratedModel": "dynakin.model.calibration.calibrated",
    "DynakinError": "dynakin.errors",
    "Estimate": "dynakin.results.estimate",
    "Estimator": "dynakin.filter.estimator",
    "GroundFrame": "dynakin.recordings.frame",
    "ModelDefinition": "dynakin.model.definition",
    "Noise": "dynakin.settings.noise",
    "Priors": "dynakin.settings.model",
    "Recording": "dynakin.recordings.recording",
    "Result": "dynakin.pipeline.result",
    "Sample": "dynakin.filter.samples",
    "Subject": "dynakin.settings.subject",
    "Tracker": "dynakin.filter.tracker",
    "load_model": "dynakin.model.definition",
    "load_opensim": "dynakin.model.opensim.definition",
    "presets": "dynakin.settings",
    "read": "dynakin.recordings.read",
    "run": "dynakin.pipeline.stages",
}


def __getattr__(name: str) -> Any:
    """A public name, from its module when it is first asked for: who reads recordings does not wait for the report."""
    if name not in _HOMES:
        raise AttributeError(f"module 'dynakin' has no attribute {name!r}")
    home = import_module(_HOMES[name])
    value = import_module(f"{_HOMES[name]}.{name}") if name == "presets" else getattr(home, name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return __all__
