"""The truth behind a simulated trial, in labelled arrays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from dynakin.simulation.markers import Site, marker_positions, true_joint_centres
from dynakin.simulation.mechanics import Dynamics, Motion, Segment, TreeMotion
from dynakin.simulation.subject import SimulatedSubject

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Truth:
    """What the sensors should have told. Ground frame of the models (X forward, Y up, Z right; origin: the
    toe landmark), SI.

    data: coordinates, speeds, accelerations, moments (time, coordinate), named and signed as in
    ``sagittal7``; wrench (time, component), ground on person, about the toe; markers (time, marker, axis) on
    the bones, and soft_tissue, the displacement of each marker from there; joint_centres (time, joint, axis);
    kinetic_energy, potential_energy (time). parameters: lengths and inertial parameters by the names of the
    filter's state (length/shank, inertia/shank/izz). origin_L: (3,) m, the toe landmark in the laboratory
    frame, whose axes are those of the ground frame.
    """

    data: xr.Dataset
    parameters: dict[str, float]
    origin_L: Array
    subject: SimulatedSubject
    tree: tuple[Segment, ...]


def label_truth(
    subject: SimulatedSubject,
    tree: tuple[Segment, ...],
    time: Array,
    motion: Motion,
    moving: TreeMotion,
    forces: Dynamics,
    sites: Sequence[Site],
    displacement: Array,
    origin_L: Array,
) -> Truth:
    """Put the simulation's arrays under their names; ``displacement`` (T, M, 3) is in the segments'
    frames."""
    bone = marker_positions(sites, moving)
    centres = true_joint_centres(subject, moving)
    by_coordinate, by_marker = ("time", "coordinate"), ("time", "marker", "axis")
    data = xr.Dataset(
        {
            "coordinates": (by_coordinate, motion.q, {"units": "rad"}),
            "speeds": (by_coordinate, motion.qd, {"units": "rad/s"}),
            "accelerations": (by_coordinate, motion.qdd, {"units": "rad/s2"}),
            "moments": (by_coordinate, forces.moments, {"units": "N m"}),
            "wrench": (("time", "component"), forces.wrench, {"units": "N, N m"}),
            "markers": (by_marker, bone, {"units": "m"}),
            "soft_tissue": (by_marker, marker_positions(sites, moving, displacement) - bone, {"units": "m"}),
            "joint_centres": (
                ("time", "joint", "axis"),
                np.stack(list(centres.values()), axis=1),
                {"units": "m"},
            ),
            "kinetic_energy": ("time", forces.kinetic, {"units": "J"}),
            "potential_energy": ("time", forces.potential, {"units": "J"}),
        },
        coords={
            "time": time,
            "coordinate": list(motion.names),
            "component": ["fx", "fy", "fz", "mx", "my", "mz"],
            "marker": [site.name for site in sites],
            "joint": list(centres),
            "axis": ["x", "y", "z"],
        },
    )
    return Truth(data, subject.parameters(), origin_L, subject, tree)
