"""A whole-body step, and what smoothing adds to it, by vector level of the core: each level in a process of its own,
the processes in turns, so that a busy machine is as busy for all.

    OMP_NUM_THREADS=1 .venv/bin/python benchmarks/levels.py

The trial is `squats1` of the shared recordings where they are (DYNAKIN_TEST_DATA or ../shared/data), else simulated.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys

import numpy as np

import dynakin
from dynakin.simulation.trial import simulate
from recordings import DATA

TURNS = 12


def work() -> None:
    """Time a turn for each line that comes in."""
    folder = DATA / "opencap_subject4"
    if folder.exists():
        recording = dynakin.read(folder / "squats1.trc", forces=folder / "squats1_grf.mot").window(2.0, 3.0)
        subject = dynakin.Subject(mass_kg=60.05)
    else:
        recording = simulate("fullbody", "squat", 1, 5.0).recording.window(2.0, 3.0)
        subject = dynakin.Subject(mass_kg=70.0, height_m=1.75, sex="male")
    ready = dynakin.Estimator(dynakin.load_model("fullbody", subject=subject)).prepare(recording, lag_s=0.0)
    for _ in sys.stdin:
        arrays = ready.tracker.fresh().run_smoothed_arrays(ready.measured)
        print(json.dumps([arrays["step_us"].tolist(), arrays["backward_us"].tolist()]), flush=True)


def main() -> None:
    from dynakin.bindings import _cpu

    levels = [level for level in _cpu.built() if _cpu.has(level)]
    workers = {
        level: subprocess.Popen(
            [sys.executable, __file__, "work"],
            env=os.environ | {"DYNAKIN_VECTOR": level},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        for level in levels
    }
    found: dict[str, list[list[list[float]]]] = {level: [] for level in levels}
    for _ in range(TURNS):
        for level, worker in workers.items():
            assert worker.stdin is not None and worker.stdout is not None
            print("go", file=worker.stdin, flush=True)
            found[level].append(json.loads(worker.stdout.readline()))
    for worker in workers.values():
        worker.communicate()
    reference = "v3" if "v3" in levels else levels[-1]
    for which, name in enumerate(("step", "smoothing adds")):
        medians = {level: np.median([us for turn in found[level] for us in turn[which]]) for level in levels}
        steps = sum(len(turn[which]) for turn in found[reference])
        for level, us in medians.items():
            turns = [
                np.median(a[which]) / np.median(b[which]) for a, b in zip(found[level], found[reference], strict=True)
            ]
            print(
                f"{name:15} {level:9} {us:7.0f} us, {us / medians[reference]:.2f} of {reference}'s "
                f"({min(turns):.2f} to {max(turns):.2f} by turn), {steps} frames"
            )


if __name__ == "__main__":
    work() if sys.argv[1:] == ["work"] else main()
