"""Methods by their error against the truth of simulated squats: the table of docs/validation.md.

    python benchmarks/methods_by_error.py [FIRST_SEED LAST_SEED]

Each method sees the same markers and plates and starts from landmarks on displaced markers. Errors are taken after 2 s;
angles after removing each coordinate's mean offset.
"""

from __future__ import annotations

import sys
from collections import defaultdict

import numpy as np
import numpy.typing as npt
import xarray as xr

import dynakin
from dynakin.reference import bodies_of, identify, reference_methods, table_dynamics
from dynakin.reference.methods import plane_wrench
from dynakin.simulation import simulate_squat

Array = npt.NDArray[np.float64]
SUBJECT = dynakin.Subject(mass_kg=70.0, height_m=1.75, sex="male")
START_S = 2.0
FIGURES = ("angles, deg", "speeds, rad/s", "accelerations, rad/s2", "moments, N m", "FX, N", "FY, N", "MZ, N m")


def short(value: float) -> str:
    """Two digits, without an exponent."""
    return f"{value:.0f}" if value >= 10.0 else f"{value:.2g}"


def rms(values: Array) -> Array:
    return np.sqrt(np.nanmean(values**2, axis=0))


def errors(data: xr.Dataset, moments: Array, wrench: Array, truth: xr.Dataset, window: Array) -> list[float]:
    """The figures of one method; moments over ankle, knee and hip."""
    names = [str(name) for name in truth["coordinate"].values]
    angle = np.degrees((data["coordinates"].sel(coordinate=names) - truth["coordinates"]).values[window])
    legs = [names.index(name) for name in ("ankle", "knee", "hip")]
    force = rms(wrench[window][:, [0, 1, 5]] - truth["wrench"].values[window][:, [0, 1, 5]])
    return [
        float(np.mean(rms(angle - np.nanmean(angle, axis=0)))),
        *(
            float(np.mean(rms((data[kind].sel(coordinate=names) - truth[kind]).values[window])))
            for kind in ("speeds", "accelerations")
        ),
        float(np.mean(rms((moments - truth["moments"].values)[window][:, legs]))),
        *(float(value) for value in force),
    ]


def one_trial(seed: int) -> dict[str, list[float]]:
    trial = simulate_squat(seed=seed, duration_s=20.0)
    truth, recording = trial.truth.data, trial.recording
    window = recording.time >= START_S
    estimator = dynakin.Estimator(dynakin.load_model("sagittal7", subject=SUBJECT, markers="opencap"))
    ekf = estimator.run(recording).data
    initial = estimator.initial
    assert initial is not None
    found = {"EKF, `paper`": errors(ekf, ekf["moments"].values, ekf["wrench_estimated"].values, truth, window)}
    for lengths, title in (("constant", "AT, 6 Hz"), ("frame", "AT, 6 Hz, lengths of each frame")):
        at = reference_methods(recording, initial, estimator.model, lengths=lengths)
        data = at.data
        found[title] = errors(data, data["moments"].values, data["wrench_estimated"].values, truth, window)
        if lengths == "frame":
            continue
        fit = identify(at.chain, initial.plan, at.kinematics, plane_wrench(recording, initial), mass_kg=initial.mass_kg)
        for title, parameters in (("least squares, free", fit.free), ("least squares, +-20 %", fit.bounded)):
            dynamics = table_dynamics(at.chain, at.kinematics, bodies_of(at.chain, parameters))
            found[title] = errors(data, dynamics.moments, dynamics.wrench, truth, window)
    return found


def main() -> None:
    first, last = (int(text) for text in sys.argv[1:3]) if len(sys.argv) > 2 else (1, 5)
    table: dict[str, list[list[float]]] = defaultdict(list)
    for seed in range(first, last + 1):
        for method, figures in one_trial(seed).items():
            table[method].append(figures)
    print(f"| method (seeds {first} to {last}) | {' | '.join(FIGURES)} |\n|{'---|' * (len(FIGURES) + 1)}")
    for method, rows in table.items():
        mean, sd = np.mean(rows, axis=0), np.std(rows, axis=0, ddof=1)
        print(f"| {method} | {' | '.join(f'{short(m)} ± {short(s)}' for m, s in zip(mean, sd, strict=True))} |")


if __name__ == "__main__":
    main()
