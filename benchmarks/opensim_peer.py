"""OpenSim on a trial: inverse kinematics frame by frame, and the residual that its inverse dynamics leaves."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import opensim
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]
opensim.Logger.setLevelString("error")
_ROOT = ("pelvis_tilt", "pelvis_list", "pelvis_rotation", "pelvis_tx", "pelvis_ty", "pelvis_tz")


@dataclass(frozen=True, eq=False)
class Kinematics:
    """time (T,) s; values of coordinates (T, C) rad or m; places of the model's markers (T, M, 3) m; step_s (T,)."""

    time: Array
    coordinates: tuple[str, ...]
    values: Array
    markers: tuple[str, ...]
    places: Array
    step_s: Array


def load(file: Path, *, as_shipped: bool = False, mass_kg: float | None = None) -> opensim.Model:
    """The model of a file, without its muscles where not asked for as shipped; masses scaled to a sum."""
    model = opensim.Model(str(file))
    if not as_shipped:
        for collection in (model.updForceSet(), model.updControllerSet()):
            collection.clearAndDestroy()
    state = model.initSystem()
    if mass_kg is not None:
        factor = mass_kg / model.getTotalMass(state)
        for body in model.updBodySet():
            body.scaleMass(factor)
        model.initSystem()
    return model


def without_patellae(model: opensim.Model) -> opensim.Model:
    """No coupler and the patellae's coordinates locked: no markers sit on them."""
    model.updConstraintSet().clearAndDestroy()
    for coordinate in model.updCoordinateSet():
        if "_beta" in coordinate.getName():
            coordinate.set_locked(True)
    model.initSystem()
    return model


def inverse_kinematics(model: opensim.Model, trc: Path, frames: int | None = None) -> Kinematics:
    """Least squares of all markers, weights 1, as OpenSim's tool does it; its own time a frame."""
    reference = opensim.MarkersReference(str(trc), opensim.SetMarkerWeights())
    times = np.array(opensim.TimeSeriesTableVec3(str(trc)).getIndependentColumn())[:frames]
    state = model.initSystem()
    solver = opensim.InverseKinematicsSolver(model, reference, opensim.SimTKArrayCoordinateReference(), np.inf)
    solver.setAccuracy(1e-5)
    state.setTime(float(times[0]))
    solver.assemble(state)
    coordinates = [model.getCoordinateSet().get(k) for k in range(model.getNumCoordinates())]
    sites = [model.getMarkerSet().get(k) for k in range(model.getMarkerSet().getSize())]
    values, places, spent = [], [], []
    for moment in times:
        state.setTime(float(moment))
        start = time.perf_counter()
        solver.track(state)
        spent.append(time.perf_counter() - start)
        model.realizePosition(state)
        values.append([c.getValue(state) for c in coordinates])
        places.append([site.getLocationInGround(state).to_numpy() for site in sites])
    names = tuple(c.getName() for c in coordinates)
    found = tuple(site.getName() for site in sites)
    return Kinematics(times, names, np.array(values), found, np.array(places), np.array(spent))


def residual(
    model: opensim.Model,
    kinematics: Kinematics,
    forces: Path,
    plates: Mapping[str, str],
    cutoff_hz: float | None,
) -> tuple[Array, Array, Array]:
    """What OpenSim's inverse dynamics leaves at the pelvis.

    Args:
        plates: columns of the force file ("ground_force_1") -> body that the plate bears on.
        cutoff_hz: of the tool's low-pass of the coordinates; None: none.

    Returns:
        Force (T, 3) N and moment (T, 3) N m about the pelvis' origin, ground axes, and that origin (T, 3) m.
    """
    with tempfile.TemporaryDirectory() as folder:
        coordinates = Path(folder) / "coordinates.sto"
        table = opensim.TimeSeriesTable(
            opensim.StdVectorDouble(kinematics.time.tolist()),
            opensim.Matrix.createFromMat(kinematics.values),
            opensim.StdVectorString(list(kinematics.coordinates)),
        )
        table.addTableMetaDataString("inDegrees", "no")
        opensim.STOFileAdapter.write(table, str(coordinates))
        loads = opensim.ExternalLoads()
        for plate, body in plates.items():
            force = opensim.ExternalForce()
            force.setName(plate)
            force.set_applied_to_body(body)
            force.set_force_expressed_in_body("ground")
            force.set_point_expressed_in_body("ground")
            force.set_force_identifier(f"{plate}_v")
            force.set_point_identifier(f"{plate}_p")
            force.set_torque_identifier(f"{plate}_m")
            loads.cloneAndAppend(force)
        loads.setDataFileName(str(forces))
        loads.printToXML(str(Path(folder) / "loads.xml"))
        tool = opensim.InverseDynamicsTool()
        tool.setModel(model)
        tool.setCoordinatesFileName(str(coordinates))
        tool.setLowpassCutoffFrequency(-1.0 if cutoff_hz is None else cutoff_hz)
        tool.setExternalLoadsFileName(str(Path(folder) / "loads.xml"))
        excluded = opensim.ArrayStr()
        excluded.append("Muscles")
        tool.setExcludedForces(excluded)
        tool.setStartTime(float(kinematics.time[0]))
        tool.setEndTime(float(kinematics.time[-1]))
        tool.setResultsDir(folder)
        tool.setOutputGenForceFileName("moments.sto")
        tool.run()
        moments = opensim.TimeSeriesTable(str(Path(folder) / "moments.sto"))
        at = np.array(moments.getIndependentColumn())
        kinds = ["moment"] * 3 + ["force"] * 3
        columns = [moments.getDependentColumn(f"{n}_{k}").to_numpy() for n, k in zip(_ROOT, kinds, strict=True)]
    q = [np.interp(at, kinematics.time, kinematics.values[:, kinematics.coordinates.index(n)]) for n in _ROOT]
    generalised, force = np.stack(columns[:3], axis=1), np.stack(columns[3:], axis=1)
    return force, _moment(generalised, np.stack(q[:3], axis=1)), np.stack(q[3:], axis=1)


def _moment(generalised: Array, angles: Array) -> Array:
    """Moment (T, 3) whose work on turns about Z, then X, then Y (each carried along) the three numbers are."""
    turn_z = Rotation.from_euler("Z", angles[:, :1])
    turn_zx = Rotation.from_euler("ZX", angles[:, :2])
    axes = [np.tile([0.0, 0.0, 1.0], (len(angles), 1)), turn_z.apply([1.0, 0.0, 0.0]), turn_zx.apply([0.0, 1.0, 0.0])]
    return np.asarray(np.linalg.solve(np.stack(axes, axis=1), generalised[..., None])[..., 0])
