"""Median and 99th percentile of a filter step, against the bare dense update of its size in the same run.

Run with ``make bench``. The trial is `squats1` of the shared recordings where they are (DYNAKIN_TEST_DATA or
../shared/data), else a simulated squat; it is repeated until there are at least 20000 steps.
"""

from __future__ import annotations

import os
import platform
from pathlib import Path

import dynakin_bench
import numpy as np

import dynakin
from dynakin.filter.augment import initial_covariance
from dynakin.filter.core_filter import filter_settings
from dynakin.filter.samples import recording_arrays
from dynakin.simulation.trial import simulate_squat

STEPS = 20_000
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
            markers, wrench = recording_arrays(recording, initial)
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


if __name__ == "__main__":
    main()
