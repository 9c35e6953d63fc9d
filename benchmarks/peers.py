"""dynakin against OpenSim and biorbd on the same recordings in one run: fit, residuals, angles, forecasts, step times.

    make peers        (or OMP_NUM_THREADS=1 python benchmarks/peers.py [part ...])

Needs the shared recordings (DYNAKIN_TEST_DATA or ../shared/data) and the extra `peers` (opensim, biorbd). Parts: fit,
residual, angles, forecast, times. Prints the tables of BENCHMARKS.md.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from opensim_peer import Kinematics, inverse_kinematics, load, residual
from peers_times import times

import dynakin
from dynakin.arrays import rms, wrench_about
from dynakin.filter.estimator import Estimator
from dynakin.filter.measurements import Measurements
from dynakin.filter.samples import marker_paths, total_wrench
from dynakin.model.definition import Definition, load_model
from dynakin.model.opensim.definition import load_opensim
from dynakin.recordings.formats.mot import read_table
from dynakin.recordings.recording import Recording
from dynakin.results.estimate import Estimate
from dynakin.results.measures.soft_tissue import displacements
from dynakin.results.records import REFUSED
from dynakin.settings.subject import Subject
from dynakin.validation.case import Setup
from dynakin.validation.held_out import halves, identify_on, measured_wrench, predict_blind

Array = NDArray[np.float64]
DATA = Path(os.environ.get("DYNAKIN_TEST_DATA", Path(__file__).parents[2] / "shared" / "data")) / "opencap_subject4"
FILE = DATA / "optimized_scale_and_markers.osim"
FEET = {"ground_force_1": "calcn_r", "ground_force_2": "calcn_l"}
WALK = (0.15, 1.20)  # s in which every stance foot is on a plate
MASS = {"squats1": 60.05, "walking1": 63.0}  # kg, by the plates of each
FLEXION = [f"{name}_{side}" for name in ("hip_flexion", "knee_angle", "ankle_angle") for side in "rl"]
OTHERS = [f"{name}_{side}" for name in ("hip_adduction", "hip_rotation", "subtalar_angle") for side in "rl"]
PELVIS = ["pelvis_tilt", "pelvis_list", "pelvis_rotation"]
ALL = ("lengths", "markers", "soft_tissue", "inertia")


def recorded(name: str) -> Recording:
    return dynakin.read(DATA / f"{name}.trc", DATA / f"{name}_grf.mot")


def models(name: str) -> dict[str, Definition]:
    subject = Subject(mass_kg=MASS[name], height_m=1.70)
    return {"fullbody": load_model("fullbody", subject), ".osim": load_opensim(FILE, subject)}


def distance_mm(measured: Array, placed: Array) -> float:
    """Root mean square 3-D distance of all markers in all frames, missing ones left out."""
    return 1000.0 * float(rms(np.linalg.norm(placed - measured, axis=2)))


def without_plates() -> dynakin.Noise:
    return dynakin.presets.default().changed(plate_force_sd_n=0.0, plate_moment_sd_nm=0.0, plate_delay_sd_s=0.0)


def filtered(estimate: tuple[str, ...], *, smooth: bool = False) -> tuple[float, Array]:
    """Marker distance (mm) of the .osim model from markers alone, and the markers' measured paths."""
    recording = recorded("squats1")
    definition = load_opensim(FILE, Subject(mass_kg=MASS["squats1"]))
    estimator = dynakin.Estimator(definition, without_plates(), estimate=estimate)
    tracker = estimator.start(recording)
    markers = marker_paths(recording, tracker.calibrated, gaps=True)
    wrench = total_wrench(recording, tracker.calibrated, gaps=True)
    wrench[:] = np.nan
    run = tracker.run_smoothed_arrays if smooth else tracker.run_arrays
    return distance_mm(markers, run(Measurements(recording.time, markers, wrench))["markers_estimated"]), markers


def fit(peer: Kinematics) -> None:
    print("\n### Fit: `squats1`, markers only, RMS of 3-D distances, mm\n")
    recording = recorded("squats1")
    names = [name for name in peer.markers if name in recording.marker_names]
    places = peer.places[:, [peer.markers.index(name) for name in names]]
    theirs = distance_mm(np.stack([recording.marker(name) for name in names], axis=1), places)
    print(f"| method ({len(names)} markers) | RMS | against OpenSim |\n|---|---|---|")
    print(f"| OpenSim, inverse kinematics | {theirs:.2f} | 1 |")
    for title, kinds, smooth in (
        ("dynakin, places and geometry held, no soft tissue", (), False),
        ("the same, smoothed", (), True),
        ("places and lengths calibrated on the trial", ("lengths", "markers"), False),
        ("the same, smoothed: constants are one set of numbers", ("lengths", "markers"), True),
        ("soft tissue too", ("lengths", "markers", "soft_tissue"), False),
    ):
        ours = filtered(kinds, smooth=smooth)[0]
        print(f"| {title} | {ours:.2f} | {ours / theirs:.3f} |", flush=True)


