"""Latency of a live session at 200 Hz: from a sample's arrival to its published estimate, with and without the viewer.

    OMP_NUM_THREADS=1 .venv/bin/python benchmarks/live_latency.py [--seconds 120] [--model fullbody] [--view yes]

Prints a table. "CPU": the time that the session's thread worked from one frame to the next, whoever else ran. "Others"
is the share of all cores that other processes took meanwhile: above a few percent the longest latencies are theirs. The
whole body needs real recordings (../shared/data, or DYNAKIN_TEST_DATA), interpolated to 200 Hz and played forwards and
backwards in turn, so that nothing jumps where it begins anew. With the viewer its process runs; no browser is open,
because one that draws without a graphics card takes the machine.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import os
import resource
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

import dynakin
from dynakin.recordings.recording import Plate, Recording
from dynakin.simulation.trial import simulate_squat
from dynakin.stream.session import Live
from dynakin.stream.sinks.base import Callback, LiveFrame, Sink
from dynakin.stream.sources.replay import Replay

RATE_HZ = 200.0
COLUMNS = (
    "model",
    "states",
    "viewer",
    "frames",
    "median ms",
    "p99 ms",
    "max ms",
    "CPU median, p99 ms",
    "lost, left out",
    "memory MB",
    "others %",
)
SETTLED_S = 2.0  # after the start, frames that came while the model was measured are caught up


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--seconds", type=float, default=120.0)
    parser.add_argument("--view", choices=["yes", "no"], action="append")
    parser.add_argument("--model", choices=["planar", "fullbody"], action="append")
    asked = parser.parse_args()
    print(f"| {' | '.join(COLUMNS)} |")
    print("|---" * len(COLUMNS) + "|", flush=True)
    for name in asked.model or ["planar", "fullbody"]:
        for view in asked.view or ["no", "yes"]:
            measure(name, asked.seconds, view == "yes")


def measure(name: str, seconds: float, view: bool) -> None:
    """One session; prints a line."""
    recording, estimator = planar() if name == "planar" else fullbody()
    # Kept as numbers, not as objects: the benchmark's own memory does not grow.
    latency = np.full(int((seconds + 10.0) * RATE_HZ), np.nan)
    worked = np.full(len(latency), np.nan)
    memory: list[int] = []
    count = 0

    def on_frame(frame: LiveFrame) -> None:
        nonlocal count
        worked[count] = time.thread_time()
        latency[count] = time.monotonic() - frame.fused.arrived_s
        count += 1
        if count % 1000 == 0:
            memory.append(resident_kb())

    sinks: list[Sink] = [Callback(on_frame)]
    if view:
        from dynakin.stream.viewer.sink import Viewer

        with contextlib.redirect_stdout(io.StringIO()):  # its address
            sinks.insert(0, Viewer(port=8137))
        time.sleep(5.0)  # the page loads its libraries
    source = Replay(recording, loop=True, duration_s=seconds + 4.0)
    live = Live(estimator, [source], sinks, lag_s=0.0, standing_wait_s=2.5, say=lambda text: None)
    before = busy_s(), own_s(), time.monotonic()
    live.run()
    after = busy_s(), own_s(), time.monotonic()
    ms = 1e3 * latency[int(SETTLED_S * RATE_HZ) : count]
    cpu = 1e3 * np.diff(worked[int(SETTLED_S * RATE_HZ) : count])
    left_out = live.status.left_out
    grown = (memory[-1] - memory[1]) / 1024 if len(memory) > 2 else float("nan")
    cores = os.cpu_count() or 1
    others = (after[0] - before[0]) - (after[1] - before[1])
    share = 100.0 * others / ((after[2] - before[2]) * cores)
    row = (
        name,
        f"{len(live.tracker.state)}",
        "yes" if view else "no",
        f"{len(ms)}",
        f"{np.median(ms):.2f}",
        f"{np.percentile(ms, 99):.2f}",
        f"{ms.max():.1f}",
        f"{np.median(cpu):.2f}, {np.percentile(cpu, 99):.2f}",
        f"{live.fusion.marker_counts.lost}, {left_out}",
        f"{grown:+.1f}",
        f"{share:.0f}",
    )
    print(f"| {' | '.join(row)} |", flush=True)


def busy_s() -> float:
    """Time that all cores have worked, of all processes; NaN where the system does not say."""
    stat = Path("/proc/stat")
    if not stat.exists():
        return float("nan")
    user, nice, system, _idle, _wait, irq, softirq = map(int, stat.read_text().split()[1:8])
    return float(user + nice + system + irq + softirq) / os.sysconf("SC_CLK_TCK")


def own_s() -> float:
    """Time that this process and those that it started have worked."""
    took = 0.0
    for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN):
        used = resource.getrusage(who)
        took += used.ru_utime + used.ru_stime
    return took


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
    return there_and_back(denser), dynakin.Estimator(dynakin.load_model("fullbody", subject))


def there_and_back(recording: Recording) -> Recording:
    """A movement that can be repeated without a jump; backwards it has the same forces."""

    def both(values: np.ndarray) -> np.ndarray:
        return np.concatenate([values, values[-2:0:-1]])

    time_s = recording.time[0] + np.arange(2 * len(recording.time) - 2) / RATE_HZ
    plates = tuple(
        Plate(plate.name, *(both(np.asarray(getattr(plate, key))) for key in KEYS)) for plate in recording.plates
    )
    return replace(recording, time=time_s, markers=both(recording.markers), plates=plates)


KEYS = ("force", "moment", "cop", "free_moment")


def between(time_in: np.ndarray, values: np.ndarray, time_out: np.ndarray) -> np.ndarray:
    """Straight lines between frames (T, ...)."""
    k = np.clip(np.searchsorted(time_in, time_out, side="right") - 1, 0, len(time_in) - 2)
    part = ((time_out - time_in[k]) / (time_in[k + 1] - time_in[k])).reshape(-1, *[1] * (values.ndim - 1))
    return np.asarray((1.0 - part) * values[k] + part * values[k + 1])


def resident_kb() -> int:
    """Memory of this process, kB: now where the system gives it, else the most so far."""
    status = Path("/proc/self/status")
    if status.exists():
        line = next(line for line in status.read_text().splitlines() if line.startswith("VmRSS"))
        return int(line.split()[1])
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak // 1024 if sys.platform == "darwin" else peak


if __name__ == "__main__":
    main()
