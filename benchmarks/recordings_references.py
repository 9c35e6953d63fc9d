"""Moments of the legs that the recordings' own files give: OpenSim's inverse dynamics, Vicon's model outputs.

They judge what a run says is measured; nothing of a run follows from them.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import ezc3d
import numpy as np
from numpy.typing import NDArray
from scipy import signal

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


@dataclass(frozen=True)
class Inverse:
    """What OpenSim's inverse dynamics takes: paths of a motion, a model and external loads, and the low-pass."""

    motion: Path
    model: Path
    loads: Path
    forces: Path
    cutoff_hz: float
    bodies: tuple[str, ...] | None = None
    """Of each load; None: as the file has them."""

    def run(self, made: Path, *, filtered: bool) -> Reference:
        """With forces as measured, or low-passed like the motion; away from the ends, where a low-pass has nothing on
        one side."""
        import opensim

        opensim.Logger.setLevelString("error")
        made.mkdir(parents=True, exist_ok=True)
        time = read_table(self.motion).time
        tool = opensim.InverseDynamicsTool()
        tool.setModelFileName(str(self.model))
        tool.setCoordinatesFileName(str(self.motion))
        tool.setLowpassCutoffFrequency(self.cutoff_hz)
        tool.setExternalLoadsFileName(str(self._loads(made, filtered)))
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
            raise RuntimeError(f"{self.motion.name}: OpenSim's inverse dynamics failed")
        edge = 1.0 / self.cutoff_hz
        what = f"OpenSim's inverse dynamics on {self.motion.name}, {self.cutoff_hz:g} Hz"
        return of_storage(made / "id.sto", (float(time[0]) + edge, float(time[-1]) - edge), what)

    def _loads(self, made: Path, filtered: bool) -> Path:
        tree = ElementTree.parse(self.loads)
        loads = list(tree.iter("ExternalForce"))
        names = [tuple(_text(load, f"{kind}_identifier") for kind in ("force", "point", "torque")) for load in loads]
        for k, load in enumerate(loads):
            if self.bodies is not None:
                _set(load, "applied_to_body", self.bodies[k])
            if filtered:
                for kind in ("force", "point", "torque"):
                    _set(load, f"{kind}_identifier", f"{kind}_{k}_")
        forces = self.forces
        if filtered:
            forces = made / "filtered.mot"
            _low_passed(self.forces, names, self.cutoff_hz, forces)
        for at in tree.iter("datafile"):
            at.text = str(forces)
        tree.write(made / "loads.xml")
        return made / "loads.xml"


def _text(load: ElementTree.Element, tag: str) -> str:
    found = load.find(tag)
    return (found.text or "").strip() if found is not None else ""


def _set(load: ElementTree.Element, tag: str, text: str) -> None:
    found = load.find(tag)
    assert found is not None, tag
    found.text = text


def _low_passed(source: Path, names: list[tuple[str, ...]], cutoff_hz: float, target: Path) -> None:
    """Forces and their moments about the origin, second order there and back; each is then applied at the origin."""
    table = read_table(source)
    rate = 1.0 / float(np.median(np.diff(table.time)))
    time = np.arange(table.time[0], table.time[-1], 1.0 / rate)
    sos = signal.butter(2, cutoff_hz / 0.802, fs=rate, output="sos")
    columns, head = [time], ["time"]
    for k, (force, point, torque) in enumerate(names):
        F, p, t = (
            np.stack([table.values[:, table.names.index(name + axis)] for axis in "xyz"], axis=1)
            for name in (force, point, torque)
        )
        moment = np.cross(np.where(np.abs(F) > 0.0, p, 0.0), F) + t
        both = np.stack([np.interp(time, table.time, column) for column in np.hstack([F, moment]).T], axis=1)
        smooth = signal.sosfiltfilt(sos, both, axis=0)
        columns += [*smooth[:, :3].T, *np.zeros((3, len(time))), *smooth[:, 3:].T]
        head += [f"{kind}_{k}_{axis}" for kind in ("force", "point", "torque") for axis in "xyz"]
    lines = [f"{target.stem}", "version=1", f"nRows={len(time)}", f"nColumns={len(head)}", "inDegrees=no", "endheader"]
    rows = ["\t".join(f"{value:.9g}" for value in row) for row in np.stack(columns, axis=1)]
    target.write_text("\n".join([*lines, "\t".join(head), *rows]) + "\n", encoding="utf-8")


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


def bodies_under(folder: Path, name: str) -> tuple[str, ...]:
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
    return tuple(found)


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
