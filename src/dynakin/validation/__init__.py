"""Methods compared on the same trials, judged by what was measured: the paper's Table II, parameters on
trials that they were not identified on, what the filter has not seen, and repetitions."""

from dynakin.validation.case import Setup
from dynakin.validation.coverage import block_coverage
from dynakin.validation.files import save_comparison
from dynakin.validation.methods import Method, Trial, trial_of
from dynakin.validation.table2 import merged, table2
from dynakin.validation.truth import truth_errors
from dynakin.validation.unseen import unseen

__all__ = [
    "Method",
    "Setup",
    "Trial",
    "block_coverage",
    "merged",
    "save_comparison",
    "table2",
    "trial_of",
    "truth_errors",
    "unseen",
]
