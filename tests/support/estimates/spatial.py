"""A made estimate of a body in space with two legs: smooth curves, nothing of it was filtered."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dynakin.recordings.feet.contact import UNMEASURED
from dynakin.results.estimate import Estimate
from dynakin.results.measures.sources import ABSENT, DERIVED, MEASURED
from dynakin.units import COMPONENTS
from support.estimates.synthetic import make_estimate

COORDINATES = {
    "pelvis_tilt": "pelvis",
    "pelvis_tx": "pelvis",
    "hip_flexion_r": "thigh_r",
    "hip_flexion_l": "thigh_l",
    "knee_angle_r": "foot_r",
    "knee_angle_l": "foot_l",
    "lumbar_extension": "torso",
    "arm_flex_r": "upper_arm_r",
    "arm_flex_l": "upper_arm_l",
    "neck_extension": "head",
}
SEGMENTS = {
    "pelvis": -1,
    "thigh_r": 0,
    "thigh_l": 0,
    "foot_r": 1,
    "foot_l": 2,
    "torso": 0,
    "head": 5,
    "upper_arm_r": 5,
    "upper_arm_l": 5,
}
CENTRES = ((0, 1, 0), (0, 0.9, 0.1), (0, 0.9, -0.1), (0, 0.1, 0.1), (0, 0.1, -0.1), (0, 1.1, 0), (0, 1.5, 0))
MASS_KG = 60.0


def make_spatial(duration_s: float = 6.0, *, walk_m: float = 0.0) -> Estimate:
    """Squats; the right knee bends 80 degrees, the left 40; the neck is locked. From 1 to 2 s the left foot's contact
    is not measured: what depends on it is derived; from 2 to 2.5 s the hips' moments are not known.

    walk_m: how far everything moves forward over the trial.
    """
    made = make_estimate(duration_s, gaps=False)
    time = made.time
    frames, count = len(time), len(COORDINATES)
    depth = 0.5 - 0.5 * np.cos(2 * np.pi * time / 3.0)
    size = np.array([0.2, 0.1, 1.2, 1.2, np.radians(80), np.radians(40), 0.3, 0.5, 0.5, 0.0])
    coordinates = depth[:, None] * size
    moments = -depth[:, None] * np.array([0, 0, 60, 60, 90, 45, 50, 3, 3, 0.0])
    source = np.zeros((frames, count), dtype=np.uint8)
    derived, unknown = (time >= 1.0) & (time < 2.0), (time >= 2.0) & (time < 2.5)
    source[np.ix_(derived, [3, 5])] = DERIVED
    source[np.ix_(unknown, [2, 3])] = ABSENT
    moments[source == ABSENT] = np.nan
    sd = np.broadcast_to(np.where(size > 0.0, 0.01, 0.0), (frames, count))

    forward = np.zeros((frames, 1, 3))
    forward[:, 0, 0] = walk_m * time / time[-1]
    markers = np.zeros((frames, 10, 3))
    markers[:, :, 0], markers[:, :, 1] = 0.05, np.linspace(0.05, 1.6, 10)
    markers[:, :, 2] = np.tile([0.15, -0.15], 5)
    markers = markers + forward
    centres = np.array([*CENTRES, (0, 1.4, 0.2), (0, 1.4, -0.2)], dtype=float) + forward

    feet = np.zeros((frames, 2, 6))
    feet[:, :, 1] = 0.5 * MASS_KG * 9.80665
    for foot, z in enumerate((0.1, -0.1)):  # at x = 0.05 m, y = 0: m = p x f
        feet[:, foot, 3], feet[:, foot, 5] = -z * feet[:, foot, 1], 0.05 * feet[:, foot, 1]
    adjustment = np.zeros_like(feet)
    adjustment[:, 0, 1] = 2.0
    measured = feet - adjustment
    contact = np.ones((frames, 2), dtype=np.uint8)
    contact[derived, 1] = UNMEASURED
    foot_source = np.where(contact == UNMEASURED, DERIVED, MEASURED).astype(np.uint8)
    measured[derived, 1] = np.nan
    total = feet.sum(axis=1)
    names = [str(name) for name in made.data["element"].values][21:]  # the constants
    per = ("time", "coordinate")
    data = made.data.drop_dims(["coordinate", "element"]).drop_vars("marker_axes_modelled")
    data = data.assign(
        {
            "coordinates": (per, coordinates),
            "coordinates_sd": (per, sd),
            "moments": (per, moments),
            "moments_sd": (per, np.where(source == ABSENT, np.nan, 1.0)),
            "moment_source": (per, source),
            "state": (("time", "element"), made.data["state"].values[:, 21:]),
            "state_sd": (("time", "element"), made.data["state_sd"].values[:, 21:]),
            **{f"markers_{k}": (("time", "marker", "axis"), markers) for k in ("measured", "estimated", "predicted")},
            **{f"wrench_{k}": (("time", "component"), total) for k in ("measured", "estimated", "predicted")},
            "joint_centres": (("time", "joint", "axis"), centres),
            "mass_centre": (("time", "axis"), centres[:, 0]),
            "mass_centre_velocity": (("time", "axis"), np.gradient(centres[:, 0], time, axis=0)),
            "foot_wrench": (("time", "foot", "component"), feet),
            "foot_wrench_measured": (("time", "foot", "component"), measured),
            "foot_adjustment": (("time", "foot", "component"), adjustment),
            "foot_contact": (("time", "foot"), contact),
            "foot_source": (("time", "foot"), foot_source),
            "wrench_remainder": (("time", "component"), np.zeros((frames, len(COMPONENTS)))),
        }
    )
    for name in ("speeds", "accelerations"):
        coordinates = np.gradient(coordinates, time, axis=0)
        data[name], data[f"{name}_sd"] = (per, coordinates), (per, sd)
    data = data.assign_coords(
        coordinate=list(COORDINATES),
        coordinate_type=("coordinate", ["translation" if name.endswith("tx") else "rotation" for name in COORDINATES]),
        coordinate_file_unit=("coordinate", ["m" if name.endswith("tx") else "deg" for name in COORDINATES]),
        coordinate_segment=("coordinate", list(COORDINATES.values())),
        marker_axes_modelled=("axis", [True, True, True]),
        joint=list(SEGMENTS),
        joint_segment=("joint", list(SEGMENTS)),
        joint_parent=("joint", list(SEGMENTS.values())),
        foot=["right", "left"],
        foot_segment=("foot", ["foot_r", "foot_l"]),
        element=names,
    )
    return replace(made, data=data, model_name="fullbody", config=made.config | {"mass_kg": MASS_KG})
