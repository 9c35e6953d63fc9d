"""Latency of a live session at 200 Hz: from a sample's arrival to its published estimate, with and without the viewer.

    .venv/bin/python benchmarks/live_latency.py [--seconds 120] [--view] [--model planar|fullbody]

The whole body needs real recordings (../shared/data, or DYNAKIN_TEST_DATA); they are interpolated to 200 Hz.
"""

from __future__ import annotations

import argparse
import os
import resource
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

import dynakin
from dynakin.recordings import Plate, Recording
from dynakin.simulation import simulate_squat
from dynakin.stream import Callback, Live, LiveFrame, Replay, Sink

RATE_HZ = 200.0


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--seconds", type=float, default=120.0)
    parser.add_argument("--view", action="store_true")
    parser.add_argument("--model", choices=["planar", "fullbody"], action="append")
    asked = parser.parse_args()
    for name in asked.model or ["planar", "fullbody"]:
        measure(name, asked.seconds, asked.view)


def measure(name: str, seconds: float, view: bool) -> None:
    """One session; prints a line."""
    recording, estimator = planar() if name == "planar" else fullbody()
    latency: list[float] = []
    memory: list[int] = []

    def on_frame(frame: LiveFrame) -> None:
        latency.append(time.monotonic() - frame.fused.arrived_s)
        if len(latency) % 1000 == 0:
            memory.append(resident_kb())

    sinks: list[Sink] = [Callback(on_frame)]
    if view:
        from dynakin.stream.viewer import Viewer

        sinks.insert(0, Viewer(port=8137))
    source = Replay(recording, loop=True, duration_s=seconds + 3.0)
    live = Live(estimator, [source], sinks, standing_wait_s=2.5, say=lambda text: None)
    live.run()
    ms = 1e3 * np.array(latency[200:])  # the first second catches up with what came while the model was measured
    grown = (memory[-1] - memory[0]) / 1024 if len(memory) > 1 else float("nan")
    print(
        f"{name:9s} {len(estimator.state):4d} states  view {'yes' if view else 'no ':3s}  {len(ms):6d} frames  "
        f"median {np.median(ms):6.2f} ms  p99 {np.percentile(ms, 99):7.2f} ms  max {ms.max():7.2f} ms  "
        f"lost {live.fusion.marker_counts.lost}  memory {grown:+.1f} MB  load {os.getloadavg()[0]:.1f}",
        flush=True,
    )


def planar() -> tuple[Recording, dynakin.Estimator]:
    """Simulated squats, sagittal7."""
    recording = simulate_squat(seed=1, duration_s=20.0, rate_hz=RATE_HZ).recording
    subject = dynakin.Subject(mass_kg=70.0, height_m=1.75, sex="male")
    return recording, dynakin.Estimator(dynakin.load_model("sagittal7", subject, markers="opencap"))


def fullbody() -> tuple[Recording, dynakin.Estimator]:
    """Real squats, every frame and one in between."""
    folder = Path(os.environ.get("DYNAKIN_TEST_DATA", "../shared/data")) / "opencap_subject4"
    recording = dynakin.read(folder / "squats1.trc", folder / "squats1_grf.mot", causal=True)
    fine = np.arange(recording.time[0], recording.time[-1], 1.0 / RATE_HZ)
    plates = tuple(
        Plate(plate.name, *(between(recording.time, getattr(plate, key), fine) for key in KEYS))
        for plate in recording.plates
    )
    denser = replace(recording, time=fine, markers=between(recording.time, recording.markers, fine), plates=plates)
    subject = dynakin.Subject(mass_kg=60.05, height_m=1.70)
    return denser, dynakin.Estimator(dynakin.load_model("fullbody", subject))


KEYS = ("force", "moment", "cop", "free_moment")


def between(time_in: np.ndarray, values: np.ndarray, time_out: np.ndarray) -> np.ndarray:
    """Straight lines between frames (T, ...)."""
    k = np.clip(np.searchsorted(time_in, time_out, side="right") - 1, 0, len(time_in) - 2)
    part = ((time_out - time_in[k]) / (time_in[k + 1] - time_in[k])).reshape(-1, *[1] * (values.ndim - 1))
    return np.asarray((1.0 - part) * values[k] + part * values[k + 1])


def resident_kb() -> int:
    """Memory of this process, kB: now where the system tells it, else the most so far."""
    status = Path("/proc/self/status")
    if status.exists():
        line = next(line for line in status.read_text().splitlines() if line.startswith("VmRSS"))
        return int(line.split()[1])
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak // 1024 if sys.platform == "darwin" else peak


if __name__ == "__main__":
    main()
