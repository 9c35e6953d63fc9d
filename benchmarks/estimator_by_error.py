"""The presets by their error against simulated truth, live and smoothed: the second table of docs/validation/planar.md.

    python benchmarks/estimator_by_error.py [--model sagittal7] [--seeds 1 20] [--duration 30] [--set KEY=VALUE]

Every trial is a squat of a drawn subject with soft tissue and noise of the default sizes. The filter starts from
landmarks on the displaced markers, the table's inertia, and lengths that are 3 % off (each its own way). Errors are
taken after 5 s; angles about their mean error, whose size is given apart.
"""

from __future__ import annotations

import argparse
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from itertools import repeat

import numpy as np

import dynakin
from dynakin.filter.measurements import Measurements
from dynakin.filter.samples import marker_paths, total_wrench
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.model.spec import free_names
from dynakin.settings import presets
from dynakin.settings.noise import Noise
from dynakin.simulation.output import SimulatedTrial
from dynakin.simulation.trial import simulate
from dynakin.validation.reference.methods import reference_methods
from dynakin.validation.truth import LEG

SUBJECT = dynakin.Subject(mass_kg=70.0, height_m=1.75, sex="male")
MARKERS = {"sagittal7": "opencap", "squat7": "plug-in-gait"}
START_S = 5.0
LENGTHS_OFF = 0.03
QUANTITIES = ("coordinates", "speeds", "accelerations", "moments")
Array = np.ndarray


@dataclass(frozen=True)
class Figures:
    """Of one method on one trial; a row a coordinate. Errors: RMS about the mean, and the mean (offset), deg; RMS
    rad/s, rad/s2, N m. sd_over_error and inside: RMS standard deviation over RMS error, and coverage of
    the 95 % interval."""

    method: str
    names: tuple[str, ...]
    angle: Array
    offset: Array
    speed: Array
    acceleration: Array
    moment: Array
    sd_over_error: dict[str, Array]
    inside: dict[str, Array]


def off_by(initial: CalibratedModel, seed: int) -> CalibratedModel:
    """Lengths too long or too short by 3 %, each as a coin falls."""

    signs = np.random.default_rng(seed).choice([-1.0, 1.0], len(initial.names))
    lengths = np.array([name.startswith("length/") for name in initial.names])
    x0 = np.where(lengths, initial.x0 * (1.0 + LENGTHS_OFF * signs), initial.x0)
    return replace(initial, x0=np.clip(x0, initial.lower, initial.upper))


def figures(method: str, given: dict[str, Array], trial: SimulatedTrial, names: tuple[str, ...]) -> Figures:
    """Errors of arrays (T, C) by name (coordinates, speeds, accelerations, moments; with _sd where known)."""
    truth = trial.truth.data.sel(coordinate=list(names))
    window = trial.recording.time >= START_S
    errors, ratio, inside = {}, {}, {}
    for name in QUANTITIES:
        if name not in given:
            continue
        error = given[name][window] - truth[name].transpose("time", "coordinate").values[window]
        errors[name] = error
        centred = error - error.mean(axis=0) if name == "coordinates" else error
        sd = given.get(f"{name}_sd")
        if sd is not None:
            rms = np.sqrt(np.mean((error if name == "coordinates" else centred) ** 2, axis=0))
            ratio[name] = np.sqrt(np.mean(sd[window] ** 2, axis=0)) / rms
            inside[name] = np.mean(np.abs(centred) < 1.96 * sd[window], axis=0)
    angle = np.degrees(errors["coordinates"])
    rms = {name: np.sqrt(np.mean(error**2, axis=0)) for name, error in errors.items()}
    return Figures(
        method, names, angle.std(axis=0), angle.mean(axis=0), rms["speeds"], rms["accelerations"], rms["moments"],
        ratio, inside,
    )  # fmt: skip


