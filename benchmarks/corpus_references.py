"""What a recording's own file, or those beside it, say of the legs: Vicon's model outputs, OpenSim's IK and ID.

Vicon's model and ours differ in where joints lie and how their axes run. So its moments are compared twice: with our
moments, and with our joints' loads taken about its joint centres along its axes, which leaves the mechanics.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path

import ezc3d
import numpy as np
import xarray as xr
from recordings_references import JOINTS, SIDES, Array

from dynakin.errors import DynakinError
from dynakin.recordings.companions import STANDING_WORDS
from dynakin.recordings.formats.c3d import read_c3d_results
from dynakin.recordings.formats.mot import read_table
from dynakin.recordings.frame import GroundFrame
from dynakin.results.measures.sources import MEASURED

Key = tuple[str, str]
"""(side, joint)"""
SEGMENTS = {"hip": "thigh", "knee": "shank", "ankle": "foot"}
COORDINATES = {
    "hip": ("hip_flexion", "hip_adduction", "hip_rotation"),
    "knee": ("knee_angle", "knee_adduction"),
    "ankle": ("ankle_angle", "subtalar_angle"),
}
_AXES = {"hip": "FE", "knee": "TI", "ankle": "FO"}
"""Points of the segments (origin, ends of the axes) along whose lateral axis Plug-in Gait gives each joint's moment."""
_CENTRES = {"knee": "FE", "ankle": "TI"}
"""Those whose origin is the joint's centre; the hip's lies on the femur's long axis, fixed in the pelvis."""
_EXTENDS = {"hip": 1.0, "knee": -1.0, "ankle": 1.0}
"""Sign of the moment about the axis to the left that extends (hip, knee) or plantarflexes."""


@dataclass(frozen=True, eq=False)
class Theirs:
    """Angles (deg, flexion and dorsiflexion positive), moments (N m/kg, likewise) and powers (W/kg, of a whole joint),
    each (T,) by side and joint at ``time`` (T,) s, NaN where there is no result.

    loaded: (T,) by side: the file has a force on that foot; empty where it does not say. centres, axes: (T, 3) m and
    unit vectors to the left, laboratory frame, of its own joints.
    """

    what: str
    time: Array
    angles: dict[Key, Array]
    moments: dict[Key, Array]
    powers: dict[Key, Array]
    loaded: dict[str, np.ndarray] = field(default_factory=dict)
    centres: dict[Key, Array] = field(default_factory=dict)
    axes: dict[Key, Array] = field(default_factory=dict)


@dataclass(frozen=True)
class Difference:
    """Of one side and joint: ours less theirs. Angles in deg over ``n`` frames; moments in N m/kg and powers in W/kg
    over the ``frames`` in which ours are measured and theirs hold; None where there is nothing to compare."""

    n: int = 0
    offset_deg: float | None = None
    rms_deg: float | None = None
    frames: int = 0
    moment: float | None = None
    stance: float | None = None
    swing: float | None = None
    power: float | None = None
    about_theirs: float | None = None
    centre_mm: float | None = None


def of_vicon(path: Path, time: Array) -> Theirs | None:
    """Plug-in Gait's outputs in a C3D file; moments and powers are per kg whatever its units say. None without any."""
    try:
        found = {label.rsplit(":", 1)[-1]: values for label, values in read_c3d_results(path).items()}
    except DynakinError:
        return None
    keys = [(side, joint) for side in SIDES for joint in JOINTS]

    def column(name: str, axis: int, factor: float) -> dict[Key, Array]:
        labels = {key: f"{key[0][0].upper()}{key[1].capitalize()}{name}" for key in keys}
        return {key: factor * found[label][:, axis] for key, label in labels.items() if label in found}

    angles = column("Angles", 0, 1.0)
    if not angles:
        return None
    forces = {side: found.get(f"{side[0].upper()}GroundReactionForce") for side in SIDES}
    moments = column("Moment", 0, -1e-3)
    loaded = {
        side: np.zeros(len(time), dtype=bool) if force is None else np.isfinite(force).all(axis=1)
        for side, force in forces.items()
    }
    centres, axes = _joints(path, len(time))
    return Theirs("Vicon", time, angles, moments, column("Power", 2, 1.0), loaded if moments else {}, centres, axes)


