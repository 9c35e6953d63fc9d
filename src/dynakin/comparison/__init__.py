"""Methods beside each other on the same trials, judged by what was measured: the paper's Table II, parameters on
trials that they were not identified on, what the filter has not seen, and repetitions."""

from dynakin.comparison.coverage import Coverage, block_coverage, parameter_coverage
from dynakin.comparison.differences import AngleDifference, MomentDifference, angle_differences, moment_differences
from dynakin.comparison.files import check_comparison_folder, save_comparison
from dynakin.comparison.held_out import Blind, Identified, halves, identify_on, judge, predict_blind
from dynakin.comparison.methods import Method, Trial, compare_trial, trial_of
from dynakin.comparison.setup import Setup
from dynakin.comparison.statistics import Spread, spread
from dynakin.comparison.table2 import Row, marker_fit, merged, table2, trial_fits
from dynakin.comparison.truth import ParameterError, TruthErrors, parameter_errors, truth_errors
from dynakin.comparison.unseen import HORIZON_S, UnseenRow, unseen, unseen_figures

__all__ = [
    "HORIZON_S",
    "AngleDifference",
    "Blind",
    "Coverage",
    "Identified",
    "Method",
    "MomentDifference",
    "ParameterError",
    "Row",
    "Setup",
    "Spread",
    "Trial",
    "TruthErrors",
    "UnseenRow",
    "angle_differences",
    "block_coverage",
    "check_comparison_folder",
    "compare_trial",
    "halves",
    "identify_on",
    "judge",
    "marker_fit",
    "merged",
    "moment_differences",
    "parameter_coverage",
    "parameter_errors",
    "predict_blind",
    "save_comparison",
    "spread",
    "table2",
    "trial_fits",
    "trial_of",
    "truth_errors",
    "unseen",
    "unseen_figures",
]
