"""How time and memory grow with frames, markers and states, and trials on cores: which power, and where it bends.

    OMP_NUM_THREADS=1 .venv/bin/python benchmarks/scaling.py [frames] [states] [trials] [--longest 16000]

Each line is a process of its own, so that its peak of memory is its own. *Frames*: `squats1` forwards and backwards in
turn, as long as asked, smoothed with all deviations, and live (one step at a time, nothing kept), seconds of processor
time with one thread; power: of the time and of the memory above an empty run's, from the line before. *States*:
`squats1` with fewer and more markers than it has: more are weighted means of those on a thigh or shank, with 0.5 mm of
noise of their own. *Trials*: `dynakin batch` over simulated walks of 5 s, one and two workers at a time, and two of a
Dask cluster on this machine.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from importlib import resources
from pathlib import Path

import numpy as np

import dynakin
from dynakin.filter.measurements import Measurements
from dynakin.filter.tracker import Tracker
from dynakin.model.definition import load_model
from dynakin.recordings.recording import Recording
from dynakin.simulation.trial import simulate_squat
from recordings import DATA

FRAMES = {"planar": (1000, 4000, 16_000, 64_000, 256_000), "fullbody": (250, 1000, 4000, 16_000)}
EXTRA = (None, 0, 5, 10, 19)
"""Further markers on each thigh and shank; None: none of the clusters."""
TIMED, TRIALS = 300, 8
TEN_HOURS = 3_600_000  # frames at 100 Hz
Array = np.ndarray


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", nargs="*", metavar="frames|states|trials")
    parser.add_argument("--longest", type=int, default=16_000, help="frames, of the whole body")
    parser.add_argument("--one", help=argparse.SUPPRESS)  # what a process of its own measures
    asked = parser.parse_args()
    if asked.one:
        kind, *values = json.loads(asked.one)
        print(json.dumps({"frames": of_frames, "states": of_states}[kind](*values)))
        return
    chosen = asked.what or ["frames", "states", "trials"]
    if "frames" in chosen:
        frames_table(asked.longest)
    if "states" in chosen:
        states_table()
    if "trials" in chosen:
        trials_table()


def alone(*what: object) -> dict[str, float]:
    """What a process of its own measures."""
    command = [sys.executable, __file__, "--one", json.dumps(what)]
    found: dict[str, float] = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    return found


def frames_table(longest: int) -> None:
    """Against frames."""
    heads = (
        "model",
        "frames",
        "smoothed, s CPU",
        "ms a frame",
        "power",
        "memory, MB",
        "power",
        "live, ms",
        "memory, MB",
    )
    print(f"| {' | '.join(heads)} |\n{'|---' * len(heads)}|")
    for model, every in FRAMES.items():
        empty, last, before = alone("frames", model, 10, "smoothed")["mb"], None, None
        for frames in (n for n in every if model == "planar" or n <= longest):
            smoothed, live = alone("frames", model, frames, "smoothed"), alone("frames", model, frames, "live")
            now = (frames, smoothed["s"], smoothed["mb"] - empty)
            powers = ["", ""] if before is None else [_power(before, now, k) for k in (1, 2)]
            print(
                f"| {model} | {frames} | {smoothed['s']:.1f} | {1e3 * smoothed['s'] / frames:.2f} | {powers[0]} | "
                f"{smoothed['mb']:.0f} | {powers[1]} | {live['ms']:.2f} | {live['mb']:.0f} |",
                flush=True,
            )
            last, before = before, now
        if last is not None:
            by_time, by_memory = (float(_power(last, now, k)) for k in (1, 2))
            more = TEN_HOURS / now[0]
            print(f"\n{model}: 10 h at 100 Hz, smoothed in one piece, would take "
                  f"{now[1] * more**by_time / 3600:.1f} h and {now[2] * more**by_memory / 1024:.0f} GB.\n")  # fmt: skip


def _power(before: tuple[int, float, float], now: tuple[int, float, float], k: int) -> str:
    return f"{np.log(max(now[k], 1e-9) / max(before[k], 1e-9)) / np.log(now[0] / before[0]):.2f}"


def of_frames(model: str, frames: int, how: str) -> dict[str, float]:
    """Seconds of CPU, and the peak of memory, of a run over so many frames; live: milliseconds a step."""
    recording, definition = planar() if model == "planar" else fullbody()
    tracker, data = repeated(recording, definition, frames)
    began = time.process_time()
    if how == "live":
        steps(tracker, data)
    else:
        tracker.run_smoothed_arrays(data)
    took = time.process_time() - began
    return {"s": took, "ms": 1e3 * took / frames, "mb": peak_mb()}


def steps(tracker: Tracker, data: Measurements) -> None:
    """One by one, in the core."""
    at, markers, wrench, _ = data
    for k in range(len(at)):
        tracker._filter.step(at[k] - at[k - 1] if k else 0.0, markers[k], wrench[k])


def repeated(recording: Recording, definition: object, frames: int) -> tuple[Tracker, Measurements]:
    """Of a recording that is played forwards and backwards in turn; the first frames are the calibration's."""
    ready = dynakin.Estimator(definition).prepare(recording)
    count, dt = recording.n_frames, 1.0 / recording.rate
    there_and_back = np.concatenate([np.arange(count), np.arange(count - 2, 0, -1)])
    chosen = np.resize(there_and_back, frames)
    tracker = ready.tracker.fresh()
    measured = ready.measured
    return tracker, Measurements(np.arange(frames) * dt, measured.markers[chosen], measured.wrench[chosen])


