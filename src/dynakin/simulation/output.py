"""A simulated trial as files: what a laboratory would hand over, and with it the truth."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dynakin.arrays import Array, cross
from dynakin.files import expanded, write_json
from dynakin.recordings.recording import Plate, Recording
from dynakin.results.files.config import versions
from dynakin.results.files.folder import FolderKind, replacing
from dynakin.results.files.markers import write_trc
from dynakin.results.files.netcdf import ONE_AT_A_TIME
from dynakin.results.files.storage import write_storage
from dynakin.simulation.truth import Truth

SCHEMA_VERSION = 1


@dataclass(frozen=True)
class SimulatedTrial:
    """The recording, as a reader would return it, the truth behind it, and what it was made with."""

    recording: Recording
    truth: Truth
    settings: dict[str, Any]

    def save(self, folder: str | Path) -> Path:
        """Write recording and truth into a folder; see `dynakin.simulation.output.save_trial`."""
        return save_trial(self, folder)


def save_trial(trial: SimulatedTrial, folder: str | Path) -> Path:
    """Write a trial into ``folder``: all files or none; one that holds an earlier trial is replaced.

    Files: markers.trc (m) and forces.mot (each plate's force, point of application and free moment, laboratory
    frame), which `dynakin.read` takes; truth_coordinates.mot, truth_speeds.sto, truth_accelerations.sto (degrees,
    m), truth_moments.sto, truth_wrench.sto and of each contact truth_contacts.sto (N m, N; ground frame, about its
    origin); truth.json (settings,
    parameters, joints' places and axes, marker places, faults); truth.nc (every array, labelled). The same trial gives
    the same bytes.

    Raises:
        OutputError: the folder cannot be written, or holds something that the simulator did not write.
    """
    folder = expanded(folder).absolute()
    with replacing(folder, kind=TRIAL) as made:
        for name, write in _WRITERS.items():
            if name != "forces.mot" or trial.recording.plates:
                write(trial, made / name)
    return folder


def _write_markers(trial: SimulatedTrial, path: Path) -> None:
    recording = trial.recording
    write_trc(path, recording.time, list(recording.marker_names), recording.markers, unit=recording.length_unit)


def _write_forces(trial: SimulatedTrial, path: Path) -> None:
    """OpenSim's spelling, plates numbered from 1: ground_force_1_vx, ground_force_1_px, ground_torque_1_x."""
    names, columns = [], []
    for k, plate in enumerate(trial.recording.plates, start=1):
        for stem, values in zip(
            (f"ground_force_{k}_v", f"ground_force_{k}_p", f"ground_torque_{k}_"), _applied(plate), strict=True
        ):
            names += [f"{stem}{axis}" for axis in "xyz"]
            columns.append(values)
    write_storage(
        path,
        "Ground reaction forces",
        trial.recording.time,
        names,
        np.hstack(columns),
        in_degrees=False,
        notes=["Ground on person, laboratory frame of the markers (X forward, Y up, Z right). N, m, N m."],
    )


def _applied(plate: Plate) -> tuple[Array, Array, Array]:
    """Force, point of application and moment about that point, (T, 3) each; where the plate is unloaded the point
    is its middle and the moment all that is left, so that the wrench stays what it is."""
    assert plate.corners is not None  # every simulated plate has them
    middle = plate.corners.mean(axis=0)
    unloaded = np.isnan(plate.cop).any(axis=1, keepdims=True)
    point = np.where(unloaded, middle, plate.cop)
    return plate.force, point, np.where(unloaded, plate.moment - cross(point, plate.force), plate.free_moment)


def _coordinate_writer(variable: str, title: str, unit: str) -> Callable[[SimulatedTrial, Path], None]:
    def write(trial: SimulatedTrial, path: Path) -> None:
        data = trial.truth.data
        values = data[variable].transpose("time", "coordinate").values.copy()
        rotation = _rotations(trial)
        values[:, rotation] = np.degrees(values[:, rotation])
        write_storage(
            path,
            title,
            data["time"].values,
            [str(name) for name in data["coordinate"].values],
            values,
            in_degrees=True,
            notes=[f"Truth of {trial.recording.name}. Rotations in degrees{unit}, translations in metres{unit}."],
        )

    return write


def _write_moments(trial: SimulatedTrial, path: Path) -> None:
    data = trial.truth.data
    kinds = ["moment" if turns else "force" for turns in _rotations(trial)]
    names = [f"{name}_{kind}" for name, kind in zip(data["coordinate"].values, kinds, strict=True)]
    notes = [f"Truth of {trial.recording.name}. Net joint moments in N m, forces in N."]
    write_storage(
        path,
        "Inverse Dynamics Generalized Forces",
        data["time"].values,
        names,
        data["moments"].values,
        in_degrees=False,
        notes=notes,
    )


def _write_wrench(trial: SimulatedTrial, path: Path) -> None:
    data = trial.truth.data
    notes = [f"Truth of {trial.recording.name}. Ground on person, N and N m about the ground origin, ground frame."]
    names = [str(name) for name in data["component"].values]
    write_storage(
        path, "External wrench", data["time"].values, names, data["wrench"].values, in_degrees=False, notes=notes
    )


def _write_contacts(trial: SimulatedTrial, path: Path) -> None:
    """right_foot_fx and so on: a contact's six components after those of the one before."""
    data = trial.truth.data
    notes = [f"Truth of {trial.recording.name}. On person, N and N m about the ground origin, ground frame."]
    for name in data["contact"].values:
        on = trial.truth.contacts.get(str(name))
        notes += [f"{name} acts on {on}."] if on else []
    names = [f"{str(c).replace(' ', '_')}_{k}" for c in data["contact"].values for k in data["component"].values]
    values = data["contact_wrench"].transpose("time", "contact", "component").values.reshape(len(data["time"]), -1)
    write_storage(path, "Contact wrenches", data["time"].values, names, values, in_degrees=False, notes=notes)


def _write_truth(trial: SimulatedTrial, path: Path) -> None:
    truth = trial.truth
    content: dict[str, Any] = {
        "schema_version": SCHEMA_VERSION,
        "versions": {"dynakin": versions()["dynakin"], "numpy": versions()["numpy"]},
        "simulation": trial.settings,
        "notes": list(map(str, trial.recording.notes)),
        "ground_origin_in_laboratory_m": truth.origin_L.tolist(),
        "parameters": truth.parameters,
        "segments": [
            {
                "name": s.name,
                "parent": s.parent,
                "placement_m": s.placement.tolist(),
                "axes": {a.coordinate: list(a.direction) for a in s.axes},
            }
            for s in truth.tree
        ],
        "markers": [
            {"name": s.name, "segment": s.segment, "place_m": s.place.tolist(), "landmark": s.landmark}
            for s in truth.sites
        ],
        "plates": {
            name: {"gain": e.gain.tolist(), "drift_per_s": e.drift.tolist()}
            for name, e in (truth.plate_errors or {}).items()
        },
        "contacts": [{"name": name, "segment": segment} for name, segment in truth.contacts.items()],
        "repetitions": [asdict(r) for r in truth.repetitions],
        "faults": [asdict(f) for f in truth.faults],
    }
    write_json(path, content)


def _write_arrays(trial: SimulatedTrial, path: Path) -> None:
    data = trial.truth.data.assign_attrs(
        title=f"truth of {trial.recording.name}",
        schema_version=SCHEMA_VERSION,
        frame="ground frame: X forward, Y up, Z right; SI, radians",
        ground_origin_in_laboratory_m=trial.truth.origin_L.tolist(),
    )
    encoding = {
        name: {"zlib": True, "complevel": 4, "shuffle": True}
        for name, variable in data.data_vars.items()
        if variable.dtype.kind == "f" and variable.size > 1000
    }
    with ONE_AT_A_TIME:
        data.to_netcdf(path, engine="netcdf4", encoding=encoding)


def _rotations(trial: SimulatedTrial) -> NDArray[np.bool_]:
    """Which coordinates are angles."""
    lengths = {axis.coordinate for segment in trial.truth.tree for axis in segment.axes if axis.translation}
    return np.array([str(name) not in lengths for name in trial.truth.data["coordinate"].values])


_WRITERS: dict[str, Callable[[SimulatedTrial, Path], None]] = {
    "markers.trc": _write_markers,
    "forces.mot": _write_forces,
    "truth_coordinates.mot": _coordinate_writer("coordinates", "Coordinates", ""),
    "truth_speeds.sto": _coordinate_writer("speeds", "Speeds", " per second"),
    "truth_accelerations.sto": _coordinate_writer("accelerations", "Accelerations", " per second squared"),
    "truth_moments.sto": _write_moments,
    "truth_wrench.sto": _write_wrench,
    "truth_contacts.sto": _write_contacts,
    "truth.json": _write_truth,
    "truth.nc": _write_arrays,
}
TRIAL_FILES = tuple(_WRITERS)
"""Every file that `save_trial` writes."""
TRIAL = FolderKind(TRIAL_FILES, "truth.json", "simulated trial")
