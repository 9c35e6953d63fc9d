"""Knees and ankles that no marker shows: from the movement itself.

Clusters of three markers and more on thigh and shank show about what these turn against each other, as in a functional
trial: the knee's axis (SARA) and the line on which the knee lies (SCoRE). How far out along the axis that is they do
not show: the leg is taken to be straight seen from the front, the knee in the plane through hip and ankle that the axis
stands on. Knees stand within 3 deg of that (Moreland et al. 1987, J Bone Joint Surg 69-A:745-749), 20 mm of a knee's
place. The ankle is where a foot of usual shape has it, laid on heel and toes; forward and up, where shank and foot turn
against each other counts as well, each by its variance.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from dynakin.errors import ModelError
from dynakin.model.calibration.completion import HOLD, Proportions, laid
from dynakin.model.calibration.frames import Trial
from dynakin.model.calibration.functional import SIDE_OF, joint_motion, put_middles
from dynakin.model.calibration.joint_motion import Centre, joint_axis, joint_centre
from dynakin.recordings.recording import Recording

Array = npt.NDArray[np.float64]

LEG_JOINTS = ("knee_r", "knee_l", "ankle_r", "ankle_l")
_RANGE_DEG = {"knee": 40.0, "ankle": 15.0}
"""Least range of motion; of a knee as in functional trials."""
_AXIS_RESIDUAL_DEG, _AXIS_SD_DEG = 5.0, 20.0
_CENTRE_RESIDUAL_M = 0.015
"""As in functional trials; but how well an axis is known is asked there of the people who read it."""
_TURNED_RAD = np.radians(10.0)
"""Frames in which a knee is turned less from the calibration frames say nothing of its axis; a person who stands for
most of a trial has many."""
_BONE = 0.25
"""How far thigh and shank may be from the length that an adult of this height has, as a part of it."""
_FOOT_SD_M = 0.015
"""How far an ankle is from where a foot of usual shape has it, beside what the movement says of its own error: standing
people have it 9 to 50 mm off, but the movement says half of its own error."""


@dataclass
class Legs:
    """Landmarks with those that were found, the joints among these, a sentence for each leg that has some, and why
    others have none."""

    landmarks: dict[str, Array]
    joints: list[str] = field(default_factory=list)
    messages: list[str] = field(default_factory=list)
    failed: list[str] = field(default_factory=list)


def legs_in_motion(
    landmarks: Mapping[str, Array], moving: Recording, source: Trial, frames: npt.NDArray[np.intp], height_m: float
) -> Legs:
    """Knees and ankles that are lacking.

    Args:
        landmarks: (3,) m in the ground frame, X forward, as frames of the source show them. moving: the recording
            that is estimated.
    """
    found = Legs(dict(landmarks))
    for letter, side in SIDE_OF.items():
        lacking = [name for name in LEG_JOINTS if name.endswith(f"_{letter}") and name not in landmarks]
        if not lacking or not {"hip_r", "hip_l"} <= landmarks.keys():
            continue
        names = f"{side} {' and '.join(name.split('_')[0] for name in lacking)}"
        unmarked = [name for name in lacking if name.startswith("knee") or f"malleoli_{letter}" not in landmarks]
        try:
            places, said = _leg(landmarks, letter, moving, source, frames, height_m)
        except ModelError as error:
            found.failed.append(f"The movement does not show the {names}: {error.message}.")
            places = {} if f"ankle_{letter}" in landmarks else _motionless_ankle(landmarks, letter, height_m)
            unmarked = [name for name in unmarked if name in places]
        else:
            found.messages.append(
                f"{names.capitalize()}: no marker shows the joint, so it is where the segments turn against each other "
                f"in the movement, with a leg that is straight seen from the front.{said}"
            )
        found.landmarks |= places
        found.joints += unmarked
    put_middles(found.landmarks, "knee", "knee_lateral", "ankle")
    return found


def _leg(
    landmarks: Mapping[str, Array],
    letter: str,
    moving: Recording,
    source: Trial,
    frames: npt.NDArray[np.intp],
    height_m: float,
) -> tuple[dict[str, Array], str]:
    """Knee, its outer end and ankle of one leg, those that are known as they are, and what did not help."""
    hip, knee, lateral, ankle = (landmarks.get(f"{n}_{letter}") for n in ("hip", "knee", "knee_lateral", "ankle"))
    ankle = landmarks.get(f"malleoli_{letter}") if ankle is None else ankle
    assert hip is not None
    below = ankle if ankle is not None else _by_foot(landmarks, letter, height_m)
    across = None if knee is None or lateral is None else (lateral - knee) / np.linalg.norm(lateral - knee)
    if across is None or knee is None:
        motion, _ = joint_motion(f"knee_{letter}", moving, landmarks, source, frames, f"{SIDE_OF[letter]} knee")
        _require(motion.range_deg[0], _RANGE_DEG["knee"], "knee")
        motion = motion.part(motion.angles_rad() > _TURNED_RAD)
        axis = joint_axis(motion)
        if axis.residual_deg > _AXIS_RESIDUAL_DEG or axis.sd_deg > _AXIS_SD_DEG:
            raise ModelError(
                f"thigh and shank do not turn about one axis (it turns by {axis.residual_deg:.1f} deg, expected at "
                f"most {_AXIS_RESIDUAL_DEG:g}, and is known to {axis.sd_deg:.1f} deg, expected {_AXIS_SD_DEG:g})"
            )
        outward = (landmarks["hip_r"] - landmarks["hip_l"]) * (1.0 if letter == "r" else -1.0)
        across = axis.direction * np.sign(axis.direction @ outward)
        if knee is None:
            line = (below - hip) / np.linalg.norm(below - hip)
            upright = across - line * float(across @ line)
            centre = joint_centre(motion, (upright / np.linalg.norm(upright), hip))
            _check_residual(centre, "thigh")
            knee = centre.point
            _check_bone(knee, hip, height_m, ("hip_r", "knee_r"), "thigh")
    said = ""
    if ankle is None:
        try:
            ankle = _ankle(landmarks, letter, moving, source, frames, (across, below))
        except ModelError as error:
            ankle, said = below, f" The ankle is that of a foot of usual shape: {error.message}."
        _check_bone(ankle, knee, height_m, ("knee_r", "ankle_r"), "shank")
    if lateral is None:
        places = Proportions.load().landmarks
        lateral = knee + height_m * float(np.linalg.norm(places["knee_lateral_r"] - places["knee_r"])) * across
    return {f"knee_{letter}": knee, f"knee_lateral_{letter}": lateral, f"ankle_{letter}": ankle}, said


def _shown(landmarks: Mapping[str, Array], letter: str) -> list[str]:
    """Heel and toes, as far as they are marked; none where the heel, or all else, is not."""
    shown = [name for name in (f"{each}_{letter}" for each in ("heel", "toe", "metatarsals")) if name in landmarks]
    return shown if f"heel_{letter}" in shown and len(shown) > 1 else []


def _motionless_ankle(landmarks: Mapping[str, Array], letter: str, height_m: float) -> dict[str, Array]:
    """The ankle between the malleoli, else by the foot's shape; nothing where neither is marked."""
    if f"malleoli_{letter}" in landmarks:  # whose recipe asks for the knee, too
        return {f"ankle_{letter}": landmarks[f"malleoli_{letter}"]}
    return {f"ankle_{letter}": _by_foot(landmarks, letter, height_m)} if _shown(landmarks, letter) else {}