def of_opensim(trial: Path, mass_kg: float, alone: bool) -> list[Theirs]:
    """IK (``*_ik.mot``) and ID (``*_id.sto``, ``inverse_dynamics.sto``) beside a trial, by their names.

    Args:
        alone: whether this is the one trial of its folder in which nobody just stands.
    """
    own, made, extends = _words(trial), [], False
    beside = sorted(trial.parent.glob("*"), key=lambda path: not path.name.endswith("_ik.mot"))
    for path in beside:
        words = _words(path) - {"ik", "id", "inverse", "dynamics"}
        kind = "IK" if path.name.endswith("_ik.mot") else "ID"
        if kind == "ID" and not path.name.endswith(("_id.sto", "inverse_dynamics.sto")):
            continue
        if own & STANDING_WORDS or not (words <= own and (words or alone)):
            continue
        table = read_table(path)
        stem = "{}_{}" if kind == "IK" else "{}_{}_moment"
        scale = 1.0 / mass_kg if kind == "ID" else 1.0 if table.in_degrees else np.rad2deg(1.0)
        values = {
            (side, joint): scale * table.values[:, table.names.index(name)]
            for side, letter in SIDES.items()
            for joint, coordinate in JOINTS.items()
            if (name := stem.format(coordinate, letter)) in table.names
        }
        if kind == "IK":  # OpenSim's oldest models bend their knees to negative angles
            extends = any(np.median(values[key]) < -5.0 for key in values if key[1] == "knee")
        if extends:
            values = {key: -column if key[1] == "knee" else column for key, column in values.items()}
        pair = (values, {}) if kind == "IK" else ({}, values)
        made.append(Theirs(f"OpenSim {kind}", np.asarray(table.time), *pair, {}))
    return made


def _words(path: Path) -> set[str]:
    return set(re.findall(r"[a-z]+|\d+", path.stem.casefold()))


def differences(data: xr.Dataset, ground: GroundFrame, mass_kg: float, theirs: Theirs) -> dict[Key, Difference]:
    """Ours against theirs, by side and joint."""
    at = data["time"].values
    found = {}
    for side, letter in SIDES.items():
        air = data["foot_contact"].sel(foot=side).values == 0 if "foot_contact" in data else np.zeros(len(at), bool)
        holds = np.ones(len(at), bool)
        if theirs.loaded:
            nearest = np.clip(np.searchsorted(theirs.time, at - 1e-6), 0, len(theirs.time) - 1)
            holds = theirs.loaded[side][nearest] | air
        for joint, coordinate in JOINTS.items():
            key, name = (side, joint), f"{coordinate}_{letter}"
            if name not in data["coordinate"].values:
                continue
            made = Difference()
            if key in theirs.angles:
                ours = np.rad2deg(data["coordinates"].sel(coordinate=name).values)
                made = _angles(ours, _at(at, theirs, key, "angles"))
            measured = holds & (data["moment_source"].sel(coordinate=name).values == MEASURED)
            ours = np.where(measured, data["moments"].sel(coordinate=name).values / mass_kg, np.nan)
            if key in theirs.moments:
                apart = ours - _at(at, theirs, key, "moments")
                known = np.isfinite(apart)
                more = {
                    "frames": int(known.sum()),
                    "moment": _rms(apart),
                    "stance": _rms(np.where(air, np.nan, apart)),
                    "swing": _rms(np.where(air, apart, np.nan)),
                }
                if key in theirs.powers:
                    power = np.where(measured, _power(data, joint, letter) / mass_kg, np.nan)
                    more["power"] = _rms(power - _at(at, theirs, key, "powers"))
                if key in theirs.axes:
                    about, centre_mm = _about_theirs(data, ground, key, theirs)
                    apart = np.where(measured, about / mass_kg, np.nan) - _at(at, theirs, key, "moments")
                    more |= {"about_theirs": _rms(apart), "centre_mm": centre_mm}
                made = Difference(made.n, made.offset_deg, made.rms_deg, **more)
            if made != Difference():
                found[key] = made
    return found


