"""Force plates of a C3D file: from analog channels to wrenches about the laboratory origin.

The plate frame is that of the C3D user guide: corner 1 lies at (+x, +y), 2 at (-x, +y), 3 at (-x, -y), 4 at
(+x, -y), and z = x cross y points into the floor. All files seen store the ground's reaction in it (F_z
negative under a person); one that stores the person's action is recognised, as a plate cannot pull, and
turned.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from dynakin.errors import RecordingError
from dynakin.recordings.formats.c3d_parameters import Parameters
from dynakin.recordings.limits import check_wrench
from dynakin.recordings.plates.pressure import UNLOADED_N, Surface, plate_from_wrench
from dynakin.recordings.recording import Array, Plate
from dynakin.recordings.resampling import CausalLowPass, ReadOptions, filled, low_pass, reach_s, resample, touched
from dynakin.units import force_factor, moment_factor

_CERTAIN_LOAD_N = 50.0  # a push that no offset of an idle plate reaches: from it the sign is judged
_OFFSET_WORTH_A_NOTE_N = 5.0


@dataclass(frozen=True)
class _Raw:
    """One plate at the analog rate, laboratory frame: force (N, 3) N, moment (N, 3) N m about the lab
    origin."""

    name: str
    force: Array
    moment: Array
    surface: Surface
    corners: Array


def read_plates(
    parameters: Parameters,
    analog: Array,
    time: Array,
    markers: Array,
    length_unit: Literal["mm", "m"],
    path: Path,
    options: ReadOptions,
) -> tuple[tuple[Plate, ...], list[str]]:
    """All plates at the marker times, and notes.

    Args:
        analog: (channels, samples) as ezc3d scales them, a whole number of samples a frame.
        time: (T,) s.
        markers: (T, M, 3) m, on whose side of a plate the person is.

    Raises:
        RecordingError: a plate of another type than 1 to 4, or parameters missing.
    """
    count = int(next(iter(parameters.integers("FORCE_PLATFORM", "USED").ravel()), 0))
    if count < 0:
        raise RecordingError(f"{path}: found {count} plates in FORCE_PLATFORM:USED, expected 0 or more")
    if count == 0:
        return (), ["The file has no force plates."]
    per_frame, odd = divmod(analog.shape[1], len(time))
    if per_frame == 0 or odd:
        raise RecordingError(
            f"{path}: found {analog.shape[1]} analog samples for {len(time)} frames, expected a whole number a frame"
        )
    raws, notes = [], []
    for k in range(count):
        corners = _corners(parameters, k, length_unit, path)
        name = f"plate {k + 1}"
        axis_x, axis_y = corners[0] - corners[1], corners[0] - corners[3]
        if np.linalg.norm(np.cross(axis_x, axis_y)) < 1e-4:
            notes.append(f"{name} left out: its corners in the file do not span a surface.")
            continue
        raws.append(_raw(name, parameters, k, analog, corners, markers, length_unit, path))
    if raws and _stores_action(raws):
        notes.append("The file stores the person's action on the plates; turned into the ground's reaction.")
        raws = [_Raw(raw.name, -raw.force, -raw.moment, raw.surface, raw.corners) for raw in raws]
    step = (time[1] - time[0]) / per_frame if len(time) > 1 else 1.0
    plates = []
    for raw in raws:
        notes += _offset_note(raw)
        plates.append(_at_marker_times(raw, np.arange(analog.shape[1]) * step + time[0], time, options, path))
    if per_frame > 1 and plates:
        how = "zero-phase FIR low-pass"
        if options.causal and len(time) > 1:
            rate = 1 / (time[1] - time[0])
            delay = CausalLowPass(rate * per_frame, 0.4 * rate).delay_s
            how = f"causal Butterworth low-pass, {1e3 * delay:.3g} ms late"
        notes.append(f"Plates resampled from {per_frame} samples a frame ({how}).")
    return tuple(plates), notes


def _raw(
    name: str,
    parameters: Parameters,
    k: int,
    analog: Array,
    corners: Array,
    markers: Array,
    length_unit: Literal["mm", "m"],
    path: Path,
) -> _Raw:
    types = parameters.integers("FORCE_PLATFORM", "TYPE").ravel()
    kind = int(types[k]) if k < len(types) else 0
    if kind not in (1, 2, 3, 4):
        raise RecordingError(f"{path}: {name} has type {kind}, expected a force plate of type 1 to 4")
    wanted = 8 if kind == 3 else 6
    listed = parameters.integers("FORCE_PLATFORM", "CHANNEL")
    per_plate = listed.reshape(listed.shape[0], -1) if listed.size else listed.reshape(0, 0)
    channels = [int(number) - 1 for number in per_plate[:wanted, k]] if k < per_plate.shape[1] else []
    if len(channels) < wanted or min(channels) < 0 or max(channels) >= len(analog):
        numbers = [channel + 1 for channel in channels]
        raise RecordingError(f"{path}: {name} lists channels {numbers}, expected {wanted} of 1 to {len(analog)}")
    metre = 1e-3 if length_unit == "mm" else 1.0
    force, moment = plate_wrench(
        kind,
        analog[channels],
        origin=_slice(parameters.array("FORCE_PLATFORM", "ORIGIN"), k, 3, "ORIGIN", name, path) * metre,
        calibration=_calibration(parameters, k, name, path) if kind == 4 else None,
        units=_channel_units(parameters, channels, metre, kind),
    )
    axis_x, axis_y = corners[0] - corners[1], corners[0] - corners[3]
    z = np.cross(axis_x, axis_y)
    y = np.cross(z, axis_x)
    R_LP = np.column_stack([v / np.linalg.norm(v) for v in (axis_x, y, z)])
    centre = corners.mean(axis=0)
    force_L = force @ R_LP.T
    moment_L = moment @ R_LP.T + np.cross(centre, force_L)
    normal = -R_LP[:, 2]
    if np.isfinite(markers).any() and float(np.dot(np.nanmean(markers, axis=(0, 1)) - centre, normal)) < 0:
        normal = -normal  # corners listed the other way round: the person's side decides what is up
    return _Raw(name, force_L, moment_L, Surface(centre, normal), corners)


def _corners(parameters: Parameters, k: int, length_unit: Literal["mm", "m"], path: Path) -> Array:
    values = _slice(parameters.array("FORCE_PLATFORM", "CORNERS"), k, 12, "CORNERS", f"plate {k + 1}", path)
    return values.reshape(3, 4, order="F").T * (1e-3 if length_unit == "mm" else 1.0)


def _slice(values: Array, k: int, size: int, key: str, name: str, path: Path) -> Array:
    """The ``size`` numbers of plate k in file order (first index fastest)."""
    flat = values.ravel(order="F")
    if len(flat) < size * (k + 1):
        raise RecordingError(f"{path}: FORCE_PLATFORM:{key} has {len(flat)} numbers, {name} needs {size * (k + 1)}")
    return flat[size * k : size * (k + 1)]


def _calibration(parameters: Parameters, k: int, name: str, path: Path) -> Array:
    matrix = _slice(parameters.array("FORCE_PLATFORM", "CAL_MATRIX"), k, 36, "CAL_MATRIX", name, path)
    by_row = parameters.text("FORCE_PLATFORM", "MATRIX_STORE").upper().replace(" ", "") == "BYROW"
    return matrix.reshape(6, 6, order="C" if by_row else "F")


def _channel_units(parameters: Parameters, channels: Sequence[int], metre: float, kind: int) -> Array:
    """Factor to N, N m or m of each channel; by default forces are in N, moments in N times the points'
    length unit.

    A type 4 channel is in volts, so its unit is that of the calibration, which the file does not name: the
    default.
    """
    defaults = [1.0] * 8 if kind == 3 else [1.0, 1.0, 1.0, metre, metre, metre]
    if kind == 4:
        return np.array(defaults)
    words = parameters.texts("ANALOG", "UNITS")
    factors: list[float] = []
    for spot, (channel, default) in enumerate(zip(channels, defaults, strict=True)):
        word = words[channel] if channel < len(words) else ""
        is_force = kind == 3 or spot < 3
        is_point = kind == 1 and spot in (3, 4)
        known = None if is_point else force_factor(word) if is_force else moment_factor(word)
        factors.append(default if known is None else known)
    return np.array(factors)


def _stores_action(raws: Sequence[_Raw]) -> bool:
    """Whether the most loaded plate is pushed into the person's side: then the file holds the person's
    action."""
    pushes = [raw.force @ raw.surface.normal for raw in raws]
    push = max(pushes, key=lambda p: float(np.quantile(np.abs(p), 0.99)))
    loaded = np.abs(push) > _CERTAIN_LOAD_N
    return bool(loaded.any() and np.median(push[loaded]) < 0)


def _offset_note(raw: _Raw) -> list[str]:
    push = raw.force @ raw.surface.normal
    idle = np.abs(push) < _CERTAIN_LOAD_N
    if idle.mean() < 0.05 or np.abs(np.median(push[idle])) < _OFFSET_WORTH_A_NOTE_N:
        return []
    return [f"{raw.name} reads {np.median(push[idle]):.3g} N where nobody stands on it (not taken off)."]


def _at_marker_times(raw: _Raw, time_in: Array, time: Array, options: ReadOptions, path: Path) -> Plate:
    wrench = np.hstack([raw.force, raw.moment])
    check_wrench(raw.name, time_in, raw.force, raw.moment, str(path))
    missing = np.asarray(np.isnan(wrench).any(axis=1))
    wrench = filled(wrench, missing)
    rate = 1 / (time_in[1] - time_in[0]) if len(time_in) > 1 else np.inf
    if options.plate_filter_hz is not None and len(time_in) > 1:
        wrench = low_pass(wrench, rate, options.plate_filter_hz, causal=options.causal)
    wrench = resample(wrench, time_in, time, causal=options.causal).copy()
    rate_out = 1 / (time[1] - time[0]) if len(time) > 1 else np.inf
    wrench[touched(missing, time_in, time, reach_s(rate, rate_out, options.plate_filter_hz))] = np.nan
    threshold = UNLOADED_N if options.force_threshold_n is None else options.force_threshold_n
    return plate_from_wrench(
        raw.name,
        wrench[:, :3],
        wrench[:, 3:],
        raw.surface,
        corners=raw.corners,
        threshold_n=threshold,
        zero_unloaded=True,
    )


def plate_wrench(
    kind: int, channels: Array, *, origin: Array, calibration: Array | None, units: Array
) -> tuple[Array, Array]:
    """Force (N, 3) N and moment (N, 3) N m about the centre of the surface, in the plate's frame (z into the
    floor).

    Args:
        kind: 1 force, centre of pressure and free moment; 2 force and moment about the transducers' origin; 3
            eight piezo-electric forces; 4 as 2, through a calibration matrix.
        channels: (6 or 8, N) as the file scales them.
        origin: (3,) m. Types 2 and 4: between the transducers' origin and the surface's centre; type 3:
            distances a, b of the sensors from the axes, and their depth. Files differ in the sign of its
            depth: the transducers lie below the surface, that is settled here.
        calibration: (6, 6), type 4 only.
        units: (6 or 8,) factor from each channel (type 4: each calibrated channel) to N, N m or m.
    """
    if calibration is not None:
        channels = calibration @ channels
    values = channels * units[:, None]
    if kind == 1:
        force = values[:3].T
        arm = np.column_stack([values[3], values[4], np.zeros(values.shape[1])])
        return force, np.cross(arm, force) + np.outer(values[5], [0.0, 0.0, 1.0])
    if kind == 3:
        return _eight_forces(values, a=abs(origin[0]), b=abs(origin[1]), depth=abs(origin[2]))
    # From the transducers' origin T to the surface's centre S, which lies above it, at negative z: a file
    # with a positive depth holds the opposite vector. M_S = M_T + F x (S - T).
    to_surface = -origin if origin[2] > 0 else origin
    force = values[:3].T
    return force, values[3:].T + np.cross(force, to_surface)


def _eight_forces(values: Array, a: float, b: float, depth: float) -> tuple[Array, Array]:
    """Kistler: f_x12, f_x34, f_y14, f_y23, f_z1 to f_z4; sensors at (+-a, +-b), ``depth`` below the
    surface."""
    x12, x34, y14, y23, z1, z2, z3, z4 = values
    force = np.column_stack([x12 + x34, y14 + y23, z1 + z2 + z3 + z4])
    moment = np.column_stack(
        [
            b * (z1 + z2 - z3 - z4),
            a * (z2 + z3 - z1 - z4),
            b * (x34 - x12) + a * (y14 - y23),
        ]
    )
    return force, moment + np.cross(force, [0.0, 0.0, -depth])
