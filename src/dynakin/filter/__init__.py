"""The filter as users meet it: noise settings, the estimator, live samples."""

from dynakin.filter import presets
from dynakin.filter.estimator import Estimator
from dynakin.filter.foot_wrenches import FootWrenches
from dynakin.filter.live import StepEstimate
from dynakin.filter.noise import Noise
from dynakin.filter.samples import Sample

__all__ = ["Estimator", "FootWrenches", "Noise", "Sample", "StepEstimate", "presets"]
