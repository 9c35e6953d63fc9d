"""`dynakin simulate`: a trial with known truth, as the files that a laboratory would hand over."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from dynakin.cli.console import out, table
from dynakin.errors import ConfigError
from dynakin.progress import stage
from dynakin.settings.defaults import CUTOFF_HZ

if TYPE_CHECKING:
    from dynakin.simulation.output import SimulatedTrial

# Words, because the registries that they stand in load all that simulates; a test compares them.
_MODELS = "sagittal7, squat7 or fullbody"
_MOTIONS = "squat, sit-to-stand, sway (fullbody: squat, gait, belt, sit, steps, steps-down, drop-jump)"
_PLATES = "feet, all, shared, right, left, none"


def simulate(
    output: Annotated[Path, typer.Option("-o", "--output", help="Folder for the trial.")],
    model: Annotated[str, typer.Option(help=f"Model whose coordinates move: {_MODELS}.")] = "sagittal7",
    motion: Annotated[str, typer.Option(help=f"{_MOTIONS}, or a coordinates file (.mot, .sto).")] = "squat",
    seed: Annotated[int, typer.Option(help="Of everything that is drawn at random, from 0.")] = 1,
    duration: Annotated[
        float | None, typer.Option(help="Length, s; else as the motion takes, or all of a file.")
    ] = None,
    rate: Annotated[float, typer.Option("--rate", help="Frames per second.")] = 100.0,
    mass: Annotated[float, typer.Option("--mass", help="Body mass, kg.")] = 70.0,
    height: Annotated[float, typer.Option("--height", help="Body height, m.")] = 1.75,
    sex: Annotated[str, typer.Option("--sex", help="male, female or mean of both, for the table.")] = "male",
    spread: Annotated[
        float,
        typer.Option(
            help="Of the subject about the table, and of joints about their landmarks; 0: none, 1: as people are."
        ),
    ] = 1.0,
    sensors: Annotated[str, typer.Option(help="none (perfect), default, laboratory, or a .toml file.")] = "default",
    sensor: Annotated[list[str] | None, typer.Option(help="KEY=VALUE of one sensor error; may be repeated.")] = None,
    motion_cutoff: Annotated[
        float, typer.Option("--motion-cutoff-hz", help="Low-pass on a coordinates file, Hz.")
    ] = CUTOFF_HZ,
    markers: Annotated[
        str | None, typer.Option(help="Marker set that fullbody wears, built in or a .toml file.")
    ] = None,
    plates: Annotated[str, typer.Option(help=f"What of fullbody has a plate: {_PLATES}.")] = "feet",
    rail: Annotated[float, typer.Option(help="Push of fullbody's hands on a rail, of body weight, to 0.3.")] = 0.0,
) -> None:
    """Simulate a trial whose truth is known, and write recording and truth."""
    from dynakin.results.files.folder import check_output_writable
    from dynakin.simulation.bodies.subject import Spread
    from dynakin.simulation.output import TRIAL
    from dynakin.simulation.sensors.sizes import load_sensors
    from dynakin.simulation.trial import simulate as simulate_trial

    check_output_writable(output, kind=TRIAL)
    noise = load_sensors(sensors).changed(_pairs(sensor or []))
    with stage("simulating"):
        trial = simulate_trial(
            model,
            motion,
            seed,
            duration,
            rate,
            mass,
            height,
            None if sex == "mean" else sex,
            noise=noise,
            spread=Spread().times(spread),
            motion_cutoff_hz=motion_cutoff,
            markers=markers,
            plates=plates,
            rail=rail,
        )
        folder = trial.save(output)
    console = out()
    for said in trial.recording.notes:
        console.print(str(said))
    console.print(_contents(trial, folder))
    console.print(_how_to_run(trial, folder), soft_wrap=True)


def _pairs(texts: Sequence[str]) -> dict[str, object]:
    """KEY=VALUE texts as numbers by key."""
    values: dict[str, object] = {}
    for text in texts:
        key, equals, number = text.partition("=")
        try:
            values[key.strip()] = float(number)
        except ValueError:
            equals = ""
        if not equals:
            raise ConfigError(f"--sensor: found {text!r}, expected KEY=NUMBER such as marker_sd_m=0")
    return values


def _contents(trial: SimulatedTrial, folder: Path) -> Table:
    recording, faults = trial.recording, trial.truth.faults
    rows = table("file", "holds")
    rows.add_row(
        str(folder / "markers.trc"),
        f"{len(recording.marker_names)} markers, {recording.n_frames} frames at {recording.rate:.6g} Hz"
        + (f", {len(faults)} gaps, swaps and flying markers" if faults else ""),
    )
    if recording.plates:
        rows.add_row(str(folder / "forces.mot"), f"{len(recording.plates)} force plates")
    rows.add_row(str(folder / "truth_*.mot, .sto"), "coordinates, speeds, accelerations, moments, wrench, contacts")
    rows.add_row(str(folder / "truth.json"), "settings, lengths, inertial parameters, marker places, faults")
    rows.add_row(str(folder / "truth.nc"), "every array of the truth")
    return rows


def _how_to_run(trial: SimulatedTrial, folder: Path) -> str:
    who = trial.truth.subject
    sex = f" --sex {who.sex}" if who.sex else ""
    forces = f" --forces {quote(str(folder / 'forces.mot'))}" if trial.recording.plates else ""
    return (
        f"To estimate it: dynakin run {quote(str(folder / 'markers.trc'))}{forces} "
        f"--model {trial.settings['model']} --mass {who.mass_kg:g} --height {who.height_m:g}{sex} -o OUT"
    )
