"""What the columns of an estimate are called: coordinates, markers, joints, feet, elements of the state."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from dynakin.bindings import _core
from dynakin.filter.contacts import ContactLoads
from dynakin.filter.directions import clinical_signs
from dynakin.filter.sources import moved_segments
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.model.schema import kinds_of
from dynakin.results.estimate import AXES
from dynakin.tree import Tree
from dynakin.units import COMPONENTS


def labels(
    model: _core.Model, initial: CalibratedModel, time: npt.NDArray[np.float64], feet: ContactLoads | None
) -> dict[str, Any]:
    """The coordinates of `Estimate.data`, for times (T,) s and the contacts that the moments are made with."""
    spec = initial.spec
    names, parents, segments = _joints(spec)
    kinds = kinds_of(spec.segments)
    found: dict[str, Any] = {
        "time": time,
        "coordinate": model.coordinate_names,
        "coordinate_type": ("coordinate", [kinds[c.name] for c in spec.coordinates]),
        "coordinate_file_unit": (
            "coordinate",
            [_file_unit(initial, c.name, kinds[c.name]) for c in spec.coordinates],
        ),
        "coordinate_segment": ("coordinate", moved_segments(spec)),
        "clinical_sign": ("coordinate", np.array(clinical_signs(model), dtype=np.int8)),
        "marker": list(initial.recorded_markers),
        "axis": list(AXES),
        "axis_": list(AXES),
        "sensor": [*initial.recorded_markers, "plates"],
        "marker_axes_modelled": ("axis", np.array(spec.markers[0].measured)),
        "component": list(COMPONENTS),
        "element": list(model.layout.names),
        "element_": list(model.layout.names),
        "joint": names,
        "joint_parent": ("joint", parents),
        "joint_segment": ("joint", segments),
    }
    if initial.coupled is not None:
        kinds_and_hosts = initial.coupled.kinds.values()
        found |= {
            "coupled_coordinate": list(initial.coupled.kinds),
            "coupled_coordinate_type": ("coupled_coordinate", [kind for kind, _ in kinds_and_hosts]),
            "coupled_coordinate_file_unit": (
                "coupled_coordinate",
                [_file_unit(initial, name, kind) for name, (kind, _) in initial.coupled.kinds.items()],
            ),
            "coupled_coordinate_follows": ("coupled_coordinate", [host for _, host in kinds_and_hosts]),
        }
    if feet is not None:
        found |= {
            "foot": list(feet.names),
            "foot_segment": ("foot", list(feet.segments)),
            "foot_declared": ("foot", np.array([name in initial.contacts for name in feet.names], dtype=bool)),
        }
    return found


def _file_unit(initial: CalibratedModel, name: str, kind: str) -> str:
    """Unit of a coordinate in the tables that OpenSim reads."""
    return "m" if kind == "translation" else "rad" if name in initial.in_radians else "deg"


def _joints(spec: _core.ModelSpec) -> tuple[list[str], list[int], list[str]]:
    """Name, number of the parent joint (-1: ground) and segment of each joint; a hinge is named as its coordinate."""
    segments = [segment.name for segment in spec.segments]
    names = []
    for segment in spec.segments:
        coordinates = {axis.coordinate for axis in segment.axes}
        names.append(coordinates.pop() if len(coordinates) == 1 else segment.name)
    if len(set(names)) < len(names):
        names = segments
    return names, Tree.of(spec.segments).numbers, segments