def mean_pressure(recording: Recording) -> Array:
    """Mean centre of pressure (3,) m of all plates together, weighted by their load."""
    load_n = np.stack([plate.force[:, 1] for plate in recording.plates])
    centre = np.stack([np.nan_to_num(plate.cop) for plate in recording.plates])
    return np.asarray((load_n[..., None] * centre).sum(axis=(0, 1)) / load_n.sum())


def components(wrench: Array) -> str:
    force = ", ".join(f"{v:.1f}" for v in rms(wrench[:, :3], axis=0))
    return f"{force} | {rms(np.linalg.norm(wrench[:, 3:], axis=1)):.1f}"


def opensim_misfit(peer: Kinematics, mass: float | None, cutoff: float | None) -> tuple[Array, Array]:
    """Residual about the pelvis and what of the wrench it is, about the ground's origin, each (T, 6)."""
    force, moment, origin = residual(load(FILE, mass_kg=mass), peer, DATA / "squats1_grf.mot", FEET, cutoff)
    at_pelvis = np.concatenate([force, moment], axis=1)
    return at_pelvis, np.concatenate([force, moment + np.cross(origin, force)], axis=1)


def left_over(title: str, estimate: Estimate) -> None:
    data = estimate.data
    rest = np.nan_to_num(data["wrench_remainder"].values)
    print(f"| {title} | {np.abs(rest[:, :3]).max():.1e} | {np.abs(rest[:, 3:]).max():.1e} (largest) |")
    for foot in estimate.foot_names:
        change = rms(data["foot_adjustment"].sel(foot=foot).transpose("time", "component").values, axis=0)
        text = ", ".join(f"{v:.1f}" for v in change)
        print(f"| its adjustment of the {foot} foot's wrench: fx, fy, fz; mx, my, mz | {text} | about the origin |")


def residuals(peer: Kinematics) -> None:
    print(
        "\n### What inverse dynamics leaves at the pelvis: `squats1`\n\n"
        "| method | force, N | moment, N m |\n|---|---|---|"
    )
    for mass in (None, MASS["squats1"]):
        for cutoff in (6.0, None):
            found = opensim_misfit(peer, mass, cutoff)[0]
            size = [float(rms(np.linalg.norm(part, axis=1))) for part in (found[:, :3], found[:, 3:])]
            title = f"{'the file' if mass is None else f'{mass:g} kg'}, {'unfiltered' if cutoff is None else '6 Hz'}"
            print(f"| OpenSim, mass of {title} | {size[0]:.1f} | {size[1]:.1f} |")
    for name, definition in models("squats1").items():
        left_over(f"dynakin, {name}", dynakin.Estimator(definition).run(recorded("squats1"), lag_s=0.0))


GROUPS = (("flexions", FLEXION, 4), ("others of the legs", OTHERS, 6), ("pelvis", PELVIS, 6))


def angles() -> None:
    """Against the recording's own inverse kinematics, whose weights it does not give, and against equal weights."""
    for trial in ("squats1", "walking1"):
        recording = recorded(trial)
        judged = np.ones(recording.n_frames, dtype=bool)
        if trial == "walking1":
            judged = (recording.time >= WALK[0]) & (recording.time <= WALK[1])
        table = read_table(DATA / f"{trial}_ik.mot")
        theirs = Angles(table.names, table.time, table.values)
        peer = inverse_kinematics(load(FILE), DATA / f"{trial}.trc")
        equal = Angles(peer.coordinates, peer.time, peer.values)
        print(
            f"\n### `{trial}`, OpenSim with equal weights against the recording's own\n\n| what | measured |\n|---|---|"
        )
        for title, wanted, _ in GROUPS:
            print(f"| {title}, deg | {apart(equal, theirs, recording.time[judged], wanted)} |")
        definitions = models(trial)
        estimators = {name: dynakin.Estimator(definition) for name, definition in definitions.items()}
        held = dynakin.Estimator(definitions[".osim"], without_plates(), estimate=())
        for name, estimator in {**estimators, ".osim, held as in OpenSim, markers only": held}.items():
            estimate = estimator.run(recording, lag_s=0.0)
            ours = Angles(estimate.coordinate_names, estimate.time, estimate.data["coordinates"].values)
            print(
                f"\n### `{trial}`, {name}\n\n| what | against the recording's own | with equal weights | goal |\n"
                "|---|---|---|---|"
            )
            for title, wanted, goal in GROUPS:
                gaps = [apart(ours, other, recording.time[judged], wanted) for other in (theirs, equal)]
                print(f"| {title}, deg | {' | '.join(gaps)} | {goal} |")
            if estimator is not held:
                told(estimate, judged)


