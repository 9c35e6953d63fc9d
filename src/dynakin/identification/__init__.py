"""Inertial parameters of a subject from several trials, and whether they predict."""

from typing import TYPE_CHECKING

from dynakin.lazy import loaded_when_asked

if TYPE_CHECKING:
    from dynakin.identification.batch import Posterior, identify_batch
    from dynakin.identification.decision import Decision
    from dynakin.identification.inertial_parameters import InertialParameters, InertialPriors
    from dynakin.identification.report import Change, change_between
    from dynakin.identification.subject import identify_subject
    from dynakin.identification.trials import measure_all

__all__ = [
    "Change",
    "Decision",
    "InertialParameters",
    "InertialPriors",
    "Posterior",
    "change_between",
    "identify_batch",
    "identify_subject",
    "measure_all",
]

__getattr__, __dir__ = loaded_when_asked(
    __name__,
    {
        "batch": ("Posterior", "identify_batch"),
        "change": ("Change", "change_between"),
        "decision": ("Decision",),
        "inertial_parameters": ("InertialParameters", "InertialPriors"),
        "subject": ("identify_subject",),
        "trials": ("measure_all",),
    },
)