def _at(time: Array, theirs: Theirs, key: Key, what: str) -> Array:
    values = getattr(theirs, what)[key]
    return np.interp(time, theirs.time, values, left=np.nan, right=np.nan)


def _angles(ours: Array, theirs: Array) -> Difference:
    apart = (ours - theirs)[np.isfinite(ours - theirs)]
    if len(apart) < 10:
        return Difference()
    return Difference(len(apart), float(apart.mean()), float(apart.std()))


def _rms(values: Array) -> float | None:
    known = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(known**2))) if len(known) >= 10 else None


def _power(data: xr.Dataset, joint: str, letter: str) -> Array:
    """(T,) W of all coordinates of a joint."""
    names = [f"{name}_{letter}" for name in COORDINATES[joint] if f"{name}_{letter}" in data["coordinate"].values]
    power = data["moments"].sel(coordinate=names) * data["speeds"].sel(coordinate=names)
    return np.asarray(power.transpose("time", "coordinate").values.sum(axis=1))


def _about_theirs(data: xr.Dataset, ground: GroundFrame, key: Key, theirs: Theirs) -> tuple[Array, float]:
    """(T,) N m of our joint's load about their centre along their axis, flexion positive, and how far apart the
    centres are, mm."""
    side, joint = key
    k = [str(name) for name in data["joint_segment"].values].index(f"{SEGMENTS[joint]}_{SIDES[side]}")
    load = data["joint_loads"].transpose("time", "joint", "component").values[:, k]
    ours = data["joint_centres"].transpose("time", "joint", "axis").values[:, k]
    centre = ground.points_to_ground(theirs.centres[key])
    moment = load[:, 3:] + np.cross(ours - centre, load[:, :3])
    along = np.einsum("ti,ti->t", moment, ground.vectors_to_ground(theirs.axes[key]))
    return -_EXTENDS[joint] * along, 1000.0 * float(np.nanmean(np.linalg.norm(ours - centre, axis=1)))


def _joints(path: Path, frames: int) -> tuple[dict[Key, Array], dict[Key, Array]]:
    """Centres (T, 3) m and axes to the left (T, 3) that the file has as points: ``RFEO`` and so on."""
    file = ezc3d.c3d(str(path))
    labels = [label.rsplit(":", 1)[-1] for label in file["parameters"]["POINT"]["LABELS"]["value"]]
    scale = 1000.0 if str(file["parameters"]["POINT"]["UNITS"]["value"][0]).strip() == "mm" else 1.0
    points = {label: file["data"]["points"][:3, k].T / scale for k, label in enumerate(labels)}
    centres: dict[Key, Array] = {}
    axes: dict[Key, Array] = {}
    for side in SIDES:
        letter = side[0].upper()
        for joint in JOINTS:
            own = letter + _AXES[joint]
            if not {f"{own}O", f"{own}L", f"{letter}FEO", f"{letter}FEP", f"{letter}TIO", "PELO"} <= points.keys():
                continue
            axes[side, joint] = _unit(points[f"{own}L"] - points[f"{own}O"])
            if joint in _CENTRES:
                centres[side, joint] = points[f"{letter}{_CENTRES[joint]}O"]
            else:
                centres[side, joint] = _fixed_point(points, letter)
    return centres, axes


def _fixed_point(points: dict[str, Array], letter: str) -> Array:
    """(T, 3) m: the point of the pelvis that the femur's long axis passes in all frames, by least squares."""
    origin = points["PELO"]
    R = np.stack([_unit(points[f"PEL{axis}"] - origin) for axis in "ALP"], axis=1)
    start = np.einsum("tij,tj->ti", R, points[f"{letter}FEO"] - origin)
    along = np.einsum("tij,tj->ti", R, _unit(points[f"{letter}FEP"] - points[f"{letter}FEO"]))
    across = np.eye(3) - along[:, :, None] * along[:, None, :]
    known = np.isfinite(across).all(axis=(1, 2)) & np.isfinite(start).all(axis=1)
    centre = np.linalg.solve(across[known].sum(axis=0), np.einsum("tij,tj->i", across[known], start[known]))
    return origin + np.einsum("tji,j->ti", R, centre)


def _unit(vectors: Array) -> Array:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1, keepdims=True))
