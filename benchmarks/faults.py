"""Simulated trials in which much goes wrong: how often does a filter lose its way, and does it say so?

    python benchmarks/faults.py [--seeds 1 200] [--presets default gain sigmoid paper]

Subjects (50 to 100 kg), motions (squats, sit-to-stand, sway) and faults are drawn: markers misplaced, lost, swapped and
flying off, plates with gain errors and a lag. "default" keeps bounds by projection; "gain" and "sigmoid" are the same
settings with other constraints; "paper" is the paper's.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass

import numpy as np

import dynakin
from dynakin.errors import DivergenceError, DynakinError
from dynakin.results.estimate import Estimate
from dynakin.settings import presets
from dynakin.settings.noise import Noise
from dynakin.simulation.output import SimulatedTrial
from dynakin.simulation.sensors.sizes import SensorNoise
from dynakin.simulation.trial import simulate

DURATION_S = 12.0
LOST_DEG = 25.0
SIGMAS = 4.0
START_S = 2.0
MOTIONS = ("squat", "squat", "sit-to-stand", "sway")
SETTINGS: dict[str, Callable[[], Noise]] = {
    "default": presets.default,
    "gain": lambda: presets.default().changed(constraint="gain"),
    "sigmoid": lambda: presets.default().changed(constraint="sigmoid"),
    "paper": presets.paper,
}


@dataclass(frozen=True)
class Outcome:
    """What became of one trial.

    refused: the recording was not taken, with the reason. lost: some angle further than 25 deg, and than 4 of its own
    standard deviations, from the truth after 2 s. told: the filter itself had said that it lost its motion, or had
    stopped. impossible: frames in which some segment's inertia belongs to no body. held: parameters that end on a bound
    (the truth never lies on one).
    """

    seed: int
    preset: str
    refused: str = ""
    lost: bool = False
    told: bool = False
    not_finite: bool = False
    impossible: int = 0
    held: tuple[str, ...] = ()
    worst_deg: float = np.nan
    step_us: float = np.nan


def faulty_trial(seed: int) -> tuple[SimulatedTrial, dynakin.Subject]:
    rng = np.random.default_rng(seed)
    mass, height = float(np.round(rng.uniform(50.0, 100.0), 1)), float(np.round(rng.uniform(1.55, 1.90), 2))
    sex = ("male", "female")[int(rng.integers(2))]
    noise = SensorNoise(
        misplacement_sd_m=0.005,
        hip_regression_sd_m=0.007,
        occlusion_per_min=rng.uniform(0.0, 10.0),
        occlusion_mean_s=rng.uniform(0.1, 1.0),
        swap_per_min=rng.uniform(0.0, 8.0),
        swap_mean_s=rng.uniform(0.1, 1.0),
        flying_per_min=rng.uniform(0.0, 8.0),
        flying_mean_s=0.1,
        plate_gain_sd=0.01,
        plate_step_n=1.0,
        plate_step_nm=0.3,
        plate_lag_s=rng.uniform(-0.01, 0.02),
    )
    motion = MOTIONS[seed % len(MOTIONS)]
    trial = simulate("sagittal7", motion, seed, DURATION_S, mass_kg=mass, height_m=height, sex=sex, noise=noise)
    return trial, dynakin.Subject(mass_kg=mass, height_m=height, sex=sex)


def outcomes(seed: int, names: tuple[str, ...]) -> list[Outcome]:
    trial, subject = faulty_trial(seed)
    model = dynakin.load_model("sagittal7", subject=subject, markers="opencap")
    found = []
    for name in names:
        try:
            estimate = dynakin.Estimator(model, SETTINGS[name]()).run(trial.recording, lag_s=0.0)
        except DivergenceError:
            found.append(Outcome(seed, name, lost=True, told=True))
        except DynakinError as error:
            found.append(Outcome(seed, name, refused=str(error)))
        else:
            found.append(judged(seed, name, estimate, trial))
    return found


def judged(seed: int, preset: str, estimate: Estimate, trial: SimulatedTrial) -> Outcome:
    truth = trial.truth.data
    window = estimate.time >= START_S
    names = list(truth["coordinate"].values)
    given = estimate.data["coordinates"].sel(coordinate=names).transpose("time", "coordinate").values
    sd = estimate.data["coordinates_sd"].sel(coordinate=names).transpose("time", "coordinate").values[window]
    error = np.abs(given - truth["coordinates"].transpose("time", "coordinate").values)[window]
    state = estimate.data["state"].values
    told = any(event.kind == "reset" for event in estimate.events)
    finite = bool(np.isfinite(state).all())
    worst = float(np.degrees(error.max())) if finite else np.inf
    lost = not finite or bool(((error > np.radians(LOST_DEG)) & (error > SIGMAS * sd)).any())
    return Outcome(
        seed,
        preset,
        lost=lost,
        told=told,
        not_finite=not finite,
        impossible=impossible_frames(estimate),
        held=tuple(p.name for p in estimate.parameters if p.at_bound),
        worst_deg=worst,
        step_us=estimate.timing.median_us,
    )


def impossible_frames(estimate: Estimate) -> int:
    """Frames in which a segment has m <= 0 or m izz <= mx^2 + my^2."""
    state = estimate.data["state"]
    segments = {p.segment for p in estimate.parameters if p.kind == "inertia" and p.estimated}
    bad = np.zeros(len(estimate.time), dtype=bool)
    for segment in segments:
        m, mx, my, izz = (state.sel(element=f"inertia/{segment}/{key}").values for key in ("mass", "mx", "my", "izz"))
        bad |= (m <= 0.0) | (m * izz <= mx**2 + my**2)
    return int(bad.sum())


def counted(rows: list[Outcome]) -> list[str]:
    taken = [row for row in rows if not row.refused]
    numbers = (
        len(taken),
        len(rows) - len(taken),
        sum(row.lost and not row.told for row in taken),
        sum(row.lost and row.told for row in taken),
        sum(row.told and not row.lost for row in taken),
        sum(row.not_finite for row in taken),
        sum(row.impossible > 0 for row in taken),
        sum(len(row.held) > 0 for row in taken),
    )
    return [*map(str, numbers), f"{np.nanmedian([row.step_us for row in taken]):.0f}"]


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--seeds", type=int, nargs=2, default=(1, 200))
    parser.add_argument("--presets", nargs="+", default=list(SETTINGS), choices=SETTINGS)
    asked = parser.parse_args()
    seeds = range(asked.seeds[0], asked.seeds[1] + 1)
    with ProcessPoolExecutor() as pool:
        rows = [row for rows in pool.map(outcomes, seeds, [tuple(asked.presets)] * len(seeds)) for row in rows]
    heads = ("constraint", "trials", "refused at the start", "lost, not told", "lost, told", "told, not lost")
    heads += ("not finite", "impossible inertia", "parameters held", "step, us")
    print("| " + " | ".join(heads) + " |\n|" + "---|" * len(heads))
    for name in asked.presets:
        print("| " + " | ".join([name, *counted([row for row in rows if row.preset == name])]) + " |")
    for row in rows:
        if row.refused or row.lost or row.told or row.impossible or row.held:
            print(row)


if __name__ == "__main__":
    main()
