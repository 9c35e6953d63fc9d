"""The truth behind a simulated trial, in labelled arrays."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import xarray as xr

from dynakin.arrays import Array
from dynakin.simulation.bodies.body import SimulatedBody
from dynakin.simulation.bodies.markers import Site, marker_positions
from dynakin.simulation.bodies.subject import SimulatedSubject
from dynakin.simulation.contacts import MechanicalState
from dynakin.simulation.mechanics import Segment
from dynakin.simulation.motions.movement import Repetition
from dynakin.simulation.sensors.plates import PlateErrors
from dynakin.simulation.sensors.sensed_markers import Fault
from dynakin.units import COMPONENTS


@dataclass(frozen=True)
class Truth:
    """What the sensors should have measured. Ground frame of the models (X forward, Y up, Z right; the planar chains'
    origin: the toe landmark), SI.

    Attributes:
        data: coordinates, speeds, accelerations, moments (time, coordinate), named and signed as in the model;
            wrench (time, component), ground on person, about the ground origin, and contact_wrench (time,
            contact, component) of each foot, the seat and each hand; in space contact_segment (contact) and
            contact_point (time, contact, axis), where it presses or pulls (NaN where a foot or seat is not loaded);
            markers (time, marker, axis) on the bones, and soft_tissue, the displacement of each marker from there;
            joint_centres (time, joint, axis); kinetic_energy, potential_energy (time). Moments are net joint
            moments: what a seat carries no joint below it supplies.
        parameters: lengths and inertial parameters by the names of the filter's state (length/shank,
            inertia/shank/izz), and where markers truly are (marker/r_knee/x, m, in their segment's frame, by
            their names in the recording).
        origin_L: (3,) m, the ground origin in the laboratory frame, whose axes are those of the ground frame.
        sites: where the markers are put on; subject, tree: who was measured.
        faults: gaps, swaps and flying markers; plate_errors: by plate; repetitions: of the movement, where known;
            contacts: segment by contact, of a body in space.
    """

    data: xr.Dataset
    parameters: dict[str, float]
    origin_L: Array
    subject: SimulatedSubject
    tree: tuple[Segment, ...]
    sites: tuple[Site, ...] = ()
    faults: tuple[Fault, ...] = ()
    plate_errors: dict[str, PlateErrors] | None = None
    repetitions: tuple[Repetition, ...] = ()
    contacts: Mapping[str, str] = field(default_factory=dict)


def label_arrays(
    body: SimulatedBody,
    time: Array,
    state: MechanicalState,
    sites: Sequence[Site],
    displacement: Array,
) -> xr.Dataset:
    """Put the simulation's arrays under their names; ``displacement`` (T, M, 3) is in the segments' frames."""
    motion, moving, forces, carried = state.motion, state.moving, state.forces, state.carried
    bone = marker_positions(sites, moving)
    centres = {name: moving.segments[segment].point(place) for name, (segment, place) in body.joint_centres.items()}
    by_coordinate, by_marker = ("time", "coordinate"), ("time", "marker", "axis")
    points = {}
    if state.points:
        stacked = np.stack([state.points[name] for name in carried], axis=1)
        points["contact_point"] = (("time", "contact", "axis"), stacked, {"units": "m"})
    unit, force = ("rad", "N m") if not body.translations else ("rad or m", "N m or N")
    return xr.Dataset(
        {
            "coordinates": (by_coordinate, motion.q, {"units": unit}),
            "speeds": (by_coordinate, motion.qd, {"units": f"({unit})/s" if " " in unit else f"{unit}/s"}),
            "accelerations": (by_coordinate, motion.qdd, {"units": f"({unit})/s2" if " " in unit else f"{unit}/s2"}),
            "moments": (by_coordinate, forces.moments, {"units": force}),
            "wrench": (("time", "component"), forces.wrench, {"units": "N, N m"}),
            "contact_wrench": (
                ("time", "contact", "component"),
                np.stack(list(carried.values()), axis=1),
                {"units": "N, N m"},
            ),
            **points,
            "markers": (by_marker, bone, {"units": "m"}),
            "soft_tissue": (by_marker, marker_positions(sites, moving, displacement) - bone, {"units": "m"}),
            "joint_centres": (
                ("time", "joint", "axis"),
                np.stack(list(centres.values()), axis=1) if centres else np.zeros((len(time), 0, 3)),
                {"units": "m"},
            ),
            "kinetic_energy": ("time", forces.kinetic, {"units": "J"}),
            "potential_energy": ("time", forces.potential, {"units": "J"}),
        },
        coords={
            "time": ("time", time, {"units": "s"}),
            "coordinate": list(motion.names),
            "component": list(COMPONENTS),
            "contact": list(carried),
            **({"contact_segment": ("contact", list(state.segments.values()))} if state.segments else {}),
            "marker": [site.name for site in sites],
            "joint": np.array(list(centres), dtype=str),
            "axis": ["x", "y", "z"],
        },
    )


def all_parameters(body: SimulatedBody, sites: Sequence[Site]) -> dict[str, float]:
    """Lengths, inertial parameters and marker places by name."""
    places = {f"marker/{s.name}/{axis}": float(v) for s in sites for axis, v in zip("xyz", s.place, strict=True)}
    return body.parameters() | places
