"""An estimate made of smooth curves and noise: nothing of it was filtered, so the tests need no core."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from dynakin.messages import note
from dynakin.recordings.frame import GroundFrame
from dynakin.recordings.recording import Plate, Recording
from dynakin.results.estimate import AXES, Estimate
from dynakin.results.records import Event, Parameter, Timing
from dynakin.units import COMPONENTS

COORDINATES = ("toe", "ankle", "knee", "hip", "lumbar", "shoulder", "elbow", "slide")
SEGMENTS = ("foot", "shank", "thigh", "pelvis", "trunk", "upper_arm", "forearm")
MARKERS = (
    "S1:RTOE",
    "S1:RHEE",
    "S1:RANK",
    "S1:RTIB",
    "S1:RKNE",
    "S1:RTHI",
    "S1:RASI",
    "S1:C7",
    "S1:RSHO",
    "S1:RELB",
)
LENGTHS = (0.18, 0.41, 0.43, 0.11, 0.47, 0.29)
MASSES = (1.6, 5.8, 14.6, 8.7, 23.9, 2.9, 2.5)
# Laboratory with Z up in which the person faces -Y: nothing is where the ground frame has it.
ROTATION = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0]])


def make_estimate(duration_s: float = 12.0, *, seed: int = 0, unit: str = "mm", gaps: bool = True) -> Estimate:
    """A plausible squat: 8 coordinates (the last a locked translation), 10 markers, planar wrench."""
    rng = np.random.default_rng(seed)
    time = np.arange(round(duration_s * 100) + 1) / 100.0
    frames = len(time)
    depth = np.where(time > 1.5, 0.5 - 0.5 * np.cos(2 * np.pi * (time - 1.5) / 3.0), 0.0)

    size = np.radians([2.0, 25.0, 80.0, 70.0, 20.0, 60.0, 15.0, 0.0])
    start = np.radians([0.0, 5.0, 4.0, 2.0, 10.0, 5.0, 15.0, 0.0])
    coordinates = start + depth[:, None] * size
    coordinates[:, -1] = 0.02
    speeds = np.gradient(coordinates, time, axis=0)
    accelerations = np.gradient(speeds, time, axis=0)
    moments = -depth[:, None] * np.array([40.0, 30, 110, 120, 60, 15, 5, 0]) + rng.normal(0, 0.5, (frames, 8))

    height = np.linspace(0.03, 1.4, len(MARKERS))
    true = np.zeros((frames, len(MARKERS), 3))
    true[:, :, 0] = -0.1 + depth[:, None] * 0.25 * np.sin(4 * height)
    true[:, :, 1] = height - depth[:, None] * 0.45 * height
    true[:, :, 2] = 0.12 + 0.01 * np.sin(time)[:, None]
    measured = true + rng.normal(0, 0.0015, true.shape)
    estimated, predicted = true.copy(), true + rng.normal(0, 0.001, true.shape)
    estimated[:, 5, 0] += 0.006 * depth
    if gaps:
        measured[300:340, 6] = np.nan
        measured[0:25, 9] = np.nan
    estimated[:, :, 2] = predicted[:, :, 2] = np.nan

    wrench = np.full((frames, 6), np.nan)
    wrench[:, 0] = 12 * np.sin(3 * time)
    wrench[:, 1] = 590 + 90 * np.gradient(np.gradient(depth, time), time)
    wrench[:, 5] = -70 + 25 * depth
    wrench_measured = wrench + rng.normal(0, [2, 5, 1, 1, 1, 3], (frames, 6))
    wrench_measured[:, 2:5] = rng.normal(0, 3, (frames, 3))

    parameters = _parameters(rng)
    states = {p.name: _path(p, time, rng) for p in parameters if p.estimated}
    locked = COORDINATES[-1]
    names = [n + suffix for suffix in ("", "/speed", "/acceleration") for n in COORDINATES if n != locked]
    moving = np.hstack([coordinates[:, :-1], speeds[:, :-1], accelerations[:, :-1]])
    state = np.hstack([moving, np.column_stack(list(states.values()))])
    per_coordinate = ("time", "coordinate")
    per_marker, per_component = ("time", "marker", "axis"), ("time", "component")
    n_rows = 2 * np.isfinite(measured[:, :, 0]).sum(axis=1) + 4
    sd = np.full_like(coordinates, np.radians(0.6))
    sd[:, -1] = 0.0
    data = xr.Dataset(
        {
            "coordinates": (per_coordinate, coordinates),
            "speeds": (per_coordinate, speeds),
            "accelerations": (per_coordinate, accelerations),
            "moments": (per_coordinate, moments),
            "coordinates_sd": (per_coordinate, sd),
            "speeds_sd": (per_coordinate, 5 * sd),
            "accelerations_sd": (per_coordinate, 30 * sd),
            "markers_measured": (per_marker, np.where([True, True, False], measured, np.nan)),
            "markers_estimated": (per_marker, estimated),
            "markers_predicted": (per_marker, predicted),
            "wrench_measured": (per_component, wrench_measured),
            "wrench_estimated": (per_component, wrench),
            "wrench_predicted": (per_component, wrench + rng.normal(0, 1, wrench.shape)),
            "state": (("time", "element"), state),
            "state_sd": (("time", "element"), np.full_like(state, 0.01)),
            "nis": ("time", rng.chisquare(n_rows).astype(float)),
            "n_rows": ("time", n_rows),
            "log_likelihood": ("time", rng.normal(50, 2, frames)),
        },
        coords={
            "time": time,
            "coordinate": list(COORDINATES),
            "coordinate_type": ("coordinate", ["rotation"] * 7 + ["translation"]),
            "coordinate_file_unit": ("coordinate", ["deg"] * 7 + ["m"]),
            "marker": list(MARKERS),
            "axis": list(AXES),
            "marker_axes_modelled": ("axis", [True, True, False]),
            "component": list(COMPONENTS),
            "element": names + list(states),
        },
    )
    ground = GroundFrame(
        ROTATION, np.array([0.3, 1.2, 0.0]), "+Z", np.array([0.0, -1.0, 0.0]), ("Vertical +Z: given.",)
    )
    return Estimate(
        data=data,
        parameters=parameters,
        events=_events(parameters, gaps),
        timing=Timing(frames, 48.2, 71.5, 210.0),
        recording=_recording(time, ground, measured, wrench_measured, unit),
        ground=ground,
        config=dict(_CONFIG),
        model_name="sagittal7",
        messages=[
            note("calibration", "Elbow: the recording has no wrist marker, so the forearm is locked to the upper arm."),
            note("mass", "Mass 57.30 kg from the plates while standing still from 0 s to 1.2 s."),
        ],
    )


_CONFIG: dict[str, Any] = {
    "trial": "/data/squat.c3d",
    "forces": None,
    "model": "sagittal7",
    "markers": "auto",
    "mass_kg": 60.05,
    "height_m": None,
    "preset": "paper",
    "noise": {"marker_variance": 1e-3},
}


def _parameters(rng: np.random.Generator) -> list[Parameter]:
    found = []
    for segment, value in zip(SEGMENTS, LENGTHS, strict=False):
        end = 1.2 * value if segment == "thigh" else value * (1 + rng.normal(0, 0.03))
        found.append(_parameter(f"length/{segment}", "length", segment, "m", value, end, 0.2 * value, None))
    for marker in MARKERS:
        for axis in "xy":
            start = float(rng.normal(0, 0.05))
            found.append(_parameter(f"marker/{marker}/{axis}", "marker", "thigh", "m", start, start + 0.004, 0.1, None))
    for segment, mass in zip(SEGMENTS, MASSES, strict=True):
        end = 0.8 * mass if segment == "pelvis" else mass * (1 + rng.normal(0, 0.04))
        found.append(_parameter(f"inertia/{segment}/mass", "inertia", segment, "kg", mass, end, 0.2 * mass, mass))
        found.append(_parameter(f"inertia/{segment}/mx", "inertia", segment, "kg m", 0.0, 0.02, 0.04 * mass, 0.0))
        izz = mass * 0.02
        found.append(_parameter(f"inertia/{segment}/izz", "inertia", segment, "kg m2", izz, izz * 1.05, 0.2 * izz, izz))
    return found


def _parameter(
    name: str, kind: Any, segment: str, unit: str, start: float, end: float, half: float, table: float | None
) -> Parameter:
    lower, upper = start - half, start + half
    at_bound = not lower + 1e-9 < end < upper - 1e-9
    return Parameter(name, kind, segment, unit, end, 0.1 * half, start, table, lower, upper, at_bound, True)


def _path(parameter: Parameter, time: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    wander = 0.02 * (parameter.value - parameter.initial) * np.sin(2 * time + rng.uniform(0, 6))
    return parameter.value + (parameter.initial - parameter.value) * np.exp(-time / 1.5) + wander


def _events(parameters: list[Parameter], gaps: bool) -> list[Event]:
    events = [
        Event(3.2 + k, 320 + 100 * k, "at_bound", p.name, f"{p.name} reached its bound {p.value:.3f} {p.unit}")
        for k, p in enumerate(p for p in parameters if p.at_bound)
    ]
    if gaps:
        events += [
            Event(0.0, 0, "missing", "S1:RELB", "missing for 25 frames"),
            Event(3.0, 300, "missing", "S1:RASI", "missing for 40 frames"),
        ]
    return sorted(events, key=lambda event: event.frame)


def _recording(time: np.ndarray, ground: GroundFrame, measured: np.ndarray, wrench: np.ndarray, unit: str) -> Recording:
    laboratory = ground.wrench_to_laboratory(wrench)
    cop = np.full((len(time), 3), np.nan)
    plate = Plate("plate 1", laboratory[:, :3], laboratory[:, 3:], cop, np.zeros((len(time), 3)))
    extra = np.zeros((len(time), 1, 3))
    markers = ground.points_to_laboratory(np.concatenate([measured, extra], axis=1))
    length_unit: Any = unit
    return Recording("squat", None, time, (*MARKERS, "S1:LTOE"), markers, (plate,), length_unit)
