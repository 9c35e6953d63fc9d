"""A made-up person in space with Plug-in Gait's markers, and trials of that person from the core's own kinematics."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from dynakin.bindings import _core
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.model.definition import ModelDefinition, load_model
from dynakin.recordings.recording import Plate, Recording
from dynakin.settings.subject import Subject

Array = npt.NDArray[np.float64]

CENTRE = {"T10": (-0.13, 1.25), "STRN": (0.10, 1.22), "C7": (-0.09, 1.47), "CLAV": (0.05, 1.40)}
SIDES = {
    "ASI": (0.10, 1.00, 0.12),
    "PSI": (-0.10, 1.02, 0.05),
    "THI": (0.03, 0.72, 0.17),
    "KNE": (0.02, 0.50, 0.155),
    "TIB": (0.01, 0.28, 0.15),
    "ANK": (-0.03, 0.09, 0.145),
    "HEE": (-0.09, 0.05, 0.105),
    "TOE": (0.13, 0.05, 0.12),
    "MT5": (0.08, 0.03, 0.165),
    "SHO": (0.00, 1.45, 0.19),
    "UPA": (0.02, 1.30, 0.25),
    "ELB": (-0.02, 1.14, 0.27),
    "WRA": (0.09, 0.90, 0.25),
    "WRB": (0.01, 0.89, 0.27),
    "FHD": (0.12, 1.65, 0.07),
    "BHD": (-0.06, 1.66, 0.07),
}
WHO = Subject(mass_kg=70.0, height_m=1.75, sex="male")
RATE = 100.0


def standing_places() -> dict[str, Array]:
    """Markers (3,) m of the person standing at the laboratory's origin, facing +X."""
    found = {name: np.array([x, y, 0.0]) for name, (x, y) in CENTRE.items()}
    for name, (x, y, z) in SIDES.items():
        found["R" + name] = np.array([x, y, z])
        found["L" + name] = np.array([x, y, -z])
    return found


def standing(n_frames: int = 100) -> Recording:
    """A second of standing still."""
    places = standing_places()
    markers = np.repeat(np.stack(list(places.values()))[None], n_frames, axis=0)
    return Recording("standing", None, np.arange(n_frames) / RATE, tuple(places), markers)


def definition() -> ModelDefinition:
    return load_model("fullbody", WHO, markers="plug-in-gait")


def measured() -> CalibratedModel:
    """fullbody measured on the standing person."""
    return definition().calibrate(standing())


def states(initial: CalibratedModel, motion: Mapping[str, Array], turn_rad: float, place: Array, time: Array) -> Array:
    """States (T, n) in which coordinates (by name, rad, (T,)) are added to standing, at another heading and place."""
    core = _core.Model(initial.spec)
    names, T = list(core.layout.names), len(time)
    n = core.layout.blocks["coordinates"][1]
    q = np.repeat(initial.x0[None, :n], T, axis=0)
    q[:, names.index("pelvis_rotation")] += turn_rad
    q[:, [names.index(f"pelvis_t{axis}") for axis in "xyz"]] += place
    for name, values in motion.items():
        q[:, names.index(name)] += values
    x = np.repeat(core.initial_state()[None], T, axis=0)
    speed = np.gradient(q, time, axis=0, edge_order=2)
    x[:, :n], x[:, n : 2 * n], x[:, 2 * n : 3 * n] = q, speed, np.gradient(speed, time, axis=0, edge_order=2)
    return x


def recording_of(
    initial: CalibratedModel, x: Array, time: Array, *, plates: bool = True, noise_m: float = 0.0
) -> Recording:
    """Markers and one large plate under both feet, of these states; the ground frame is the laboratory's."""
    core, rng = _core.Model(initial.spec), np.random.default_rng(1)
    markers = np.stack([_core.marker_positions(core, row) for row in x])
    markers = markers + noise_m * rng.normal(size=markers.shape)
    found: tuple[Plate, ...] = ()
    if plates:
        w = np.stack([_core.wrench(core, row) for row in x])
        cop = np.stack([w[:, 5] / w[:, 1], np.zeros(len(w)), -w[:, 3] / w[:, 1]], axis=1)
        corners = np.array([[-3.0, 0.0, 3.0], [3.0, 0.0, 3.0], [3.0, 0.0, -3.0], [-3.0, 0.0, -3.0]])
        free = w[:, 3:] - np.cross(cop, w[:, :3])
        found = (Plate("plate 1", w[:, :3], w[:, 3:], cop, free, corners),)
    return Recording("made", None, time, initial.recorded_markers, markers, found)
