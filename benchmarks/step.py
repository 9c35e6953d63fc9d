"""Median and 99th percentile of a filter step, against the bare dense update of its size in the same run; what
smoothing and fixed lags take beside a step, and beside the bare products of their size.

Run with ``make bench``. The trial is `squats1` of the shared recordings where they are (DYNAKIN_TEST_DATA or
../shared/data), else a simulated squat; it is repeated until there are at least 20000 steps.
"""

from __future__ import annotations

import os
import platform
from pathlib import Path
from time import perf_counter, process_time

import dynakin_bench
import numpy as np
from numpy.typing import NDArray

import dynakin
from dynakin.filter.augment import initial_covariance
from dynakin.filter.core_filter import filter_settings
from dynakin.filter.measurements import Measurements
from dynakin.filter.samples import marker_paths, total_wrench
from dynakin.filter.tracker import Tracker
from dynakin.model.definition import Definition
from dynakin.simulation.trial import simulate_squat

Array = NDArray[np.float64]
STEPS = 20_000
ROUNDS, SMOOTHED, LAGGED = 3, 240, 40
"""Of smoothing: rounds, frames of each, and of those with a lag."""
LAGS = (2, 5, 10)
CONSTANTS = ("lengths", "markers", "inertia")
"""Blocks of the state that do not move, by the preset `default`."""
DATA = Path(os.environ.get("DYNAKIN_TEST_DATA", Path(__file__).parents[2] / "shared" / "data"))


def trials() -> list[tuple[str, str, dynakin.Recording, dynakin.Subject]]:
    """(title, model, recording, subject) of what is timed."""
    found = []
    folder = DATA / "opencap_subject4"
    if folder.exists():
        squats = dynakin.read(folder / "squats1.trc", forces=folder / "squats1_grf.mot")
        found.append(("squats1, sagittal7", "sagittal7", squats, dynakin.Subject(mass_kg=60.05)))
    simulated = simulate_squat(seed=1, duration_s=20.0)
    subject = dynakin.Subject(mass_kg=70.0, height_m=1.75, sex="male")
    found.append(("simulated squat, sagittal7", "sagittal7", simulated.recording, subject))
    return found


def smoothing(title: str, model: Definition, recording: dynakin.Recording) -> None:
    """Medians over rounds in turn, so that a busy machine is as busy for all: a step, what smoothing adds to it, its
    bare products, steps with a lag, and whole runs with a lag, which have deviations in each frame."""
    ready = dynakin.Estimator(model).prepare(recording)
    start, data = ready.tracker, ready.measured.first(SMOOTHED)._replace(contacts=None)
    blocks = {name: size for name, (_, size) in start.core_model.layout.blocks.items()}
    constants = sum(blocks.get(name, 0) for name in CONSTANTS)
    moving = sum(blocks.values()) - constants
    found: dict[str, list[float]] = {}

    def note(name: str, us: list[float] | Array) -> None:
        found.setdefault(name, []).append(float(np.median(us)))

    for _ in range(ROUNDS):
        for threads, name in (("1", "smoothing adds"), ("2", "smoothing adds, 2 threads")):
            os.environ["OMP_NUM_THREADS"] = threads
            arrays = start.fresh().run_smoothed_arrays(data)
            note("step", arrays["step_us"])
            note(name, arrays["backward_us"])
        rows = int(np.median(arrays["n_rows"]))
        note("its bare products", dynakin_bench.smoothing_products(moving, constants, rows, 60))
        for lag in LAGS:
            late = Tracker(start.calibrated, start.noise, start.estimate, lag)
            note(f"step, lag {lag}", [one_step(late, data, k) for k in range(LAGGED)][lag + 1 :])
            before = process_time()
            start.fresh().run_late_arrays(lag, data.first(LAGGED))
            note(f"run, lag {lag}, deviations", [1e6 * (process_time() - before) / LAGGED])
        plain = start.fresh()
        note("step, no lag", [one_step(plain, data, k) for k in range(LAGGED)])
    step = np.median(found["step"])
    print(f"{title}: {moving} moving states, {constants} constants, {rows} rows")
    for name, us in found.items():
        print(f"  {name:25} {np.median(us):8.0f} us, {np.median(us) / step:5.2f} steps")


def one_step(tracker: Tracker, data: Measurements, k: int) -> float:
    """Microseconds of the core's step alone."""
    time, markers, wrench, _ = data
    core = tracker._filter if tracker._lag is None else tracker._lag
    dt = time[k] - time[k - 1] if k else 0.0
    before = perf_counter()
    core.step(dt, markers[k], wrench[k])
    return 1e6 * (perf_counter() - before)


def describe(values: list[float]) -> str:
    return f"median {np.median(values):6.1f} us, p99 {np.percentile(values, 99):6.1f} us"


def main() -> None:
    print(f"{platform.processor() or platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}")
    for title, name, recording, subject in trials():
        medians = {}
        for preset in ("paper", "default"):
            noise = dynakin.presets.preset(preset)
            estimator = dynakin.Estimator(dynakin.load_model(name, subject=subject, markers="opencap"), noise)
            tracker = estimator.start(recording)
            initial, model = tracker.calibrated, tracker.core_model
            markers, wrench = marker_paths(recording, initial), total_wrench(recording, initial)
            rows = int(sum(sum(m.measured) for m in initial.spec.markers) + sum(initial.spec.wrench_measured))
            rows += noise.total_mass_use == "frame"
            settings, P0 = filter_settings(initial, noise, model.layout), initial_covariance(initial, noise)
            step, dense = [], []
            while len(step) < STEPS:
                result = dynakin_bench.interleaved(
                    model, settings, initial.x0, P0, recording.time, markers, wrench, rows
                )
                step += result[0]
                dense += result[1]
            medians[preset] = np.median(step)
            print(f"{title}, {preset}: {model.layout.size} states, {rows} rows, {len(step)} steps")
            print(f"  step         {describe(step)}")
            print(f"  dense update {describe(dense)}   step / dense = {medians[preset] / np.median(dense):.2f}")
        print(f"  default / paper = {medians['default'] / medians['paper']:.2f}")
    for title, name, recording, subject in trials():
        smoothing(title, dynakin.load_model(name, subject=subject, markers="opencap"), recording)
        if title.startswith("squats1"):
            body = dynakin.Subject(mass_kg=subject.mass_kg, height_m=1.70)
            smoothing("squats1, fullbody", dynakin.load_model("fullbody", subject=body), recording)


if __name__ == "__main__":
    main()
