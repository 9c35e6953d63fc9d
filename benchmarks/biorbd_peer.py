"""biorbd's Kalman filter (kinematics only) on the same tree of segments, axes and markers."""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

import biorbd
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from dynakin.bindings import _core
from dynakin.model.spec import free_names

Array = NDArray[np.float64]


def bio_mod(spec: _core.ModelSpec) -> str:
    """A model file of biorbd: one of its segments an axis.

    Axes that are functions of a coordinate (other than s = q) stay where they are at the start, as biorbd has no such
    joints: a knee is a hinge. So do locked coordinates.
    """
    free = set(free_names(spec))
    start = {c.name: c.value for c in spec.coordinates}
    length = {p.name: p.value for p in spec.parameters}
    lines, last, taken = ["version 4"], {"ground": "root"}, set()

    def segment(name: str, parent: str, R: Array, p: Array, motion: str = "", body: bool = False) -> str:
        lines.extend([f"segment {name}", f"parent {parent}", "rtinmatrix 1", "rt"])
        lines.extend(" ".join(f"{v:.12g}" for v in (*R[k], p[k])) for k in range(3))
        lines.append("0 0 0 1")
        lines.extend([motion] if motion else [])
        lines.extend(["mass 1", "inertia 1 0 0 0 1 0 0 0 1", "com 0 0 0"] if body else [])
        lines.append("endsegment")
        return name

    for s in spec.segments:
        place = np.array(s.translation) + sum(
            (length[t.parameter] * np.array(t.direction) for t in s.lengths), np.zeros(3)
        )
        R, p, parent = np.array(s.rotation), place, last[s.parent]
        for k, axis in enumerate(s.axes):
            along = np.array(axis.direction) / np.linalg.norm(axis.direction)
            identity = not axis.functions and not axis.scale and list(axis.coefficients) in ([0.0, 1.0], [0.0, -1.0])
            if axis.coordinate in free - taken and identity:
                taken.add(axis.coordinate)
                turn = Rotation.align_vectors([axis.coefficients[1] * along], [[1.0, 0.0, 0.0]])[0].as_matrix()
                kind = "rotations" if axis.kind == "rotation" else "translations"
                parent = segment(f"{s.name}_{k}", parent, R @ turn, p, f"{kind} x")
                R, p = turn.T, np.zeros(3)
                continue
            at = _value(axis, start[axis.coordinate], length)
            if axis.kind == "rotation":
                R = R @ Rotation.from_rotvec(at * along).as_matrix()
            else:
                p = p + R @ (at * along)
        last[s.name] = segment(s.name, parent, R, p, body=True)
    for m in spec.markers:
        x, y, z = m.position
        lines.extend([f"marker {m.name}", f"parent {m.segment}", f"position {x:.12g} {y:.12g} {z:.12g}"])
        lines.extend(["technical 1", "anatomical 0", "endmarker"])
    return "\n".join(lines) + "\n"


def kalman(spec: _core.ModelSpec, markers: Array, rate_hz: float) -> tuple[int, Array, Array]:
    """biorbd's filter over markers (T, M, 3) m.

    Returns:
        Its number of coordinates, seconds a frame (T,) and the markers' places (T, M, 3) m.
    """
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "model.bioMod"
        file.write_text(bio_mod(spec))
        model = biorbd.Model(str(file))
    found = biorbd.KalmanReconsMarkers(model, biorbd.KalmanParam(rate_hz))
    q, qd, qdd = (
        kind(model)
        for kind in (biorbd.GeneralizedCoordinates, biorbd.GeneralizedVelocity, biorbd.GeneralizedAcceleration)
    )
    spent, places = [], []
    for frame in np.nan_to_num(markers):  # it takes zeros for markers that are missing
        flat = frame.ravel()
        start = time.perf_counter()
        found.reconstructFrame(model, flat, q, qd, qdd)
        spent.append(time.perf_counter() - start)
        places.append([m.to_array() for m in model.markers(q)])
    return model.nbQ(), np.array(spent), np.array(places)


def _value(axis: _core.AxisSpec, q: float, length: dict[str, float]) -> float:
    if axis.functions:
        return 0.0
    s = sum(c * q**k for k, c in enumerate(axis.coefficients))
    return float(s * (length[axis.scale] if axis.scale else 1.0))
