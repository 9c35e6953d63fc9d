"""Joint angles as clinics read them: from a standing zero, under clinical names and signs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from dynakin.arrays import Array
from dynakin.results.estimate import Estimate

Signs = Literal["opensim", "clinical"]


class Convention(NamedTuple):
    """Clinical name of a coordinate, its sign against OpenSim's, what its two directions are called, and about which
    axis of a standing person its positive one turns the lower segment of a joint, or the trunk (X forward, Y up, Z to
    the right; X and Y of the left side are the right's in a mirror)."""

    name: str
    sign: int
    positive: str
    negative: str
    axis: str

    @property
    def leg(self) -> bool:
        """Whether it is of a leg's joint."""
        return self.name.startswith(("hip", "knee", "ankle", "subtalar"))


# The signs are those of OpenSim's models since version 4 (Rajagopal et al. 2016) and of the built-in ones; the
# clinical names are the International Society of Biomechanics' (Wu et al. 2002, 2005), whose pelvis tilts forwards and
# whose trunk flexes forwards as positive.
CONVENTIONS = {
    "pelvis_tilt": Convention("pelvic_tilt", -1, "anterior", "posterior", "-z"),
    "pelvis_list": Convention("pelvic_obliquity", -1, "right side up", "right side down", "-x"),
    "pelvis_rotation": Convention("pelvic_rotation", 1, "right side forward", "right side backward", "+y"),
    "hip_flexion": Convention("hip_flexion", 1, "flexion", "extension", "+z"),
    "hip_adduction": Convention("hip_adduction", 1, "adduction", "abduction", "+x"),
    "hip_rotation": Convention("hip_rotation", 1, "internal rotation", "external rotation", "+y"),
    "knee_angle": Convention("knee_flexion", 1, "flexion", "extension", "-z"),
    "ankle_angle": Convention("ankle_dorsiflexion", 1, "dorsiflexion", "plantarflexion", "+z"),
    "subtalar_angle": Convention("subtalar_inversion", 1, "inversion", "eversion", "+x"),
    "lumbar_extension": Convention("trunk_flexion", -1, "flexion", "extension", "-z"),
    "arm_flex": Convention("shoulder_flexion", 1, "flexion", "extension", "+z"),
    "arm_add": Convention("shoulder_adduction", 1, "adduction", "abduction", "+x"),
    "elbow_flex": Convention("elbow_flexion", 1, "flexion", "extension", "+z"),
}
_PLANAR = {
    "hip": "hip_flexion",
    "knee": "knee_angle",
    "ankle": "ankle_angle",
    "lumbar": "lumbar_extension",
    "shoulder": "arm_flex",
    "elbow": "elbow_flex",
}
CONVENTIONS |= {name: CONVENTIONS[whole] for name, whole in _PLANAR.items()}


def convention_of(coordinate: str) -> tuple[Convention, str] | None:
    """Convention of a coordinate and its side ("_r", "_l" or nothing); None where it has no clinical name."""
    side = coordinate[-2:] if coordinate.endswith(("_r", "_l")) else ""
    found = CONVENTIONS.get(coordinate.removesuffix(side))
    return None if found is None else (found, side)


def clinical_signs(estimate: Estimate) -> Array:
    """Of each coordinate (C,): 1 where it grows as the clinical angle of its name does, -1 against it, 0 where it has
    no clinical name or the model turns otherwise. The model says so (``clinical_sign``); else OpenSim 4's hold."""
    if "clinical_sign" in estimate.data.coords:
        return np.asarray(estimate.data["clinical_sign"].values, dtype=float)
    found = [convention_of(name) for name in estimate.coordinate_names]
    return np.array([float(one[0].sign) if one else 0.0 for one in found])


def ways_of(estimate: Estimate, shown: Array | float = 1.0) -> list[str]:
    """Of each coordinate (C,) " (+ flexion)": which way it grows, or the moment that turns it so; "" where the
    direction has no clinical name.

    Args:
        shown: sign of what is shown against the model's, one or (C,).
    """
    signs = clinical_signs(estimate) * shown * estimate.is_rotation()
    ways = []
    for name, sign in zip(estimate.coordinate_names, signs, strict=True):
        found = convention_of(name) if sign else None
        ways.append(f" (+ {found[0].positive if sign > 0.0 else found[0].negative})" if found else "")
    return ways


def mean_angles(names: Sequence[str], rotation: npt.NDArray[np.bool_], coordinates: Array) -> dict[str, float]:
    """Mean over the frames of coordinates (T, C) of each that is a rotation, rad."""
    return {n: float(v) for n, v, turns in zip(names, coordinates.mean(axis=0), rotation, strict=True) if turns}


def with_angles(estimate: Estimate, zero: Mapping[str, float], signs: Signs) -> Estimate:
    """The same estimate with joint angles to report: ``angles.sto`` and ``metrics.json`` (``angles``) show them.

    Args:
        zero: rad, by coordinate: what counts as 0 (`filter.zero.standing_zero`); those of the root, which places the
            whole body, are left out, and those that are not named are 0.
        signs: names and signs of the columns.
    """
    from dynakin.results.measures.power import root_coordinates

    root = root_coordinates(estimate)
    offset = [0.0 if name in root else zero.get(name, 0.0) for name in estimate.coordinate_names]
    data = estimate.data.assign(zero_offset=("coordinate", np.array(offset)))
    return replace(estimate, data=data.assign_attrs(angle_signs=signs))


class Reported(NamedTuple):
    """How ``angles.sto`` shows each coordinate (C,): sign * (value - offset); as the model has it where no angles were
    asked for, and what is no rotation ever. way: " (+ flexion)" of one that grows against its name, else "". asked:
    whether they were."""

    sign: Array
    offset: Array
    way: tuple[str, ...]
    asked: bool

    def of(self, coordinates: Array) -> Array:
        """Coordinates (..., C), rad or m."""
        return np.asarray(self.sign * (coordinates - self.offset))


def reported(estimate: Estimate) -> Reported:
    """Zero and signs that `with_angles` asked for."""
    count = len(estimate.coordinate_names)
    if "zero_offset" not in estimate.data:
        return Reported(np.ones(count), np.zeros(count), ("",) * count, False)
    clinical = estimate.data.attrs["angle_signs"] == "clinical"
    against = clinical & (clinical_signs(estimate) < 0.0) & estimate.is_rotation()
    sign = np.where(against, -1.0, 1.0)
    way = tuple(name if turned else "" for name, turned in zip(ways_of(estimate, sign), against, strict=True))
    return Reported(sign, estimate.data["zero_offset"].values, way, True)


def angle_columns(estimate: Estimate) -> tuple[list[str], Array, list[str]]:
    """Names, degrees (T, N) and a line on each of the joint angles that `with_angles` asked for: all rotations.

    Those of the pelvis are against the way the person faces, not against the laboratory.
    """
    from dynakin.results.measures.facing import facing

    estimate = facing(estimate)
    shown = reported(estimate)
    values = np.degrees(shown.of(estimate.values("coordinates")))
    clinical = estimate.data.attrs["angle_signs"] == "clinical"
    signs = clinical_signs(estimate)
    names, columns, lines = [], [], []
    for k in np.flatnonzero(estimate.is_rotation()):
        if estimate.coordinate_names[k] in estimate.held:
            continue
        name = estimate.coordinate_names[k]
        found = convention_of(name)
        line = f"{name}: as the model has it"
        if clinical and found is not None and signs[k]:
            convention, side = found
            line = f"{convention.name}{side}: + {convention.positive}, - {convention.negative}"
            name = convention.name + side
        names.append(name)
        columns.append(values[:, k])
        lines.append(f"{line}; zero at {np.degrees(shown.offset[k]) + 0.0:.2f} deg of the model")
    return names, np.column_stack(columns) if columns else np.empty((len(values), 0)), lines
