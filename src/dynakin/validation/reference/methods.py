"""Classical angles, their derivatives, and the table's wrench and moments, labelled as an `Estimate` is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from dynakin.arrays import Array
from dynakin.errors import ConfigError
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.model.definition import Definition, ModelDefinition
from dynakin.recordings.recording import Recording
from dynakin.recordings.smoothing import smooth
from dynakin.settings.defaults import CUTOFF_HZ
from dynakin.units import COMPONENTS
from dynakin.validation.reference.chain import Kinematics, PlanarChain
from dynakin.validation.reference.classical import classical_angles, hinge_paths, landmark_paths
from dynakin.validation.reference.regressor import IN_PLANE, table_dynamics

if TYPE_CHECKING:
    import xarray as xr

Lengths = Literal["constant", "frame"]


@dataclass(frozen=True, eq=False)
class Reference:
    """What the reference methods make of a recording.

    ``data`` has the names, dimensions, frame and units of `Estimate.data`: coordinates, speeds, accelerations and
    moments (time, coordinate), wrench_estimated (the table's, "AT") and wrench_measured (time, component; absent
    without plates; as measured, not filtered); and coordinates_unfiltered (time, coordinate), the paper's classical
    angles as they are. NaN: a gap of the markers that was too long to fill, or a component out of the plane.

    chain: what the dynamics were computed on, with the table's inertia. kinematics: the filtered coordinates as the
    arrays that `identify` takes. notes: sentences on gaps and choices.
    """

    data: xr.Dataset
    chain: PlanarChain
    kinematics: Kinematics
    cutoff_hz: float | None
    lengths: Lengths
    notes: tuple[str, ...]


def reference_methods(
    recording: Recording,
    initial: CalibratedModel,
    definition: Definition,
    cutoff_hz: float | None = CUTOFF_HZ,
    *,
    lengths: Lengths = "constant",
) -> Reference:
    """Classical joint angles, low-passed and differentiated, then the table's wrench and joint moments.

    Args:
        initial, definition: the calibrated model, and what it was calibrated from (`Estimator.model`).
        cutoff_hz: of the zero-lag low-pass of the angles; None: none.
        lengths: "constant": the chain of (1) with its lengths as measured while standing and its root at rest, as in
            the paper. "frame": each hinge follows its landmarks, so that angles and lengths err together and partly
            cancel in the wrench; the stronger opponent on real trials, where thigh and shank leave the sagittal plane
            and look shorter.

    Raises:
        ModelError: the model is not planar or no tree of hinges, or the markers do not fit.
        RecordingError: uneven time steps, or a cut-off that is not below half the rate.
        ConfigError: ``lengths`` is neither.
    """
    import xarray as xr  # the slowest library of all, which reading a trial does without

    if lengths not in ("constant", "frame"):
        raise ConfigError(f"lengths is {lengths!r}, expected constant or frame")
    plan = initial.measured_plan()
    assert isinstance(definition, ModelDefinition)  # else there is no plan
    chain = PlanarChain.of(plan)
    landmarks = landmark_paths(recording, initial, definition)
    angles = classical_angles(chain, plan, landmarks)
    smoothed = smooth(recording.time, angles, cutoff_hz, names=chain.coordinates)
    hinges = None
    if lengths == "frame":
        paths = hinge_paths(chain, plan, landmarks, angles)
        flat = smooth(recording.time, paths.reshape(len(paths), -1), cutoff_hz)
        hinges = np.stack([flat.values, flat.rates, flat.seconds]).reshape(3, *paths.shape)
    kinematics = Kinematics(smoothed.values, smoothed.rates, smoothed.seconds, hinges)
    forces = table_dynamics(chain, kinematics)
    by_coordinate = ("time", "coordinate")
    variables: dict[str, tuple[tuple[str, str], Array, dict[str, str]]] = {
        "coordinates": (by_coordinate, smoothed.values, {"units": "rad"}),
        "coordinates_unfiltered": (by_coordinate, angles, {"units": "rad"}),
        "speeds": (by_coordinate, smoothed.rates, {"units": "rad/s"}),
        "accelerations": (by_coordinate, smoothed.seconds, {"units": "rad/s2"}),
        "moments": (by_coordinate, forces.moments, {"units": "N m"}),
        "wrench_estimated": (("time", "component"), forces.wrench, {"units": "N, N m"}),
    }
    if recording.plates:
        variables["wrench_measured"] = (("time", "component"), plane_wrench(recording, initial), {"units": "N, N m"})
    coords = {
        "time": recording.time,
        "coordinate": list(chain.coordinates),
        "coordinate_type": ("coordinate", ["rotation"] * len(chain.coordinates)),
        "component": list(COMPONENTS),
    }
    low_pass = "not filtered" if cutoff_hz is None else f"zero-lag low-pass at {cutoff_hz:g} Hz"
    how = {
        "constant": "segment lengths constant, as measured while standing",
        "frame": "joint places by the landmarks of each frame",
    }
    notes = (f"Classical angles: {low_pass}; {how[lengths]}.", *smoothed.notes)
    data = xr.Dataset(variables, coords=coords)
    return Reference(data, chain, kinematics, cutoff_hz, lengths, notes)


def plane_wrench(recording: Recording, initial: CalibratedModel) -> Array:
    """The plates' total wrench (T, 6) about the model's ground origin, ground frame, NaN out of the plane."""
    measured = initial.ground.wrench_to_ground(recording.total_wrench())
    wrench = np.full(measured.shape, np.nan)
    wrench[:, IN_PLANE] = measured[:, IN_PLANE]
    return wrench
