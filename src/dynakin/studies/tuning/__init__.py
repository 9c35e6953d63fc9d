"""Noise settings chosen by measurement: the paper's grid, maximum likelihood, and what each criterion is worth."""

from dynakin.studies.tuning.grid import Axis, Grid, axis, belongs_to, paper_axes, run_grid
from dynakin.studies.tuning.score import CRITERIA, Shared
from dynakin.studies.tuning.trial import TuningTrial, prepare

__all__ = [
    "CRITERIA",
    "Axis",
    "Grid",
    "Shared",
    "TuningTrial",
    "axis",
    "belongs_to",
    "paper_axes",
    "prepare",
    "run_grid",
]
