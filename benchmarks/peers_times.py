"""Time a frame of each program on `squats1`, in turns, so that a busy machine is as busy for all of them."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
from biorbd_peer import kalman
from numpy.typing import NDArray
from opensim_peer import inverse_kinematics, load, without_patellae

import dynakin
from dynakin.filter.measurements import Measurements
from dynakin.filter.samples import marker_paths, total_wrench
from dynakin.model.opensim.definition import load_opensim
from dynakin.settings.subject import Subject

Array = NDArray[np.float64]
ROUNDS = 3


def steps(file: Path, data: Path, mass: float, kinds: tuple[str, ...], plates: bool) -> tuple[str, Array]:
    """Of the filter: what it holds, and microseconds a step."""
    recording = dynakin.read(data / "squats1.trc", data / "squats1_grf.mot")
    noise = dynakin.presets.default()
    if not plates:
        noise = noise.changed(plate_force_sd_n=0.0, plate_moment_sd_nm=0.0, plate_delay_sd_s=0.0)
    estimator = dynakin.Estimator(load_opensim(file, Subject(mass_kg=mass)), noise, estimate=kinds)
    tracker = estimator.start(recording)
    initial = tracker.calibrated
    markers, wrench = marker_paths(recording, initial, gaps=True), total_wrench(recording, initial, gaps=True)
    if not plates:
        wrench[:] = np.nan
    found = []
    for _ in range(2):
        found.append(tracker.fresh().run_arrays(Measurements(recording.time, markers, wrench))["step_us"])
    return f"{len(initial.names)} states", np.concatenate(found)


def biorbd_frames(file: Path, data: Path, mass: float) -> tuple[str, Array]:
    recording = dynakin.read(data / "squats1.trc").window(0.0, 10.0)
    initial = dynakin.Estimator(load_opensim(file, Subject(mass_kg=mass)), estimate=()).start(recording).calibrated
    markers = np.stack([recording.marker(name) for name in initial.recorded_markers], axis=1)
    n, spent, places = kalman(initial.spec, markers, 100.0)
    gap = 1000.0 * np.sqrt(np.nanmean(((places - markers) ** 2).sum(axis=2)))
    return f"{3 * n} states, markers {gap:.1f} mm", 1e6 * spent


def times(file: Path, data: Path, mass: float) -> None:
    everything = ("lengths", "markers", "soft_tissue", "inertia")
    programs = {
        "dynakin, kinematics only, no soft tissue": lambda: steps(file, data, mass, (), False),
        "dynakin, all but soft tissue": lambda: steps(file, data, mass, ("lengths", "markers", "inertia"), True),
        "dynakin, everything estimated": lambda: steps(file, data, mass, everything, True),
        "biorbd, Kalman filter, kinematics": lambda: biorbd_frames(file, data, mass),
        "OpenSim IK, no muscles, no patella couplers": lambda: opensim_frames(file, data, False),
        "OpenSim IK, as shipped": lambda: opensim_frames(file, data, True),
    }
    found: dict[str, list[tuple[str, Array]]] = {name: [] for name in programs}
    loads = []
    for _ in range(ROUNDS):
        for name, program in programs.items():
            loads.append(os.getloadavg()[0])
            found[name].append(program())
    print(
        f"\n### Time a frame, the quietest of {ROUNDS} rounds; load {min(loads):.0f} to {max(loads):.0f} on "
        f"{os.cpu_count()} cores\n\n| program | holds | frames | median, us | p99, us | against kinematics only |\n"
        "|---|---|---|---|---|---|"
    )
    base = 0.0
    for name, rounds in found.items():
        holds, best = min(rounds, key=lambda entry: float(np.median(entry[1])))
        median = float(np.median(best))
        base = base or median
        print(
            f"| {name} | {holds} | {len(best)} | {median:.0f} | {np.percentile(best, 99):.0f} | {median / base:.1f} |"
        )


def opensim_frames(file: Path, data: Path, as_shipped: bool) -> tuple[str, Array]:
    model = load(file, as_shipped=as_shipped)
    if not as_shipped:
        model = without_patellae(model)
    spent = inverse_kinematics(model, data / "squats1.trc", 60 if as_shipped else 300).step_s
    return "one frame at a time", 1e6 * spent[1:]