def blocks(arrays: dict[str, Array], initial: CalibratedModel) -> dict[str, Array]:
    """The core's arrays by the names of the outputs."""
    n = len(free_names(initial.spec))
    found = {"moments": arrays["moments"], "moments_sd": arrays["moments_sd"]}
    for k, name in enumerate(("coordinates", "speeds", "accelerations")):
        found[name] = arrays["state"][:, k * n : (k + 1) * n]
        found[f"{name}_sd"] = arrays["state_sd"][:, k * n : (k + 1) * n]
    return found


def one_trial(model: str, seed: int, duration: float, changes: dict[str, float]) -> list[Figures]:
    trial = simulate(model, "squat", seed, duration)
    definition = dynakin.load_model(model, subject=SUBJECT, markers=MARKERS[model])
    found = []
    settings = {"default": presets.default().model_dump() | changes, "paper": presets.paper().model_dump()}
    for name, values in settings.items():
        estimator = dynakin.Estimator(definition, Noise(**values))
        tracker = estimator.start(off_by(estimator.start(trial.recording).calibrated, seed))
        initial = tracker.calibrated
        names = tuple(free_names(initial.spec))
        markers, wrench = marker_paths(trial.recording, initial), total_wrench(trial.recording, initial)
        measured = Measurements(trial.recording.time, markers, wrench)
        arrays = tracker.run_arrays(measured)
        found.append(figures(name, blocks(arrays, initial), trial, names))
        if name == "default":
            arrays = tracker.fresh().run_smoothed_arrays(measured)
            found.append(figures("default, smoothed", blocks(arrays, initial), trial, names))
    at = reference_methods(trial.recording, initial, definition).data.sel(coordinate=list(names))
    given = {
        n: at[n].transpose("time", "coordinate").values for n in ("coordinates", "speeds", "accelerations", "moments")
    }
    return [*found, figures("AT, 6 Hz", given, trial, names)]


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--model", default="sagittal7", choices=MARKERS)
    parser.add_argument("--seeds", type=int, nargs=2, default=(1, 20))
    parser.add_argument("--duration", type=float, default=30.0)
    parser.add_argument("--set", nargs="*", default=[], metavar="KEY=VALUE", help="changes of the default preset")
    asked = parser.parse_args()
    changes = {key: float(value) for key, _, value in (text.partition("=") for text in asked.set)}
    seeds = range(asked.seeds[0], asked.seeds[1] + 1)
    with ProcessPoolExecutor() as pool:
        trials = list(pool.map(one_trial, repeat(asked.model), seeds, repeat(asked.duration), repeat(changes)))
    print(f"{asked.model}, seeds {asked.seeds[0]} to {asked.seeds[1]}, {asked.duration:g} s")
    for rows in zip(*trials, strict=True):
        tell(rows)


def tell(rows: tuple[Figures, ...]) -> None:
    names = rows[0].names
    leg = [names.index(name) for name in LEG if name in names]
    mean = {
        key: np.mean([getattr(row, key) for row in rows], axis=0)
        for key in ("angle", "speed", "acceleration", "moment")
    }
    offset = np.sqrt(np.mean([row.offset**2 for row in rows], axis=0))
    print(f"\n{rows[0].method}: {', '.join(names)}")
    for title, unit, values in (
        ("angle about its mean", "deg", mean["angle"]),
        ("angle's offset, RMS over trials", "deg", offset),
        ("speed", "rad/s", mean["speed"]),
        ("acceleration", "rad/s2", mean["acceleration"]),
        ("moment", "N m", mean["moment"]),
    ):
        extra = f", ankle to hip {values[leg].mean():.2f}" if title == "moment" else ""
        print(f"  {title}, {unit}: {' '.join(f'{v:.3g}' for v in values)}; mean {values.mean():.3g}{extra}")
    for name in rows[0].sd_over_error:
        ratio = np.sqrt(np.mean([row.sd_over_error[name] ** 2 for row in rows], axis=0))
        inside = np.mean([row.inside[name] for row in rows], axis=0)
        print(
            f"  {name}: sd / error {' '.join(f'{v:.2g}' for v in ratio)}; in 95 % "
            f"{' '.join(f'{100 * v:.0f}' for v in inside)}, pooled {100 * inside.mean():.1f} %"
        )


if __name__ == "__main__":
    main()