class Angles(NamedTuple):
    """Coordinates of a movement: names, time (T,) s, values (T, C) rad."""

    names: Sequence[str]
    time: Array
    values: Array

    def at(self, name: str, time: Array) -> Array:
        return np.interp(time, self.time, self.values[:, list(self.names).index(name)])


def apart(ours: Angles, theirs: Angles, time: Array, wanted: list[str]) -> str:
    """RMS difference of each coordinate that both have, less its mean, deg."""
    found = []
    for name in wanted:
        if name in ours.names and name in theirs.names:
            gap = ours.at(name, time) - theirs.at(name, time)
            found.append(f"{name} {np.rad2deg((gap + np.pi) % (2 * np.pi) - np.pi).std():.1f}")
    return ", ".join(found)


def told(estimate: Estimate, judged: Array) -> None:
    data = estimate.data
    measured, placed = data["markers_measured"].values[judged], data["markers_estimated"].values[judged]
    print(f"| markers, mm | {distance_mm(measured, placed):.1f} | | |")
    bounded = [p for p in estimate.parameters if p.estimated and (p.lower is not None or p.upper is not None)]
    on = [p.name for p in bounded if p.at_bound]
    share = 100 * len(on) / max(len(bounded), 1)
    print(f"| parameters on a bound | {len(on)} of {len(bounded)} ({share:.1f} %) | | 5 % |")
    moved = displacements(estimate, judged)
    ratio = {n: d.rms / d.expected for n, d in moved.items() if d.rms is not None and d.expected}
    worst = sorted(ratio, key=lambda n: -ratio[n])[:3]
    beyond = sum(value > 1.5 for value in ratio.values())
    print(
        f"| soft tissue, RMS over declared size | median {np.median(list(ratio.values())):.2f}, {beyond} of "
        f"{len(ratio)} beyond 1.5; largest {', '.join(f'{n} {ratio[n]:.1f}' for n in worst)} | | 1.5 |"
    )
    refused = (data["verdict"].values == REFUSED).sum(axis=0)
    often = [f"{s} {k}" for s, k in zip(data["sensor"].values, refused, strict=True) if k]
    print(f"| frames refused | {', '.join(often) or 'none'} | | |", flush=True)


def forecast(peer: Kinematics) -> None:
    print("\n### Wrench from markers alone, second half of `squats1`; moment about the mean centre of pressure\n")
    print("| method | FX, FY, FZ, N | moment, N m |\n|---|---|---|")
    first, second = halves(recorded("squats1"))
    last = peer.time >= second.time[0] - 1e-9
    centre = mean_pressure(recorded("squats1"))
    misfit = wrench_about(opensim_misfit(peer, MASS["squats1"], 6.0)[1], centre)
    print(f"| OpenSim, 6 Hz, 60.05 kg, whole trial | {components(misfit)} |")
    print(f"| the same, second half | {components(misfit[last[: len(misfit)]])} |")
    for name, definition in models("squats1").items():
        identified = identify_on(first, Setup(Estimator(definition)), same_recording=True)
        blind = predict_blind(identified, second)
        truth = measured_wrench(second, blind.start)
        point = blind.start.ground.points_to_ground(centre)
        for method, wrench in blind.wrenches.items():
            if method.startswith("EKF") or "persistence: mean" in method:
                print(f"| dynakin, {name}: {method} | {components(wrench_about(wrench - truth, point))} |", flush=True)


def main() -> None:
    parts = sys.argv[1:] or ["fit", "residual", "angles", "forecast", "times"]
    peer = None
    if {"fit", "residual", "forecast"} & set(parts):
        peer = inverse_kinematics(load(FILE), DATA / "squats1.trc")
    if peer and "fit" in parts:
        fit(peer)
    if peer and "residual" in parts:
        residuals(peer)
    if "angles" in parts:
        angles()
    if peer and "forecast" in parts:
        forecast(peer)
    if "times" in parts:
        times(FILE, DATA, MASS["squats1"])


if __name__ == "__main__":
    main()
