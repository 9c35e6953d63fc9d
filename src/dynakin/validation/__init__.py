"""Methods compared on the same trials, judged by what was measured: the paper's Table II, parameters on
trials that they were not identified on, what the filter has not seen, and repetitions."""

from dynakin.validation.case import Setup
from dynakin.validation.coverage import block_coverage
from dynakin.validation.files import save_comparison
from dynakin.validation.methods import ComparedTrial, Method, trial_of
from dynakin.validation.table2 import merged, table2
from dynakin.validation.truth import truth_errors
from dynakin.validation.unseen import unseen

__all__ = [
    "ComparedTrial",
    "Method",
    "Setup",
    "block_coverage",
    "merged",
    "save_comparison",
    "table2",
    "trial_of",
    "truth_errors",
    "unseen",
]
