"""Moments of the legs that the recordings' own files give: OpenSim's inverse dynamics, Vicon's model outputs.

They judge what a run says is measured; nothing of a run follows from them.
"""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import ezc3d
import numpy as np
from numpy.typing import NDArray

from dynakin.recordings.formats.mot import read_table
from dynakin.recordings.read import read

Array = NDArray[np.float64]
JOINTS = {"hip": "hip_flexion", "knee": "knee_angle", "ankle": "ankle_angle"}
SIDES = {"right": "r", "left": "l"}
Columns = dict[tuple[str, str], Array]
"""(side, joint) -> (T,) N m, positive in flexion and dorsiflexion; NaN where it has no result."""


@dataclass(frozen=True, eq=False)
class Reference:
    """time (T,) s and moments; aloft: (side) -> (T,) the file has no force on that foot, so that its moments hold only
    while the foot is in the air."""

    what: str
    time: Array
    moments: Columns
    aloft: dict[str, NDArray[np.bool_]]


def of_storage(path: Path, span: tuple[float, float], what: str, knee_sign: float = 1.0) -> Reference:
    """A file of OpenSim's inverse dynamics, within the seconds ``span`` in which it holds."""
    table = read_table(path)
    inside = (table.time >= span[0]) & (table.time <= span[1])
    moments = {
        (side, joint): np.where(inside, table.values[:, table.names.index(f"{name}_{letter}_moment")], np.nan)
        * (knee_sign if joint == "knee" else 1.0)
        for side, letter in SIDES.items()
        for joint, name in JOINTS.items()
    }
    return Reference(what, np.asarray(table.time), moments, {})


def of_kinematics(folder: Path, name: str, model: str, cutoff_hz: float, made: Path) -> Reference:
    """OpenSim's inverse dynamics on the file's own inverse kinematics, each plate on the foot that it lies under.

    Away from the ends, where a low-pass has nothing on one side.
    """
    import opensim

    opensim.Logger.setLevelString("error")
    made.mkdir(parents=True, exist_ok=True)
    loads = made / "loads.xml"
    text = (folder / f"{name}_external_forces.xml").read_text(encoding="utf-8")
    feet = iter(_bodies(folder, name))
    text = re.sub(r"<applied_to_body>.*?<", lambda _: f"<applied_to_body>{next(feet)}<", text)
    loads.write_text(re.sub(r"<datafile>.*?<", f"<datafile>{folder / f'{name}_grf.mot'}<", text), encoding="utf-8")
    motion = folder / f"{name}_ik.mot"
    time = read_table(motion).time
    tool = opensim.InverseDynamicsTool()
    tool.setModelFileName(str(folder / model))
    tool.setCoordinatesFileName(str(motion))
    tool.setLowpassCutoffFrequency(cutoff_hz)
    tool.setExternalLoadsFileName(str(loads))
    tool.setStartTime(float(time[0]))
    tool.setEndTime(float(time[-1]))
    excluded = opensim.ArrayStr()
    excluded.append("Muscles")
    tool.setExcludedForces(excluded)
    tool.setResultsDir(str(made))
    tool.setOutputGenForceFileName("id.sto")
    with _quiet():
        done = tool.run()
    if not done:
        raise RuntimeError(f"{name}: OpenSim's inverse dynamics failed")
    edge = 1.0 / cutoff_hz
    what = f"OpenSim's inverse dynamics on {name}_ik.mot, {cutoff_hz:g} Hz"
    return of_storage(made / "id.sto", (float(time[0]) + edge, float(time[-1]) - edge), what)


@contextmanager
def _quiet() -> Iterator[None]:
    """OpenSim prints the model on the process' own standard output, where the table is to stand."""
    sys.stdout.flush()
    kept = os.dup(1)
    with Path(os.devnull).open("w", encoding="utf-8") as nowhere:
        os.dup2(nowhere.fileno(), 1)
        try:
            yield
        finally:
            os.dup2(kept, 1)
            os.close(kept)


def _bodies(folder: Path, name: str) -> list[str]:
    """Which heel bone lies under each plate; the right one for a plate that carries nothing."""
    recording = read(folder / f"{name}.trc", folder / f"{name}_grf.mot")
    found = []
    for plate in recording.plates:
        loaded = np.nan_to_num(plate.force[:, 1]) > 100.0
        away = {
            side: np.nanmean(np.linalg.norm(recording.marker(heel)[loaded] - plate.cop[loaded], axis=1))
            if loaded.any()
            else 0.0
            for side, heel in (("r", "r_calc"), ("l", "L_calc"))
        }
        found.append(f"calcn_{min(away, key=lambda side: away[side])}")
    return found


def of_c3d(path: Path, mass_kg: float) -> Reference:
    """Plug-in Gait's moments in the file: N mm/kg whatever its units say, extension and plantar flexion positive; zeros
    in all components, and negative residuals, are no result."""
    file = ezc3d.c3d(str(path))
    points, labels = file["data"]["points"], file["parameters"]["POINT"]["LABELS"]["value"]
    residuals = file["data"]["meta_points"]["residuals"][0]
    plain = [label.rsplit(":", 1)[-1] for label in labels]
    rate = float(file["parameters"]["POINT"]["RATE"]["value"][0])

    def output(name: str) -> tuple[Array, NDArray[np.bool_]]:
        if name not in plain:
            none = np.full((3, points.shape[2]), np.nan)
            return none, np.zeros(points.shape[2], dtype=bool)
        k = plain.index(name)
        values = points[:3, k]
        return values, np.isfinite(values).all(axis=0) & (values != 0.0).any(axis=0) & (residuals[k] >= 0.0)

    moments: Columns = {}
    aloft = {}
    for side in SIDES:
        letter = side[0].upper()
        for joint in JOINTS:
            values, known = output(f"{letter}{joint.capitalize()}Moment")
            moments[side, joint] = np.where(known, -values[0] * mass_kg / 1000.0, np.nan)
        aloft[side] = ~output(f"{letter}GroundReactionForce")[1]
    return Reference("Plug-in Gait's moments in the file", np.arange(points.shape[2]) / rate, moments, aloft)
