"""What a run gives back: labelled arrays, parameters, events and timing; figures of fit; one writer a file format."""

from dynakin.results.consistency import Consistency, consistency
from dynakin.results.estimate import AXES, COMPONENTS, Estimate
from dynakin.results.fit import SignalFit, TruthError, marker_rms_mm, signal_fit, truth_error, wrench_fit
from dynakin.results.marker_file import laboratory_markers, write_trc
from dynakin.results.mean_curves import MeanCurve, estimate_curves
from dynakin.results.metrics import SCHEMA_VERSION, compute_metrics, evaluation_window
from dynakin.results.output_folder import OPTIONAL_FILES, OUTPUT_FILES, check_output_writable
from dynakin.results.records import EVENT_KINDS, Event, Parameter, Timing
from dynakin.results.repetitions import Found, Repetition, find_repetitions, repetitions_of
from dynakin.results.storage_file import write_storage

__all__ = [
    "AXES",
    "COMPONENTS",
    "EVENT_KINDS",
    "OPTIONAL_FILES",
    "OUTPUT_FILES",
    "SCHEMA_VERSION",
    "Consistency",
    "Estimate",
    "Event",
    "Found",
    "MeanCurve",
    "Parameter",
    "Repetition",
    "SignalFit",
    "Timing",
    "TruthError",
    "check_output_writable",
    "compute_metrics",
    "consistency",
    "estimate_curves",
    "evaluation_window",
    "find_repetitions",
    "laboratory_markers",
    "marker_rms_mm",
    "repetitions_of",
    "signal_fit",
    "truth_error",
    "wrench_fit",
    "write_storage",
    "write_trc",
]
