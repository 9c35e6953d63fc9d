"""Methods by their error against the truth of simulated squats: the table of docs/validation/planar.md.

    python benchmarks/methods_by_error.py [FIRST_SEED LAST_SEED]

Each method sees the same markers and plates and starts from landmarks on displaced markers. Errors are taken after 2 s.
"""

from __future__ import annotations

import sys
from collections import defaultdict

import numpy as np

import dynakin
from dynakin.simulation.trial import simulate_squat
from dynakin.validation.reference.least_squares import identify, inertia_of
from dynakin.validation.reference.methods import plane_wrench, reference_methods
from dynakin.validation.reference.regressor import table_dynamics
from dynakin.validation.truth import FIGURES, LEG, truth_errors

SUBJECT = dynakin.Subject(mass_kg=70.0, height_m=1.75, sex="male")
START_S = 2.0


def one_trial(seed: int) -> dict[str, tuple[float, ...]]:
    trial = simulate_squat(seed=seed, duration_s=20.0)
    recording = trial.recording
    window = recording.time >= START_S
    estimator = dynakin.Estimator(dynakin.load_model("sagittal7", subject=SUBJECT, markers="opencap"))
    estimate, tracker = estimator.track(recording, lag_s=0.0)
    data, initial = {"EKF, `paper`": estimate.data}, tracker.calibrated
    at = reference_methods(recording, initial, estimator.model)
    data["AT, 6 Hz"] = at.data
    fit = identify(at.chain, initial.plan, at.kinematics, plane_wrench(recording, initial), mass_kg=initial.mass_kg)
    for title, parameters in (("least squares, free", fit.free), ("least squares, ±20 %", fit.bounded)):
        dynamics = table_dynamics(at.chain, at.kinematics, inertia_of(at.chain, parameters))
        data[title] = at.data.assign(
            moments=(("time", "coordinate"), dynamics.moments),
            wrench_estimated=(("time", "component"), dynamics.wrench),
        )
    data["AT, joints follow their landmarks"] = reference_methods(
        recording, initial, estimator.model, lengths="frame"
    ).data
    return {name: truth_errors(name, given, trial.truth.data, window, LEG).values for name, given in data.items()}


def short(value: float) -> str:
    """Two digits, without an exponent."""
    return f"{value:.0f}" if value >= 10.0 else f"{value:.2g}"


def main() -> None:
    first, last = (int(text) for text in sys.argv[1:3]) if len(sys.argv) > 2 else (1, 5)
    table: dict[str, list[tuple[float, ...]]] = defaultdict(list)
    for seed in range(first, last + 1):
        for method, figures in one_trial(seed).items():
            table[method].append(figures)
    titles = [f"{title}, {unit}" for title, unit in FIGURES]
    print(f"| method (seeds {first} to {last}) | {' | '.join(titles)} |\n|{'---|' * (len(titles) + 1)}")
    for method, rows in table.items():
        mean, sd = np.mean(rows, axis=0), np.std(rows, axis=0, ddof=1)
        print(f"| {method} | {' | '.join(f'{short(m)} ± {short(s)}' for m, s in zip(mean, sd, strict=True))} |")


if __name__ == "__main__":
    main()
