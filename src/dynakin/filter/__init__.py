"""The filter as users meet it: the estimator, live samples."""

from dynakin.filter.estimator import Estimator
from dynakin.filter.foot_wrenches import FootWrenches
from dynakin.filter.live import StepEstimate
from dynakin.filter.samples import Sample

__all__ = ["Estimator", "FootWrenches", "Sample", "StepEstimate"]
