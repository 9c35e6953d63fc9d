"""The filter as users meet it: the estimator and its tracker, live samples."""

from dynakin.filter.contacts import ContactLoads
from dynakin.filter.estimator import Estimator
from dynakin.filter.samples import Sample
from dynakin.filter.step import StepEstimate
from dynakin.filter.tracker import Tracker

__all__ = ["ContactLoads", "Estimator", "Sample", "StepEstimate", "Tracker"]
