"""A filter step on an OpenSim model, `squats1`: everything estimated, and kinematics only.

Needs the shared recordings (DYNAKIN_TEST_DATA or ../shared/data).
"""

from __future__ import annotations

import os
import platform
from pathlib import Path

import numpy as np

import dynakin
from dynakin.filter.samples import recording_arrays
from dynakin.model import Subject, load_opensim

DATA = Path(os.environ.get("DYNAKIN_TEST_DATA", Path(__file__).parents[2] / "shared" / "data")) / "opencap_subject4"
FILE = "optimized_scale_and_markers.osim"
REPEATS = 3


def timed(title: str, estimate: tuple[str, ...], *, plates: bool) -> None:
    recording = dynakin.read(DATA / "squats1.trc", DATA / "squats1_grf.mot")
    definition = load_opensim(DATA / FILE, Subject(mass_kg=60.05), estimate=estimate)
    noise = dynakin.presets.default()
    if not plates:
        noise = noise.model_copy(update={"plate_force": 0.0, "plate_moment": 0.0, "plate_delay_s": 0.0})
    estimator = dynakin.Estimator(definition, noise)
    initial = estimator.start(recording)
    markers, wrench = recording_arrays(recording, initial, gaps=True)
    if not plates:
        wrench = np.full_like(wrench, np.nan)
    steps, gaps = [], []
    for _ in range(REPEATS):
        estimator.start_from(initial)
        arrays = estimator.run_arrays(recording.time, markers, wrench)
        steps.append(arrays["step_us"])
        gaps.append(np.sqrt(np.nanmean(((arrays["markers_estimated"] - markers) ** 2).sum(axis=2))))
    best = min(steps, key=lambda values: float(np.median(values)))
    print(
        f"{title}: {arrays['state'].shape[1]} states, {markers.shape[1]} markers, {len(best)} steps: "
        f"median {np.median(best):.0f} us, p99 {np.percentile(best, 99):.0f} us; markers {1000 * gaps[0]:.1f} mm (rms)"
    )


def main() -> None:
    print(f"{platform.processor() or platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}")
    timed("kinematics only", (), plates=False)
    timed("all but soft tissue", ("lengths", "markers", "inertia"), plates=True)
    timed("everything", ("lengths", "markers", "soft_tissue", "inertia"), plates=True)


if __name__ == "__main__":
    main()