def planar() -> tuple[Recording, object]:
    """Simulated squats, `sagittal7`."""
    subject = dynakin.Subject(mass_kg=70.0, height_m=1.75, sex="male")
    return simulate_squat(seed=1, duration_s=10.0).recording, load_model("sagittal7", subject, markers="opencap")


def fullbody(markers: str | Path = "opencap") -> tuple[Recording, object]:
    """`squats1`."""
    folder = DATA / "opencap_subject4"
    recording = dynakin.read(folder / "squats1.trc", folder / "squats1_grf.mot")
    subject = dynakin.Subject(mass_kg=60.05, height_m=1.70)
    return recording, load_model("fullbody", subject, markers=str(markers))


def states_table() -> None:
    """Against markers and states."""
    print("| markers | states | rows | step, ms | smoothing adds, ms | power of both in states | memory, MB |")
    print("|---|---|---|---|---|---|---|")
    every = [alone("states", "planar", 0), *(alone("states", "fullbody", extra) for extra in EXTRA)]
    before = None
    for now in every:
        power = "" if before is None else ", ".join(
            f"{np.log(now[key] / before[key]) / np.log(now['states'] / before['states']):.2f}"
            for key in ("step", "back")
        )  # fmt: skip
        print(
            f"| {now['markers']} | {now['states']} | {now['rows']} | {now['step']:.3f} | {now['back']:.3f} | {power} | "
            f"{now['mb']:.0f} |",
            flush=True,
        )
        before = now


def of_states(model: str, extra: int | None) -> dict[str, float]:
    """Medians of a step and of what smoothing adds, ms, with so many further markers on thighs and shanks."""
    recording, definition = planar() if model == "planar" else with_markers(extra)
    tracker, data = repeated(recording, definition, TIMED)
    arrays = tracker.run_smoothed_arrays(data)
    return {
        "markers": len(tracker.calibrated.recorded_markers),
        "states": tracker.core_model.layout.size,
        "rows": int(np.median(arrays["n_rows"])),
        "step": 1e-3 * float(np.median(arrays["step_us"])),
        "back": 1e-3 * float(np.median(arrays["backward_us"])),
        "mb": peak_mb(),
    }


