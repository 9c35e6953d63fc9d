"""An estimate as seen by the person: X forward, Y up, Z to the right, for what is read along the way one faces.

A body that is fixed nowhere is estimated, and written to files, in the laboratory's frame. Figures, cycles and clinical
angles speak of forward and right; this is the one place that turns an estimate into them.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy

from dynakin.arrays import Array
from dynakin.messages import Message, warning
from dynakin.results.estimate import Estimate
from dynakin.results.measures.power import root_coordinates

PELVIS = ("pelvis_tilt", "pelvis_list", "pelvis_rotation")
"""OpenSim's turns of the pelvis, about Z, X and Y in this order (Rajagopal et al. 2016)."""
_SAME = 1e-6  # rad: how well these three turns must give the pelvis' axes to be what they are called
_SINGULAR_DEG = 75.0
"""Beyond this of the middle one of three turns the outer two act about nearly one axis: a fourth of what each of them
does is left to separate them."""


def facing(estimate: Estimate) -> Estimate:
    """The same estimate along the way the person faces; itself where its ground has X forward already.

    Positions, vectors, orientations and wrenches are turned about the ground's origin, and the pelvis' three turns
    where they have OpenSim's names and order, with their speeds. Deviations of vectors are turned as if their
    components were independent. Translations of the root, accelerations, moments and the filter's own state stay.
    """
    ground = estimate.ground.facing()
    turn = ground.rotation @ estimate.ground.rotation.T  # R_FG
    if estimate.planar or np.allclose(turn, np.eye(3), atol=1e-12):
        return estimate
    found = {}
    for name, variable in estimate.data.data_vars.items():
        last = next((axis for axis in ("component", "axis") if axis in variable.dims), None)
        if last is None:
            continue
        ordered = (
            variable.transpose(..., "axis", "axis_") if "axis_" in variable.dims else variable.transpose(..., last)
        )
        found[name] = (ordered.dims, _turned(ordered.values, turn, str(name), last), variable.attrs)
    data = estimate.data.assign(found)
    angles = _pelvis(estimate, turn)
    if angles is not None:
        own, rates = (
            estimate.data[block].sel(coordinate=list(PELVIS)).transpose("time", "coordinate").values
            for block in ("coordinates", "speeds")
        )
        velocity = np.einsum("tij,tj->ti", _turns_about(own), rates) @ turn.T
        speeds = np.linalg.solve(_turns_about(angles), velocity[..., None])[..., 0]
        for block, turned in (("coordinates", angles), ("speeds", speeds)):
            data[block] = data[block].copy()
            for name, values in zip(PELVIS, turned.T, strict=True):
                data[block].loc[{"coordinate": name}] = values
    return replace(estimate, data=data, ground=ground)


def _turned(values: Array, turn: Array, name: str, last: str) -> Array:
    if name == "joint_orientations":
        return np.asarray(turn @ values)
    vectors = values.reshape(*values.shape[:-1], -1, 3) if last == "component" else values
    turned = np.sqrt(vectors**2 @ (turn**2).T) if name.endswith("_sd") else vectors @ turn.T
    return np.asarray(turned.reshape(values.shape))


def _pelvis(estimate: Estimate, turn: Array) -> Array | None:
    """Tilt, list and rotation (T, 3) rad of the pelvis' axes, turned, NaN in lost frames; None where the model's are no
    such turns."""
    root = root_coordinates(estimate)
    if not set(PELVIS) <= root:
        return None
    segment = str(estimate.data["coordinate_segment"].sel(coordinate=PELVIS[0]).values)
    at = [str(name) for name in estimate.data["joint_segment"].values].index(segment)
    R_GB = estimate.values("joint_orientations")[:, at]
    own = estimate.data["coordinates"].sel(coordinate=list(PELVIS)).transpose("time", "coordinate").values
    known = np.isfinite(R_GB).all(axis=(1, 2))
    rotation = scipy.spatial.transform.Rotation
    if not known.any() or np.abs(rotation.from_euler("ZXY", own[known]).as_matrix() - R_GB[known]).max() > _SAME:
        return None
    angles = np.full(own.shape, np.nan)
    angles[known] = np.unwrap(rotation.from_matrix(turn @ R_GB[known]).as_euler("ZXY"), axis=0)
    return angles


def _turns_about(angles: Array) -> Array:
    """Axes (T, 3, 3), as columns, about which tilt, list and rotation (T, 3) turn: R = Rz(tilt) Rx(list) Ry."""
    tilt, lean = (np.cos(angles[:, k]) + 1j * np.sin(angles[:, k]) for k in (0, 1))
    axes = np.zeros((len(angles), 3, 3))
    axes[:, 2, 0] = 1.0
    axes[:, 0, 1], axes[:, 1, 1] = tilt.real, tilt.imag
    axes[:, 0, 2], axes[:, 1, 2], axes[:, 2, 2] = -lean.real * tilt.imag, lean.real * tilt.real, lean.imag
    axes[np.isnan(angles).any(axis=1)] = np.nan
    return axes


def nearly_singular(estimate: Estimate) -> list[Message]:
    """Says when the pelvis leans so far, against the laboratory's axes, that its turns can hardly be separated."""
    if not set(PELVIS) <= root_coordinates(estimate):
        return []
    middle = np.degrees(estimate.data["coordinates"].sel(coordinate=PELVIS[1]).values)
    away = np.nan_to_num(np.abs((middle + 90.0) % 180.0 - 90.0))  # lost frames do not lean
    if away.max() <= _SINGULAR_DEG:
        return []
    frame = int(np.argmax(away))
    return [
        warning(
            "angles",
            f"{PELVIS[1]} reaches {middle[frame]:.0f} deg at {estimate.time[frame]:.2f} s: near 90 deg "
            f"{PELVIS[0]} and {PELVIS[2]} turn about one axis. Give --forward, so that a forward lean is {PELVIS[0]}.",
        )
    ]