def _by_foot(landmarks: Mapping[str, Array], letter: str, height_m: float) -> Array:
    """The ankle of a foot of usual shape laid on the markers' heel and toes."""
    shape = {name: height_m * place for name, place in Proportions.load().landmarks.items()}
    shown = _shown(landmarks, letter)
    if not shown:
        raise ModelError("no markers show heel and toes")
    source, target = (np.array([places[name] for name in shown]) for places in (shape, landmarks))
    turn, shift = laid(source, target, np.ones(len(shown)), np.eye(3), HOLD * height_m)
    return np.asarray(turn @ shape[f"ankle_{letter}"] + shift)


def _ankle(
    landmarks: Mapping[str, Array],
    letter: str,
    moving: Recording,
    source: Trial,
    frames: npt.NDArray[np.intp],
    foot: tuple[Array, Array],
) -> Array:
    """The ankle by the foot's shape, and along the plane across the leg's axis by the movement as well."""
    across, by_foot = foot
    motion, _ = joint_motion(f"ankle_{letter}", moving, landmarks, source, frames, f"{SIDE_OF[letter]} ankle")
    _require(motion.range_deg[0], _RANGE_DEG["ankle"], "ankle")
    centre = joint_centre(motion, (across, by_foot))
    _check_residual(centre, "shank")
    part = _FOOT_SD_M**2 / (_FOOT_SD_M**2 + centre.sd_m**2)
    apart = centre.point - by_foot
    return np.asarray(by_foot + part * (apart - across * float(across @ apart)))


def _require(turned_deg: float, least_deg: float, joint: str) -> None:
    if turned_deg < least_deg:
        raise ModelError(f"the {joint} turns through {turned_deg:.2f} deg, expected {least_deg:g} deg or more")


def _check_residual(centre: Centre, bone: str) -> None:
    if centre.residual_m > _CENTRE_RESIDUAL_M:
        raise ModelError(
            f"the segments below and above the {bone}'s lower end do not turn about one point (it moves by "
            f"{1e3 * centre.residual_m:.0f} mm, expected at most {1e3 * _CENTRE_RESIDUAL_M:g} mm)"
        )


def _check_bone(below: Array, above: Array, height_m: float, ends: tuple[str, str], bone: str) -> None:
    places = Proportions.load().landmarks
    usual = height_m * float(np.linalg.norm(places[ends[0]] - places[ends[1]]))
    length = float(np.linalg.norm(below - above))
    if abs(length / usual - 1.0) > _BONE:
        raise ModelError(f"the {bone} would be {length:.2f} m long, expected {usual:.2f} m give or take {_BONE:.0%}")
