"""Knees and ankles that no marker shows, of a person who never stands still: from the movement itself.

Clusters of three markers and more on thigh, shank and foot show about what these turn against each other, as in a
functional trial: the knee's axis (SARA) and the lines on which knee and ankle lie (SCoRE). How far out along its axis a
joint lies they do not show: the leg is taken to be straight seen from the front, knee and ankle in the plane through
the hip at right angles to the knee's axis. Knees stand within 3 deg of that (Moreland et al. 1987, J Bone Joint Surg
69-A:745-749), 20 mm of a knee's place. An ankle turns little while a foot's markers move on it: where heel and toes are
marked, a foot of usual shape laid on them counts as well, each by its variance.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from dynakin.errors import ModelError
from dynakin.model.calibration.completion import HOLD, Proportions, laid
from dynakin.model.calibration.frames import Trial
from dynakin.model.calibration.functional import SIDE_OF, joint_motion
from dynakin.model.calibration.joint_motion import Centre, joint_axis, joint_centre

Array = npt.NDArray[np.float64]

LEG_JOINTS = ("knee_r", "knee_l", "ankle_r", "ankle_l")
_RANGE_DEG = {"knee": 40.0, "ankle": 15.0}
"""Least range of motion; of a knee as in functional trials."""
_AXIS_RESIDUAL_DEG = 5.0
_CENTRE_RESIDUAL_M = 0.015
"""As in functional trials."""
_BONE = 0.25
"""How far thigh and shank may be from the length that an adult of this height has, as a part of it."""


_FOOT_SD_M = 0.015
"""How far an ankle is from where a foot of usual shape has it, beside what the movement says of its own error. Standing
people have it 9 to 50 mm off, but the movement says half of its own: tried 15, 30 mm and no foot, on simulated squats
(seeds 1, 2, 4; ankle moment up to 7, 18, 39 N m off) and a real walk (9 N m with 15 mm, 27 without)."""
_SHOWN = ("heel", "toe", "metatarsals")


def legs_in_motion(
    landmarks: Mapping[str, Array], source: Trial, frames: npt.NDArray[np.intp], height_m: float
) -> tuple[dict[str, Array], list[str], list[str]]:
    """The landmarks with knees and ankles that are lacking, a sentence for each leg that is found, and why others are
    not.

    Args:
        landmarks: (3,) m in the ground frame, X forward, as the frames show them. source: the movement.
    """
    found, messages, failed = dict(landmarks), [], list[str]()
    for letter, side in SIDE_OF.items():
        lacking = [name for name in ("knee", "ankle") if f"{name}_{letter}" not in landmarks]
        if not lacking or not {"hip_r", "hip_l"} <= found.keys():
            continue
        try:
            found |= _leg(found, letter, source, frames, height_m)
        except ModelError as error:
            failed.append(f"The movement does not show the {side} {' and '.join(lacking)}: {error.message}.")
        else:
            messages.append(
                f"{' and '.join(lacking).capitalize()}, {side}: no marker shows them and nobody stands still, so they "
                "are where the segments turn against each other in the movement, with a leg that is straight seen from "
                "the front."
            )
    for name in ("knee", "knee_lateral", "ankle"):
        if all(f"{name}_{letter}" in found for letter in SIDE_OF):
            found[name] = np.mean([found[f"{name}_{letter}"] for letter in SIDE_OF], axis=0)
    return found, messages, failed


def _leg(
    landmarks: Mapping[str, Array], letter: str, source: Trial, frames: npt.NDArray[np.intp], height_m: float
) -> dict[str, Array]:
    """Knee, its outer end and ankle of one leg, those that are known as they are."""
    known = {name: landmarks.get(f"{name}_{letter}") for name in ("hip", "knee", "ankle")}
    template = Proportions.load().landmarks
    hip = landmarks[f"hip_{letter}"]

    motion, _ = joint_motion(f"knee_{letter}", source.recording, landmarks, source, frames, "knee")
    _require(motion.range_deg[0], _RANGE_DEG["knee"], "knee")
    axis = joint_axis(motion)
    if axis.residual_deg > _AXIS_RESIDUAL_DEG:
        raise ModelError(f"thigh and shank do not turn about one axis (it turns by {axis.residual_deg:.1f} deg)")
    outward = (landmarks["hip_r"] - landmarks["hip_l"]) * (1.0 if letter == "r" else -1.0)
    across = axis.direction * np.sign(axis.direction @ outward)
    knee = known["knee"]
    if knee is None:
        knee = _centre(joint_centre(motion, (across, hip)), hip, height_m, ("hip_r", "knee_r"), "thigh")
    ankle = known["ankle"]
    if ankle is None:
        motion, _ = joint_motion(f"ankle_{letter}", source.recording, landmarks, source, frames, "ankle")
        _require(motion.range_deg[0], _RANGE_DEG["ankle"], "ankle")
        centre = joint_centre(motion, (across, knee))
        ankle = _centre(_with_foot(centre, landmarks, letter, height_m), knee, height_m, ("knee_r", "ankle_r"), "shank")
    half = height_m * float(np.linalg.norm(template["knee_lateral_r"] - template["knee_r"]))
    return {
        f"knee_{letter}": knee,
        f"knee_lateral_{letter}": landmarks.get(f"knee_lateral_{letter}", knee + half * across),
        f"ankle_{letter}": ankle,
    }


def _with_foot(centre: Centre, landmarks: Mapping[str, Array], letter: str, height_m: float) -> Centre:
    """The ankle by motion and by a foot of usual shape, where markers show how that lies."""
    shape = {name: height_m * place for name, place in Proportions.load().landmarks.items()}
    shown = [name for name in (f"{each}_{letter}" for each in _SHOWN) if name in landmarks]
    if len(shown) < 2:
        return centre
    source, target = (np.array([places[name] for name in shown]) for places in (shape, landmarks))
    turn, shift = laid(source, target, np.ones(len(shown)), np.eye(3), HOLD * height_m)
    by_foot = turn @ shape[f"ankle_{letter}"] + shift
    part = _FOOT_SD_M**2 / (_FOOT_SD_M**2 + centre.sd_m**2)
    return replace(centre, point=by_foot + part * (centre.point - by_foot))


def _require(turned_deg: float, least_deg: float, joint: str) -> None:
    if turned_deg < least_deg:
        raise ModelError(f"the {joint} turns through {turned_deg:.1f} deg, expected {least_deg:g} deg or more")


def _centre(centre: Centre, above: Array, height_m: float, ends: tuple[str, str], bone: str) -> Array:
    """Where a centre is, if one is found that leaves the bone above it as long as bones are."""
    if centre.residual_m > _CENTRE_RESIDUAL_M:
        raise ModelError(
            f"the segments below and above the {bone}'s lower end do not turn about one point (it moves by "
            f"{1e3 * centre.residual_m:.0f} mm, expected at most {1e3 * _CENTRE_RESIDUAL_M:g} mm)"
        )
    places = Proportions.load().landmarks
    usual = height_m * float(np.linalg.norm(places[ends[0]] - places[ends[1]]))
    length = float(np.linalg.norm(centre.point - above))
    if abs(length / usual - 1.0) > _BONE:
        raise ModelError(f"the {bone} would be {length:.2f} m long, expected {usual:.2f} m give or take {_BONE:.0%}")
    return centre.point
