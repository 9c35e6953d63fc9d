"""A made-up person with known joint places, as a recording with the marker names of the set "opencap"."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from dynakin.recordings.recording import Recording

Array = npt.NDArray[np.float64]
LENGTHS = {"foot": 0.16, "shank": 0.41, "thigh": 0.40}
FOOT_DIRECTION = np.array([-0.95, np.sqrt(1.0 - 0.95**2)])


def turn(degrees: float) -> Array:
    """Rotation (2, 2) about Z in the sagittal plane."""
    a = np.deg2rad(degrees)
    return np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]])


def stand(ankle: float = 5.0, knee: float = 8.0, hip: float = 10.0, heel_rise: float = 0.0) -> dict[str, Array]:
    """Marker places (3,) m in the ground frame (toe at the origin) for angles in degrees with OpenSim's
    signs."""
    foot = turn(-heel_rise)
    shank = foot @ turn(-ankle)
    thigh = shank @ turn(knee)
    pelvis = thigh @ turn(-hip)
    up = np.array([0.0, 1.0])
    p_ankle = foot @ FOOT_DIRECTION * LENGTHS["foot"]
    p_knee = p_ankle + shank @ up * LENGTHS["shank"]
    p_hip = p_knee + thigh @ up * LENGTHS["thigh"]
    trunk = pelvis @ turn(5.0)
    back = p_hip + pelvis @ np.array([-0.02, 0.10])
    places = {
        "toe": np.zeros(2),
        "5meta": foot @ np.array([-0.03, -0.02]),
        "calc": foot @ np.array([-0.21, -0.01]),
        "ankle": p_ankle,
        "sh2": p_ankle + shank @ np.array([0.04, 0.21]),
        "shank_antsup": p_ankle + shank @ np.array([0.04, 0.33]),
        "knee": p_knee,
        "thigh1": p_knee + thigh @ np.array([0.05, 0.28]),
        "thigh2": p_knee + thigh @ np.array([0.06, 0.17]),
        "thigh3": p_knee + thigh @ np.array([0.01, 0.14]),
        "HJC_reg": p_hip,
        "ASIS": p_hip + pelvis @ np.array([0.06, 0.09]),
        "PSIS": p_hip + pelvis @ np.array([-0.14, 0.09]),
        "Sternum": back + trunk @ np.array([0.06, 0.40]),
        "C7": back + trunk @ np.array([-0.06, 0.47]),
        "Shoulder": back + trunk @ np.array([0.0, 0.44]),
        "elbow_lat": back + trunk @ np.array([0.01, 0.12]),
        "wrist_radius": back + trunk @ np.array([0.08, -0.13]),
    }
    half_width = {"ASIS": 0.12, "PSIS": 0.05, "HJC_reg": 0.09, "Sternum": 0.02, "Shoulder": 0.17}
    found: dict[str, Array] = {}
    for name, (x, y) in places.items():
        if name == "C7":
            found[name] = np.array([x, y, 0.0])
            continue
        for side, sign in (("R", 1.0), ("L", -1.0)):
            found[f"{side}_{name}"] = np.array([x, y, sign * half_width.get(name, 0.10)])
    return found


def make(frames: list[dict[str, Array]], name: str = "made", **fields: object) -> Recording:
    """A recording at 100 Hz of these frames, laboratory frame equal to a ground frame moved by (1, 0.1, 0.3)
    m."""
    names = tuple(frames[0])
    markers = np.array([[frame[n] for n in names] for frame in frames]) + np.array([1.0, 0.1, 0.3])
    return Recording(name, None, np.arange(len(frames)) / 100.0, names, markers, **fields)  # type: ignore[arg-type]
