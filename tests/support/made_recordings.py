"""Small recordings and files made by hand, whose content is known."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import ezc3d
import numpy as np

from dynakin.recordings.plates.pressure import Surface, plate_from_wrench
from dynakin.recordings.recording import Plate, Recording

TRC_TOP = (
    "PathFileType\t4\t(X/Y/Z)\ttrial.trc\n"
    "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames\n"
    "100\t100\t2\t2\tmm\t100\t1\t2\n"
    "Frame#\tTime\tRKNE\t\t\tRANK\t\t\n"
    "\t\tX1\tY1\tZ1\tX2\tY2\tZ2\n"
    "\n"
)
TRC = TRC_TOP + "1\t0.00\t1\t2\t3\t4\t5\t6\n2\t0.01\t1.5\t2.5\t3.5\t4.5\t5.5\t6.5\n"

FEET = {
    "LHEE": (0.00, 0.04, -0.15),
    "LTOE": (0.20, 0.04, -0.18),
    "LMT5": (0.15, 0.03, -0.22),
    "RHEE": (0.00, 0.04, 0.15),
    "RTOE": (0.20, 0.04, 0.18),
    "RMT5": (0.15, 0.03, 0.22),
}
BODY = {
    "LPSI": (-0.05, 1.0, -0.05),
    "LASI": (0.12, 1.0, -0.12),
    "RPSI": (-0.05, 1.0, 0.05),
    "RASI": (0.12, 1.0, 0.12),
}


def write(folder: Path, name: str, text: str) -> Path:
    path = folder / name
    path.write_bytes(text.encode())
    return path


def standing(
    mass_kg: float = 70.0,
    *,
    rotation_LG: np.ndarray | None = None,
    origin_L: Sequence[float] = (0.0, 0.0, 0.0),
    cop_shift_m: float = 0.0,
    sign: float = 1.0,
    n_frames: int = 101,
) -> Recording:
    """A person who stands still on two plates, X forward, Y up, Z right before ``rotation_LG`` and
    ``origin_L``."""
    R = np.eye(3) if rotation_LG is None else rotation_LG
    origin = np.asarray(origin_L, dtype=float)
    places = {**FEET, **BODY}
    markers = np.repeat((np.array(list(places.values())) @ R.T + origin)[None], n_frames, axis=0)
    plates = []
    for k, z in enumerate((-0.18, 0.18)):
        force_G = np.array([3.0, sign * mass_kg * 9.80665 / 2, 20.0 * (-1) ** k])
        cop_G = np.array([0.1 + cop_shift_m, 0.0, z])
        force, point = R @ force_G, R @ cop_G + origin
        moment = np.cross(point, force) + R @ np.array([0.0, 2.0, 0.0])
        ones = np.ones((n_frames, 1))
        plates.append(
            plate_from_wrench(
                f"plate {k + 1}",
                ones * force,
                ones * moment,
                Surface(point, R[:, 1]),
                corners=None,
                threshold_n=10.0,
                zero_unloaded=False,
            )
        )
    time = np.arange(n_frames) / 100.0
    return Recording("standing", None, time, tuple(places), markers, tuple(plates))


def without(recording: Recording, *names: str) -> Recording:
    """The same without these markers, as if they had not been worn."""
    keep = [k for k, name in enumerate(recording.marker_names) if name not in names]
    kept = tuple(recording.marker_names[k] for k in keep)
    return replace(recording, marker_names=kept, markers=recording.markers[:, keep])


def unseen(recording: Recording, *names: str, frames: slice = slice(None)) -> Recording:
    """The same with these markers seen in no frame, or in none of ``frames``."""
    markers = recording.markers.copy()
    markers[frames, [recording.marker_names.index(name) for name in names]] = np.nan
    return replace(recording, markers=markers)


def plain(n_frames: int, rate: float = 100.0, plates: tuple[Plate, ...] = ()) -> Recording:
    """One marker that stands still."""
    markers = np.ones((n_frames, 1, 3))
    return Recording("plain", None, np.arange(n_frames) / rate, ("RKNE",), markers, plates)


def grf_text(time: np.ndarray, columns: Mapping[str, np.ndarray | float], *, rows: int | None = None) -> str:
    """An OpenSim force file."""
    table = np.column_stack([time, *(np.broadcast_to(values, time.shape) for values in columns.values())])
    lines = [
        f"nColumns={table.shape[1]}",
        f"nRows={rows or len(time)}",
        "version=1",
        "inDegrees=yes",
        "endheader",
    ]
    lines.append("\t".join(["time", *columns]))
    lines += ["\t".join(f"{value:.12g}" for value in row) for row in table]
    return "\n".join(lines) + "\n"


def write_c3d(
    path: Path,
    points: dict[str, np.ndarray],
    *,
    kinds: Sequence[int] = (),
    channels: np.ndarray | None = None,
    corners: Sequence[np.ndarray] = (),
    origins: Sequence[Sequence[float]] = (),
    calibration: np.ndarray | None = None,
    analog_units: Sequence[str] = (),
    unit: str = "mm",
    per_frame: int = 10,
    residuals: np.ndarray | None = None,
    by_row: bool = False,
) -> Path:
    """A C3D at 100 Hz: points name -> (T, 3) in ``unit``, analog channels (C, T * per_frame), corners (4, 3)
    in ``unit``."""
    c3d = ezc3d.c3d()
    c3d["parameters"]["POINT"]["RATE"]["value"] = [100.0]
    c3d["parameters"]["POINT"]["LABELS"]["value"] = list(points)
    c3d["parameters"]["POINT"]["UNITS"]["value"] = [unit]
    data = np.stack(list(points.values()), axis=1)  # (T, N, 3)
    homogeneous = np.ones((4, data.shape[1], data.shape[0]))
    homogeneous[:3] = data.transpose(2, 1, 0)
    c3d["data"]["points"] = homogeneous
    if residuals is not None:
        c3d["data"]["meta_points"]["residuals"] = residuals[None]
    if channels is not None:
        c3d["parameters"]["ANALOG"]["RATE"]["value"] = [100.0 * per_frame]
        c3d["parameters"]["ANALOG"]["LABELS"]["value"] = [f"ch{k}" for k in range(len(channels))]
        c3d["data"]["analogs"] = channels[None]
        if analog_units:
            c3d.add_parameter("ANALOG", "UNITS", list(analog_units))
        sizes = [{3: 8, 5: 8, 6: 12, 7: 8}.get(kind, 6) for kind in kinds]
        listed = np.zeros((max(sizes, default=6), len(kinds)))
        at = 1
        for k, size in enumerate(sizes):
            listed[:size, k] = np.arange(at, at + size)
            at += size
        c3d.add_parameter("FORCE_PLATFORM", "USED", [len(kinds)])
        c3d.add_parameter("FORCE_PLATFORM", "TYPE", list(kinds))
        c3d.add_parameter("FORCE_PLATFORM", "CHANNEL", listed)
        c3d.add_parameter("FORCE_PLATFORM", "CORNERS", np.stack([c.T for c in corners], axis=2))
        c3d.add_parameter("FORCE_PLATFORM", "ORIGIN", np.array(origins, dtype=float).T)
        c3d.add_parameter("FORCE_PLATFORM", "ZERO", [1, 0])
        if by_row:
            c3d.add_parameter("FORCE_PLATFORM", "MATRIX_STORE", ["ByRow"])
        if calibration is not None:
            c3d.add_parameter("FORCE_PLATFORM", "CAL_MATRIX", np.repeat(calibration[:, :, None], len(kinds), axis=2))
    c3d.write(str(path))
    return path
