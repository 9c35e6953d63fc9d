"""`dynakin model NAME --identifiability`: what the model's measurements can tell, and what a trial told."""

from __future__ import annotations

from pathlib import Path

from rich.table import Table

from dynakin.cli.console import out, progress_bar, table
from dynakin.filter.estimator import Estimator
from dynakin.identification.observability.person import tracker_of
from dynakin.identification.observability.structure import Structure, structure_of
from dynakin.identification.observability.trial import Identifiability, identifiability
from dynakin.model.definition import ModelDefinition
from dynakin.recordings.read import read
from dynakin.results.measures.posterior import JUDGEMENT_WORDS, judged
from dynakin.results.naming import number, sentence


def print_identifiability(definition: ModelDefinition, trial: Path | None, forces: Path | None) -> None:
    """Structure of the model, by a simulated person where no trial is given; what the trial told where one is.

    Raises:
        DynakinError: model and trial do not fit.
    """
    if trial is None:
        _print_structure(structure_of(tracker_of(definition)))
        return
    with progress_bar("estimating") as progress:
        estimate, tracker = Estimator(definition).track(read(trial, forces), progress=progress)
    with progress_bar("trying motions") as progress:
        found = identifiability(tracker, estimate, progress)
    _print_structure(found.structure, found)
    console = out()
    console.print("\nWhat this trial tells", style="bold")
    for text in found.in_words():
        console.print(f"- {text}")
    console.print("\nWhat would tell more", style="bold")
    for text in found.advice:
        console.print(f"- {text}")


def _print_structure(structure: Structure, told: Identifiability | None = None) -> None:
    console = out()
    for text in structure.in_words():
        console.print(text)
    console.print(_base(structure, told))
    console.print("Gauges: what no measurement sees", style="bold")
    for text in structure.gauges_in_words:
        console.print(f"- {sentence(text)}.")


def _base(structure: Structure, told: Identifiability | None) -> Table:
    if told is None:
        rows = table("", "base parameter", numbers=(0,), title="Base parameters")
        for k, text in enumerate(structure.base_in_words, start=1):
            rows.add_row(str(k), text)
        return rows
    rows = table(
        "base parameter", "value", "sd before", "sd after", "", numbers=(1, 2, 3), title="Base parameters (kg, m)"
    )
    for entry in told.base:
        numbers = (number(value) for value in (entry.value, entry.prior_sd, entry.sd))
        rows.add_row(entry.words, *numbers, JUDGEMENT_WORDS[judged(entry.share)])
    return rows