def with_markers(extra: int | None) -> tuple[Recording, object]:
    """`squats1` with more markers, or without those of the clusters."""
    recording, _ = fullbody()
    text = resources.files("dynakin.model.markers.sets").joinpath("opencap.toml").read_text(encoding="utf-8")
    head, _, clusters = text.partition("[clusters]")
    names, places = list(recording.marker_names), [recording.markers]
    rng = np.random.default_rng(1)
    if extra is None:
        clusters = ""
    for segment, own in {"thigh": ("thigh1", "thigh2", "thigh3"), "shank": ("sh2", "sh3", "shank_antsup")}.items():
        for k in range(extra or 0):
            weights = rng.dirichlet(np.ones(3)) * 2.0 - 1.0 / 3.0  # not all between the three
            for side in ("r", "L"):
                columns = [recording.marker_names.index(f"{side}_{name}") for name in own]
                place = np.einsum("k,tkc->tc", weights, recording.markers[:, columns])
                places.append((place + 5e-4 * rng.standard_normal(place.shape))[:, None])
                names.append(f"{side}_more_{segment}_{k}")
            clusters = clusters.replace(f"{segment} = [", f'{segment} = ["{{r,L}}_more_{segment}_{k}", ')
    more = replace(recording, marker_names=tuple(names), markers=np.concatenate(places, axis=1))
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "more.toml"
        file.write_text(head.replace('name = "opencap"', 'name = "more"') + "[clusters]" + clusters, encoding="utf-8")
        return more, fullbody(file)[1]


def trials_table() -> None:
    """`dynakin batch` over trials, by workers."""
    program = [str(Path(sys.executable).with_name("dynakin"))]
    print("| workers | trials of 5 s | wall, s | a trial, s | 1,000 trials, h |\n|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        made = [folder / f"walk{seed}" for seed in (1, 2)]
        for seed, out in enumerate(made, start=1):
            asked = ["--model", "fullbody", "--motion", "gait", "--seed", str(seed), "--duration", "5", "-o", str(out)]
            subprocess.run([*program, "simulate", *asked], check=True, capture_output=True)
        lines = []
        for k in range(TRIALS):
            source = made[k % len(made)]
            lines += [
                f'[[subjects]]\nname = "s{k}"\nfolder = "{source}"\nmass_kg = 70.0\nheight_m = 1.75',
                'trials = [{ trial = "markers.trc", forces = "forces.mot" }]',
            ]
        dataset = folder / "DATASET.toml"
        dataset.write_text('model = "fullbody"\noutput = "out"\n' + "\n".join(lines) + "\n", encoding="utf-8")
        for label, options in {"1 process": ["--jobs", "1"], "2 processes": ["--jobs", "2"]}.items():
            _batch(label, [*program, "batch", str(dataset), "-o", str(folder / label.replace(" ", "_")), *options])
        with _cluster() as address:
            out = ["-o", str(folder / "dask"), "--backend", "dask", "--scheduler", address]
            _batch("2 of a Dask cluster", [*program, "batch", str(dataset), *out])


def _batch(label: str, command: list[str]) -> None:
    began = time.perf_counter()
    done = subprocess.run(command, capture_output=True, text=True)
    took = time.perf_counter() - began
    if done.returncode != 0:
        raise SystemExit(
            f"{' '.join(command)}: exit code {done.returncode}\n{done.stdout[-2000:]}{done.stderr[-2000:]}"
        )
    print(f"| {label} | {TRIALS} | {took:.1f} | {took / TRIALS:.2f} | {1000 * took / TRIALS / 3600:.2f} |", flush=True)


class _cluster:
    """A Dask cluster of two workers in processes of their own."""

    def __enter__(self) -> str:
        from distributed import LocalCluster

        self._own = LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None)
        return str(self._own.scheduler_address)

    def __exit__(self, *exception: object) -> None:
        self._own.close()


def peak_mb() -> float:
    """The most memory that this process has had."""
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / (1024.0**2 if sys.platform == "darwin" else 1024.0)


if __name__ == "__main__":
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    main()
