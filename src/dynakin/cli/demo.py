"""`dynakin demo`: a simulated squat whose truth is known, estimated and compared with it and with other methods."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from dynakin.cli.console import out
from dynakin.progress import stage
from dynakin.settings.settings import Settings


def demo(
    output: Annotated[Path, typer.Option("-o", "--output", help="Folder for the results.")] = Path("dynakin-demo"),
    seed: Annotated[int, typer.Option(min=0, help="Of everything that is drawn at random.")] = 1,
    duration: Annotated[float, typer.Option(help="Length of the simulated trial, s.")] = 20.0,
) -> None:
    """Simulate a squat, estimate it, and compare the estimate and the reference methods with the truth."""
    from dynakin.cli.demo_tables import compared_with_truth, constants_in_words, methods_by_error, own_uncertainty
    from dynakin.cli.summary import end, print_summary
    from dynakin.pipeline.stages import judged
    from dynakin.results.failures import Failures
    from dynakin.results.files.folder import check_output_writable
    from dynakin.simulation.trial import simulate_squat
    from dynakin.validation.case import case_of
    from dynakin.validation.methods import estimate_each

    check_output_writable(output)
    trial = simulate_squat(seed=seed, duration_s=duration)
    who = trial.truth.subject
    keys = {"trial": trial.recording.name, "model": "sagittal7", "markers": "opencap", "output": output}
    keys |= {"mass_kg": who.mass_kg, "height_m": who.height_m, "sex": who.sex}
    # with the paper's settings too, for comparison
    case = case_of(Settings.of(keys, "demo"), ("default", "paper"), recording=trial.recording)
    failures = Failures()
    with stage("estimating") as progress:
        estimates, lost, trackers = estimate_each(case.recording, case.setup, progress=progress, failures=failures)
    result = judged(case, estimates, lost, trackers, failures)
    drawn = {"seed": seed, "duration_s": duration}
    result = replace(result, estimate=replace(result.estimate, config=drawn | result.estimate.config))
    estimate, comparison = result.estimate, result.comparison
    methods = {method.name: method.data for method in comparison.methods} if comparison else {}
    folder = result.save(output, check=False)
    console = out()
    console.print(methods_by_error(methods, estimate, trial.truth))
    console.print(compared_with_truth(estimate, trial.truth))
    console.print(own_uncertainty(estimate, trial.truth))
    console.print(constants_in_words(estimate, trial.truth))
    console.print()
    console.print(
        "AT: classical angles, low-passed and differentiated, with the table's inertia and constant lengths; "
        "classical: the same with joints that follow their landmarks. Moments: ankle, knee and hip. "
        "The truth comes from a simulation with soft tissue and sensor noise that shares no code with the filter. "
        "A small distance to markers and plates does not make angles, speeds and moments right.",
        style="dim",
    )
    console.print()
    with failures.stage("summary"):
        print_summary(result, folder)
    end(result)
