"""A made walker with two equal legs, of which some stances are off the plates; nothing of it was filtered."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dynakin.messages import note
from dynakin.recordings.feet.contact import NO_CONTACT, ON_PLATE, UNMEASURED
from dynakin.results.estimate import Estimate
from dynakin.results.measures.sources import ABSENT, DERIVED, MEASURED
from support.estimates.synthetic import make_estimate

COORDINATES = {
    "pelvis_ty": "pelvis",
    "knee_angle_r": "shank_r",
    "knee_angle_l": "shank_l",
    "arm_flex_r": "upper_arm_r",
    "arm_flex_l": "upper_arm_l",
}
SEGMENTS = {
    "pelvis": -1,
    "shank_r": 0,
    "shank_l": 0,
    "foot_r": 1,
    "foot_l": 2,
    "torso": 0,
    "upper_arm_r": 5,
    "upper_arm_l": 5,
}
MASS_KG = 60.0
STANCE_S, CYCLE_S = 0.6, 1.0
TOUCH_DOWN_S = {"right": (0.2, 1.2, 2.2), "left": (-0.3, 0.7, 1.7, 2.7)}
"""In 3 s at 100 Hz: three whole stances of the right foot, two of the left and two that the ends cut."""
WRONG = 1.5
"""What is not measured is so many times too large."""


def make_walker(withheld: tuple[int, ...] = (), *, code: int = DERIVED) -> Estimate:
    """Both legs do the same half a second apart; knees bear a tenth of their foot's force as a moment.

    withheld: numbers of the left foot's stances off the plates. code: what depends on them is derived, a prior, or
    absent.
    """
    made = make_estimate(3.0, gaps=False)
    time = made.time
    frames = len(time)
    contact = np.full((frames, 2), NO_CONTACT, dtype=np.uint8)
    push = np.zeros((frames, 2))
    for foot, (_, touch_downs) in enumerate(TOUCH_DOWN_S.items()):
        for k, start in enumerate(touch_downs):
            stands = (time > start - 1e-6) & (time < start + STANCE_S - 1e-6)
            beside = foot == 1 and k in withheld
            contact[stands, foot] = UNMEASURED if beside else ON_PLATE
            load = 700.0 * np.sin(np.pi * (time[stands] - start) / STANCE_S)
            push[stands, foot] = (np.nan if code == ABSENT else WRONG * load) if beside else load
    lacking = contact == UNMEASURED
    source = np.zeros((frames, len(COORDINATES)), dtype=np.uint8)
    source[lacking[:, 1], 2] = source[lacking[:, 1], 0] = code
    phase = 2.0 * np.pi * (time[:, None] - [0.2, 0.7]) / CYCLE_S
    coordinates = np.column_stack([0.01 * np.sin(2.0 * phase[:, 0]), np.sin(phase), 0.3 * np.cos(phase)])
    moments = np.column_stack([np.zeros(frames), 0.1 * push, 2.0 * np.sin(phase)])
    moments[source == ABSENT] = np.nan

    feet = np.zeros((frames, 2, 6))
    feet[:, :, 1], feet[:, 0, 3], feet[:, 1, 3] = push, -0.1 * push[:, 0], 0.1 * push[:, 1]
    feet[np.isnan(push)] = np.nan
    measured = np.where((contact == ON_PLATE)[..., None], feet, np.nan)
    total = np.where(lacking.any(axis=1)[:, None], np.nan, np.nan_to_num(feet).sum(axis=1))
    flight = (contact == NO_CONTACT).all(axis=1)
    markers = np.zeros((frames, 10, 3))
    markers[:, :, 0], markers[:, :, 1], markers[:, :, 2] = 0.05, np.linspace(0.05, 1.6, 10), np.tile([0.15, -0.15], 5)
    centres = np.broadcast_to([0.0, 0.9, 0.0], (frames, len(SEGMENTS), 3))
    joint_source = np.zeros((frames, len(SEGMENTS)), dtype=np.uint8)
    joint_source[lacking[:, 1][:, None] & np.isin(list(SEGMENTS), ["pelvis", "shank_l", "foot_l"])] = code
    loads = np.where((joint_source == ABSENT)[..., None], np.nan, np.ones((frames, len(SEGMENTS), 6)))
    names = [str(name) for name in made.data["element"].values][21:]  # the constants
    per, by_foot = ("time", "coordinate"), ("time", "foot", "component")
    data = made.data.drop_dims(["coordinate", "element"]).drop_vars("marker_axes_modelled")
    data = data.assign(
        {
            "coordinates": (per, coordinates),
            "speeds": (per, np.gradient(coordinates, time, axis=0)),
            "accelerations": (per, np.zeros_like(coordinates)),
            "moments": (per, moments),
            "moment_source": (per, source),
            **{f"{kind}_sd": (per, np.full_like(coordinates, 0.01)) for kind in ("coordinates", "speeds", "moments")},
            "state": (("time", "element"), made.data["state"].values[:, 21:]),
            "state_sd": (("time", "element"), made.data["state_sd"].values[:, 21:]),
            **{f"markers_{k}": (("time", "marker", "axis"), markers) for k in ("measured", "estimated", "predicted")},
            **{
                f"wrench_{k}": (("time", "component"), np.nan_to_num(feet).sum(axis=1))
                for k in ("estimated", "predicted")
            },
            "wrench_measured": (("time", "component"), total),
            "joint_centres": (("time", "joint", "axis"), centres),
            "joint_loads": (("time", "joint", "component"), loads),
            "joint_source": (("time", "joint"), joint_source),
            "foot_wrench": (by_foot, feet),
            "foot_wrench_measured": (by_foot, measured),
            "foot_adjustment": (by_foot, np.zeros_like(feet)),
            "foot_contact": (("time", "foot"), contact),
            "foot_source": (("time", "foot"), np.where(lacking, code, MEASURED).astype(np.uint8)),
            "wrench_remainder": (("time", "component"), np.where(flight[:, None], [0.0, 8.0, 0, 0, 0, 0], 0.0)),
        }
    )
    data = data.assign_coords(
        coordinate=list(COORDINATES),
        coordinate_type=("coordinate", ["translation"] + 4 * ["rotation"]),
        coordinate_file_unit=("coordinate", ["m"] + 4 * ["deg"]),
        coordinate_segment=("coordinate", list(COORDINATES.values())),
        marker_axes_modelled=("axis", [True, True, True]),
        joint=list(SEGMENTS),
        joint_segment=("joint", list(SEGMENTS)),
        joint_parent=("joint", list(SEGMENTS.values())),
        foot=["right", "left"],
        foot_segment=("foot", ["foot_r", "foot_l"]),
        element=names,
    )
    reason = "The left foot stands off the plates from 1.70 to 2.30 s: what it carries is estimated there."
    return replace(
        made,
        data=data,
        model_name="fullbody",
        config=made.config | {"mass_kg": MASS_KG, "ground": {"reasons": [reason] if withheld else []}},
        messages=[*made.messages, *([note("plates", reason)] if withheld else [])],
    )
